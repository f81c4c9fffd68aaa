//! Fits both tires to points from several starts: first to short stretches of the drives, then to all of them.

use std::ops::Range;

use nalgebra::DVector;
use numerics::convergence::{ConvergenceReport, OptimisationStatus};
use numerics::low_discrepancy::AdditiveRecurrence;
use numerics::sqp::{self, SqpLimits, SqpMinimum};
use rayon::prelude::*;
use tire_inference::bounds::Bounds;
use tire_inference::parameters::{Parameter, TireParameters};

use crate::error::Error;
use crate::points::RegressionPoint;
use crate::regression::{COLUMNS, RegressionTarget, ResidualWeights, TireRegression};
use crate::regularisation::TireRegularisation;
use crate::tires::{SIZE, Tires, box_corners, from_array, from_vector, to_vector};

/// Of each stretch of `THIN_PERIOD` samples, starts are compared on the first `THIN_LENGTH`.
const THIN_PERIOD: usize = 200;
const THIN_LENGTH: usize = 50;
/// Share of the lowest cost by which two optima on the stretches may differ and be carried on both.
const CLOSE: f64 = 0.05;
/// Relative difference of parameters below which two optima are one.
const SAME: f64 = 1e-3;

/// What a fit to points looks for, and how.
#[derive(Clone, Copy, Debug)]
pub struct PointFit {
    /// What the tires have to explain.
    pub target: RegressionTarget,
    /// How residuals are weighed.
    pub weights: ResidualWeights,
    /// What is expected of the tires.
    pub expected: TireRegularisation,
    /// Whether three odd terms are added to the lateral acceleration.
    pub odd_terms: bool,
    /// Number of starts.
    pub starts: usize,
    /// Turns the starts.
    pub seed: u64,
    /// The box of each axle.
    pub bounds: Bounds,
    /// Standard deviations of the residuals to begin with.
    pub std: [f64; 4],
}

/// What was found.
#[derive(Clone, Debug)]
pub struct PointFitResult {
    /// Parameters.
    pub tires: Tires,
    /// Factors of the odd terms [m/s², m²/s², 1/m], 0 unless they were free.
    pub odd: [f64; 3],
    /// All different optima, best first.
    pub optima: Vec<Tires>,
    /// The minimum, for its second derivatives.
    pub minimum: SqpMinimum,
    /// How it was reached.
    pub convergence: ConvergenceReport,
    /// Root mean squares of the residuals: accelerations, yaw-rate changes, front and rear forces.
    pub std: [f64; 4],
}

/// The middle of the box of both tires, then points that leave no gaps where tires of the literature are.
pub fn start_tires(bounds: &Bounds, count: usize, seed: u64) -> Vec<Tires> {
    let bounds = bounds.intersect(&Bounds::GOBLIRSCH);
    let points = AdditiveRecurrence::<SIZE>::new(seed);
    let at = |shares: [f64; SIZE]| {
        from_array(shares).map(|tire| TireParameters {
            B: bounds.interpolate(Parameter::B, tire.B),
            C: bounds.interpolate(Parameter::C, tire.C),
            D: bounds.interpolate(Parameter::D, tire.D),
            E: bounds.interpolate(Parameter::E, tire.E),
        })
    };
    // The outer tenths of the box are left to the minimiser.
    let inner = |k: usize| at(points.point(k).map(|share| 0.1 + 0.8 * share));
    std::iter::once(at([0.5; SIZE])).chain((1..count).map(inner)).collect()
}

