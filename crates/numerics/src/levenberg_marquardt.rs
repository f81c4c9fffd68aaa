//! Minimises a small sum of squares by Levenberg's and Marquardt's method: Gauss-Newton steps, damped until the cost falls.
//!
//! For fits of a few parameters that are done thousands of times. Bounds are projections of the next point. Where multipliers, inequalities
//! or convergence to rounding matter, use [`crate::sqp`].

use nalgebra::{SMatrix, SVector};

/// A sum of squares over `N` parameters, with what else is quadratic in it, such as a normal prior.
pub trait SquaredCost<const N: usize> {
    /// The cost.
    fn cost(&self, x: &SVector<f64, N>) -> f64;

    /// Half of the cost's Gauss-Newton Hessian JᵀWJ and half of its descent −JᵀWr.
    fn normal_equations(&self, x: &SVector<f64, N>) -> (SMatrix<f64, N, N>, SVector<f64, N>);

    /// The nearest point that is allowed.
    fn project(&self, x: SVector<f64, N>) -> SVector<f64, N> {
        x
    }
}

/// First damping, relative to the diagonal of the Hessian.
const DAMPING: f64 = 1e-3;
/// Factors of the damping after a step that lowers the cost, and after one that does not.
const ACCEPTED: f64 = 0.3;
const REJECTED: f64 = 4.0;
/// Steps from one point that may be rejected.
const TRIES: usize = 8;
/// Share of the cost by which the last step lowers it.
const NEGLIGIBLE: f64 = 1e-7;

/// The minimum near a start, after `iterations` accepted steps at most.
pub fn minimise_levenberg_marquardt<const N: usize>(
    problem: &impl SquaredCost<N>,
    start: SVector<f64, N>,
    iterations: usize,
) -> SVector<f64, N> {
    let (mut x, mut cost) = (start, problem.cost(&start));
    let mut damping = DAMPING;
    for _ in 0..iterations {
        let (hessian, descent) = problem.normal_equations(&x);
        let lower = (0..TRIES).find_map(|_| {
            let damped = hessian + SMatrix::from_diagonal(&(hessian.diagonal() * damping));
            let next = problem.project(x + damped.try_inverse()? * descent);
            let next_cost = problem.cost(&next);
            if next_cost < cost {
                return Some((next, next_cost));
            }
            damping *= REJECTED;
            None
        });
        let Some((next, next_cost)) = lower else { return x };
        let gain = (cost - next_cost) / cost;
        (x, cost) = (next, next_cost);
        damping *= ACCEPTED;
        if gain < NEGLIGIBLE {
            return x;
        }
    }
    x
}

#[cfg(test)]
mod tests {
    use nalgebra::{matrix, vector};

    use super::*;

    /// Rosenbrock's function: residuals 10 (y − x²) and 1 − x.
    struct Rosenbrock {
        most: f64,
    }

    impl SquaredCost<2> for Rosenbrock {
        fn cost(&self, x: &SVector<f64, 2>) -> f64 {
            100.0 * (x[1] - x[0] * x[0]).powi(2) + (1.0 - x[0]).powi(2)
        }

        fn normal_equations(&self, x: &SVector<f64, 2>) -> (SMatrix<f64, 2, 2>, SVector<f64, 2>) {
            let jacobian = matrix![-20.0 * x[0], 10.0; -1.0, 0.0];
            let residual = vector![10.0 * (x[1] - x[0] * x[0]), 1.0 - x[0]];
            (jacobian.transpose() * jacobian, -jacobian.transpose() * residual)
        }

        fn project(&self, x: SVector<f64, 2>) -> SVector<f64, 2> {
            vector![x[0].min(self.most), x[1]]
        }
    }

    #[test]
    fn a_curved_valley_is_followed_to_its_end() {
        let x = minimise_levenberg_marquardt(&Rosenbrock { most: 9.0 }, vector![-1.2, 1.0], 100);
        assert!((x - vector![1.0, 1.0]).norm() < 1e-6, "{x}");
    }

    #[test]
    fn a_bound_ends_the_way() {
        let x = minimise_levenberg_marquardt(&Rosenbrock { most: 0.5 }, vector![-1.2, 1.0], 100);
        assert!(x[0] <= 0.5 && (x - vector![0.5, 0.25]).norm() < 1e-2, "{x}");
    }
}
