//! Judges what the data can tell about a tire: each quantity by five criteria, in words. Their thresholds are those of [`numerics::identifiability`].
//!
//! The data identify a quantity if (a) they narrow it to less than 0.3 of what bounds and literature allow, (b) its profile likelihood rules out
//! values on both sides inside the box with one optimum between them, and (c) another width of the prior would not move it, nor
//! (d) a wider box, searched for other optima too, and the likeliest tire does not have it on its bound, and (e) data of twice
//! the noise would tell it as well as twice the noise allows.
//! If (a) fails the value is what the prior says; if only another one fails, the data say something and the prior the rest. A criterion
//! that was not looked at does not count.

mod active_bounds;
mod doubled_noise;
mod peak;
mod reason;

pub use numerics::identifiability::Identifiability;
use numerics::identifiability::{MAX_PRIOR_SHIFT, MAX_WIDTH_IDENTIFIED, NEGLIGIBLE_PRIOR_SHIFT};
use numerics::statistics::{central_95_percent_interval, mean, quantile, std};
use preparation::direction::ForceDirection;
use serde::Serialize;

use crate::compressed::CompressedSamples;
use crate::curve_profile::CurveProfiler;
use crate::parameters::{Theta, magic_formula_from_theta};
use crate::posterior::PosteriorSamples;
use crate::prior::Prior;
use crate::profile::LikelihoodProfile;
use crate::quantity::Quantity;
pub use active_bounds::ActiveBounds;
pub use doubled_noise::DoubledNoise;
use doubled_noise::DoubledNoisePosterior;
pub use peak::cap_absent_peak;

/// Standard deviations from the likeliest value at which another optimum is another answer.
const MODE_DISTANCE: f64 = 1.5;

/// What the data can tell about a quantity.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct QuantityIdentifiability {
    /// What is judged.
    pub quantity: Quantity,
    /// Whether the data can tell.
    pub verdict: Identifiability,
    /// Why, in a sentence or two.
    pub reason: String,
    /// Mean of the posterior.
    pub mean: f64,
    /// Standard deviation of the posterior.
    pub std: f64,
    /// The middle 95 % of the posterior, with all that the profile does not rule out, where it was followed: what volume of the box
    /// says against a value is not said by the data.
    pub interval: [f64; 2],
    /// Criterion (a): width of the posterior over that of the prior.
    pub width_ratio: f64,
    /// Criterion (b); absent where the profile was not followed.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub profile: Option<LikelihoodProfile>,
    /// Value of another optimum that the data do not rule out, where the draws do not show it.
    pub rival: Option<f64>,
    /// Criterion (c): standard deviations by which half or double the width of the prior moves the mean; absent without draws of the
    /// posterior.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub prior_shift: Option<f64>,
    /// Criterion (e); absent where another one failed already, or all are far from the limits of (c).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub noisier: Option<DoubledNoise>,
    /// The slip whose measurement would tell most, up to half as much again as was driven; absent if nothing would.
    pub drive: Option<f64>,
}

/// What was measured, for judging it.
#[derive(Clone, Copy, Debug)]
pub struct MeasurementEvidence<'a> {
    /// The samples.
    pub data: &'a CompressedSamples,
    /// Smallest and largest slip.
    pub slip_range: [f64; 2],
    /// Standard deviation of the noise of the friction coefficient [-].
    pub noise_std: f64,
    /// Which force.
    pub direction: ForceDirection,
}

