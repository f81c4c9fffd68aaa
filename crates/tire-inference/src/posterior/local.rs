//! Draws from the posterior about the optima, by importance sampling: where data have so little noise that no grid in the box is fine
//! enough, there is nothing of it elsewhere.

use nalgebra::DVector;
use numerics::importance;
use numerics::resampling::systematic_resample;
use numerics::variational::LogDensity;

use crate::compressed::CompressedSamples;
use crate::density::TireLogPosterior;
use crate::parameters::Theta;
use crate::posterior::report::{PosteriorReport, SamplingMethod, SamplingStatus};
use crate::posterior::{PosteriorSamples, SampledPosterior, SamplingOptions};
use crate::prior::Prior;

/// Effective draws for each one that is wanted.
const SHARE: f64 = 0.5;

/// Draws of equal weight; `None` where they do not come close to the posterior. A mode that no optimum is near is missed.
pub fn draw_near_optima(
    data: &CompressedSamples,
    prior: &Prior,
    optima: &[Theta],
    options: &SamplingOptions,
) -> Option<SampledPosterior> {
    let density = TireLogPosterior::new(data, prior);
    let freedom = data.effective_count().checked_sub(density.dimension()).filter(|freedom| *freedom > 0)?;
    let start = |theta: &Theta| {
        let point =
            density.unbounded_coordinates(theta, (data.residual_squares(theta) / freedom as f64).sqrt());
        let covariance = density.information_matrix(&point).cholesky()?.inverse();
        Some((point, covariance))
    };
    let starts: Vec<_> = optima.iter().filter_map(start).collect();
    let logs =
        |points: &[DVector<f64>]| points.iter().map(|x| density.log_density_and_gradient(x).0).collect();
    let sampled =
        importance::sample_by_importance(&logs, &starts, SHARE * options.draws as f64, options.seed, || {
            true
        })?;
    let chosen = systematic_resample(&sampled.weights, options.draws, options.seed);
    let draws = chosen.into_iter().map(|index| density.theta_at(&sampled.points[index])).collect();
    let report = PosteriorReport {
        method: SamplingMethod::Importance,
        status: SamplingStatus::Exact,
        effective_share: sampled.diagnosis.effective_share,
        largest_weight: sampled.diagnosis.largest_weight,
        k_hat: Some(sampled.diagnosis.k_hat),
        cells: sampled.evaluations,
        levels: sampled.rounds,
        ..PosteriorReport::default()
    };
    sampled.is_exact().then_some(SampledPosterior { posterior: PosteriorSamples { samples: draws }, report })
}