impl PointFit {
    /// Fits to points, of which there is one list for each recording.
    ///
    /// # Errors
    ///
    /// [`Error::NoStart`] if no start gave a finite cost.
    pub fn fit_points(
        &self,
        body: &vehicle::VehicleBody,
        points: &[Vec<RegressionPoint>],
    ) -> Result<PointFitResult, Error> {
        let (mut regression, whole) = self.build_regression(body, points);
        let [lower, upper] = self.box_corners();
        let coarse = SqpLimits { iterations: 60, target: 1e-4, tolerance: 1e-3, ..SqpLimits::default() };
        let minima: Vec<SqpMinimum> = start_tires(&self.bounds, self.starts.max(1), self.seed)
            .par_iter()
            .map(|start| sqp::minimise_sqp(&regression, &lower, &upper, &self.x_from_tires(start), coarse))
            .collect();
        let mut evaluations = minima.iter().map(|m| m.evaluations).sum::<usize>();
        let within = minima.iter().map(|m| CLOSE * m.model.cost).fold(f64::INFINITY, f64::min);
        let candidates = distinct_minima(minima, within);
        let Some(first) = candidates.first() else {
            return Err(Error::NoStart { starts: self.starts });
        };

        regression.std = regression.rms_residuals(&first.x);
        regression.blocks = whole;
        let fine = SqpLimits { iterations: 40, target: 1e-7, tolerance: 1e-5, ..SqpLimits::default() };
        let minima: Vec<SqpMinimum> = candidates
            .par_iter()
            .map(|from| sqp::minimise_sqp(&regression, &lower, &upper, &from.x, fine))
            .collect();
        evaluations += minima.iter().map(|m| m.evaluations).sum::<usize>();
        let minima = distinct_minima(minima, f64::INFINITY);
        let Some(minimum) = minima.first().cloned() else {
            return Err(Error::NoStart { starts: self.starts });
        };
        Ok(PointFitResult {
            tires: from_vector(&minimum.x),
            odd: std::array::from_fn(|i| if self.odd_terms { minimum.x[SIZE + i] } else { 0.0 }),
            optima: minima.iter().map(|m| from_vector(&m.x)).collect(),
            convergence: convergence_report(&minimum, self.starts, minima.len(), evaluations),
            std: regression.rms_residuals(&minimum.x),
            minimum,
        })
    }

    /// Residuals over short stretches, and the stretches that make up everything.
    fn build_regression<'a>(
        &self,
        body: &vehicle::VehicleBody,
        points: &'a [Vec<RegressionPoint>],
    ) -> (TireRegression<'a>, Vec<(usize, Range<usize>)>) {
        let whole: Vec<_> = points.iter().enumerate().map(|(i, p)| (i, 0..p.len())).collect();
        let thin = whole.iter().flat_map(|(i, range)| {
            let stretch = move |from: usize| (*i, from..(from + THIN_LENGTH).min(range.end));
            range.clone().step_by(THIN_PERIOD).map(stretch)
        });
        let regression = TireRegression {
            body: *body,
            points,
            blocks: thin.collect(),
            target: self.target,
            weights: self.weights,
            std: self.std,
            odd_terms: self.odd_terms,
            expected: self.expected,
        };
        (regression, whole)
    }

    /// The box of the tires, and without limits whatever follows.
    fn box_corners(&self) -> [DVector<f64>; 2] {
        let more = if self.odd_terms { COLUMNS } else { SIZE };
        let [lower, upper] = box_corners(&self.bounds);
        [lower.resize_vertically(more, f64::NEG_INFINITY), upper.resize_vertically(more, f64::INFINITY)]
    }

    fn x_from_tires(&self, tires: &Tires) -> DVector<f64> {
        to_vector(tires).resize_vertically(if self.odd_terms { COLUMNS } else { SIZE }, 0.0)
    }
}

/// How a minimum was reached.
pub fn convergence_report(
    minimum: &SqpMinimum,
    starts: usize,
    optima: usize,
    evaluations: usize,
) -> ConvergenceReport {
    ConvergenceReport {
        status: minimum.status,
        iterations: minimum.iterations,
        evaluations,
        kkt_residual: Some(minimum.kkt_residual),
        starts,
        optima,
        cost: minimum.model.cost,
        trace: minimum.trace.clone(),
    }
}

/// The different minima with finite costs, best first, as far as their costs are within a distance of the best. Of the others
/// only those count that converged.
pub fn distinct_minima(mut minima: Vec<SqpMinimum>, within: f64) -> Vec<SqpMinimum> {
    minima.retain(|m| m.model.cost.is_finite());
    minima.sort_by(|a, b| a.model.cost.total_cmp(&b.model.cost));
    let mut kept: Vec<SqpMinimum> = Vec::new();
    for minimum in minima {
        let Some(best) = kept.first() else {
            kept.push(minimum);
            continue;
        };
        let rise = minimum.model.cost - best.model.cost;
        let close = rise <= within;
        let same = |known: &SqpMinimum| {
            let off = (&known.x - &minimum.x).component_div(&known.x.map(|x| x.abs().max(0.1)));
            off.amax() <= SAME
        };
        if close && minimum.status == OptimisationStatus::Converged && !kept.iter().any(same) {
            kept.push(minimum);
        }
    }
    kept
}
