//! Holds a normal distribution: mean and covariance.

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
pub(crate) fn symmetric_part<const N: usize>(cov: &SMatrix<f64, N, N>) -> SMatrix<f64, N, N> {
    (cov + cov.transpose()) * 0.5
}
