//! Fits a normal distribution by natural gradients with Newton's step length: variational online Newton (Khan and Rue, "The
//! Bayesian learning rule", 2023), with fixed points and steps that never lower the bound.

use nalgebra::{DMatrix, SymmetricEigen};

use crate::convergence::OptimisationStatus;
use crate::variational::LogDensity;
use crate::variational::gaussian::{DensityComparison, Gaussian};

/// Eigenvalues of the whitened precision that one step may follow.
const CURVATURES: [f64; 2] = [0.1, 10.0];
/// Shares of a step that are tried before giving up.
const SHORTEST: f64 = 1e-6;

/// Of the start.
const MOST_HALVINGS: usize = 30;

/// When to stop.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NewtonLimits {
    /// Largest gradient norm, see [`DensityComparison::gradient_norm`].
    pub tolerance: f64,
    /// Most steps.
    pub steps: usize,
}

/// A distribution that was fitted.
#[derive(Clone, Debug)]
pub struct GaussianFit {
    /// The distribution.
    pub gaussian: Gaussian,
    /// How it ended.
    pub status: OptimisationStatus,
    /// Gradient norm at the end, see [`DensityComparison::gradient_norm`].
    pub gradient_norm: f64,
    /// Steps that were taken.
    pub steps: usize,
    /// Evidence lower bound before the first step and after each.
    pub trace: Vec<f64>,
    /// Evaluations of the density.
    pub evaluations: usize,
}

/// Maximises the evidence lower bound over points that stand for the standard normal distribution. The start is narrowed
/// first, as long as that raises the bound: the curvature at the top of a curved ridge makes a distribution far too wide.
pub fn maximise_elbo(
    density: &impl LogDensity,
    start: Gaussian,
    points: &DMatrix<f64>,
    limits: NewtonLimits,
) -> GaussianFit {
    let mut gaussian = start;
    let mut here = gaussian.compare_with_density(density, points);
    let mut comparisons = 1;
    for _ in 0..MOST_HALVINGS {
        let half = Gaussian { mean: gaussian.mean.clone(), factor: 0.5 * &gaussian.factor };
        let there = half.compare_with_density(density, points);
        comparisons += 1;
        if here.elbo >= there.elbo || there.elbo.is_nan() {
            break;
        }
        (gaussian, here) = (half, there);
    }
    let (mut share, mut trace) = (1.0, vec![here.elbo]);
    let status = loop {
        if here.gradient_norm() <= limits.tolerance {
            break OptimisationStatus::Converged;
        }
        if trace.len() > limits.steps {
            break OptimisationStatus::IterationLimit;
        }
        let taken = loop {
            let next = newton_step(&gaussian, &here, share);
            let there = next.as_ref().map(|next| next.compare_with_density(density, points));
            comparisons += 1;
            match (next, there) {
                (Some(next), Some(there)) if there.elbo >= here.elbo => break Some((next, there)),
                _ if share <= SHORTEST => break None,
                _ => share *= 0.4,
            }
        };
        let Some((next, there)) = taken else { break OptimisationStatus::Stalled };
        (gaussian, here) = (next, there);
        trace.push(here.elbo);
        share = f64::min(2.0 * share, 1.0);
    };
    GaussianFit {
        gradient_norm: here.gradient_norm(),
        status,
        steps: trace.len() - 1,
        trace,
        evaluations: comparisons * points.ncols(),
        gaussian,
    }
}

/// A share of Newton's step: a mix of the old precision and that of the density.
fn newton_step(from: &Gaussian, here: &DensityComparison, share: f64) -> Option<Gaussian> {
    let eigen = SymmetricEigen::new(-&here.bend);
    let [low, high] = CURVATURES;
    let mixed = eigen.eigenvalues.map(|value| 1.0 - share + share * value.clamp(low, high));
    let inverse = DMatrix::from_diagonal(&mixed.map(f64::recip));
    let covariance = &eigen.eigenvectors * inverse * eigen.eigenvectors.transpose();
    let mean = &from.mean + &from.factor * (&covariance * &here.slope) * share;
    let factor = &from.factor * covariance.cholesky()?.l();
    let finite = mean.iter().chain(factor.iter()).all(|x| x.is_finite());
    finite.then_some(Gaussian { mean, factor })
}

