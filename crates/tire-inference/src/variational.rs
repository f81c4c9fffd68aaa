//! Fits a normal distribution with full covariance to the posterior of a tire: variational inference.
//!
//! Where the posterior is a curved valley or ends at a bound, which it does unless the tire was driven well past its peak, no
//! normal distribution is like it. So this never comes without what tells: weights, which also correct it where it is close.

pub mod adam;
pub mod report;

use std::time::Instant;

use nalgebra::{DMatrix, DVector};
use numerics::convergence::Status;
use numerics::low_discrepancy as points;
use numerics::psis::{self, Diagnosis};
use numerics::resampling::systematic;
use numerics::variational::LogDensity;
use numerics::variational::adam::climb;
use numerics::variational::gaussian::Gaussian;
use numerics::variational::newton::{self, Fitted, Limits};
use preparation::samples::Samples;
use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;
use serde::Deserialize;

use crate::compressed::Compressed;
use crate::density::{Minibatch, TireDensity};
use crate::parameters::Theta;
use crate::posterior::Posterior;
use crate::prior::Prior;
use adam::Adam;
use report::{Report, Summary, Suspicion};

/// Draws that judge the fit, as many as the exact posterior gives.
const DRAWS: usize = 8192;
/// Fewer points than this many times the square of the dimension are overfitted, and fewer than the next number.
const POINTS: usize = 3;
const FEWEST_POINTS: usize = 64;
/// Most points.
const MOST_POINTS: usize = 1024;
/// Degrees of freedom of the heavier tails, and how much wider they begin.
const FREEDOM: usize = 5;
const WIDER: f64 = 1.2;
/// By how much [nat] the bound over the fit's own points may exceed that over fresh draws.
const OVERFIT: f64 = 0.1;

/// How the bound is raised.
#[derive(Clone, Copy, Debug, Default, PartialEq, Deserialize)]
#[serde(tag = "optimiser", rename_all = "snake_case", deny_unknown_fields)]
pub enum Optimiser {
    /// Natural gradients from all samples, until the dimensionless gradient is below 0.01.
    #[default]
    Newton,
    /// Adam from typical values, see [`Adam`].
    Adam(Adam),
}

/// What is known before the fit.
#[derive(Clone, Copy)]
pub struct Start<'a> {
    /// The samples.
    pub samples: &'a Samples,
    /// The same samples.
    pub data: &'a Compressed,
    /// What is known before any data.
    pub prior: &'a Prior,
    /// The best fit, and the standard deviation of its residuals.
    pub best: (&'a Theta, f64),
}

/// A normal distribution in place of the posterior.
#[derive(Clone, Debug)]
pub struct Variational {
    /// Draws from it.
    pub gaussian: Posterior,
    /// Draws from it with heavier tails, weighted by the posterior: what remains of its error where it is close.
    pub corrected: Posterior,
    /// What it said.
    pub report: Report,
    fitted: Fitted,
}

