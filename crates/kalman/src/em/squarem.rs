//! Extrapolates the path of EM: the step of SQUAREM, in logarithms of covariances.
#![allow(non_snake_case, reason = "matrices are written as in the equations")]

use nalgebra::{SMatrix, SVector};

use super::maximise::{CovarianceStructure, map_eigenvalues, scale_covariance};

/// Coordinates of what is free in a covariance: logarithms of variances, or the matrix logarithm.
///
/// All of space stands for covariances that are positive definite, and the distance between two of
/// them does not depend on units.
pub(crate) struct LogCovarianceChart<const D: usize> {
    freedom: CovarianceStructure<D>,
    /// Standard deviations by which a full covariance is divided before its logarithm is taken.
    unit: SVector<f64, D>,
}

impl<const D: usize> LogCovarianceChart<D> {
    /// Coordinates for covariances near `C`.
    pub(crate) fn near(C: &SMatrix<f64, D, D>, freedom: CovarianceStructure<D>) -> Self {
        Self { freedom, unit: C.diagonal().map(f64::sqrt) }
    }

    /// Coordinates of a covariance, as a symmetric matrix.
    pub(crate) fn to_coordinates(&self, C: &SMatrix<f64, D, D>) -> SMatrix<f64, D, D> {
        match self.freedom {
            CovarianceStructure::Fixed => SMatrix::zeros(),
            CovarianceStructure::Diagonal(free) => {
                SMatrix::from_diagonal(&SVector::from_fn(|i, _| if free[i] { C[(i, i)].ln() } else { 0.0 }))
            }
            CovarianceStructure::Full => {
                map_eigenvalues(&scale_covariance(C, &self.unit.map(f64::recip)), f64::ln)
            }
        }
    }

    /// The covariance with these coordinates, and its variances not below the floor.
    pub(crate) fn to_covariance(
        &self,
        coordinates: &SMatrix<f64, D, D>,
        old: &SMatrix<f64, D, D>,
        floor: &SVector<f64, D>,
    ) -> SMatrix<f64, D, D> {
        let C = match self.freedom {
            CovarianceStructure::Full => {
                scale_covariance(&map_eigenvalues(coordinates, f64::exp), &self.unit)
            }
            _ => SMatrix::from_diagonal(&coordinates.diagonal().map(f64::exp)),
        };
        self.freedom.maximise_covariance(&C, old, floor)
    }
}

/// Three points of the path of EM in coordinates, as their first and second differences.
#[derive(Clone, Copy)]
pub(crate) struct EmPath<const D: usize> {
    from: SMatrix<f64, D, D>,
    first: SMatrix<f64, D, D>,
    second: SMatrix<f64, D, D>,
}

impl<const D: usize> EmPath<D> {
    /// The path through three covariances.
    pub(crate) fn through(chart: &LogCovarianceChart<D>, points: [&SMatrix<f64, D, D>; 3]) -> Self {
        let [a, b, c] = points.map(|C| chart.to_coordinates(C));
        Self { from: a, first: b - a, second: c - b - b + a }
    }

    /// Squared lengths of the first and the second difference.
    pub(crate) fn squared_difference_lengths(&self) -> [f64; 2] {
        [self.first.norm_squared(), self.second.norm_squared()]
    }

    /// The point at the length α of the step; α = 1 is the third point.
    pub(crate) fn extrapolate(&self, alpha: f64) -> SMatrix<f64, D, D> {
        self.from + self.first * (2.0 * alpha) + self.second * (alpha * alpha)
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{Matrix3, Vector3};
    use proptest::array::uniform9;
    use proptest::prelude::*;

    use super::*;
    use crate::dense::covariance_from_entries;

    proptest! {
        #[test]
        fn a_step_of_length_one_ends_at_the_third_point(
            a in uniform9(-1.0..1.0f64), b in uniform9(-1.0..1.0f64), c in uniform9(-1.0..1.0f64),
        ) {
            let [a, b, c] = [a, b, c].map(|entries| covariance_from_entries::<3>(&entries, 0.1));
            let only = |C: &Matrix3<f64>| Matrix3::from_diagonal(&C.diagonal());
            let [d, e, f] = [a, b, c].map(|C| only(&C));
            let floor = Vector3::repeat(1e-9);
            for (freedom, [a, b, c]) in [(CovarianceStructure::Full, [a, b, c]), (CovarianceStructure::DIAGONAL, [d, e, f])] {
                let chart = LogCovarianceChart::near(&b, freedom);
                let path = EmPath::through(&chart, [&a, &b, &c]);
                let end = chart.to_covariance(&path.extrapolate(1.0), &b, &floor);
                prop_assert!((end - c).amax() <= 1e-12 * c.amax(), "{} {}", end, c);
            }
        }
    }

    #[test]
    fn along_a_geometric_path_the_step_ends_at_its_limit() {
        // Errors of the logarithms that halve: 8, 4, 2 above 1; the step is 2 long and lands on 1.
        let at = |ln: f64| Matrix3::from_diagonal_element(ln.exp());
        let chart = LogCovarianceChart::near(&at(5.0), CovarianceStructure::DIAGONAL);
        let path = EmPath::through(&chart, [&at(9.0), &at(5.0), &at(3.0)]);
        let [first, second] = path.squared_difference_lengths();
        assert!(((first / second).sqrt() - 2.0).abs() < 1e-12);
        assert!((path.extrapolate(2.0)[(0, 0)] - 1.0).abs() < 1e-12);
    }
}