/// Judges all free parameters, and what follows from them. `optimum` is the result of a fit, or any guess.
pub fn judge_quantities(
    evidence: &MeasurementEvidence,
    prior: &Prior,
    posterior: &PosteriorSamples,
    optimum: &Theta,
) -> Vec<QuantityIdentifiability> {
    let profiler = CurveProfiler::new(evidence.data, prior, posterior, optimum);
    let before =
        PosteriorSamples { samples: prior.restricted_to_literature().space_filling_points(4096).collect() };
    let lessons = ExpectedInformation::new(evidence, posterior);
    let pressed = ActiveBounds::new(evidence.data, prior, profiler.likeliest_tire());
    let one = |quantity: Quantity| {
        let values = posterior.quantity_values(quantity);
        let stated = central_95_percent_interval(values.clone());
        let best = quantity.value(profiler.likeliest_tire());
        // Draws of two narrow modes are at least two standard deviations apart, their interval has both.
        let apart = |value: &f64| {
            !(stated[0]..=stated[1]).contains(value) || (value - best).abs() > MODE_DISTANCE * std(&values)
        };
        let rival = profiler.rival_optima().iter().map(|theta| quantity.value(theta)).find(apart);
        let profile = profiler.profile_quantity(quantity, &values);
        // Neither the volume of the box nor a ridge that the profile does not see makes it narrower than the other says.
        let interval = [stated[0].min(profile.lower.at), stated[1].max(profile.upper.at)];
        let known = QuantityStatistics {
            quantity,
            mean: mean(&values),
            std: std(&values),
            interval,
            width_ratio: posterior_width_ratio(quantity, prior, &values, &before),
            profile: Some(profile),
            rival,
            prior_shift: Some(prior_shift(prior, posterior, &values)),
            noisier: None,
        };
        (known, lessons.most_informative_slip(&values))
    };
    let quantities = prior.free_parameters().map(Quantity::Parameter).chain(Quantity::DERIVED);
    let mut found: Vec<(QuantityStatistics, Option<f64>)> = quantities.map(one).collect();
    let identified = |known: &QuantityStatistics| known.verdict() == Identifiability::Identified;
    let near = |known: &QuantityStatistics| {
        identified(known)
            && known.prior_shift.is_some_and(|shift| doubled_noise::is_near(shift, known.width_ratio))
    };
    if found.iter().any(|(known, _)| near(known)) {
        let doubled = DoubledNoisePosterior::new(evidence.data, prior, profiler.likeliest_tire());
        for (known, _) in found.iter_mut().filter(|(known, _)| identified(known)) {
            known.noisier = Some(doubled.statistics(known.quantity, prior, &before));
        }
    }
    let judged = |(known, drive): (QuantityStatistics, Option<f64>)| {
        let judgement = known.into_judgement(prior, &reason::advise_on_driving(drive, evidence));
        pressed.cap_judgement(QuantityIdentifiability { drive, ..judgement })
    };
    let mut judgements: Vec<_> = found.into_iter().map(judged).collect();
    cap_absent_peak(&mut judgements, evidence.slip_range, evidence.direction);
    judgements
}

/// What is known of a quantity, before it is judged. The fields are those of [`QuantityJudgement`].
#[derive(Clone, Debug, PartialEq)]
pub struct QuantityStatistics {
    /// What is judged.
    pub quantity: Quantity,
    /// Mean.
    pub mean: f64,
    /// Standard deviation.
    pub std: f64,
    /// 95 % of the distribution.
    pub interval: [f64; 2],
    /// Criterion (a).
    pub width_ratio: f64,
    /// Criterion (b).
    pub profile: Option<LikelihoodProfile>,
    /// Value of another optimum.
    pub rival: Option<f64>,
    /// Criterion (c).
    pub prior_shift: Option<f64>,
    /// Criterion (e).
    pub noisier: Option<DoubledNoise>,
}

impl QuantityStatistics {
    /// The judgement, with advice on what to drive for a quantity that is not identified.
    pub fn into_judgement(self, prior: &Prior, advice: &str) -> QuantityIdentifiability {
        let verdict = self.verdict();
        let reason = reason::explain_verdict(&self, verdict, prior, advice);
        let Self { quantity, mean, std, interval, .. } = self;
        let Self { width_ratio, profile, rival, prior_shift, noisier, .. } = self;
        QuantityIdentifiability {
            quantity,
            verdict,
            reason,
            mean,
            std,
            interval,
            width_ratio,
            profile,
            rival,
            prior_shift,
            noisier,
            drive: None,
        }
    }

    /// Whether the data can tell.
    pub fn verdict(&self) -> Identifiability {
        let closed = self.profile.as_ref().is_none_or(|p| p.lower.closed && p.upper.closed);
        let alone = closed && self.rival.is_none();
        let steady = self.noisier.is_none_or(|noisier| noisier.is_identified());
        let unmoved = self
            .prior_shift
            .is_none_or(|shift| shift < MAX_PRIOR_SHIFT || shift * self.width_ratio < NEGLIGIBLE_PRIOR_SHIFT);
        // Written so that a NaN is never a success.
        match (self.width_ratio < MAX_WIDTH_IDENTIFIED, alone && unmoved && steady) {
            (true, true) => Identifiability::Identified,
            (true, false) => Identifiability::Weak,
            (false, _) => Identifiability::NotIdentifiable,
        }
    }
}

