//! Estimates states and noises from noisy measurements with Kalman filters over statically sized matrices:
//! transitions, Jacobians and measurements go in; means, covariances and likelihoods come out.
//!
//! The crate sees models as matrices only, so linear and extended filters are the same calls. A step of
//! a filter allocates nothing. Symbols are those of the field: state x with covariance P, transition F, process
//! noise Q, measurement matrix H, measurement noise R, innovation ν with covariance S.
//!
//! # A filter
//!
//! It estimates a position and its speed, of which the position is measured, every 0.1 s:
//!
//! ```
//! use kalman::{Gaussian, discretise, measurement_update, predict};
//! use nalgebra::{SMatrix, SVector};
//!
//! // Constant velocity; the velocity walks randomly and the position is measured.
//! let A = SMatrix::<f64, 2, 2>::new(0.0, 1.0, 0.0, 0.0);
//! let Q_c = SMatrix::from_diagonal(&SVector::from([0.0, 0.05]));
//! let H = SMatrix::<f64, 1, 2>::new(1.0, 0.0);
//! let R = SMatrix::<f64, 1, 1>::new(1e-4);
//! let (F, Q_d) = discretise(&A, &Q_c, 0.1);
//!
//! let mut state = Gaussian { mean: SVector::zeros(), cov: SMatrix::identity() };
//! for y in [0.11, 0.19, 0.31, 0.40, 0.49, 0.61, 0.70] {
//!     let prior = predict(&state, F * state.mean, &F, &Q_d);
//!     let residual = SVector::from([y]) - H * prior.mean;
//!     let (posterior, innovation) = measurement_update(&prior, &residual, &H, &R)?;
//!     assert!(innovation.nis < 10.8, "beyond the 99.9 % quantile of chi squared");
//!     state = posterior;
//! }
//! assert!((state.mean[1] - 1.0).abs() < 3.0 * state.cov[(1, 1)].sqrt());
//! assert!(state.cov[(1, 1)].sqrt() < 0.15);
//! # Ok::<(), kalman::UpdateError>(())
//! ```
//!
//! An extended filter has the same calls: `mean_after` is then the integrated state, F the transition matrix
//! of the linearisation, and H the Jacobian of the measurement.
//!
//! # A recording
//!
//! A recording is a list of [`LinearStep`]s. [`linearise_along_trajectory`] and [`linearise_by_extended_filter`] make them from a [`NonlinearModel`].
//! [`filter_forward`] filters, [`smooth_recording`] runs the smoother of Rauch, Tung and Striebel (RTS), and [`EmSettings`] estimates
//! the noises by expectation maximisation (EM):
//!
//! ```
//! use kalman::{EmSettings, EmStatus, Gaussian, LinearStep, NoiseParameters, filter_forward, smooth_recording};
//! use nalgebra::{SMatrix, SVector};
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let measured = [0.1, 0.9, f64::NAN, 3.2, 3.9, 5.1, 5.8, 7.2];
//! let steps = measured.map(|y| LinearStep {
//!     y: SVector::from([y]),
//!     H: SMatrix::<f64, 1, 2>::new(1.0, 0.0),
//!     F: SMatrix::<f64, 2, 2>::new(1.0, 1.0, 0.0, 1.0),
//!     b: SVector::zeros(),
//! });
//! let guess = NoiseParameters {
//!     start: Gaussian { mean: SVector::zeros(), cov: SMatrix::identity() },
//!     Q: SMatrix::identity() * 0.1,
//!     R: SMatrix::identity(),
//! };
//! let found = EmSettings::default().fit(&steps, &guess)?;
//! assert_eq!(found.status, EmStatus::Converged);
//! let smoothed = smooth_recording(&steps, &filter_forward(&steps, &found.parameters)?)?;
//! assert!((smoothed.states[2].mean[0] - 2.0).abs() < 0.2);
//! # Ok(())
//! # }
//! ```
//!
//! # An augmented state
//!
//! [`augmented`] is an extended filter over any kind of number, such as those with derivatives: rates and their derivatives go in, sensors
//! may err, and each may have coloured noise, whose states are added to those of the model.
//!
//! In the registry this crate is `trackside-kalman`; the name in code stays.
#![forbid(unsafe_code)]
#![allow(rustdoc::broken_intra_doc_links, reason = "units stand in brackets, which rustdoc takes for links")]

pub mod augmented;
mod consistency;
#[cfg(test)]
mod dense;
mod discretise;
mod em;
mod filter;
mod forward;
mod gaussian;
mod model;
mod rts;
mod step;

pub use consistency::{MeanNis, NisConsistency};
pub use discretise::{discretise, transition_matrix};
pub use em::{
    CovarianceStructure, EmError, EmEstimate, EmSettings, EmStatus, InitialStateUpdate, LikelihoodFall,
};
pub use filter::{Innovation, UpdateError, measurement_update, predict};
pub use forward::{FilteredRecording, PassError, StepFit, filter_forward};
pub use gaussian::Gaussian;
pub use model::{NonlinearModel, linearise_along_trajectory, linearise_by_extended_filter};
pub use rts::{SmoothedRecording, smooth_recording, smooth_step};
pub use step::{LinearStep, NoiseParameters};