#[cfg(test)]
mod tests {
    use approx::assert_relative_eq;
    use nalgebra::{DVector, dmatrix, dvector};

    use super::*;
    use crate::low_discrepancy::normal_points;

    const LIMITS: NewtonLimits = NewtonLimits { tolerance: 1e-7, steps: 200 };

    /// exp of a parabola, with a bend in the first coordinate.
    struct Parabola {
        precision: DMatrix<f64>,
        bend: f64,
    }

    impl LogDensity for Parabola {
        fn dimension(&self) -> usize {
            2
        }

        fn log_density_and_gradient(&self, x: &DVector<f64>) -> (f64, DVector<f64>) {
            let from = DVector::from_vec(vec![x[0] - 3.0, x[1] + 1.0 - self.bend * x[0] * x[0]]);
            let force = -&self.precision * &from;
            let log = 0.5 * from.dot(&force);
            (log, dvector![force[0] - 2.0 * self.bend * x[0] * force[1], force[1]])
        }
    }

    fn fit(bend: f64, count: usize) -> GaussianFit {
        let density = Parabola { precision: dmatrix![4.0, 1.5; 1.5, 1.0], bend };
        let start = Gaussian { mean: DVector::zeros(2), factor: DMatrix::identity(2, 2) };
        maximise_elbo(&density, start, &normal_points(2, count, 0), LIMITS)
    }

    #[test]
    fn a_normal_density_is_found_exactly() {
        let fitted = fit(0.0, 16);
        assert_eq!(fitted.status, OptimisationStatus::Converged);
        assert_relative_eq!(fitted.gaussian.mean, dvector![3.0, -1.0], epsilon = 1e-6);
        let covariance = &fitted.gaussian.factor * fitted.gaussian.factor.transpose();
        let expected = dmatrix![4.0, 1.5; 1.5, 1.0].try_inverse().expect("regular");
        assert_relative_eq!(covariance, expected, max_relative = 1e-7);
        // The bound is tight: it is the logarithm of the density's integral.
        let integral = (std::f64::consts::TAU / (4.0_f64 - 1.5 * 1.5).sqrt()).ln();
        assert_relative_eq!(fitted.trace[fitted.steps], integral, max_relative = 1e-9);
    }

    #[test]
    fn the_bound_never_falls_and_its_slope_is_zero_where_it_ends() {
        let fitted = fit(0.2, 64);
        assert_eq!(fitted.status, OptimisationStatus::Converged, "{fitted:?}");
        assert!(fitted.trace.is_sorted());
        let density = Parabola { precision: dmatrix![4.0, 1.5; 1.5, 1.0], bend: 0.2 };
        let points = normal_points(2, 64, 0);
        let elbo = |change: [f64; 5]| {
            let mut moved = fitted.gaussian.clone();
            moved.mean += dvector![change[0], change[1]];
            moved.factor += dmatrix![change[2], 0.0; change[3], change[4]];
            moved.compare_with_density(&density, &points).elbo
        };
        for k in 0..5 {
            let step = |length: f64| elbo(std::array::from_fn(|i| if i == k { length } else { 0.0 }));
            let slope = (step(1e-4) - step(-1e-4)) / 2e-4;
            assert!(slope.abs() < 1e-5, "{k}: {slope}");
        }
    }

    #[test]
    fn few_steps_are_reported_as_too_few() {
        let density = Parabola { precision: DMatrix::identity(2, 2), bend: 0.0 };
        let start = Gaussian { mean: dvector![50.0, 0.0], factor: 0.01 * DMatrix::identity(2, 2) };
        let limits = NewtonLimits { steps: 2, ..LIMITS };
        let fitted = maximise_elbo(&density, start, &normal_points(2, 16, 0), limits);
        assert_eq!((fitted.status, fitted.steps), (OptimisationStatus::IterationLimit, 2));
        assert!(fitted.gradient_norm > 1.0);
    }
}
