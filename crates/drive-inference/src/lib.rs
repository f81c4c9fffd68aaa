//! Identifies the tires of both axles at once from drives under closed-loop control: recordings of one car go in; the parameters of
//! both tires, their joint posterior and verdicts come out.
//!
//! States are smoothed with a car of linear tires, parameters fitted to points along them, and the result is the start from
//! which the likelihood of the recordings themselves is maximised: by the prediction errors of an extended Kalman filter with
//! the Magic Formula inside. That is unbiased where fits to smoothed states are not, as these are most wrong near the peak.
#![forbid(unsafe_code)]
#![allow(non_snake_case, reason = "symbols as in vehicle dynamics and estimation")]
#![allow(
    rustdoc::broken_intra_doc_links,
    reason = "units stand in brackets, which rustdoc takes for links"
)]

// The drives of the integration tests name this crate.
#[cfg(test)]
extern crate self as drive_inference;

mod adequacy;
mod algebra;
pub mod calibration;
mod car;
mod coordinates;
pub mod correction;
mod error;
mod evaluation;
mod explored;
mod filter;
mod global;
mod identification;
mod identified;
mod joint;
pub mod likelihood;
mod noises;
mod options;
mod passes;
pub mod pem;
pub mod points;
mod posterior_samples;
mod problem;
mod profile;
mod progress;
pub mod regression;
mod regularisation;
mod relaxed;
pub mod replay;
mod ridge;
mod rows;
mod samples;
mod sampling;
pub mod search;
pub mod selection;
mod sensors;
mod series;
pub mod smoothing;
#[cfg(test)]
mod tests;
pub mod tires;
mod told;
mod uncertainty;
mod unknowns;
pub mod validation;
mod variational;
mod verdict;
mod wanted;
mod wide;

pub use adequacy::HOLD_OUT;
pub use error::Error;
pub use identification::identify;
pub use identified::{Fitted, Identified, Innovations};
pub use likelihood::{DriveNoise, Likelihood};
pub use options::{DriveOptions, ErrorOptions, Formulation, Noises};
pub use preparation::{Drive, DriveError, SHORTEST};
pub use regression::{Target, Weights};
pub use replay::{Replay, replay};
pub use sampling::{Sampled, Sampling};
pub use series::Series;
pub use smoothing::{Explained, SmootherOptions};
pub use tires::Tires;
pub use uncertainty::CarUncertainty;
