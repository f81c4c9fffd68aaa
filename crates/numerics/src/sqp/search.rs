//! Carries out the parts of a step: the subproblem, the point after it, and how far it is from an optimum.
#![allow(non_snake_case, reason = "matrices as in the literature")]

use nalgebra::{Cholesky, DMatrix, DVector};

use crate::convergence::OptimisationStatus;
use crate::sqp::qp::{self, ConstraintState, QuadraticSubproblem, SubproblemSolution};
use crate::sqp::secant::SecantHessian;
use crate::sqp::{Objective, QuadraticModel, SqpMinimum};

/// A price beyond this share of the scale says that the inequalities contradict each other or the box.
const MOST_PRICE: f64 = 1e7;

/// A point with everything that is known there.
pub struct SqpIterate {
    pub x: DVector<f64>,
    pub model: QuadraticModel,
    pub values: DVector<f64>,
    pub rows: DMatrix<f64>,
    /// √H_ii, or 1 where it vanishes.
    pub width: DVector<f64>,
}

/// What a minimisation carries along.
pub struct SqpMinimisation<'a> {
    objective: &'a dyn Objective,
    lower: &'a DVector<f64>,
    upper: &'a DVector<f64>,
    evaluations: usize,
    price: f64,
    secant: SecantHessian,
}

impl<'a> SqpMinimisation<'a> {
    pub fn new(objective: &'a dyn Objective, lower: &'a DVector<f64>, upper: &'a DVector<f64>) -> Self {
        Self { objective, lower, upper, evaluations: 0, price: 0.0, secant: SecantHessian::new(lower.len()) }
    }

    pub fn evaluate(&mut self, x: DVector<f64>) -> SqpIterate {
        self.evaluations += 1;
        let model = self.objective.model(&x);
        let inequalities = self.objective.inequalities(&x);
        let values = DVector::from_iterator(inequalities.len(), inequalities.iter().map(|c| c.value));
        let rows = DMatrix::from_fn(inequalities.len(), x.len(), |r, i| inequalities[r].gradient[i]);
        let width = model.hessian.diagonal().map(|h| if h > 0.0 { h.sqrt() } else { 1.0 });
        SqpIterate { x, model, values, rows, width }
    }

    /// The damped step in scaled variables; the price rises until it suffices.
    pub fn solve_step(&mut self, point: &SqpIterate, hessian: DMatrix<f64>) -> Option<SubproblemSolution> {
        let n = point.x.len();
        let width = &point.width;
        let gradient = point.model.gradient.component_div(width);
        let rows = DMatrix::from_fn(point.values.len(), n, |r, i| point.rows[(r, i)] / width[i]);
        // What the rows must be able to pull with; where they have no slope yet, the price rises later.
        let steepest = if rows.is_empty() { 0.0 } else { rows.amax() };
        if steepest > 0.0 {
            self.price =
                self.price.max((10.0 * gradient.amax() / steepest).min(MOST_PRICE * point.model.scale));
        }
        let mut subproblem = QuadraticSubproblem {
            hessian,
            gradient,
            lower: (self.lower - &point.x).component_mul(width),
            upper: (self.upper - &point.x).component_mul(width),
            rows,
            values: point.values.clone(),
            price: self.price,
        };
        let mut step = qp::solve_subproblem(&subproblem)?;
        while step.rows.contains(&ConstraintState::Violated)
            && subproblem.price < MOST_PRICE * point.model.scale
        {
            subproblem.price = 10.0 * subproblem.price.max(point.model.scale);
            step = qp::solve_subproblem(&subproblem)?;
        }
        if !step.rows.contains(&ConstraintState::Violated) {
            self.price = subproblem.price;
        }
        Some(step)
    }

    /// Keeps what a step tells of second derivatives, also if it is not accepted.
    pub fn update_secant(&mut self, point: &SqpIterate, next: &SqpIterate, multipliers: &DVector<f64>) {
        let lagrangian = |p: &SqpIterate| &p.model.gradient - p.rows.transpose() * multipliers;
        let change = lagrangian(next) - lagrangian(point);
        let step = &next.x - &point.x;
        self.secant.update(&step, &change, &point.model.hessian, &next.model.hessian, &point.width);
    }

