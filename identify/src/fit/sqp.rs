//! Minimises a smooth cost in a box under smooth inequalities: sequential quadratic programming with the Hessian of Gauss and
//! Newton, damped after Levenberg and Marquardt. It knows nothing of tires.
//!
//! Each step minimises the quadratic model, with μ added to its scaled diagonal, over the box and the linearised inequalities;
//! violations of those cost a price per unit (exact penalty), so that a step always exists. μ follows the gain ratio.
#![allow(non_snake_case, reason = "matrices as in the literature")]

use nalgebra::{Cholesky, DMatrix, DVector};

use super::qp::{self, Place, Step, Subproblem};
use super::secant::Secant;
use crate::result::Status;

/// A cost to second order.
#[derive(Clone, Debug)]
pub struct Model {
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
pub struct Inequality {
    /// Value, of order 1 over the box.
    pub value: f64,
    /// Its derivatives, length n.
    pub gradient: DVector<f64>,
}

/// What can be minimised.
pub trait Objective: Sync {
    /// The cost at a point inside the box. A cost that is not finite makes the step shorter.
    fn model(&self, x: &DVector<f64>) -> Model;

    /// The inequalities, always the same number of them.
    fn inequalities(&self, _x: &DVector<f64>) -> Vec<Inequality> {
        Vec::new()
    }
}

/// When to stop.
#[derive(Clone, Copy, Debug)]
pub struct Limits {
    /// Most steps, accepted or not.
    pub iterations: usize,
    /// KKT residual at which iterations end.
    pub target: f64,
    /// KKT residual that counts as converged where rounding forbids the target.
    pub tolerance: f64,
}

impl Default for Limits {
    fn default() -> Self {
        Self { iterations: 500, target: 1e-11, tolerance: 1e-8 }
    }
}

/// Where a minimisation ended.
#[derive(Clone, Debug)]
pub struct Minimum {
    /// The point, exactly on a bound where it is active.
    pub x: DVector<f64>,
    /// The cost there.
    pub model: Model,
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
    pub status: Status,
    /// Steps tried.
    pub iterations: usize,
    /// Evaluations of the objective.
    pub evaluations: usize,
}

const FIRST_DAMPING: f64 = 1e-2;
const LEAST_DAMPING: f64 = 1e-13;
const MOST_DAMPING: f64 = 1e12;
/// Predicted decreases below this share of scale² drown in the rounding of the cost.
const ROUNDING: f64 = 1e-13;

/// A point with everything that is known there.
struct Point {
    x: DVector<f64>,
    model: Model,
    values: DVector<f64>,
    rows: DMatrix<f64>,
    /// √H_ii, or 1 where it vanishes.
    width: DVector<f64>,
}

struct Search<'a> {
    objective: &'a dyn Objective,
    lower: &'a DVector<f64>,
    upper: &'a DVector<f64>,
    evaluations: usize,
    price: f64,
    secant: Secant,
}

