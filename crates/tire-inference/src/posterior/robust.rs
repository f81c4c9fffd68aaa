//! Draws from the posterior under noise that is not normal: normal noise with a weight for each sample proposes the draws, and
//! importance weights correct them.
//!
//! Near the best curve a loss is a square with a weight for each sample, and that can be compressed. The square is as wide
//! as the loss is on average over the samples; the weights of the draws are those of the likelihood itself: that of the square with a
//! weight for each sample, of all samples, and what the loss differs from it by, of some. At the best curve the two have the same
//! gradient, sample by sample, so that few of them tell the difference well. Degrees of freedom and scale are taken as known.

use numerics::loss::Loss;
use numerics::resampling::systematic_resample;
use preparation::samples::CurveSamples;
use rayon::prelude::*;

use crate::compressed::CompressedSamples;
use crate::kernel::{self, friction_coefficient};
use crate::parameters::{Normal, Theta};
use crate::posterior::grid::{EFFECTIVE, LARGEST};
use crate::posterior::report::{PosteriorReport, SamplingStatus};
use crate::posterior::{PosteriorSamples, SampledPosterior, SamplingOptions, draw_posterior};
use crate::prior::Prior;

/// Draws of the normal problem for each one that is wanted.
const SPARE: usize = 2;
/// Samples that tell by how much the loss differs from a square.
const COMPARED: usize = 4096;
/// The loss is as wide as a square that is at most this much wider than the weights alone say.
const WIDEST: f64 = 5.0;

/// A likelihood of samples that is not normal.
#[derive(Clone, Copy, Debug)]
pub struct RobustLikelihood<'a> {
    samples: &'a CurveSamples,
    loss: Loss,
    /// What the cost is divided by in −ln(likelihood).
    variance: f64,
    /// What of the samples would tell as much if they were independent of each other.
    share: f64,
}

/// The normal problem near a curve.
pub struct GaussianApproximation {
    /// What proposes the draws.
    pub proposal: CompressedSamples,
    /// The sum of squares with a weight for each sample, of all samples.
    squares: CompressedSamples,
    /// Some samples as they are.
    some: CurveSamples,
    /// The same with these weights.
    some_squares: CompressedSamples,
    /// How many samples one of them stands for.
    each: f64,
}

impl<'a> RobustLikelihood<'a> {
    /// `share` of the samples would tell as much if they were independent.
    pub fn new(samples: &'a CurveSamples, loss: Loss, noise_std: f64, share: f64) -> Self {
        Self { samples, loss, variance: loss.cost_divisor(noise_std), share }
    }

    /// The normal problem near a curve, with what was known from elsewhere.
    pub fn gaussian_approximation(&self, theta: &Theta, known: Option<Normal>) -> GaussianApproximation {
        let mut weighted = self.samples.clone();
        let (mut weights, mut curvatures) = (0.0, 0.0);
        let points = self.samples.slip.iter().zip(&self.samples.force);
        for ((&slip, &force), weight) in points.zip(&mut weighted.weight) {
            let residual = friction_coefficient(theta, slip) - force;
            curvatures += *weight * self.loss.curvature(residual);
            *weight *= self.loss.weight(residual);
            weights += *weight;
        }
        let wider = if curvatures * WIDEST > weights { weights / curvatures } else { WIDEST };
        let variance = wider.max(1.0) * self.variance;
        let squares = CompressedSamples::new(&weighted);
        let proposal = squares.clone().with_noise_variance(variance, theta).with_effective_share(self.share);
        let (some, some_squares, each) = self.subsample(&weighted);
        let proposal = proposal.with_prior(known, variance / self.share);
        GaussianApproximation { proposal, squares, some, some_squares, each }
    }

    /// Samples at even steps in the order of the slip.
    fn subsample(&self, weighted: &CurveSamples) -> (CurveSamples, CompressedSamples, f64) {
        let rows = self.samples.rows_by_slip(COMPARED);
        let each = self.samples.len() as f64 / rows.len().max(1) as f64;
        (self.samples.select_rows(&rows), CompressedSamples::new(&weighted.select_rows(&rows)), each)
    }

    /// Draws from the posterior; `near` is that of [`Self::gaussian_approximation`].
    pub fn draw_posterior(
        &self,
        near: &GaussianApproximation,
        prior: &Prior,
        optima: &[Theta],
        options: &SamplingOptions,
    ) -> SampledPosterior {
        let more = SamplingOptions { draws: SPARE * options.draws, ..*options };
        let GaussianApproximation { proposal, squares, some, some_squares, each } = near;
        let SampledPosterior { posterior, report } = draw_posterior(proposal, prior, optima, &more);
        let half = 0.5 * (proposal.effective_count() as f64 - 1.0);
        let log_weight = |theta: &Theta| {
            let known =
                proposal.prior().map_or(0.0, |(normal, _)| normal.squared_mahalanobis_distance(theta).0);
            let of_some =
                kernel::curve_cost(some, theta, self.loss) - 0.5 * some_squares.residual_squares(theta);
            let cost = self.share * (0.5 * squares.residual_squares(theta) + each * of_some) / self.variance;
            half * proposal.residual_squares(theta).ln() - cost - 0.5 * known
        };
        let logs: Vec<f64> = posterior.samples.par_iter().map(log_weight).collect();
        let best = logs.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let weights: Vec<f64> = logs.iter().map(|log| (log - best).exp()).collect();
        let whole: f64 = weights.iter().sum();
        let squares: f64 = weights.iter().map(|weight| weight * weight).sum();
        let effective_share = report.effective_share * whole * whole / squares / weights.len() as f64;
        let largest_weight = weights.iter().copied().fold(0.0, f64::max) / whole;
        let even = effective_share >= EFFECTIVE && largest_weight <= LARGEST;
        let status = match report.status {
            SamplingStatus::Exact if !even => SamplingStatus::Uneven,
            status => status,
        };
        let chosen = systematic_resample(&weights, options.draws, options.seed);
        let draws = chosen.into_iter().map(|index| posterior.samples[index]).collect();
        let report = PosteriorReport { effective_share, largest_weight, status, ..report };
        SampledPosterior { posterior: PosteriorSamples { samples: draws }, report }
    }
}
