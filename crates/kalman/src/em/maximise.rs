//! Finds the covariance of a noise from its second moments: the M-step, with floors and locks.
#![allow(non_snake_case, reason = "matrices are written as in the equations")]

use nalgebra::{Cholesky, DMatrix, SMatrix, SVector};

use crate::gaussian::symmetric_part;

/// Which entries of a covariance are estimated.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum CovarianceStructure<const D: usize> {
    /// None: the covariance is known.
    Fixed,
    /// The variances that are marked, of a diagonal covariance; the others are known.
    Diagonal([bool; D]),
    /// All of them.
    Full,
}

impl<const D: usize> CovarianceStructure<D> {
    /// All variances of a diagonal covariance.
    pub const DIAGONAL: Self = Self::Diagonal([true; D]);

    /// True for a variance that is estimated.
    pub(crate) fn is_free(&self, i: usize) -> bool {
        match self {
            Self::Fixed => false,
            Self::Diagonal(free) => free[i],
            Self::Full => true,
        }
    }

    /// The covariance C with C ⪰ diag(`floor`) that maximises −ln det C − tr(C⁻¹ S) for the second
    /// moments `S`, among those that keep the entries of `old` that are not free.
    ///
    /// The objective falls apart into the variances of a diagonal C, each with one maximum, at its
    /// moment; into the eigenvalues of a full one, in coordinates in which the floor is the
    /// identity. So the larger one of moment and floor is the maximiser, and a floor costs EM
    /// nothing of its monotony.
    pub(crate) fn maximise_covariance(
        &self,
        S: &SMatrix<f64, D, D>,
        old: &SMatrix<f64, D, D>,
        floor: &SVector<f64, D>,
    ) -> SMatrix<f64, D, D> {
        match self {
            Self::Fixed => *old,
            Self::Diagonal(free) => SMatrix::from_diagonal(&SVector::from_fn(|i, _| {
                if free[i] { S[(i, i)].max(floor[i]) } else { old[(i, i)] }
            })),
            Self::Full => raise_eigenvalues(S, floor),
        }
    }
}

/// The eigenvalues of S in units of the floor are raised to one.
fn raise_eigenvalues<const D: usize>(S: &SMatrix<f64, D, D>, floor: &SVector<f64, D>) -> SMatrix<f64, D, D> {
    if Cholesky::new(S - SMatrix::from_diagonal(floor)).is_some() {
        return *S;
    }
    let unit = floor.map(f64::sqrt);
    scale_covariance(&map_eigenvalues(&scale_covariance(S, &unit.map(f64::recip)), |l| l.max(1.0)), &unit)
}

/// D C D with a diagonal D.
pub(crate) fn scale_covariance<const D: usize>(
    C: &SMatrix<f64, D, D>,
    unit: &SVector<f64, D>,
) -> SMatrix<f64, D, D> {
    SMatrix::from_fn(|i, j| unit[i] * C[(i, j)] * unit[j])
}

/// A function of a symmetric matrix, through its eigenvalues.
pub(crate) fn map_eigenvalues<const D: usize>(
    C: &SMatrix<f64, D, D>,
    f: impl Fn(f64) -> f64,
) -> SMatrix<f64, D, D> {
    // Of dynamic size, as the bounds of nalgebra's static eigenvalues spread to all callers.
    let mut eigen = DMatrix::from_column_slice(D, D, C.as_slice()).symmetric_eigen();
    eigen.eigenvalues.apply(|l| *l = f(*l));
    symmetric_part(&SMatrix::from_column_slice(eigen.recompose().as_slice()))
}

#[cfg(test)]
mod tests {
    use nalgebra::{Matrix3, Vector3};
    use proptest::array::{uniform3, uniform9};
    use proptest::prelude::*;

    use super::*;
    use crate::dense::covariance_from_entries;

    /// The objective of a covariance for given moments: −ln det C − tr(C⁻¹ S).
    fn objective(C: &Matrix3<f64>, S: &Matrix3<f64>) -> f64 {
        let factor = Cholesky::new(*C).expect("a covariance");
        -factor.ln_determinant() - factor.solve(S).trace()
    }

    proptest! {
        #[test]
        fn no_other_covariance_above_the_floor_is_better(
            s in uniform9(-1.0..1.0f64), floor in uniform3(0.05..1.0f64), other in uniform9(-1.0..1.0f64),
        ) {
            let (S, floor) = (covariance_from_entries::<3>(&s, 1e-3), Vector3::from(floor));
            let C = CovarianceStructure::Full.maximise_covariance(&S, &S, &floor);
            let D = Matrix3::from_diagonal(&floor);
            prop_assert!((C - D).symmetric_eigenvalues().min() >= -1e-12, "{}", C - D);
            let other = covariance_from_entries::<3>(&other, 0.0) + D;
            for part in [1e-3, 0.1, 1.0] {
                let near = C * (1.0 - part) + other * part;
                let gain = objective(&near, &S) - objective(&C, &S);
                prop_assert!(gain <= 1e-12, "{}: {}", part, gain);
            }
        }
    }
}
