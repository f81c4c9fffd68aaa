//! Minimises a sum of squares by Levenberg's and Marquardt's method: Gauss-Newton steps, damped until the cost falls.
//!
//! Bounds are projections of the next point. Where multipliers, inequalities or convergence to rounding matter, use [`crate::sqp`].

use nalgebra::allocator::Allocator;
use nalgebra::{Cholesky, DefaultAllocator, Dim, OMatrix, OVector};

use crate::convergence::OptimisationStatus;

/// First damping, relative to the diagonal of the normal equations, and the least one.
const DAMPING: f64 = 1e-3;
const LEAST_DAMPING: f64 = 1e-9;

/// A sum of squares over `D` parameters, with what else is quadratic in it, such as a normal prior.
pub trait SquaredCost<D: Dim>
where
    DefaultAllocator: Allocator<D> + Allocator<D, D>,
{
    /// The cost; a step to one that is not finite is rejected.
    fn cost(&self, x: &OVector<f64, D>) -> f64;

    /// The cost to second order; `None` ends the search.
    fn normal_equations(&self, x: &OVector<f64, D>) -> Option<NormalEquations<D>>;

    /// Where a step leads, in the coordinates of the normal equations: a point that is allowed.
    fn point_after_step(&self, x: &OVector<f64, D>, step: &OVector<f64, D>) -> OVector<f64, D> {
        x + step
    }
}

/// A sum of squares to second order.
#[derive(Clone, Debug)]
pub struct NormalEquations<D: Dim>
where
    DefaultAllocator: Allocator<D> + Allocator<D, D>,
{
    /// JᵀWJ, half of the Gauss-Newton Hessian, `D` × `D`. A parameter with 0 on the diagonal rests.
    pub matrix: OMatrix<f64, D, D>,
    /// JᵀWr, half of the gradient.
    pub gradient: OVector<f64, D>,
}

impl<D: Dim> NormalEquations<D>
where
    DefaultAllocator: Allocator<D> + Allocator<D, D>,
{
    /// The step s of (A + λ diag A) s = −g, with 1 + λ on the diagonal of what is factored; `None` where that is not positive definite.
    fn damped_step(&self, damping: f64) -> Option<OVector<f64, D>> {
        let scale = self.matrix.diagonal().map(|it| it.max(0.0).sqrt());
        let scaled = |value: f64, scale: f64| if scale > 0.0 { value / scale } else { 0.0 };
        let (size, _) = scale.shape_generic();
        let system = OMatrix::<f64, D, D>::from_fn_generic(size, size, |i, j| {
            if i == j { 1.0 + damping } else { scaled(self.matrix[(i, j)], scale[i] * scale[j]) }
        });
        let right = self.gradient.zip_map(&scale, |by, scale| scaled(-by, scale));
        Some(Cholesky::new(system)?.solve(&right).zip_map(&scale, scaled))
    }
}

/// How the damping follows the cost, and when a search ends.
#[derive(Clone, Copy, Debug)]
pub struct LevenbergMarquardtOptions {
    /// Most steps that lower the cost.
    pub iterations: usize,
    /// Most steps in a row that do not.
    pub rejections: usize,
    /// Factor of the damping after a step that does not lower the cost.
    pub increase: f64,
    /// Factor of the damping after a step that lowers the cost by more than [`gain_ratio`](Self::gain_ratio).
    pub decrease: f64,
    /// Share of the decrease that the quadratic model promises.
    pub gain_ratio: f64,
    /// The search has converged after a step that lowers the cost by at most this share of it,
    pub relative_tolerance: f64,
    /// or at a point where the next step promises less than this.
    pub absolute_tolerance: f64,
}

impl Default for LevenbergMarquardtOptions {
    /// For fits of a few parameters that are done thousands of times.
    fn default() -> Self {
        Self {
            iterations: 40,
            rejections: 8,
            increase: 4.0,
            decrease: 0.3,
            gain_ratio: 0.0,
            relative_tolerance: 1e-7,
            absolute_tolerance: 0.0,
        }
    }
}

/// Where a search ended.
#[derive(Clone, Debug)]
pub struct LevenbergMarquardtMinimum<D: Dim>
where
    DefaultAllocator: Allocator<D>,
{
    /// The point.
    pub x: OVector<f64, D>,
    /// The cost there.
    pub cost: f64,
    /// How it ended.
    pub status: OptimisationStatus,
    /// Steps that lowered the cost.
    pub iterations: usize,
}

