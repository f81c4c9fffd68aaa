//! Draws from the posterior under noise that is not normal: normal noise with a weight for each sample proposes the draws, and
//! importance weights correct them.
//!
//! Near the best curve a loss is a square with a weight for each sample, and that can be compressed. The square is as wide
//! as the loss is on average over the samples; the weights of the draws are those of the likelihood itself, sample by
//! sample. Degrees of freedom and scale are taken as known.

use numerics::loss::Loss;
use numerics::resampling::systematic;
use preparation::samples::Samples;
use rayon::prelude::*;

use crate::compressed::Compressed;
use crate::kernel::{self, value};
use crate::parameters::{Normal, Theta};
use crate::posterior::grid::{EFFECTIVE, LARGEST};
use crate::posterior::report::{PosteriorReport, SamplingStatus};
use crate::posterior::{Found, PosteriorSamples, SamplingOptions, draw};
use crate::prior::Prior;

/// Draws of the normal problem for each one that is wanted.
const SPARE: usize = 2;
/// The loss is as wide as a square that is at most this much wider than the weights alone say.
const WIDEST: f64 = 5.0;

/// A likelihood of samples that is not normal.
#[derive(Clone, Copy, Debug)]
pub struct Robust<'a> {
    samples: &'a Samples,
    loss: Loss,
    /// What the cost is divided by in −ln(likelihood).
    variance: f64,
}

impl<'a> Robust<'a> {
    /// `None` for normal noise.
    pub fn new(samples: &'a Samples, loss: Loss, noise_std: f64) -> Option<Self> {
        let variance = loss.variance(noise_std);
        (loss != Loss::Square).then_some(Self { samples, loss, variance })
    }

    /// The normal problem near a curve, with what was known from elsewhere.
    pub fn near(&self, theta: &Theta, known: Option<Normal>) -> Compressed {
        let mut weighted = self.samples.clone();
        let (mut weights, mut curvatures) = (0.0, 0.0);
        let points = self.samples.slip.iter().zip(&self.samples.force);
        for ((&slip, &force), weight) in points.zip(&mut weighted.weight) {
            let residual = value(theta, slip) - force;
            curvatures += *weight * self.loss.curvature(residual);
            *weight *= self.loss.weight(residual);
            weights += *weight;
        }
        let wider = if curvatures * WIDEST > weights { weights / curvatures } else { WIDEST };
        let variance = wider.max(1.0) * self.variance;
        Compressed::new(&weighted).of_variance(variance, theta).with(known, variance)
    }

    /// Draws from the posterior; `near` is that of [`Self::near`].
    pub fn draw(
        &self,
        near: &Compressed,
        prior: &Prior,
        optima: &[Theta],
        options: &SamplingOptions,
    ) -> Found {
        let more = SamplingOptions { draws: SPARE * options.draws, ..*options };
        let Found { posterior, report } = draw(near, prior, optima, &more);
        let half = 0.5 * (near.count() as f64 - 1.0);
        let log_weight = |theta: &Theta| {
            let known = near.prior().map_or(0.0, |(normal, _)| normal.distance(theta).0);
            let cost = kernel::cost(self.samples, theta, self.loss) / self.variance;
            half * near.squares(theta).ln() - cost - 0.5 * known
        };
        let logs: Vec<f64> = posterior.samples.par_iter().map(log_weight).collect();
        let best = logs.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let weights: Vec<f64> = logs.iter().map(|log| (log - best).exp()).collect();
        let whole: f64 = weights.iter().sum();
        let squares: f64 = weights.iter().map(|weight| weight * weight).sum();
        let effective_share =
            report.effective_share * whole * whole / squares / weights.len() as f64;
        let largest_weight = weights.iter().copied().fold(0.0, f64::max) / whole;
        let even = effective_share >= EFFECTIVE && largest_weight <= LARGEST;
        let status = match report.status {
            SamplingStatus::Exact if !even => SamplingStatus::Uneven,
            status => status,
        };
        let chosen = systematic(&weights, options.draws, options.seed);
        let draws = chosen.into_iter().map(|index| posterior.samples[index]).collect();
        let report = PosteriorReport { effective_share, largest_weight, status, ..report };
        Found { posterior: PosteriorSamples { samples: draws }, report }
    }
}
