//! Cars that predict drives: a log at even instants goes in; tires, steering and what they predict of parts that were not fitted come out,
//! beside simple models that see the same inputs.
#![forbid(unsafe_code)]
#![allow(rustdoc::broken_intra_doc_links, reason = "units stand in brackets, which rustdoc takes for links")]

pub mod agreement;
pub mod baseline;
pub mod car;
pub mod curve;
pub mod drive;
pub mod hidden;
pub mod lag;
pub mod predictor;
pub mod resampling;
pub mod rollout;
pub mod score;
pub mod single_track;
pub mod steering_map;
pub mod zero_phase;

pub use drive::{DriveSensors, EvenDrive};
pub use predictor::MotionPredictor;
