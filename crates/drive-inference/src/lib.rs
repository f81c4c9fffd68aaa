//! Identifies the tires of both axles at once from drives under closed-loop control: recordings of one car go in; the parameters of
//! both tires, their joint posterior and verdicts come out.
//!
//! States are smoothed with a car of linear tires, parameters fitted to points along them, and the result is the start from
//! which the likelihood of the recordings themselves is maximised: by the prediction errors of an extended Kalman filter with
//! the Magic Formula inside. That is unbiased where fits to smoothed states are not, as these are most wrong near the peak.
#![forbid(unsafe_code)]
#![allow(non_snake_case, reason = "symbols as in vehicle dynamics and estimation")]
#![allow(rustdoc::broken_intra_doc_links, reason = "units stand in brackets, which rustdoc takes for links")]

// The drives of the integration tests name this crate.
#[cfg(test)]
extern crate self as drive_inference;

mod adequacy;
pub mod calibration;
mod car;
mod channel_delays;
mod coordinates;
pub mod correction;
mod error;
mod error_selection;
mod evaluation;
mod filter_pass;
mod global;
mod identification;
mod input_selection;
mod joint_posterior;
mod laplace;
pub mod likelihood;
pub mod model_selection;
mod noise_estimate;
mod options;
mod outliers;
pub mod pem;
pub mod points;
mod posterior_samples;
mod prepared_drive;
mod problem;
mod profile;
pub mod progress;
mod recorded_input;
pub mod regression;
mod regularisation;
pub mod replay;
mod residual_rows;
mod result;
mod ridge;
pub mod search;
mod segments;
mod sensors;
mod series;
pub mod smoothing;
mod steering_steps;
mod summary;
#[cfg(test)]
mod tests;
pub mod tires;
mod transient_slip;
mod uncertainty;
mod unknowns;
pub mod validation;
mod variational;
mod verdict;

pub use adequacy::HOLD_OUT;
pub use error::Error;
pub use identification::identify_tires;
pub use likelihood::{DriveLikelihood, DriveNoise};
pub use options::{DriveOptions, ErrorOptions, FitFormulation, NoiseOption};
pub use preparation::{Drive, DriveError, InputInterpolation, InputInterpolations, SHORTEST};
pub use regression::{RegressionTarget, ResidualWeights};
pub use replay::{OpenLoopReplay, replay_open_loop};
pub use result::{DriveIdentification, FormulationFit, InnovationStatistics};
pub use segments::{SamplingReport, SegmentedDrive};
pub use series::IdentificationSeries;
pub use smoothing::{SmoothedDrive, SmootherOptions};
pub use tires::Tires;
pub use uncertainty::CarUncertainty;
