//! Minimises a smooth cost in a box under smooth inequalities: sequential quadratic programming with the Hessian of Gauss and
//! Newton, damped after Levenberg and Marquardt. It knows nothing of tires.
//!
//! Each step minimises the quadratic model, with μ added to its scaled diagonal, over the box and the linearised inequalities;
//! violations of those cost a price per unit (exact penalty), so that a step always exists. μ follows the gain ratio.
#![allow(non_snake_case, reason = "matrices as in the literature")]

mod qp;
mod search;
mod secant;

use std::ops::ControlFlow;

use nalgebra::{DMatrix, DVector};

use crate::convergence::OptimisationStatus;
use search::SqpMinimisation;

/// A cost to second order.
#[derive(Clone, Debug)]
pub struct QuadraticModel {
    /// Value.
    pub cost: f64,
    /// Exact first derivatives, length n.
    pub gradient: DVector<f64>,
    /// Positive semidefinite approximation of the second derivatives, n × n.
    pub hessian: DMatrix<f64>,
    /// What gradients are measured by: √(2 cost) for a sum of squares, √N for a log-likelihood of N points.
    pub scale: f64,
}

/// An inequality, value ≥ 0, to first order.
#[derive(Clone, Debug)]
pub struct LinearisedInequality {
    /// Value, of order 1 over the box.
    pub value: f64,
    /// Its derivatives, length n.
    pub gradient: DVector<f64>,
}

/// What can be minimised.
pub trait Objective: Sync {
    /// The cost at a point inside the box. A cost that is not finite makes the step shorter.
    fn model(&self, x: &DVector<f64>) -> QuadraticModel;

    /// The cost alone.
    fn cost(&self, x: &DVector<f64>) -> f64 {
        self.model(x).cost
    }

    /// The costs at several points.
    fn costs(&self, points: &[DVector<f64>]) -> Vec<f64> {
        points.iter().map(|x| self.cost(x)).collect()
    }

    /// The inequalities, always the same number of them.
    fn inequalities(&self, _x: &DVector<f64>) -> Vec<LinearisedInequality> {
        Vec::new()
    }
}

/// When to stop.
#[derive(Clone, Copy, Debug)]
pub struct SqpLimits {
    /// Most steps, accepted or not.
    pub iterations: usize,
    /// KKT residual at which iterations end.
    pub target: f64,
    /// KKT residual that counts as converged where rounding forbids the target.
    pub tolerance: f64,
    /// First damping, relative to the diagonal of the Hessian. A small one lets a search move along a ridge at once, if its
    /// start is so near that the quadratic model holds.
    pub damping: f64,
}

impl Default for SqpLimits {
    fn default() -> Self {
        Self { iterations: 500, target: 1e-12, tolerance: 1e-8, damping: 1e-2 }
    }
}

/// Where a minimisation ended.
#[derive(Clone, Debug)]
pub struct SqpMinimum {
    /// The point, exactly on a bound where it is active.
    pub x: DVector<f64>,
    /// The cost there.
    pub model: QuadraticModel,
    /// Gradients of the inequalities that hold with equality, one per row.
    pub active_rows: DMatrix<f64>,
    /// Which variables stand on a bound.
    pub at_bound: Vec<bool>,
    /// Largest violation of an inequality, 0 if none.
    pub violation: f64,
    /// Largest violation of the conditions of Karush, Kuhn and Tucker: |gradient of the Lagrangian| / (√H_ii · scale) for free
    /// variables, the violation of inequalities, and multiplier · slack / scale².
    pub kkt_residual: f64,
    /// How it ended.
    pub status: OptimisationStatus,
    /// Steps tried.
    pub iterations: usize,
    /// Evaluations of the objective.
    pub evaluations: usize,
    /// The cost at the start and after each step that was accepted.
    pub trace: Vec<f64>,
}

const LEAST_DAMPING: f64 = 1e-13;
const MOST_DAMPING: f64 = 1e12;
/// Predicted decreases below this share of scale² drown in the rounding of the cost.
const ROUNDING: f64 = 1e-13;
/// Most steps after convergence whose decrease drowns. Where there is curvature two or three reach the target; along a flat ridge they wander.
const DROWNED: usize = 20;

