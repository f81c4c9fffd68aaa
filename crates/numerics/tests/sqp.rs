//! The optimiser on problems that are no tires.

use approx::assert_relative_eq;
use nalgebra::{DMatrix, DVector, dvector};
use numerics::convergence::OptimisationStatus;
use numerics::sqp::{LinearisedInequality, Objective, QuadraticModel, SqpLimits, SqpMinimum, minimise_sqp};

/// Residuals 10 (y − x²) and 1 − x (Rosenbrock), inside a circle.
struct Rosenbrock {
    circle: Option<f64>,
}

impl Objective for Rosenbrock {
    fn model(&self, x: &DVector<f64>) -> QuadraticModel {
        let residual = dvector![10.0 * (x[1] - x[0] * x[0]), 1.0 - x[0]];
        let jacobian = DMatrix::from_row_slice(2, 2, &[-20.0 * x[0], 10.0, -1.0, 0.0]);
        let cost = 0.5 * residual.norm_squared();
        QuadraticModel {
            cost,
            gradient: jacobian.transpose() * &residual,
            hessian: jacobian.transpose() * jacobian,
            scale: residual.norm() + 1e-4,
        }
    }

    fn inequalities(&self, x: &DVector<f64>) -> Vec<LinearisedInequality> {
        let row = |square: f64| LinearisedInequality { value: square - x.norm_squared(), gradient: -2.0 * x };
        self.circle.map(row).into_iter().collect()
    }
}

fn solve(objective: &dyn Objective, half: f64, start: DVector<f64>) -> SqpMinimum {
    let side = DVector::from_element(start.len(), half);
    minimise_sqp(objective, &-&side, &side, &start, SqpLimits::default())
}

#[test]
fn the_banana_valley_is_followed_to_its_end() {
    let end = solve(&Rosenbrock { circle: None }, 5.0, dvector![-1.2, 1.0]);
    assert_eq!(end.status, OptimisationStatus::Converged);
    assert_relative_eq!(end.x, dvector![1.0, 1.0], epsilon = 1e-10);
    // The trace leads from the start to the end, and downhill but for rounding.
    assert_relative_eq!(end.trace[0], 12.1, max_relative = 1e-12);
    assert_eq!(end.trace.last(), Some(&end.model.cost));
    assert!(end.trace.windows(2).all(|pair| pair[1] <= pair[0] + 1e-15));
}

#[test]
fn bounds_hold_to_the_last_bit() {
    let end = solve(&Rosenbrock { circle: None }, 0.7, dvector![-0.5, 0.2]);
    assert_eq!(end.status, OptimisationStatus::Converged);
    assert_eq!((end.x[0], end.at_bound[0], end.at_bound[1]), (0.7, true, false));
    assert_relative_eq!(end.x[1], 0.49, epsilon = 1e-10);
}

#[test]
fn a_curved_constraint_is_met_with_its_multiplier() {
    for start in [dvector![-1.2, 1.0], dvector![3.0, 3.0], dvector![0.0, 0.0]] {
        let end = solve(&Rosenbrock { circle: Some(1.0) }, 5.0, start);
        assert_eq!(end.status, OptimisationStatus::Converged, "{end:?}");
        assert_relative_eq!(end.x.norm(), 1.0, epsilon = 1e-10);
        // Gradient and radius are parallel, and the cost falls outwards.
        let g = &end.model.gradient;
        assert!((g[0] * end.x[1] - g[1] * end.x[0]).abs() < 1e-8 && g.dot(&end.x) < 0.0);
        assert_eq!(end.active_rows.nrows(), 1);
    }
}

/// An exponential decay in each of eleven unknowns, coupled by their sum, with residuals that do not vanish.
struct Coupled;

impl Objective for Coupled {
    fn model(&self, x: &DVector<f64>) -> QuadraticModel {
        let n = x.len();
        let mut residual = x.map_with_location(|i, _, x| x.exp() - 0.3 * i as f64);
        let mut jacobian = DMatrix::from_diagonal(&x.map(f64::exp)).resize_vertically(n + 1, 1.0);
        residual = residual.push(x.sum() - 2.0);
        jacobian.row_mut(n).fill(1.0);
        QuadraticModel {
            cost: 0.5 * residual.norm_squared(),
            gradient: jacobian.transpose() * &residual,
            hessian: jacobian.transpose() * &jacobian,
            scale: residual.norm(),
        }
    }

    fn inequalities(&self, x: &DVector<f64>) -> Vec<LinearisedInequality> {
        let mut gradient = DVector::zeros(x.len());
        (gradient[0], gradient[1]) = (1.0, 1.0);
        vec![LinearisedInequality { value: x[0] + x[1] + 1.0, gradient }]
    }
}

#[test]
fn eleven_unknowns_with_bounds_and_a_row() {
    let end = solve(&Coupled, 1.0, DVector::zeros(11));
    assert_eq!(end.status, OptimisationStatus::Converged, "{}", end.kkt_residual);
    assert_relative_eq!(end.x[0] + end.x[1], -1.0, epsilon = 1e-12);
    for i in 2..11 {
        let slope = end.model.gradient[i];
        let held = (end.x[i] == 1.0 && slope <= 0.0) || (end.x[i] == -1.0 && slope >= 0.0);
        assert!(held || slope.abs() < 1e-8, "{i}: {slope}");
    }
    assert_relative_eq!(end.model.gradient[0], end.model.gradient[1], epsilon = 1e-8);
}