/// The minimum near a start.
pub fn minimise_levenberg_marquardt<D: Dim>(
    problem: &impl SquaredCost<D>,
    start: OVector<f64, D>,
    options: &LevenbergMarquardtOptions,
) -> LevenbergMarquardtMinimum<D>
where
    DefaultAllocator: Allocator<D> + Allocator<D, D>,
{
    let cost = problem.cost(&start);
    let status = OptimisationStatus::IterationLimit;
    let mut minimum = LevenbergMarquardtMinimum { x: start, cost, status, iterations: 0 };
    let mut damping = DAMPING;
    while minimum.iterations < options.iterations {
        let before = minimum.cost;
        if let Some(status) = lower_cost(problem, &mut minimum, &mut damping, options) {
            return LevenbergMarquardtMinimum { status, ..minimum };
        }
        minimum.iterations += 1;
        if before - minimum.cost <= options.relative_tolerance * minimum.cost {
            return LevenbergMarquardtMinimum { status: OptimisationStatus::Converged, ..minimum };
        }
    }
    minimum
}

/// Takes one step that lowers the cost, or says how the search has ended.
fn lower_cost<D: Dim>(
    problem: &impl SquaredCost<D>,
    minimum: &mut LevenbergMarquardtMinimum<D>,
    damping: &mut f64,
    options: &LevenbergMarquardtOptions,
) -> Option<OptimisationStatus>
where
    DefaultAllocator: Allocator<D> + Allocator<D, D>,
{
    let Some(normal) = problem.normal_equations(&minimum.x) else {
        return Some(OptimisationStatus::Stalled);
    };
    for _ in 0..options.rejections {
        if let Some(step) = normal.damped_step(*damping) {
            // sᵀ(A + λ diag A)s, which leaves out λ sᵀ diag A s of the decrease.
            let promised = -normal.gradient.dot(&step);
            if promised < options.absolute_tolerance {
                return Some(OptimisationStatus::Converged);
            }
            let x = problem.point_after_step(&minimum.x, &step);
            let cost = problem.cost(&x);
            if cost < minimum.cost {
                if minimum.cost - cost > options.gain_ratio * promised {
                    *damping = (*damping * options.decrease).max(LEAST_DAMPING);
                }
                (minimum.x, minimum.cost) = (x, cost);
                return None;
            }
        }
        *damping *= options.increase;
    }
    Some(OptimisationStatus::Stalled)
}

#[cfg(test)]
mod tests {
    use nalgebra::{U2, Vector2, matrix, vector};

    use super::*;

    /// Rosenbrock's function: residuals 10 (y − x²) and 1 − x.
    struct Rosenbrock {
        most: f64,
    }

    impl SquaredCost<U2> for Rosenbrock {
        fn cost(&self, x: &Vector2<f64>) -> f64 {
            100.0 * (x[1] - x[0] * x[0]).powi(2) + (1.0 - x[0]).powi(2)
        }

        fn normal_equations(&self, x: &Vector2<f64>) -> Option<NormalEquations<U2>> {
            let jacobian = matrix![-20.0 * x[0], 10.0; -1.0, 0.0].transpose();
            let residual = vector![10.0 * (x[1] - x[0] * x[0]), 1.0 - x[0]];
            Some(NormalEquations { matrix: jacobian * jacobian.transpose(), gradient: jacobian * residual })
        }

        fn point_after_step(&self, x: &Vector2<f64>, step: &Vector2<f64>) -> Vector2<f64> {
            vector![(x[0] + step[0]).min(self.most), x[1] + step[1]]
        }
    }

    fn minimum_from_usual_start(
        most: f64,
        options: LevenbergMarquardtOptions,
    ) -> LevenbergMarquardtMinimum<U2> {
        let options = LevenbergMarquardtOptions { iterations: 100, ..options };
        minimise_levenberg_marquardt(&Rosenbrock { most }, vector![-1.2, 1.0], &options)
    }

    #[test]
    fn a_curved_valley_is_followed_to_its_end() {
        let x = minimum_from_usual_start(9.0, LevenbergMarquardtOptions::default()).x;
        assert!((x - vector![1.0, 1.0]).norm() < 1e-6, "{x}");
    }

    #[test]
    fn a_bound_ends_the_way() {
        let x = minimum_from_usual_start(0.5, LevenbergMarquardtOptions::default()).x;
        assert!(x[0] <= 0.5 && (x - vector![0.5, 0.25]).norm() < 1e-2, "{x}");
    }

    #[test]
    fn what_a_step_promises_ends_the_search() {
        let options = LevenbergMarquardtOptions {
            relative_tolerance: 0.0,
            absolute_tolerance: 1e-6,
            gain_ratio: 0.5,
            ..Default::default()
        };
        let minimum = minimum_from_usual_start(9.0, options);
        assert_eq!(minimum.status, OptimisationStatus::Converged);
        assert!(minimum.cost < 2e-6 && minimum.iterations < 40, "{minimum:?}");
    }

    #[test]
    fn a_parameter_without_influence_rests() {
        let normal = NormalEquations { matrix: matrix![4.0, 0.0; 0.0, 0.0], gradient: vector![2.0, 3.0] };
        assert_eq!(normal.damped_step(0.0), Some(vector![-0.5, 0.0]));
    }
}
