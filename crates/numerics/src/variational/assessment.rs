//! Fits a normal distribution to a density and judges it by weighted draws.

use std::time::Instant;

use nalgebra::DVector;
use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;

use crate::low_discrepancy::log_normal;
use crate::psis::{self, WeightDiagnosis};
use crate::variational::LogDensity;
use crate::variational::gaussian::Gaussian;
use crate::variational::newton::GaussianFit;

/// Degrees of freedom of the heavier tails, and how much wider they begin.
const FREEDOM: usize = 5;
const WIDER: f64 = 1.2;
/// By how much [nat] the bound over the fit's own points may exceed that over fresh draws.
const OVERFIT: f64 = 0.1;

/// A fitted normal distribution, and what draws from it say.
#[derive(Clone, Debug)]
pub struct GaussianFitAssessment {
    /// The fit.
    pub fitted: GaussianFit,
    /// Points that stood for the standard normal distribution in it.
    pub points: usize,
    /// Draws from it.
    pub draws: GaussianDraws,
    /// Wall time [s].
    pub seconds: f64,
}

/// Fits with more and more points, from `points` on: until the fit is as good on fresh draws as on its own points, or is not worth more,
/// or `most` is reached.
pub fn fit_and_assess_gaussian(
    density: &impl LogDensity,
    fit: impl Fn(usize) -> GaussianFit,
    [points, most]: [usize; 2],
    worth_more: impl Fn(&GaussianFit) -> bool,
    draws: usize,
    seed: u64,
) -> GaussianFitAssessment {
    let begin = Instant::now();
    let mut points = points;
    loop {
        let fitted = fit(points);
        let draws = GaussianDraws::new(density, &fitted.gaussian, ProposalTails::Normal, draws, seed);
        let overfit = fitted.trace.last().is_some_and(|own| own - draws.elbo > OVERFIT);
        if !(overfit && worth_more(&fitted)) || points >= most {
            return GaussianFitAssessment { fitted, points, draws, seconds: begin.elapsed().as_secs_f64() };
        }
        points *= 2;
    }
}

/// What draws from a normal distribution are like far out.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ProposalTails {
    /// As they are.
    Normal,
    /// Those of a somewhat wider t distribution: a normal distribution that was fitted to a skewed one is too narrow, and
    /// weights cannot give mass to where there are no draws.
    Heavy,
}

/// Draws from a normal distribution, and what weights say of them.
#[derive(Clone, Debug)]
pub struct GaussianDraws {
    /// The draws.
    pub points: Vec<DVector<f64>>,
    /// Their weights, smoothed.
    pub weights: Vec<f64>,
    /// How even the weights are.
    pub diagnosis: WeightDiagnosis,
    /// Evidence lower bound [nat].
    pub elbo: f64,
}

impl GaussianDraws {
    /// As many as wanted.
    pub fn new(
        density: &impl LogDensity,
        gaussian: &Gaussian,
        tails: ProposalTails,
        count: usize,
        seed: u64,
    ) -> Self {
        // Not the stream of the points.
        let mut random = Pcg64::seed_from_u64(!seed);
        let dimension = density.dimension();
        let drawn = (0..count).map(|_| {
            let mut e = DVector::from_fn(dimension, |_, _| StandardNormal.sample(&mut random));
            let mut log_drawn = log_normal(&e) - gaussian.log_determinant();
            if tails == ProposalTails::Heavy {
                let chi_squared = (0..FREEDOM).map(|_| {
                    let normal: f64 = StandardNormal.sample(&mut random);
                    normal * normal
                });
                let freedom = FREEDOM as f64;
                e *= (freedom / chi_squared.sum::<f64>()).sqrt();
                // But for a constant.
                log_drawn = -0.5 * (freedom + dimension as f64) * (e.norm_squared() / freedom).ln_1p();
                e *= WIDER;
            }
            (gaussian.x_from_deviate(&e), log_drawn)
        });
        let (points, logs_drawn): (Vec<_>, Vec<f64>) = drawn.unzip();
        let logs = density.log_densities(&points).into_iter().zip(logs_drawn);
        let log_weights: Vec<f64> = logs.map(|(log, log_drawn)| log - log_drawn).collect();
        let (diagnosis, weights) = psis::pareto_smooth(&log_weights);
        let elbo = log_weights.iter().sum::<f64>() / count as f64;
        Self { points, weights, diagnosis, elbo }
    }
}