/// Fits the distribution, and judges it.
pub fn fit(start: Start, optimiser: Optimiser, seed: u64) -> Variational {
    let begin = Instant::now();
    let Start { samples, data, prior, best: (theta, noise_std) } = start;
    let density = TireDensity::new(data, prior);
    let limits = Limits { tolerance: 1e-2, steps: 100 };
    let dimension = density.dimension();
    let mut count = (POINTS * dimension * dimension).next_power_of_two().max(FEWEST_POINTS);
    let (fitted, draws) = loop {
        let points = points::normal_points(dimension, count, seed);
        let fitted = match optimiser {
            Optimiser::Newton => {
                let mode = density.point(theta, noise_std);
                let information = density.information(&mode);
                // The information is positive definite unless its numbers overflow.
                let laplace = Gaussian::laplace(mode.clone(), information);
                let wide = Gaussian { mean: mode, factor: DMatrix::identity(dimension, dimension) };
                newton::maximise(&density, laplace.unwrap_or(wide), &points, limits)
            }
            Optimiser::Adam(adam) => {
                let from = Gaussian {
                    mean: density.point(&adam.start.unwrap_or(prior.centre), 0.1),
                    factor: DMatrix::identity(dimension, dimension),
                };
                let size = adam.batch.unwrap_or(samples.len()).max(1);
                let batch = Minibatch { whole: &density, samples, size };
                let judge = (&density, &points, limits);
                match adam.batch {
                    None => climb(&adam.schedule(), &|x, _| density.at(x), from, judge, seed),
                    Some(_) => climb(&adam.schedule(), &|x, r| batch.at(x, r), from, judge, seed),
                }
            }
        };
        let draws = Draws::new(&density, &fitted.gaussian, Tails::Normal, seed);
        let overfit = fitted.trace.last().is_some_and(|own| own - draws.elbo > OVERFIT);
        let worth_more = fitted.status == Status::Converged && optimiser == Optimiser::Newton;
        if !(overfit && worth_more) || count >= MOST_POINTS {
            break (fitted, draws);
        }
        count *= 2;
    };
    let Draws { posterior: gaussian, diagnosis, elbo, noise_std, .. } = draws;
    let heavy = Draws::new(&density, &fitted.gaussian, Tails::Heavy, seed);
    let chosen = systematic(&heavy.weights, DRAWS, seed).into_iter();
    let corrected = Posterior { draws: chosen.map(|i| heavy.posterior.draws[i]).collect() };
    let Summary { mean, std, interval } = Summary::of(&gaussian, prior);
    let free: Vec<_> = prior.free().collect();
    let report = Report {
        trusted: true,
        warning: None,
        mean,
        std,
        interval,
        parameters: free.iter().map(|parameter| parameter.name().to_owned()).collect(),
        covariance: gaussian.covariance(&free),
        noise_std,
        status: fitted.status,
        gradient_norm: fitted.gradient_norm,
        steps: fitted.steps,
        points: count,
        evaluations: fitted.evaluations + 2 * DRAWS,
        elbo,
        elbo_trace: fitted.trace.clone(),
        diagnosis,
        correction: heavy.diagnosis,
        seconds: begin.elapsed().as_secs_f64(),
    };
    let mut variational = Variational { gaussian, corrected, report, fitted };
    variational.suspect(&Suspicion::default());
    variational
}

impl Variational {
    /// Takes into account what the fit itself cannot see.
    pub fn suspect(&mut self, suspicion: &Suspicion) {
        let Fitted { status, gradient_norm, .. } = self.fitted;
        let report = &mut self.report;
        let weights = [&report.diagnosis, &report.correction];
        report.warning = report::warning((status, gradient_norm), weights, suspicion);
        report.trusted = report.warning.is_none();
    }
}

/// What draws from a normal distribution are like far out.
#[derive(Clone, Copy, PartialEq)]
enum Tails {
    /// As they are.
    Normal,
    /// Those of a somewhat wider t distribution: a normal distribution that was fitted to a skewed one is too narrow, and
    /// weights cannot give mass to where there are no draws.
    Heavy,
}

/// Draws from a normal distribution, and what weights say of them.
struct Draws {
    posterior: Posterior,
    weights: Vec<f64>,
    diagnosis: Diagnosis,
    elbo: f64,
    noise_std: f64,
}

impl Draws {
    fn new(density: &TireDensity, gaussian: &Gaussian, tails: Tails, seed: u64) -> Self {
        // Not the stream of the points.
        let mut random = Pcg64::seed_from_u64(!seed);
        let dimension = density.dimension();
        let mut log_weights = Vec::with_capacity(DRAWS);
        let mut draws = Vec::with_capacity(DRAWS);
        let mut noise_std = 0.0;
        for _ in 0..DRAWS {
            let mut e = DVector::from_fn(dimension, |_, _| StandardNormal.sample(&mut random));
            let mut log_drawn = points::log_normal(&e) - gaussian.log_volume();
            if tails == Tails::Heavy {
                let chi_squared = (0..FREEDOM).map(|_| {
                    let normal: f64 = StandardNormal.sample(&mut random);
                    normal * normal
                });
                let freedom = FREEDOM as f64;
                e *= (freedom / chi_squared.sum::<f64>()).sqrt();
                // But for a constant.
                log_drawn =
                    -0.5 * (freedom + dimension as f64) * (e.norm_squared() / freedom).ln_1p();
                e *= WIDER;
            }
            let x = gaussian.at(&e);
            log_weights.push(density.at(&x).0 - log_drawn);
            draws.push(density.theta(&x));
            noise_std += density.noise_std(&x) / DRAWS as f64;
        }
        let (diagnosis, weights) = psis::smooth(&log_weights);
        let elbo = log_weights.iter().sum::<f64>() / DRAWS as f64;
        Self { posterior: Posterior { draws }, weights, diagnosis, elbo, noise_std }
    }
}
