//! Fits a tire to the data of a bench: F_x, F_y and M_z one after the other, each with a posterior, verdicts and bands.
#![allow(non_snake_case, reason = "symbols as in Pacejka, Tire and Vehicle Dynamics")]

use nalgebra::{DMatrix, DVector};
use numerics::convergence::OptimisationStatus;
use numerics::identifiability::Identifiability;
use numerics::statistics::NORMAL_95;
use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64Mcg;
use tire::{Coefficients, MagicFormulaVersion};

use crate::condition::{RevolutionMean, average_over_revolutions, reference_temperature};
use crate::model::{COUNT, FittedChannel, plain_tire_model};
use crate::prior::{FittedParameter, FreeParameterPrior, free_coefficients};
use crate::sample::{BenchError, BenchSample, SWEPT, value_range};
use crate::solve::ChannelFitProblem;
use crate::spread::{PredictionVariance, cluster_robust_covariance};

/// Largest number of iterations for one channel.
const LIMIT: usize = 80;

/// What a fit takes beside the data.
#[derive(Clone, Debug)]
pub struct TireFitOptions {
    /// The tire's radius, nominal load and pressure, and all that is not fitted.
    pub tire: Coefficients,
    /// Whether terms beyond the formula and temperature are fitted.
    pub extended: bool,
    /// Joint draws of the posterior.
    pub draws: usize,
    /// Seed of the draws.
    pub seed: u64,
}

/// One coefficient or term.
#[derive(Clone, Debug, PartialEq)]
pub struct CoefficientEstimate {
    /// Its key.
    pub name: &'static str,
    /// Its value at the optimum.
    pub value: f64,
    /// Standard deviation of the posterior.
    pub std: f64,
    /// Standard deviation of the prior.
    pub prior_std: f64,
    /// What the data tell.
    pub verdict: Identifiability,
    /// Why.
    pub reason: String,
}

/// How a channel was fitted.
#[derive(Clone, Debug, PartialEq)]
pub struct ChannelFitSummary {
    /// The channel.
    pub channel: FittedChannel,
    /// Points that it was fitted to.
    pub points: usize,
    /// Root mean square of the residuals [N, N m].
    pub rms: f64,
    /// Points that count as one independent one, since neighbours miss alike.
    pub correlated: f64,
    /// How the minimisation ended.
    pub status: OptimisationStatus,
    /// Its iterations.
    pub iterations: usize,
}

/// A fitted tire with its posterior.
#[derive(Clone, Debug)]
pub struct TireFit {
    /// The coefficients at the optimum; SI, ISO-W.
    pub coefficients: Coefficients,
    /// The terms at the optimum, in the order of [`crate::TERMS`].
    pub terms: [f64; COUNT],
    /// The temperature of tread and carcass at which the terms of temperature are 0 [K].
    pub reference: f64,
    /// All that was free, channel by channel.
    pub estimates: Vec<CoefficientEstimate>,
    /// Covariance of the estimates; 0 between channels.
    pub covariance: DMatrix<f64>,
    /// Joint draws of the estimates, one a row.
    pub draws: Vec<Vec<f64>>,
    /// How each channel was fitted.
    pub residuals: Vec<ChannelFitSummary>,
    channels: Vec<ChannelPosterior>,
}

/// The posterior of one channel, in standard deviations of the prior, and the spread of what it misses.
#[derive(Clone, Debug)]
struct ChannelPosterior {
    channel: FittedChannel,
    free: Vec<FreeParameterPrior>,
    z: DVector<f64>,
    covariance: DMatrix<f64>,
    spread: PredictionVariance,
}

/// Fits samples, which may be of several runs.
///
/// # Errors
/// When they have neither sweeps of slip ratio nor of slip angle, or the start is no tire.
pub fn fit_tire(samples: &[BenchSample], options: &TireFitOptions) -> Result<TireFit, BenchError> {
    fit_tire_to_means(&average_over_revolutions(samples, &options.tire), options)
}

/// As [`fit_tire`], of points that [`average_over_revolutions`] made.
///
/// # Errors
/// As [`fit_tire`].
pub fn fit_tire_to_means(points: &[RevolutionMean], options: &TireFitOptions) -> Result<TireFit, BenchError> {
    let bad = |text: &str| BenchError { file: "bench".to_owned(), line: None, text: text.to_owned() };
    let driven = swept_points(points, |it| it.sample.kappa);
    let turned = swept_points(points, |it| it.sample.alpha);
    if driven.is_empty() && turned.is_empty() {
        return Err(bad(
            "expected sweeps of slip angle or slip ratio by more than 0.05, found none: check the units of both",
        ));
    }
    let mut found = TireFit {
        coefficients: Coefficients { version: MagicFormulaVersion::Mf61, ..options.tire },
        terms: [0.0; COUNT],
        reference: reference_temperature(points),
        estimates: Vec::new(),
        covariance: DMatrix::zeros(0, 0),
        draws: Vec::new(),
        residuals: Vec::new(),
        channels: Vec::new(),
    };
    let with_moment = points.iter().filter(|it| it.sample.M_z.is_finite());
    let with_moment: Vec<RevolutionMean> = with_moment.copied().collect();
    let data = [&driven[..], points, &with_moment];
    for (channel, data) in
        [FittedChannel::Longitudinal, FittedChannel::Lateral, FittedChannel::Aligning].into_iter().zip(data)
    {
        let done = data.is_empty() || found.fit_channel(channel, data, options.extended).is_some();
        if !done {
            return Err(bad(
                "the prior is no tire with these nominal values: check FNOMIN, NOMPRES and UNLOADED_RADIUS",
            ));
        }
    }
    found.join_channels(options);
    Ok(found)
}

