//! Searches from several starts that cover the box, and tells how many different optima they led to.

use nalgebra::DVector;
use numerics::convergence::{Convergence, Status};
use numerics::low_discrepancy::AdditiveRecurrence;
use numerics::sqp::{self, Limits, Minimum, Objective};
use rayon::prelude::*;

use crate::bounds::Bounds;
use crate::fit::{FitError, FitOptions};
use crate::parameters::{COUNT, Parameter, Theta};

/// Violations of constraints below this are rounding.
const FEASIBLE: f64 = 1e-9;
/// Two points are one optimum if their curves differ by less than this share of the residuals.
const SAME: f64 = 1e-3;

/// The best minimum, and what all starts together say.
pub struct Multistart {
    pub best: Minimum,
    /// One minimum of each kind, best first.
    pub optima: Vec<Minimum>,
    pub starts: usize,
    pub evaluations: usize,
}

impl Multistart {
    pub fn convergence(&self) -> Convergence {
        Convergence {
            status: self.best.status,
            iterations: self.best.iterations,
            evaluations: self.evaluations,
            kkt_residual: Some(self.best.kkt_residual),
            starts: self.starts,
            optima: self.optima.len(),
            cost: self.best.model.cost,
            trace: self.best.trace.clone(),
        }
    }
}

/// The starts in the box: the given one first, then points that leave no gaps where tires of the literature are.
pub fn starts(bounds: &Bounds, held: &Theta, options: &FitOptions) -> Vec<Theta> {
    let bounds = bounds.and(&Bounds::GOBLIRSCH);
    let points = AdditiveRecurrence::<COUNT>::new(options.seed);
    let point = |k: usize| -> Theta {
        let shares = points.point(k + 1);
        Parameter::ALL.map(|parameter| {
            let value = bounds.at(parameter, shares[parameter as usize]);
            if value.is_finite() { value } else { held[parameter as usize] }
        })
    };
    let given = options.start.into_iter();
    let others = options.starts.max(1).saturating_sub(usize::from(options.start.is_some()));
    given.chain((0..others).map(point)).collect()
}

/// Minimises from all starts and compares what comes out. The order of the starts decides ties, not that of the threads.
///
/// `rough` is a cheap cost that is very nearly the same, for the way from the starts to the optima.
pub fn search(
    objective: &dyn Objective,
    rough: Option<&dyn Objective>,
    lower: &DVector<f64>,
    upper: &DVector<f64>,
    starts: &[DVector<f64>],
    options: &FitOptions,
) -> Result<Multistart, FitError> {
    let limits = Limits { iterations: options.iterations, ..Limits::default() };
    let minimise =
        |objective, start: &DVector<f64>| sqp::minimise(objective, lower, upper, start, limits);
    let first = rough.unwrap_or(objective);
    let minima: Vec<Minimum> = starts.par_iter().map(|start| minimise(first, start)).collect();
    let mut evaluations: usize = minima.iter().map(|m| m.evaluations).sum();
    let mut minima = feasible(minima)?;
    if rough.is_some() {
        let near = distinct(&minima);
        let polished: Vec<Minimum> =
            near.par_iter().map(|near| minimise(objective, &near.x)).collect();
        evaluations += polished.iter().map(|m| m.evaluations).sum::<usize>();
        let whole_way = |(near, end): (Minimum, Minimum)| Minimum {
            iterations: near.iterations + end.iterations,
            trace: near.trace.into_iter().chain(end.trace).collect(),
            ..end
        };
        minima = feasible(near.into_iter().zip(polished).map(whole_way).collect())?;
    }
    let optima = distinct(&minima);
    // Of those that differ by rounding, the one that meets the conditions of optimality best.
    let best = minima
        .iter()
        .filter(|m| {
            same(&minima[0], m)
                && m.model.cost - minima[0].model.cost <= 1e-13 * minima[0].model.scale.powi(2)
        })
        .min_by(|a, b| a.kkt_residual.total_cmp(&b.kkt_residual))
        .unwrap_or(&minima[0])
        .clone();
    Ok(Multistart { best, optima, starts: starts.len(), evaluations })
}

/// Minima with a cost and without violations, best first; at least one.
fn feasible(mut minima: Vec<Minimum>) -> Result<Vec<Minimum>, FitError> {
    minima.retain(|m| m.model.cost.is_finite());
    let violation = minima.iter().map(|m| m.violation).fold(f64::INFINITY, f64::min);
    if minima.is_empty() {
        return Err(FitError::NoStart);
    }
    minima.retain(|m| m.violation <= FEASIBLE);
    if minima.is_empty() {
        return Err(FitError::Infeasible { violation });
    }
    minima.sort_by(|a, b| a.model.cost.total_cmp(&b.model.cost));
    Ok(minima)
}

/// The best, and one of each other kind that converged.
fn distinct(minima: &[Minimum]) -> Vec<Minimum> {
    let mut kinds: Vec<Minimum> = Vec::new();
    for minimum in minima {
        let counts = kinds.is_empty() || minimum.status == Status::Converged;
        if counts && !kinds.iter().any(|known| same(known, minimum)) {
            kinds.push(minimum.clone());
        }
    }
    kinds
}

fn same(a: &Minimum, b: &Minimum) -> bool {
    let change = &a.x - &b.x;
    let distance = change.dot(&(&a.model.hessian * &change)).max(0.0).sqrt();
    let rise = (a.model.cost - b.model.cost).abs();
    distance <= SAME * a.model.scale && rise <= SAME * SAME * a.model.scale.powi(2)
}
