//! Looks ahead along the path of EM: SQUAREM's step, in logarithms of covariances.
#![allow(non_snake_case, reason = "matrices are written as in the equations")]

use nalgebra::{SMatrix, SVector};

use super::maximise::{Freedom, rescaled, spectral};

/// Coordinates of what is free in a covariance: logarithms of variances, or the matrix logarithm.
///
/// All of space stands for covariances that are positive definite, and the distance between two of
/// them does not depend on units.
pub(crate) struct Chart<const D: usize> {
    freedom: Freedom<D>,
    /// Standard deviations by which a full covariance is divided before its logarithm is taken.
    unit: SVector<f64, D>,
}

impl<const D: usize> Chart<D> {
    /// Coordinates for covariances near `C`.
    pub(crate) fn near(C: &SMatrix<f64, D, D>, freedom: Freedom<D>) -> Self {
        Self { freedom, unit: C.diagonal().map(f64::sqrt) }
    }

    /// Coordinates of a covariance, as a symmetric matrix.
    pub(crate) fn coordinates(&self, C: &SMatrix<f64, D, D>) -> SMatrix<f64, D, D> {
        match self.freedom {
            Freedom::Fixed => SMatrix::zeros(),
            Freedom::Diagonal(free) => SMatrix::from_diagonal(&SVector::from_fn(|i, _| {
                if free[i] { C[(i, i)].ln() } else { 0.0 }
            })),
            Freedom::Full => spectral(&rescaled(C, &self.unit.map(f64::recip)), f64::ln),
        }
    }

    /// The covariance with these coordinates, and its variances not below the floor.
    pub(crate) fn covariance(
        &self,
        coordinates: &SMatrix<f64, D, D>,
        old: &SMatrix<f64, D, D>,
        floor: &SVector<f64, D>,
    ) -> SMatrix<f64, D, D> {
        let C = match self.freedom {
            Freedom::Full => rescaled(&spectral(coordinates, f64::exp), &self.unit),
            _ => SMatrix::from_diagonal(&coordinates.diagonal().map(f64::exp)),
        };
        self.freedom.maximise(&C, old, floor)
    }
}

/// Three points of the path of EM in coordinates, as their first and second differences.
#[derive(Clone, Copy)]
pub(crate) struct Path<const D: usize> {
    from: SMatrix<f64, D, D>,
    first: SMatrix<f64, D, D>,
    second: SMatrix<f64, D, D>,
}

impl<const D: usize> Path<D> {
    /// The path through three covariances.
    pub(crate) fn through(chart: &Chart<D>, points: [&SMatrix<f64, D, D>; 3]) -> Self {
        let [a, b, c] = points.map(|C| chart.coordinates(C));
        Self { from: a, first: b - a, second: c - b - b + a }
    }

    /// Squared lengths of the first and the second difference.
    pub(crate) fn lengths(&self) -> [f64; 2] {
        [self.first.norm_squared(), self.second.norm_squared()]
    }

    /// The point at the length α of the step; α = 1 is the third point.
    pub(crate) fn at(&self, alpha: f64) -> SMatrix<f64, D, D> {
        self.from + self.first * (2.0 * alpha) + self.second * (alpha * alpha)
    }
}