/// Minimises from a start, which is first moved into the box. Bounds may be infinite.
pub fn minimise_sqp(
    objective: &dyn Objective,
    lower: &DVector<f64>,
    upper: &DVector<f64>,
    start: &DVector<f64>,
    limits: SqpLimits,
) -> SqpMinimum {
    minimise_sqp_observed(objective, lower, upper, start, limits, &mut |_| ControlFlow::Continue(()))
}

/// Minimises as [`minimise_sqp`] does, and shows the KKT residual at the start and after each step. A break ends the search as
/// if it were at its limit of iterations.
pub fn minimise_sqp_observed(
    objective: &dyn Objective,
    lower: &DVector<f64>,
    upper: &DVector<f64>,
    start: &DVector<f64>,
    limits: SqpLimits,
    observe: &mut dyn FnMut(f64) -> ControlFlow<()>,
) -> SqpMinimum {
    let mut search = SqpMinimisation::new(objective, lower, upper);
    let start = DVector::from_fn(start.len(), |i, _| start[i].clamp(lower[i], upper[i]));
    let mut point = search.evaluate(start);
    let mut trace = vec![point.model.cost];
    let mut multipliers = DVector::zeros(point.values.len());
    let mut residual = search.kkt_residual(&point, &mut multipliers);
    let mut damping = limits.damping;
    let mut iterations = 0;
    let mut drowned_steps = 0;
    let mut status = OptimisationStatus::IterationLimit;
    while iterations < limits.iterations {
        if residual <= limits.target || drowned_steps > DROWNED {
            status = OptimisationStatus::Converged;
            break;
        }
        if observe(residual).is_break() {
            break;
        }
        iterations += 1;
        let (hessian, damped) = search.hessian_and_damped_hessian(&point, damping);
        let Some(step) = search.solve_step(&point, damped) else {
            damping *= 10.0;
            if damping > MOST_DAMPING {
                status = OptimisationStatus::Stalled;
                break;
            }
            continue;
        };
        let next = search.evaluate(search.point_after_step(&point, &step));
        let change = &next.x - &point.x;
        let predicted = search.predicted_decrease(&point, &hessian, &change);
        let actual = search.merit_function(&point) - search.merit_function(&next);
        let mut next_multipliers = step.multipliers.clone();
        let next_residual = search.kkt_residual(&next, &mut next_multipliers);
        let drowned = predicted.abs() <= ROUNDING * point.model.scale.powi(2);
        drowned_steps += usize::from(drowned && residual <= limits.tolerance);
        let gain = if drowned {
            if next_residual < residual { 1.0 } else { -1.0 }
        } else if predicted > 0.0 {
            actual / predicted
        } else {
            -1.0
        };
        if next_residual.is_finite() {
            search.update_secant(&point, &next, &next_multipliers);
        }
        if gain > 1e-4 && next_residual.is_finite() {
            (point, multipliers, residual) = (next, next_multipliers, next_residual);
            trace.push(point.model.cost);
        } else if drowned && damping <= LEAST_DAMPING || damping > MOST_DAMPING || change.amax() == 0.0 {
            status = OptimisationStatus::Stalled;
            break;
        } else if drowned {
            // The undamped step is the last chance to improve what rounding lets improve.
            damping = LEAST_DAMPING;
            continue;
        }
        damping = next_damping(damping, gain);
    }
    if residual <= limits.tolerance {
        status = OptimisationStatus::Converged;
    }
    SqpMinimum { trace, ..search.into_minimum(point, &multipliers, residual, status, iterations) }
}

fn next_damping(damping: f64, gain: f64) -> f64 {
    let factor = if !gain.is_finite() || gain <= 0.0 {
        8.0
    } else if gain < 0.25 {
        3.0
    } else if gain > 0.75 {
        0.1
    } else {
        0.5
    };
    (damping * factor).max(LEAST_DAMPING)
}
