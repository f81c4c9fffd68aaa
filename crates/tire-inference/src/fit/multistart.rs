//! Searches from several starts that cover the box, and tells how many different optima they led to.

use nalgebra::DVector;
use numerics::convergence::{ConvergenceReport, OptimisationStatus};
use numerics::low_discrepancy::AdditiveRecurrence;
use numerics::sqp::{self, Objective, SqpLimits, SqpMinimum};
use rayon::prelude::*;

use crate::bounds::Bounds;
use crate::fit::{FitError, FitOptions};
use crate::parameters::{COUNT, Parameter, Theta};

/// Violations of constraints below this are rounding.
const FEASIBLE: f64 = 1e-9;
/// Two points are one optimum if their curves differ by less than this share of the residuals.
const SAME: f64 = 1e-3;

/// The best minimum, and what all starts together say.
pub struct MultistartResult {
    pub best: SqpMinimum,
    /// One minimum of each kind, best first.
    pub optima: Vec<SqpMinimum>,
    pub starts: usize,
    pub evaluations: usize,
}

impl MultistartResult {
    pub fn convergence(&self) -> ConvergenceReport {
        ConvergenceReport {
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
pub fn start_points(bounds: &Bounds, held: &Theta, options: &FitOptions) -> Vec<Theta> {
    let bounds = bounds.intersect(&Bounds::GOBLIRSCH);
    let points = AdditiveRecurrence::<COUNT>::new(options.seed);
    let point = |k: usize| -> Theta {
        let shares = points.point(k + 1);
        Parameter::ALL.map(|parameter| {
            let value = bounds.interpolate(parameter, shares[parameter as usize]);
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
pub fn search_from_starts(
    objective: &dyn Objective,
    rough: Option<&dyn Objective>,
    lower: &DVector<f64>,
    upper: &DVector<f64>,
    starts: &[DVector<f64>],
    options: &FitOptions,
) -> Result<MultistartResult, FitError> {
    let limits = SqpLimits { iterations: options.iterations, ..SqpLimits::default() };
    let minimise =
        |objective, start: &DVector<f64>| sqp::minimise_sqp(objective, lower, upper, start, limits);
    let first = rough.unwrap_or(objective);
    let minima: Vec<SqpMinimum> = starts.par_iter().map(|start| minimise(first, start)).collect();
    let mut evaluations: usize = minima.iter().map(|m| m.evaluations).sum();
    let mut minima = feasible_minima(minima)?;
    if rough.is_some() {
        let near = distinct_minima(&minima);
        let polished: Vec<SqpMinimum> = near.par_iter().map(|near| minimise(objective, &near.x)).collect();
        evaluations += polished.iter().map(|m| m.evaluations).sum::<usize>();
        let whole_way = |(near, end): (SqpMinimum, SqpMinimum)| SqpMinimum {
            iterations: near.iterations + end.iterations,
            trace: near.trace.into_iter().chain(end.trace).collect(),
            ..end
        };
        minima = feasible_minima(near.into_iter().zip(polished).map(whole_way).collect())?;
    }
    let optima = distinct_minima(&minima);
    // Of those that differ by rounding, the one that meets the conditions of optimality best.
    let best = minima
        .iter()
        .filter(|m| {
            is_same_minimum(&minima[0], m)
                && m.model.cost - minima[0].model.cost <= 1e-13 * minima[0].model.scale.powi(2)
        })
        .min_by(|a, b| a.kkt_residual.total_cmp(&b.kkt_residual))
        .unwrap_or(&minima[0])
        .clone();
    Ok(MultistartResult { best, optima, starts: starts.len(), evaluations })
}

/// Minima with a cost and without violations, best first; at least one.
fn feasible_minima(mut minima: Vec<SqpMinimum>) -> Result<Vec<SqpMinimum>, FitError> {
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
fn distinct_minima(minima: &[SqpMinimum]) -> Vec<SqpMinimum> {
    let mut kinds: Vec<SqpMinimum> = Vec::new();
    for minimum in minima {
        let counts = kinds.is_empty() || minimum.status == OptimisationStatus::Converged;
        if counts && !kinds.iter().any(|known| is_same_minimum(known, minimum)) {
            kinds.push(minimum.clone());
        }
    }
    kinds
}

fn is_same_minimum(a: &SqpMinimum, b: &SqpMinimum) -> bool {
    let change = &a.x - &b.x;
    let distance = change.dot(&(&a.model.hessian * &change)).max(0.0).sqrt();
    let rise = (a.model.cost - b.model.cost).abs();
    distance <= SAME * a.model.scale && rise <= SAME * SAME * a.model.scale.powi(2)
}
