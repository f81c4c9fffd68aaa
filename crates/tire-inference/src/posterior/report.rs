//! Says what a posterior looks like, how draws from it were made, and whether to rely on them.

use numerics::loss::Loss;
use serde::Serialize;

use crate::kernel::friction_coefficient;
use crate::parameters::Theta;
use crate::posterior::PosteriorSamples;
use crate::posterior::predictive::PosteriorPredictiveCheck;
use crate::quantity::PerQuantity;

/// How draws were made.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum SamplingMethod {
    /// A grid that is refined where the posterior is: exact but for the noise of the draws.
    #[default]
    Grid,
    /// A population from the prior to the posterior: good for means and widths, not for the masses of modes.
    Tempered,
    /// Draws from distributions that were fitted to it, with weights: exact but for the noise of the draws.
    Importance,
}

/// What standard deviations, intervals and covariance are those of, and of posteriors also the values.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum UncertaintySource {
    /// The likelihood near its maximum.
    Likelihood,
    /// A normal distribution, by variational inference, its draws weighted by the posterior.
    Svi,
    /// The exact posterior, from a grid.
    Grid,
    /// The posterior, from a tempered population.
    Tempered,
    /// The exact posterior, from draws with weights.
    Importance,
}

/// Whether the draws of a grid or the weighted draws can be relied on.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum SamplingStatus {
    /// Yes: resolved, and the weights are even.
    Exact,
    /// No: the limit of cells or levels was reached first.
    Unresolved,
    /// No: few draws carry most of the weight.
    Uneven,
    /// No grid was made: there are too few samples, hardly any noise, or nothing is free.
    #[default]
    NotApplicable,
}

/// A mode of the posterior.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PosteriorMode {
    /// Its share of the posterior.
    pub mass: f64,
    /// Mean of the parameters in it.
    pub mean: Theta,
}

/// The middle 95 % of the curves at some slips.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CurveBand {
    /// From the smallest to the largest slip of the data.
    pub slip: Vec<f64>,
    /// Friction coefficient [-] that 2.5 % of the curves are below.
    pub lower: Vec<f64>,
    /// Friction coefficient [-] that 2.5 % of the curves are above.
    pub upper: Vec<f64>,
}

impl CurveBand {
    /// At `count` slips.
    pub fn new(posterior: &PosteriorSamples, [low, high]: [f64; 2], count: usize) -> Self {
        let share = |k: usize| k as f64 / (count.max(2) - 1) as f64;
        let slip: Vec<f64> = (0..count).map(|k| low + share(k) * (high - low)).collect();
        let (lower, upper) = posterior.curve_band(&slip).into_iter().map(|[a, b]| (a, b)).unzip();
        Self { slip, lower, upper }
    }

    /// As wide as it has to be to hold a curve.
    #[must_use]
    pub fn widened_to_contain(mut self, theta: &Theta) -> Self {
        let ends = self.lower.iter_mut().zip(&mut self.upper);
        for (slip, (low, high)) in self.slip.iter().zip(ends) {
            let coefficient = friction_coefficient(theta, *slip);
            *low = low.min(coefficient);
            *high = high.max(coefficient);
        }
        self
    }
}

/// How draws were made, how well, and what they say.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct PosteriorReport {
    /// What the draws are from.
    pub method: SamplingMethod,
    /// Of the grid, also where its draws were not used.
    pub status: SamplingStatus,
    /// Effective number of the weighted draws over their number; 0 without a grid.
    pub effective_share: f64,
    /// Largest weight, their sum being 1; 0 without a grid.
    pub largest_weight: f64,
    /// Shape of the tail of weights of draws, to be below 0.7, see [`numerics::psis`]; absent for a grid.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub k_hat: Option<f64>,
    /// Modes with more than a thousandth of the mass, that with most first; empty without a grid.
    pub modes: Vec<PosteriorMode>,
    /// Cells that were looked at, or draws.
    pub cells: usize,
    /// How often they were split, or rounds of draws.
    pub levels: usize,
    /// What the noise was taken to be.
    pub noise: Loss,
    /// Means of the draws, all parameters free. With the covariance beside it that is what a later run can start from.
    pub mean: PerQuantity,
    /// The curves; absent where nobody asked for them.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub band: Option<CurveBand>,
    /// Whether the model fits the data; absent where nobody asked, or there are too few samples.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub predictive: Option<PosteriorPredictiveCheck>,
}

impl PosteriorReport {
    /// Whether the draws are from the posterior itself, with the masses of its modes.
    pub fn is_exact(&self) -> bool {
        self.method != SamplingMethod::Tempered && self.status == SamplingStatus::Exact
    }

    /// What numbers from the draws are reported to be of.
    pub fn uncertainty_source(&self) -> UncertaintySource {
        match self.method {
            SamplingMethod::Grid => UncertaintySource::Grid,
            SamplingMethod::Tempered => UncertaintySource::Tempered,
            SamplingMethod::Importance => UncertaintySource::Importance,
        }
    }
}