/// The points of the blocks that sweep a slip.
fn swept_points(points: &[RevolutionMean], slip: fn(&RevolutionMean) -> f64) -> Vec<RevolutionMean> {
    let blocks = points.chunk_by(|a, b| (a.sample.run, a.sample.block) == (b.sample.run, b.sample.block));
    let wide = |block: &&[RevolutionMean]| value_range(block.iter().map(slip)) > SWEPT;
    blocks.filter(wide).flatten().copied().collect()
}

impl TireFit {
    /// Fits one channel: first with all points taken as independent, then as what their residuals show.
    fn fit_channel(
        &mut self,
        channel: FittedChannel,
        points: &[RevolutionMean],
        extended: bool,
    ) -> Option<()> {
        let mut free = free_coefficients(channel, extended);
        let usual = free.clone();
        let scale =
            points.iter().map(|it| channel.measured_value(it).powi(2)).sum::<f64>() / points.len() as f64;
        let mut problem = ChannelFitProblem {
            channel,
            points,
            free: &usual,
            coefficients: self.coefficients,
            terms: self.terms,
            reference: self.reference,
            // A first guess: 5 % of the force, five points alike.
            weight: 1.0 / (5.0 * 0.0025 * scale),
        };
        let mut solved = problem.minimise(DVector::zeros(free.len()), LIMIT)?;
        if channel == FittedChannel::Lateral
            && self.residuals.iter().any(|it| it.channel == FittedChannel::Longitudinal)
        {
            let similar = by_similarity(&problem.coefficients_and_terms_at(&solved.z).0, free.clone());
            solved.z = DVector::from_fn(free.len(), |k, _| {
                (usual[k].mean + usual[k].std * solved.z[k] - similar[k].mean) / similar[k].std
            });
            free = similar;
            problem = ChannelFitProblem { free: &free, ..problem };
            solved = problem.minimise(solved.z, LIMIT)?;
        }
        let mut correlated = 1.0;
        for _ in 0..2 {
            let rows = problem.residuals_and_gradients(&solved.z, points)?;
            let residuals: Vec<f64> = rows.iter().map(|it| it.0).collect();
            let square = residuals.iter().map(|it| it * it).sum::<f64>() / residuals.len() as f64;
            correlated = integrated_autocorrelation(points, &residuals);
            problem.weight = 1.0 / (correlated * square);
            solved = problem.minimise(solved.z, LIMIT)?;
        }
        let rows = problem.residuals_and_gradients(&solved.z, points)?;
        let square = rows.iter().map(|it| it.0 * it.0).sum::<f64>() / rows.len() as f64;
        let inverse = solved.information.clone().cholesky()?.inverse();
        let covariance = cluster_robust_covariance(&inverse, points, &rows, problem.weight);
        (self.coefficients, self.terms) = problem.coefficients_and_terms_at(&solved.z);
        self.residuals.push(ChannelFitSummary {
            channel,
            points: points.len(),
            rms: square.sqrt(),
            correlated,
            status: solved.status,
            iterations: solved.iterations,
        });
        let spread = PredictionVariance::from_residuals(points, &rows, &solved.information, problem.weight);
        self.channels.push(ChannelPosterior { channel, free, z: solved.z, covariance, spread });
        Some(())
    }

    /// Puts the channels together: estimates, covariance and draws.
    fn join_channels(&mut self, options: &TireFitOptions) {
        let count = self.channels.iter().map(|it| it.free.len()).sum();
        self.covariance = DMatrix::zeros(count, count);
        for fitted in &self.channels {
            let begin = self.estimates.len();
            for (k, free) in fitted.free.iter().enumerate() {
                for (l, other) in fitted.free.iter().enumerate() {
                    self.covariance[(begin + k, begin + l)] =
                        fitted.covariance[(k, l)] * free.std * other.std;
                }
                self.estimates.push(coefficient_estimate(
                    free,
                    fitted.z[k],
                    fitted.covariance[(k, k)].sqrt(),
                ));
            }
        }
        let mut random = Pcg64Mcg::seed_from_u64(options.seed);
        let factors: Vec<_> = self.channels.iter().map(|it| it.covariance.clone().cholesky()).collect();
        self.draws = (0..options.draws)
            .map(|_| {
                let draw = |(fitted, factor): (
                    &ChannelPosterior,
                    &Option<nalgebra::Cholesky<f64, nalgebra::Dyn>>,
                )| {
                    let e = DVector::from_fn(fitted.z.len(), |_, _| StandardNormal.sample(&mut random));
                    let moved = factor.as_ref().map_or(fitted.z.clone(), |it| &fitted.z + it.l() * e);
                    fitted
                        .free
                        .iter()
                        .zip(moved.iter())
                        .map(|(it, z)| it.mean + it.std * z)
                        .collect::<Vec<_>>()
                };
                self.channels.iter().zip(&factors).flat_map(draw).collect()
            })
            .collect();
    }

