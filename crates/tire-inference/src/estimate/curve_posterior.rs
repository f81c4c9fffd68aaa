//! Draws the posterior of a curve near its best fit, and compares it with the samples.

use numerics::loss::Loss;
use preparation::samples::CurveSamples;

use crate::compressed::CompressedSamples;
use crate::dependence::SampleDependence;
use crate::fit::FitSolution;
use crate::linearised_slip_noise::linearise_slip_noise;
use crate::parameters::Theta;
use crate::posterior::predictive::check_posterior_predictive;
use crate::posterior::report::{CurveBand, PosteriorReport};
use crate::posterior::robust::RobustLikelihood;
use crate::posterior::{PosteriorSamples, SampledPosterior, SamplingOptions, draw_posterior};
use crate::settings::IdentificationSettings;

/// Slips at which the report has the band of the curves.
const BAND: usize = 41;

/// Standard deviations of the slip's noise that samples are away from the outermost ones, to be compared with the model.
const ENDS: f64 = 4.0;

/// The posterior of a curve, and what it is of.
pub struct CurvePosterior {
    /// The samples, their slips without noise.
    pub noisy: CurveSamples,
    /// The same.
    pub data: CompressedSamples,
    pub optima: Vec<Theta>,
    pub posterior: PosteriorSamples,
    pub report: PosteriorReport,
}

impl CurvePosterior {
    /// Near the best fit.
    pub fn new(
        samples: &CurveSamples,
        settings: &IdentificationSettings,
        best: &FitSolution,
        slip_range: [f64; 2],
    ) -> Self {
        let IdentificationSettings { prior, loss, prior_from_file, options, .. } = settings;
        let dependence = SampleDependence::estimate(samples, &best.theta);
        let share = dependence.effective_share();
        let slip_std = settings.slip_noise.map_or(0.0, |noise| noise.std);
        let noisy = linearise_slip_noise(samples, &best.theta, slip_std, best.noise_std);
        let optima: Vec<Theta> = best.optima.iter().map(|(theta, _)| *theta).collect();
        let wanted = SamplingOptions { seed: options.seed, ..SamplingOptions::default() };
        let (data, SampledPosterior { posterior, report }) = match *loss {
            Loss::Square => {
                let variance = best.noise_std.powi(2) / share;
                let data = CompressedSamples::new(&noisy)
                    .with_effective_share(share)
                    .with_prior(*prior_from_file, variance);
                let found = draw_posterior(&data, prior, &optima, &wanted);
                (data, found)
            }
            loss => {
                let robust = RobustLikelihood::new(&noisy, loss, best.noise_std, share);
                let near = robust.gaussian_approximation(&best.theta, *prior_from_file);
                let found = robust.draw_posterior(&near, prior, &optima, &wanted);
                (near.proposal, found)
            }
        };
        let inner = inner_slip_samples(&noisy, slip_std);
        let report = PosteriorReport {
            mean: prior.free_parameters().map(|p| (p.into(), posterior.parameter_mean(p))).collect(),
            band: Some(CurveBand::new(&posterior, slip_range, BAND)),
            predictive: check_posterior_predictive(&inner, *loss, &posterior, dependence, options.seed),
            noise: *loss,
            ..report
        };
        Self { noisy, data, optima, posterior, report }
    }
}

/// Samples whose true slips are on both sides of the measured ones: the outermost of many measured slips is several standard deviations
/// beyond the outermost true one, and the curve is not that of the model between them.
fn inner_slip_samples(samples: &CurveSamples, slip_std: f64) -> CurveSamples {
    let Some([low, high]) = samples.slip_range() else { return CurveSamples::default() };
    let within = low + ENDS * slip_std..=high - ENDS * slip_std;
    let mut inner = CurveSamples::default();
    let points = samples.slip.iter().zip(&samples.force).zip(&samples.weight);
    for ((&slip, &force), &weight) in points.filter(|((slip, _), _)| within.contains(*slip)) {
        inner.push(slip, force, weight);
    }
    inner
}