    /// Second derivatives as well as they are known, with a positive definite scaled and damped form; else those of Gauss and
    /// Newton.
    pub fn hessian_and_damped_hessian(
        &self,
        point: &SqpIterate,
        damping: f64,
    ) -> (DMatrix<f64>, DMatrix<f64>) {
        let n = point.x.len();
        let width = &point.width;
        let scaled = |hessian: &DMatrix<f64>| {
            DMatrix::from_fn(n, n, |i, j| {
                hessian[(i, j)] / (width[i] * width[j]) + if i == j { damping } else { 0.0 }
            })
        };
        if let Some(missing) = self.secant.trusted_estimate() {
            let hessian = &point.model.hessian + missing;
            let damped = scaled(&hessian);
            if Cholesky::new(damped.clone()).is_some() {
                return (hessian, damped);
            }
        }
        (point.model.hessian.clone(), scaled(&point.model.hessian))
    }

    /// The point after a step, on the bounds to the last bit.
    pub fn point_after_step(&self, point: &SqpIterate, step: &SubproblemSolution) -> DVector<f64> {
        DVector::from_fn(point.x.len(), |i, _| match step.places[i] {
            ConstraintState::Lower => self.lower[i],
            ConstraintState::Upper => self.upper[i],
            _ => (point.x[i] + step.d[i] / point.width[i]).clamp(self.lower[i], self.upper[i]),
        })
    }

    pub fn merit_function(&self, point: &SqpIterate) -> f64 {
        point.model.cost + self.price * total_violation(&point.values)
    }

    /// Decrease of the merit that the undamped model promises.
    pub fn predicted_decrease(
        &self,
        point: &SqpIterate,
        hessian: &DMatrix<f64>,
        change: &DVector<f64>,
    ) -> f64 {
        let linear = &point.rows * change + &point.values;
        let curved = 0.5 * change.dot(&(hessian * change));
        -point.model.gradient.dot(change) - curved
            + self.price * (total_violation(&point.values) - total_violation(&linear))
    }

    /// Side of the box that a point stands on: −1, 0 or +1; `None` where the sides coincide.
    fn bound_side(&self, x: &DVector<f64>, i: usize) -> Option<i8> {
        let side = i8::from(x[i] >= self.upper[i]) - i8::from(x[i] <= self.lower[i]);
        (self.lower[i] < self.upper[i]).then_some(side)
    }

    /// Largest violation of the conditions of optimality. The multipliers come in as those of the subproblem and leave as the
    /// best ones for this point, by least squares over the rows that hold.
    pub fn kkt_residual(&self, point: &SqpIterate, multipliers: &mut DVector<f64>) -> f64 {
        let n = point.x.len();
        let scale = point.model.scale;
        let free: Vec<usize> = (0..n).filter(|&i| self.bound_side(&point.x, i) == Some(0)).collect();
        let held: Vec<usize> = (0..multipliers.len()).filter(|&r| multipliers[r] > 0.0).collect();
        if !held.is_empty() && held.len() <= free.len() {
            let A = DMatrix::from_fn(free.len(), held.len(), |i, r| {
                point.rows[(held[r], free[i])] / point.width[free[i]]
            });
            let g = DVector::from_fn(free.len(), |i, _| point.model.gradient[free[i]] / point.width[free[i]]);
            if let Ok(best) = A.svd(true, true).solve(&g, 1e-12) {
                for (k, &r) in held.iter().enumerate() {
                    multipliers[r] = best[k].max(0.0);
                }
            }
        }
        let lagrangian = &point.model.gradient - point.rows.transpose() * &*multipliers;
        let slope = |i: usize| {
            let slope = lagrangian[i] / (point.width[i] * scale);
            match self.bound_side(&point.x, i) {
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

    pub fn into_minimum(
        self,
        point: SqpIterate,
        multipliers: &DVector<f64>,
        kkt_residual: f64,
        status: OptimisationStatus,
        iterations: usize,
    ) -> SqpMinimum {
        let n = point.x.len();
        let active: Vec<usize> = (0..multipliers.len()).filter(|&r| multipliers[r] > 0.0).collect();
        let worst = point.values.iter().fold(0.0_f64, |worst, v| worst.max(-v));
        SqpMinimum {
            active_rows: point.rows.select_rows(&active),
            at_bound: (0..n).map(|i| self.bound_side(&point.x, i) != Some(0)).collect(),
            violation: worst,
            kkt_residual,
            status,
            iterations,
            evaluations: self.evaluations,
            trace: Vec::new(),
            x: point.x,
            model: point.model,
        }
    }
}

/// Sum of the violations.
fn total_violation(values: &DVector<f64>) -> f64 {
    values.iter().map(|v| (-v).max(0.0)).sum()
}