/// Minimises from a start, which is first moved into the box. Bounds may be infinite.
pub fn minimise(
    objective: &dyn Objective,
    lower: &DVector<f64>,
    upper: &DVector<f64>,
    start: &DVector<f64>,
    limits: Limits,
) -> Minimum {
    let mut search = Search {
        objective,
        lower,
        upper,
        evaluations: 0,
        price: 0.0,
        secant: Secant::new(start.len()),
    };
    let start = DVector::from_fn(start.len(), |i, _| start[i].clamp(lower[i], upper[i]));
    let mut point = search.at(start);
    let mut multipliers = DVector::zeros(point.values.len());
    let mut residual = search.kkt_residual(&point, &mut multipliers);
    let mut damping = FIRST_DAMPING;
    let mut iterations = 0;
    let mut status = Status::IterationLimit;
    while iterations < limits.iterations {
        if residual <= limits.target {
            status = Status::Converged;
            break;
        }
        iterations += 1;
        let (hessian, damped) = search.curvature(&point, damping);
        let Some(step) = search.step(&point, damped) else {
            damping *= 10.0;
            if damping > MOST_DAMPING {
                status = Status::Stalled;
                break;
            }
            continue;
        };
        let next = search.at(search.moved(&point, &step));
        let change = &next.x - &point.x;
        let predicted = search.predicted(&point, &hessian, &change);
        let actual = search.merit(&point) - search.merit(&next);
        let mut next_multipliers = step.multipliers.clone();
        let next_residual = search.kkt_residual(&next, &mut next_multipliers);
        let drowned = predicted.abs() <= ROUNDING * point.model.scale.powi(2);
        let gain = if drowned {
            if next_residual < residual { 1.0 } else { -1.0 }
        } else {
            actual / predicted
        };
        if next_residual.is_finite() {
            search.learn(&point, &next, &next_multipliers);
        }
        if gain > 1e-4 && next_residual.is_finite() {
            (point, multipliers, residual) = (next, next_multipliers, next_residual);
        } else if drowned && damping <= LEAST_DAMPING
            || damping > MOST_DAMPING
            || change.amax() == 0.0
        {
            status = Status::Stalled;
            break;
        } else if drowned {
            // The undamped step is the last chance to improve what rounding lets improve.
            damping = LEAST_DAMPING;
            continue;
        }
        damping = next_damping(damping, gain);
    }
    if residual <= limits.tolerance {
        status = Status::Converged;
    }
    search.minimum(point, &multipliers, residual, status, iterations)
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

impl Search<'_> {
    fn at(&mut self, x: DVector<f64>) -> Point {
        self.evaluations += 1;
        let model = self.objective.model(&x);
        let inequalities = self.objective.inequalities(&x);
        let values =
            DVector::from_iterator(inequalities.len(), inequalities.iter().map(|c| c.value));
        let rows =
            DMatrix::from_fn(inequalities.len(), x.len(), |r, i| inequalities[r].gradient[i]);
        let width = model.hessian.diagonal().map(|h| if h > 0.0 { h.sqrt() } else { 1.0 });
        Point { x, model, values, rows, width }
    }

    /// The damped step in scaled variables; the price rises until it suffices.
    fn step(&mut self, point: &Point, hessian: DMatrix<f64>) -> Option<Step> {
        let n = point.x.len();
        let width = &point.width;
        let gradient = point.model.gradient.component_div(width);
        let rows = DMatrix::from_fn(point.values.len(), n, |r, i| point.rows[(r, i)] / width[i]);
        if !rows.is_empty() {
            self.price = self.price.max(10.0 * gradient.amax() / rows.amax().max(1e-12));
        }
        let mut subproblem = Subproblem {
            hessian,
            gradient,
            lower: (self.lower - &point.x).component_mul(width),
            upper: (self.upper - &point.x).component_mul(width),
            rows,
            values: point.values.clone(),
            price: self.price,
        };
        let mut step = qp::solve(&subproblem)?;
        for _ in 0..6 {
            if !step.rows.contains(&Place::Violated) {
                break;
            }
            subproblem.price *= 10.0;
            step = qp::solve(&subproblem)?;
        }
        if !step.rows.contains(&Place::Violated) {
            self.price = subproblem.price;
        }
        Some(step)
    }

    /// Keeps what a step tells of second derivatives, also if it is not accepted.
    fn learn(&mut self, point: &Point, next: &Point, multipliers: &DVector<f64>) {
        let lagrangian = |p: &Point| &p.model.gradient - p.rows.transpose() * multipliers;
        let change = lagrangian(next) - lagrangian(point);
        let step = &next.x - &point.x;
        self.secant.learn(&step, &change, &point.model.hessian, &next.model.hessian, &point.width);
    }

    /// Second derivatives as well as they are known, with a positive definite scaled and damped form; else those of Gauss and
    /// Newton.
    fn curvature(&self, point: &Point, damping: f64) -> (DMatrix<f64>, DMatrix<f64>) {
        let n = point.x.len();
        let width = &point.width;
        let scaled = |hessian: &DMatrix<f64>| {
            DMatrix::from_fn(n, n, |i, j| {
                hessian[(i, j)] / (width[i] * width[j]) + if i == j { damping } else { 0.0 }
            })
        };
        if let Some(missing) = self.secant.trusted() {
            let hessian = &point.model.hessian + missing;
            let damped = scaled(&hessian);
            if Cholesky::new(damped.clone()).is_some() {
                return (hessian, damped);
            }
        }
        (point.model.hessian.clone(), scaled(&point.model.hessian))
    }

    /// The point after a step, on the bounds to the last bit.
    fn moved(&self, point: &Point, step: &Step) -> DVector<f64> {
        DVector::from_fn(point.x.len(), |i, _| match step.places[i] {
            Place::Lower => self.lower[i],
            Place::Upper => self.upper[i],
            _ => (point.x[i] + step.d[i] / point.width[i]).clamp(self.lower[i], self.upper[i]),
        })
    }

    fn merit(&self, point: &Point) -> f64 {
        point.model.cost + self.price * violation(&point.values)
    }

    /// Decrease of the merit that the undamped model promises.
    fn predicted(&self, point: &Point, hessian: &DMatrix<f64>, change: &DVector<f64>) -> f64 {
        let linear = &point.rows * change + &point.values;
        let curved = 0.5 * change.dot(&(hessian * change));
        -point.model.gradient.dot(change) - curved
            + self.price * (violation(&point.values) - violation(&linear))
    }

    /// Side of the box that a point stands on: −1, 0 or +1; `None` where the sides coincide.
    fn side(&self, x: &DVector<f64>, i: usize) -> Option<i8> {
        let side = i8::from(x[i] >= self.upper[i]) - i8::from(x[i] <= self.lower[i]);
        (self.lower[i] < self.upper[i]).then_some(side)
    }

    /// Largest violation of the conditions of optimality. The multipliers come in as those of the subproblem and leave as the
    /// best ones for this point, by least squares over the rows that hold.
    fn kkt_residual(&self, point: &Point, multipliers: &mut DVector<f64>) -> f64 {
        let n = point.x.len();
        let scale = point.model.scale;
        let free: Vec<usize> = (0..n).filter(|&i| self.side(&point.x, i) == Some(0)).collect();
        let held: Vec<usize> = (0..multipliers.len()).filter(|&r| multipliers[r] > 0.0).collect();
        if !held.is_empty() && held.len() <= free.len() {
            let A = DMatrix::from_fn(free.len(), held.len(), |i, r| {
                point.rows[(held[r], free[i])] / point.width[free[i]]
            });
            let g = DVector::from_fn(free.len(), |i, _| {
                point.model.gradient[free[i]] / point.width[free[i]]
            });
            if let Ok(best) = A.svd(true, true).solve(&g, 1e-12) {
                for (k, &r) in held.iter().enumerate() {
                    multipliers[r] = best[k].max(0.0);
                }
            }
        }
        let lagrangian = &point.model.gradient - point.rows.transpose() * &*multipliers;
        let slope = |i: usize| {
            let slope = lagrangian[i] / (point.width[i] * scale);
            match self.side(&point.x, i) {
                Some(-1) => (-slope).max(0.0),
                Some(1) => slope.max(0.0),
                Some(_) => slope.abs(),
                None => 0.0,
            }
        };
        let stationarity = (0..n).map(slope).fold(0.0, f64::max);
        let rows = (0..multipliers.len()).map(|r| {
            let value = point.values[r];
            (-value).max((multipliers[r] * value).abs() / scale.powi(2))
        });
        rows.fold(stationarity, f64::max)
    }

    fn minimum(
        self,
        point: Point,
        multipliers: &DVector<f64>,
        kkt_residual: f64,
        status: Status,
        iterations: usize,
    ) -> Minimum {
        let n = point.x.len();
        let active: Vec<usize> = (0..multipliers.len()).filter(|&r| multipliers[r] > 0.0).collect();
        let worst = point.values.iter().fold(0.0_f64, |worst, v| worst.max(-v));
        Minimum {
            active_rows: point.rows.select_rows(&active),
            at_bound: (0..n).map(|i| self.side(&point.x, i) != Some(0)).collect(),
            violation: worst,
            kkt_residual,
            status,
            iterations,
            evaluations: self.evaluations,
            x: point.x,
            model: point.model,
        }
    }
}

/// Sum of the violations.
fn violation(values: &DVector<f64>) -> f64 {
    values.iter().map(|v| (-v).max(0.0)).sum()
}