/// Criterion (a), from draws of the posterior and of the prior: of parameters standard deviations; of what follows from them, whose
/// prior has long tails, the middle 68 %.
pub fn posterior_width_ratio(
    quantity: Quantity,
    prior: &Prior,
    values: &[f64],
    before: &PosteriorSamples,
) -> f64 {
    match quantity {
        Quantity::Parameter(parameter) => std(values) / prior.difference_unit(parameter),
        _ => {
            central_68_percent_width(values.to_vec())
                / central_68_percent_width(before.quantity_values(quantity))
        }
    }
}

/// Criterion (a), where only a standard deviation is known.
pub fn width_ratio_from_std(quantity: Quantity, prior: &Prior, std: f64, before: &PosteriorSamples) -> f64 {
    /// The middle 68 % of the standard normal distribution.
    const MIDDLE: f64 = 1.988_915_7;
    match quantity {
        Quantity::Parameter(parameter) => std / prior.difference_unit(parameter),
        _ => MIDDLE * std / central_68_percent_width(before.quantity_values(quantity)),
    }
}

/// The width of the middle 68 %.
fn central_68_percent_width(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    quantile(&values, 0.84) - quantile(&values, 0.16)
}

/// Criterion (c), from draws of the posterior: the larger move of the mean when a normal prior as wide as the box, about its centre, is given half and double its
/// width, in standard deviations.
pub fn prior_shift(prior: &Prior, posterior: &PosteriorSamples, values: &[f64]) -> f64 {
    let distance = |theta: &Theta| -> f64 {
        prior
            .free_parameters()
            .map(|p| ((theta[p as usize] - prior.centre[p as usize]) / prior.parameter_std(p)).powi(2))
            .sum()
    };
    let distances: Vec<f64> = posterior.samples.iter().map(distance).collect();
    let nearest = distances.iter().copied().fold(f64::INFINITY, f64::min);
    let mean = |width: f64| {
        let weights = distances.iter().map(|distance| (-0.5 * (distance - nearest) / (width * width)).exp());
        let (sum, whole) =
            weights.zip(values).fold((0.0, 0.0), |(s, w), (weight, v)| (s + weight * v, w + weight));
        sum / whole
    };
    let usual = mean(1.0);
    (mean(0.5) - usual).abs().max((mean(2.0) - usual).abs()) / std(values)
}

/// What one more measurement at a slip would teach, for slips up to half as much again as was driven.
struct ExpectedInformation {
    slips: Vec<f64>,
    /// Friction coefficient of each draw, less its mean, for each slip.
    predictions: Vec<Vec<f64>>,
    /// Variance of a measurement at each slip.
    variances: Vec<f64>,
}

impl ExpectedInformation {
    fn new(evidence: &MeasurementEvidence, posterior: &PosteriorSamples) -> Self {
        let driven = evidence.slip_range[0].abs().max(evidence.slip_range[1].abs());
        let slips: Vec<f64> = (1..=30).map(|i| 1.5 * driven * f64::from(i) / 30.0).collect();
        let predict = |&slip: &f64| {
            let values: Vec<f64> = posterior
                .samples
                .iter()
                .map(|theta| magic_formula_from_theta(theta).friction_coefficient(slip))
                .collect();
            let mean = mean(&values);
            values.into_iter().map(|value| value - mean).collect()
        };
        let predictions: Vec<Vec<f64>> = slips.iter().map(predict).collect();
        let noise = evidence.noise_std * evidence.noise_std;
        let variances = predictions.iter().map(|values| std(values).powi(2) + noise).collect();
        Self { slips, predictions, variances }
    }

    /// The slip that lowers the variance of a quantity most, by the best linear estimate: over all draws, so that it
    /// does not hang on the slope at one point that may be wrong.
    fn most_informative_slip(&self, values: &[f64]) -> Option<f64> {
        let gain = |(predictions, variance): (&Vec<f64>, &f64)| {
            let covariance =
                predictions.iter().zip(values).map(|(f, q)| f * q).sum::<f64>() / values.len() as f64;
            covariance * covariance / variance
        };
        let gains = self.predictions.iter().zip(&self.variances).map(gain);
        let best = self.slips.iter().zip(gains).max_by(|a, b| a.1.total_cmp(&b.1))?;
        (best.1 > 0.0).then_some(*best.0)
    }
}
