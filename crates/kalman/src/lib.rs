//! Estimates states from noisy measurements with Kalman filters over statically sized matrices.
//!
//! The crate knows matrices only: a model hands in its transition, its Jacobians and its
//! predictions, so linear and extended filters are the same calls. Nothing allocates.
//!
//! One step of an extended filter with the rates f(x), their Jacobian A and the measurement h(x):
//!
//! ```
//! use kalman::{Gaussian, discretise, predict, update};
//! use nalgebra::{SMatrix, SVector};
//!
//! # fn main() -> Result<(), kalman::UpdateError> {
//! // Constant velocity; the velocity walks randomly and the position is measured.
//! let A = SMatrix::<f64, 2, 2>::new(0.0, 1.0, 0.0, 0.0);
//! let Q_c = SMatrix::from_diagonal(&SVector::from([0.0, 0.5]));
//! let H = SMatrix::<f64, 1, 2>::new(1.0, 0.0);
//! let R = SMatrix::<f64, 1, 1>::new(1e-2);
//!
//! let start = Gaussian { mean: SVector::zeros(), cov: SMatrix::identity() };
//! let (F, Q_d) = discretise(&A, &Q_c, 0.01);
//! let prior = predict(&start, F * start.mean, &F, &Q_d);
//! let residual = SVector::from([0.2]) - H * prior.mean;
//! let (posterior, innovation) = update(&prior, &residual, &H, &R)?;
//! assert!(posterior.cov[(0, 0)] < prior.cov[(0, 0)] && innovation.nis < 1.0);
//! # Ok(())
//! # }
//! ```
#![forbid(unsafe_code)]
#![allow(
    rustdoc::broken_intra_doc_links,
    reason = "units stand in brackets, which rustdoc takes for links"
)]

#[cfg(test)]
mod dense;
mod discretise;
mod em;
mod filter;
mod forward;
mod model;
mod rts;

pub use discretise::{discretise, transition};
pub use em::{Em, EmError, Estimate, Freedom, StartUpdate, Status, Violation};
pub use filter::{Innovation, UpdateError, predict, update};
pub use forward::{Filtered, Fit, PassError, forward};
pub use model::{Model, Parameters, Step, extended, linearise};
pub use rts::{Smoothed, smooth};

use nalgebra::{SMatrix, SVector};
use serde::{Deserialize, Serialize};

/// Normal distribution of a state with `N` components.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Gaussian<const N: usize> {
    /// Expected state.
    pub mean: SVector<f64, N>,
    /// Covariance of the state, symmetric and positive semidefinite.
    pub cov: SMatrix<f64, N, N>,
}

/// Symmetric part of a matrix; rounding alone makes a computed covariance need it.
#[inline]
pub(crate) fn symmetric<const N: usize>(cov: &SMatrix<f64, N, N>) -> SMatrix<f64, N, N> {
    (cov + cov.transpose()) * 0.5
}
