//! Fits both tires to points from several starts: first to short stretches of the drives, then to all of them.

use std::ops::Range;

use nalgebra::DVector;
use numerics::convergence::{Convergence, Status};
use numerics::sqp::{self, Limits, Minimum};
use rayon::prelude::*;

use crate::error::Error;
use crate::likelihood::Theta8;
use crate::options::Bounds;
use crate::points::Point;
use crate::pull::Pull;
use crate::regression::{COLUMNS, Regression, Target, Weights};

/// Of each stretch of `THIN_PERIOD` samples, starts are compared on the first `THIN_LENGTH`.
const THIN_PERIOD: usize = 200;
const THIN_LENGTH: usize = 50;
/// Share of the lowest cost by which two optima on the stretches may differ and be carried on both.
const CLOSE: f64 = 0.05;
/// Relative difference of parameters below which two optima are one.
const SAME: f64 = 1e-3;

/// What a fit to points looks for, and how.
#[derive(Clone, Copy, Debug)]
pub struct Search {
    /// What the tires have to explain.
    pub target: Target,
    /// How residuals are weighed.
    pub weights: Weights,
    /// What pulls the parameters.
    pub pull: Pull,
    /// Whether three odd terms are added to the lateral acceleration.
    pub odd: bool,
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
pub struct Found {
    /// Parameters.
    pub theta: Theta8,
    /// Factors of the odd terms [m/s², m²/s², 1/m], 0 unless they were free.
    pub odd: [f64; 3],
    /// All different optima, best first.
    pub optima: Vec<Theta8>,
    /// The minimum, for its second derivatives.
    pub minimum: Minimum,
    /// How it was reached.
    pub convergence: Convergence,
    /// Root mean squares of the residuals: accelerations, yaw-rate changes, front and rear forces.
    pub std: [f64; 4],
}

/// Points of a lattice without gaps in the box of both axles (additive recurrence with the roots of g⁹ = g + 1).
pub fn starts(bounds: &Bounds, count: usize, seed: u64) -> Vec<Theta8> {
    let g = (0..60).fold(1.1_f64, |g, _| (1.0 + g).powf(1.0 / 9.0));
    let turn = (seed as f64 * 0.754_877_666_246_692_7).fract();
    let middle = std::array::from_fn(|i| 0.5 * (bounds.lower[i % 4] + bounds.upper[i % 4]));
    let point = |k: usize| -> Theta8 {
        std::array::from_fn(|i| {
            let share = (0.5 + turn + k as f64 * g.powi(-(i as i32 + 1))).fract();
            // The outer tenths of the box are left to the minimiser.
            bounds.lower[i % 4] + (0.1 + 0.8 * share) * (bounds.upper[i % 4] - bounds.lower[i % 4])
        })
    };
    std::iter::once(middle).chain((1..count).map(point)).collect()
}

impl Search {
    /// Fits to points, of which there is one list for each recording.
    ///
    /// # Errors
    ///
    /// [`Error::NoStart`] if no start gave a finite cost.
    pub fn run(&self, body: &vehicle::Body, points: &[Vec<Point>]) -> Result<Found, Error> {
        let (mut regression, whole) = self.regression(body, points);
        let [lower, upper] = self.corners();
        let coarse = Limits { iterations: 60, target: 1e-4, tolerance: 1e-3, ..Limits::default() };
        let minima: Vec<Minimum> = starts(&self.bounds, self.starts.max(1), self.seed)
            .par_iter()
            .map(|start| sqp::minimise(&regression, &lower, &upper, &self.vector(start), coarse))
            .collect();
        let mut evaluations = minima.iter().map(|m| m.evaluations).sum::<usize>();
        let within = minima.iter().map(|m| CLOSE * m.model.cost).fold(f64::INFINITY, f64::min);
        let candidates = different(minima, within);
        let Some(first) = candidates.first() else {
            return Err(Error::NoStart { starts: self.starts });
        };

        regression.std = regression.residual_std(&first.x);
        regression.blocks = whole;
        let fine = Limits { iterations: 40, target: 1e-7, tolerance: 1e-5, ..Limits::default() };
        let minima: Vec<Minimum> = candidates
            .par_iter()
            .map(|from| sqp::minimise(&regression, &lower, &upper, &from.x, fine))
            .collect();
        evaluations += minima.iter().map(|m| m.evaluations).sum::<usize>();
        let minima = different(minima, f64::INFINITY);
        let Some(minimum) = minima.first().cloned() else {
            return Err(Error::NoStart { starts: self.starts });
        };
        Ok(Found {
            theta: theta(&minimum.x),
            odd: std::array::from_fn(|i| if self.odd { minimum.x[8 + i] } else { 0.0 }),
            optima: minima.iter().map(|m| theta(&m.x)).collect(),
            convergence: convergence(&minimum, self.starts, minima.len(), evaluations),
            std: regression.residual_std(&minimum.x),
            minimum,
        })
    }

    /// Residuals over short stretches, and the stretches that make up everything.
    fn regression<'a>(
        &self,
        body: &vehicle::Body,
        points: &'a [Vec<Point>],
    ) -> (Regression<'a>, Vec<(usize, Range<usize>)>) {
        let whole: Vec<_> = points.iter().enumerate().map(|(i, p)| (i, 0..p.len())).collect();
        let thin = whole.iter().flat_map(|(i, range)| {
            let stretch = move |from: usize| (*i, from..(from + THIN_LENGTH).min(range.end));
            range.clone().step_by(THIN_PERIOD).map(stretch)
        });
        let regression = Regression {
            body: *body,
            points,
            blocks: thin.collect(),
            target: self.target,
            weights: self.weights,
            std: self.std,
            odd: self.odd,
            pull: self.pull,
        };
        (regression, whole)
    }

    fn corners(&self) -> [DVector<f64>; 2] {
        let n = if self.odd { COLUMNS } else { 8 };
        let corner = |side: &[f64; 4], beyond: f64| {
            DVector::from_fn(n, |i, _| if i < 8 { side[i % 4] } else { beyond })
        };
        [corner(&self.bounds.lower, f64::NEG_INFINITY), corner(&self.bounds.upper, f64::INFINITY)]
    }

    fn vector(&self, theta: &Theta8) -> DVector<f64> {
        let n = if self.odd { COLUMNS } else { 8 };
        DVector::from_fn(n, |i, _| theta.get(i).copied().unwrap_or(0.0))
    }
}

/// The first eight variables.
pub fn theta(x: &DVector<f64>) -> Theta8 {
    std::array::from_fn(|i| x[i])
}

/// How a minimum was reached.
pub fn convergence(
    minimum: &Minimum,
    starts: usize,
    optima: usize,
    evaluations: usize,
) -> Convergence {
    Convergence {
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
pub fn different(mut minima: Vec<Minimum>, within: f64) -> Vec<Minimum> {
    minima.retain(|m| m.model.cost.is_finite());
    minima.sort_by(|a, b| a.model.cost.total_cmp(&b.model.cost));
    let mut kept: Vec<Minimum> = Vec::new();
    for minimum in minima {
        let Some(best) = kept.first() else {
            kept.push(minimum);
            continue;
        };
        let rise = minimum.model.cost - best.model.cost;
        let close = rise <= within;
        let same = |known: &Minimum| {
            let off = (&known.x - &minimum.x).component_div(&known.x.map(|x| x.abs().max(0.1)));
            off.amax() <= SAME
        };
        if close && minimum.status == Status::Converged && !kept.iter().any(same) {
            kept.push(minimum);
        }
    }
    kept
}
