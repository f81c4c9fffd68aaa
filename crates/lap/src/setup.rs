//! Finds the fastest set-up of a car: parameters within ranges, by sequential quadratic programming on the least lap time.

use std::sync::atomic::{AtomicUsize, Ordering};

use nalgebra::{DMatrix, DVector, SymmetricEigen};
use numerics::convergence::OptimisationStatus;
use numerics::sqp::{Objective, QuadraticModel, SqpLimits, minimise_sqp};
use rayon::prelude::*;
use track::TrackLine;

use crate::interior_point::InteriorPointStatus;
use crate::optimum::LapOptimum;
use crate::parameters::{CarParameters, ParameterRange};
use crate::{Error, LapOptions};

/// The set-up with the least lap time.
#[derive(Clone, Debug)]
pub struct SetupOptimum {
    /// The values of the ranges, in their order.
    pub values: Vec<f64>,
    /// All parameters of the car with this set-up.
    pub parameters: CarParameters,
    /// Its fastest lap.
    pub lap: LapOptimum,
    /// How the search ended.
    pub status: OptimisationStatus,
    /// Fastest laps that were searched for.
    pub searches: usize,
}

/// Change of a parameter for the derivatives of the least lap time, over its range.
const DERIVATIVE_CHANGE: f64 = 1e-4;
/// Change of a parameter for the change of these derivatives, over its range.
const CURVATURE_CHANGE: f64 = 0.05;
/// Least curvature of the lap time [s] over the whole range: less is noise of the searches.
const LEAST_CURVATURE: f64 = 1e-3;
/// A residual r leaves about r²/2 seconds of the lap.
const LIMITS: SqpLimits = SqpLimits { iterations: 30, target: 2e-3, tolerance: 1e-2, damping: 1e-4 };

impl LapOptimum {
    /// The set-up within these ranges with the least lap time, from this lap of the car on.
    ///
    /// The derivatives of the least lap time are those of the Lagrangian (envelope theorem), its curvature is made of their differences.
    ///
    /// # Errors
    /// As [`LapOptimum::find`]; when the car has no lap where the search ends.
    pub fn fastest_setup(
        &self,
        parameters: &CarParameters,
        ranges: &[ParameterRange],
        line: &TrackLine,
        options: &LapOptions,
    ) -> Result<SetupOptimum, Error> {
        let objective =
            SetupObjective { start: self, parameters, ranges, line, options, searches: AtomicUsize::new(0) };
        let share = |it: &ParameterRange| (it.key.value(parameters) - it.low) / (it.high - it.low);
        let start = DVector::from_iterator(ranges.len(), ranges.iter().map(share));
        let [lower, upper] = [0.0, 1.0].map(|bound| DVector::from_element(ranges.len(), bound));
        let minimum = minimise_sqp(&objective, &lower, &upper, &start, LIMITS);
        if !minimum.model.cost.is_finite() {
            let message =
                "the lap time has no derivatives within the ranges of the set-up: tell narrower ones";
            return Err(Error::Options(message.to_owned()));
        }
        let parameters = objective.parameters_at(&minimum.x)?;
        let lap = objective.fastest_lap(&parameters)?;
        let lap =
            lap.ok_or_else(|| Error::Options("no set-up within the ranges has a fastest lap".to_owned()))?;
        Ok(SetupOptimum {
            values: ranges.iter().map(|it| it.key.value(&parameters)).collect(),
            parameters,
            lap,
            status: minimum.status,
            searches: objective.searches.into_inner(),
        })
    }
}

/// The least cost of a lap over the shares of the ranges: its time, with what steering and pedals cost.
struct SetupObjective<'a> {
    start: &'a LapOptimum,
    parameters: &'a CarParameters,
    ranges: &'a [ParameterRange],
    line: &'a TrackLine,
    options: &'a LapOptions,
    searches: AtomicUsize,
}