    /// The value of a channel at a point [N, N m]; `None` for a channel without data.
    pub fn predict_channel(&self, channel: FittedChannel, point: &RevolutionMean) -> Option<f64> {
        self.channels.iter().find(|it| it.channel == channel)?;
        Some(plain_tire_model(&self.coefficients, self.terms, self.reference)?.channel_value(channel, point))
    }

    /// Values of a channel at points, each with half the width of the band that holds 95 % of measured means [N, N m].
    pub fn prediction_bands(
        &self,
        channel: FittedChannel,
        points: &[RevolutionMean],
    ) -> Option<Vec<[f64; 2]>> {
        let fitted = self.channels.iter().find(|it| it.channel == channel)?;
        let problem = ChannelFitProblem {
            channel,
            points,
            free: &fitted.free,
            coefficients: self.coefficients,
            terms: self.terms,
            reference: self.reference,
            weight: 1.0,
        };
        let rows = problem.residuals_and_gradients(&fitted.z, points)?;
        let band = |(point, (residual, by)): (&RevolutionMean, (f64, DVector<f64>))| {
            let model = (&fitted.covariance * &by).dot(&by);
            let variance = fitted.spread.variance_at(point, model);
            [residual + channel.measured_value(point), NORMAL_95 * variance.sqrt()]
        };
        Some(points.iter().zip(rows).map(band).collect())
    }
}

/// What the pure curves say about the fall of F_y with slip ratio before combined slip is measured: forces that depend on normalised slips
/// alone (Pacejka, section 4.3.4) halve at κ = (μ_x / K_x) √(1.9² + 3 (K_y α / μ_y)²), with stiffnesses K divided by load.
fn by_similarity(c: &Coefficients, mut free: Vec<FreeParameterPrior>) -> Vec<FreeParameterPrior> {
    let along = (c.PKX1 / c.PDX1).abs();
    let across = (c.PKY1 * (c.PKY4 * (1.0 / c.PKY2).atan()).sin() / c.PDY1).abs();
    let half = 1.9 / along;
    // The cosine of the weight halves where its angle is 60 degrees.
    let slope = (std::f64::consts::FRAC_PI_3 / 1.05).tan() / half;
    for it in &mut free {
        match it.what.target_name() {
            "RBY1" => (it.mean, it.std) = (slope, 0.2 * slope),
            "RBY2" => (it.mean, it.std) = (0.91 * across, 0.18 * across),
            _ => {}
        }
    }
    free
}

fn coefficient_estimate(free: &FreeParameterPrior, z: f64, ratio: f64) -> CoefficientEstimate {
    let verdict = Identifiability::from_width(ratio);
    let what = match verdict {
        Identifiability::Identified => "the data narrow it",
        Identifiability::Weak => "the data narrow it a little, the prior says the rest",
        Identifiability::NotIdentifiable => "the data say no more than the prior",
    };
    let name = match free.what {
        FittedParameter::Key(key) => key.name,
        FittedParameter::Term(_) => free.what.target_name(),
    };
    CoefficientEstimate {
        name,
        value: free.mean + free.std * z,
        std: free.std * ratio,
        prior_std: free.std,
        verdict,
        reason: format!("{what}: {:.0} % of the prior's width", 100.0 * ratio),
    }
}

/// How many neighbours miss alike: the integrated autocorrelation of the residuals within blocks, up to its first zero.
fn integrated_autocorrelation(points: &[RevolutionMean], residuals: &[f64]) -> f64 {
    let mut sums = [[0.0; 2]; 64];
    let mut begin = 0;
    for block in points.chunk_by(|a, b| (a.sample.run, a.sample.block) == (b.sample.run, b.sample.block)) {
        let own = &residuals[begin..begin + block.len()];
        begin += block.len();
        for (lag, sum) in sums.iter_mut().enumerate() {
            for (a, b) in own.iter().zip(own.iter().skip(lag)) {
                sum[0] += a * b;
                sum[1] += 1.0;
            }
        }
    }
    let mean = |sum: &[f64; 2]| sum[0] / sum[1].max(1.0);
    let positive = sums[1..].iter().map(|sum| mean(sum) / mean(&sums[0])).take_while(|it| *it > 0.0);
    1.0 + 2.0 * positive.sum::<f64>()
}
