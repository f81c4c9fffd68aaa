//! Fits a normal distribution with full covariance to the posterior of a tire: variational inference.
//!
//! Where the posterior is a curved ridge or ends at a bound, which it does unless the tire was driven well past its peak, no
//! normal distribution is like it. So this never comes without what tells: weights, which also correct it where it is close.

pub mod adam;
pub mod report;

use std::time::Instant;

use nalgebra::DMatrix;
use numerics::convergence::OptimisationStatus;
use numerics::low_discrepancy::normal_points;
use numerics::resampling::systematic_resample;
use numerics::variational::LogDensity;
use numerics::variational::adam::fit_gaussian_by_adam;
use numerics::variational::assessment::{self, GaussianDraws, ProposalTails};
use numerics::variational::gaussian::Gaussian;
use numerics::variational::newton::{self, GaussianFit, NewtonLimits};
use preparation::samples::CurveSamples;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::compressed::CompressedSamples;
use crate::density::{MinibatchPosterior, TireLogPosterior};
use crate::parameters::Theta;
use crate::posterior::PosteriorSamples;
use crate::prior::Prior;
use adam::Adam;
use report::{NonNormalityEvidence, VariationalReport};

/// Draws that judge the fit, as many as the exact posterior gives.
const DRAWS: usize = 8192;
/// Fewer points than this many times the square of the dimension are overfitted, and fewer than the next number.
const POINTS: usize = 3;
const FEWEST_POINTS: usize = 64;
/// Most points.
const MOST_POINTS: usize = 1024;

/// Optimiser of the evidence lower bound.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "optimiser", rename_all = "snake_case", deny_unknown_fields)]
pub enum ElboOptimiser {
    /// Natural gradients from all points, until the dimensionless gradient is below 0.01.
    #[default]
    Newton,
    /// Adam from the typical values.
    Adam(Adam),
}

/// What is known before the fit.
#[derive(Clone, Copy)]
pub struct VariationalStart<'a> {
    /// The samples.
    pub samples: &'a CurveSamples,
    /// The same samples.
    pub data: &'a CompressedSamples,
    /// What is known before any data.
    pub prior: &'a Prior,
    /// The best fit, and the standard deviation of its residuals.
    pub best: (&'a Theta, f64),
}

/// A normal distribution in place of the posterior.
#[derive(Clone, Debug)]
pub struct VariationalPosterior {
    /// Draws from it.
    pub gaussian: PosteriorSamples,
    /// Draws from it with heavier tails, weighted by the posterior: what remains of its error where it is close.
    pub corrected: PosteriorSamples,
    /// What it said.
    pub report: VariationalReport,
}

/// Fits the distribution, and judges it.
pub fn fit_variational(start: VariationalStart, optimiser: ElboOptimiser, seed: u64) -> VariationalPosterior {
    let begin = Instant::now();
    let VariationalStart { samples, data, prior, best: (theta, noise_std) } = start;
    let density = TireLogPosterior::new(data, prior);
    let limits = NewtonLimits { tolerance: 1e-2, steps: 100 };
    let dimension = density.dimension();
    let fewest = (POINTS * dimension * dimension).next_power_of_two().max(FEWEST_POINTS);
    let fit = |count: usize| {
        let points = normal_points(dimension, count, seed);
        match optimiser {
            ElboOptimiser::Newton => {
                let mode = density.unbounded_coordinates(theta, noise_std);
                let information = density.information_matrix(&mode);
                // The information is positive definite unless its numbers overflow.
                let laplace = Gaussian::laplace(mode.clone(), information);
                let wide = Gaussian { mean: mode, factor: DMatrix::identity(dimension, dimension) };
                newton::maximise_elbo(&density, laplace.unwrap_or(wide), &points, limits)
            }
            ElboOptimiser::Adam(adam) => {
                let from = Gaussian {
                    mean: density.unbounded_coordinates(&adam.start.unwrap_or(prior.centre), 0.1),
                    factor: DMatrix::identity(dimension, dimension),
                };
                let size = adam.batch.unwrap_or(samples.len()).max(1);
                let batch = MinibatchPosterior { whole: &density, samples, size };
                match adam.batch {
                    None => fit_gaussian_by_adam(
                        &adam.schedule(),
                        &|x, _| density.log_density_and_gradient(x),
                        from,
                        &density,
                        &points,
                        limits,
                        seed,
                    ),
                    Some(_) => fit_gaussian_by_adam(
                        &adam.schedule(),
                        &|x, r| batch.estimate_log_posterior(x, r),
                        from,
                        &density,
                        &points,
                        limits,
                        seed,
                    ),
                }
            }
        }
    };
    let worth_more = |fitted: &GaussianFit| {
        fitted.status == OptimisationStatus::Converged && optimiser == ElboOptimiser::Newton
    };
    let judged =
        assessment::fit_and_assess_gaussian(&density, fit, [fewest, MOST_POINTS], worth_more, DRAWS, seed);
    let drawn = &judged.draws.points;
    let gaussian = PosteriorSamples { samples: drawn.iter().map(|x| density.theta_at(x)).collect() };
    let noise_std = drawn.iter().map(|x| density.noise_std(x) / DRAWS as f64).sum();
    let heavy = GaussianDraws::new(&density, &judged.fitted.gaussian, ProposalTails::Heavy, DRAWS, seed);
    let chosen = systematic_resample(&heavy.weights, DRAWS, seed).into_iter();
    let corrected =
        PosteriorSamples { samples: chosen.map(|i| density.theta_at(&heavy.points[i])).collect() };
    let mut report = VariationalReport::new(&judged, heavy.diagnosis, &gaussian, prior, noise_std);
    report.evaluations += DRAWS;
    report.seconds = begin.elapsed().as_secs_f64();
    report.apply_evidence(&NonNormalityEvidence::default());
    VariationalPosterior { gaussian, corrected, report }
}