impl SetupObjective<'_> {
    fn parameters_at(&self, x: &DVector<f64>) -> Result<CarParameters, Error> {
        let mut parameters = self.parameters.clone();
        for (range, share) in self.ranges.iter().zip(x.iter()) {
            let value = range.low + share * (range.high - range.low);
            parameters
                .set_number(range.key, value)
                .map_err(|message| Error::Options(format!("`{}`: {message}", range.key.name)))?;
        }
        Ok(parameters)
    }

    /// None where the search does not converge.
    fn fastest_lap(&self, parameters: &CarParameters) -> Result<Option<LapOptimum>, Error> {
        self.searches.fetch_add(1, Ordering::Relaxed);
        let (car, _) = parameters.car().map_err(Error::Options)?;
        let lap = self.start.find_similar(&car, self.line, self.options)?;
        Ok((lap.status == InteriorPointStatus::Converged).then_some(lap))
    }

    /// The least cost [s] and its derivatives by the shares [s].
    fn cost_and_gradient(&self, x: &DVector<f64>) -> Option<(f64, DVector<f64>)> {
        let lap = self.fastest_lap(&self.parameters_at(x).ok()?).ok()??;
        let mut gradient = DVector::zeros(x.len());
        for i in 0..x.len() {
            let lagrangian = |sign: f64| {
                let mut changed = x.clone();
                changed[i] += sign * DERIVATIVE_CHANGE;
                let (car, _) = self.parameters_at(&changed).ok()?.car().ok()?;
                let by_node = lap.lagrangian_by_node(&car, self.line, self.options).ok()?;
                Some(by_node.iter().sum::<f64>())
            };
            // A parameter at the end of what it can be has one side only.
            let sides = [1.0, -1.0].map(|sign| lagrangian(sign).map(|value| (sign, value)));
            let at = || lagrangian(0.0).map(|value| (0.0, value));
            let (high, low) = (sides[0].or_else(at)?, sides[1].or_else(at)?);
            gradient[i] = (high.1 - low.1) / ((high.0 - low.0) * DERIVATIVE_CHANGE);
        }
        Some((lap.cost, gradient))
    }
}

impl Objective for SetupObjective<'_> {
    fn model(&self, x: &DVector<f64>) -> QuadraticModel {
        let n = x.len();
        let unsolved = || QuadraticModel {
            cost: f64::INFINITY,
            gradient: DVector::zeros(n),
            hessian: DMatrix::identity(n, n),
            scale: 1.0,
        };
        let change = |i: usize| if x[i] > 0.5 { -CURVATURE_CHANGE } else { CURVATURE_CHANGE };
        let point = |i: Option<usize>| {
            let mut x = x.clone();
            if let Some(i) = i {
                x[i] += change(i);
            }
            self.cost_and_gradient(&x)
        };
        let points: Vec<_> = (0..=n).into_par_iter().map(|i| point(i.checked_sub(1))).collect();
        let Some((cost, gradient)) = points[0].clone() else { return unsolved() };
        let mut hessian = DMatrix::zeros(n, n);
        for (i, changed) in points[1..].iter().enumerate() {
            let Some((_, changed)) = changed else { return unsolved() };
            hessian.set_column(i, &((changed - &gradient) / change(i)));
        }
        let eigen = SymmetricEigen::new((&hessian + hessian.transpose()) * 0.5);
        let values = eigen.eigenvalues.map(|value| value.max(LEAST_CURVATURE));
        let hessian = &eigen.eigenvectors * DMatrix::from_diagonal(&values) * eigen.eigenvectors.transpose();
        QuadraticModel { cost, gradient, hessian, scale: 1.0 }
    }

    fn cost(&self, x: &DVector<f64>) -> f64 {
        let lap = self.parameters_at(x).and_then(|parameters| self.fastest_lap(&parameters));
        lap.ok().flatten().map_or(f64::INFINITY, |lap| lap.cost)
    }
}
