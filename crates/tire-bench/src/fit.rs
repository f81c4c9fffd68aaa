//! Fits a tire to the data of a bench: F_x, F_y and M_z one after the other, each with a posterior, verdicts and bands.
#![allow(non_snake_case, reason = "symbols as in Pacejka, Tire and Vehicle Dynamics")]

use nalgebra::{DMatrix, DVector};
use numerics::convergence::Status;
use numerics::identifiability::Verdict;
use numerics::statistics::NORMAL_95;
use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64Mcg;
use tire::{Coefficients, Version};

use crate::condition::{Point, condition, reference};
use crate::model::{COUNT, Channel, plain};
use crate::prior::{FitTarget, FreeCoefficient, free};
use crate::sample::{BenchError, SWEPT, Sample, range};
use crate::solve::Problem;
use crate::spread::{Spread, clustered};

/// Largest number of iterations for one channel.
const LIMIT: usize = 80;

/// What a fit takes beside the data.
#[derive(Clone, Debug)]
pub struct Options {
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
pub struct Estimate {
    /// Its key.
    pub name: &'static str,
    /// Its value at the optimum.
    pub value: f64,
    /// Standard deviation of the posterior.
    pub std: f64,
    /// Standard deviation of the prior.
    pub prior_std: f64,
    /// What the data tell.
    pub verdict: Verdict,
    /// Why.
    pub reason: String,
}

/// How a channel was fitted.
#[derive(Clone, Debug, PartialEq)]
pub struct Residuals {
    /// The channel.
    pub channel: Channel,
    /// Points that it was fitted to.
    pub points: usize,
    /// Root mean square of the residuals [N, N m].
    pub rms: f64,
    /// Points that count as one independent one, since neighbours miss alike.
    pub correlated: f64,
    /// How the minimisation ended.
    pub status: Status,
    /// Its iterations.
    pub iterations: usize,
}

/// A fitted tire with its posterior.
#[derive(Clone, Debug)]
pub struct Fit {
    /// The coefficients at the optimum; SI, ISO-W.
    pub coefficients: Coefficients,
    /// The terms at the optimum, in the order of [`crate::TERMS`].
    pub terms: [f64; COUNT],
    /// The temperature of tread and carcass at which the terms of temperature are 0 [K].
    pub reference: f64,
    /// All that was free, channel by channel.
    pub estimates: Vec<Estimate>,
    /// Covariance of the estimates; 0 between channels.
    pub covariance: DMatrix<f64>,
    /// Joint draws of the estimates, one a row.
    pub draws: Vec<Vec<f64>>,
    /// How each channel was fitted.
    pub residuals: Vec<Residuals>,
    channels: Vec<ChannelFit>,
}

/// The posterior of one channel, in standard deviations of the prior, and the spread of what it misses.
#[derive(Clone, Debug)]
struct ChannelFit {
    channel: Channel,
    free: Vec<FreeCoefficient>,
    z: DVector<f64>,
    covariance: DMatrix<f64>,
    spread: Spread,
}

/// Fits samples, which may be of several runs.
///
/// # Errors
/// When they have neither sweeps of slip ratio nor of slip angle, or the start is no tire.
pub fn fit(samples: &[Sample], options: &Options) -> Result<Fit, BenchError> {
    fit_points(&condition(samples, &options.tire), options)
}

/// As [`fit`], of points that [`condition`] made.
///
/// # Errors
/// As [`fit`].
pub fn fit_points(points: &[Point], options: &Options) -> Result<Fit, BenchError> {
    let bad =
        |text: &str| BenchError { file: "bench".to_owned(), line: None, text: text.to_owned() };
    let driven = swept(points, |it| it.sample.kappa);
    let turned = swept(points, |it| it.sample.alpha);
    if driven.is_empty() && turned.is_empty() {
        return Err(bad(
            "expected sweeps of slip angle or slip ratio by more than 0.05, found none: check the units of both",
        ));
    }
    let mut found = Fit {
        coefficients: Coefficients { version: Version::Mf61, ..options.tire },
        terms: [0.0; COUNT],
        reference: reference(points),
        estimates: Vec::new(),
        covariance: DMatrix::zeros(0, 0),
        draws: Vec::new(),
        residuals: Vec::new(),
        channels: Vec::new(),
    };
    let with_moment = points.iter().filter(|it| it.sample.M_z.is_finite());
    let with_moment: Vec<Point> = with_moment.copied().collect();
    let data = [&driven[..], points, &with_moment];
    for (channel, data) in
        [Channel::Longitudinal, Channel::Lateral, Channel::Aligning].into_iter().zip(data)
    {
        let done = data.is_empty() || found.channel(channel, data, options.extended).is_some();
        if !done {
            return Err(bad(
                "the prior is no tire with these nominal values: check FNOMIN, NOMPRES and UNLOADED_RADIUS",
            ));
        }
    }
    found.join(options);
    Ok(found)
}

/// The points of the blocks that sweep a slip.
fn swept(points: &[Point], slip: fn(&Point) -> f64) -> Vec<Point> {
    let blocks =
        points.chunk_by(|a, b| (a.sample.run, a.sample.block) == (b.sample.run, b.sample.block));
    let wide = |block: &&[Point]| range(block.iter().map(slip)) > SWEPT;
    blocks.filter(wide).flatten().copied().collect()
}

impl Fit {
    /// Fits one channel: first with all points taken as independent, then as what their residuals show.
    fn channel(&mut self, channel: Channel, points: &[Point], extended: bool) -> Option<()> {
        let mut free = free(channel, extended);
        let usual = free.clone();
        let scale =
            points.iter().map(|it| channel.measured(it).powi(2)).sum::<f64>() / points.len() as f64;
        let mut problem = Problem {
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
        if channel == Channel::Lateral
            && self.residuals.iter().any(|it| it.channel == Channel::Longitudinal)
        {
            let similar = by_similarity(&problem.at(&solved.z).0, free.clone());
            solved.z = DVector::from_fn(free.len(), |k, _| {
                (usual[k].mean + usual[k].std * solved.z[k] - similar[k].mean) / similar[k].std
            });
            free = similar;
            problem = Problem { free: &free, ..problem };
            solved = problem.minimise(solved.z, LIMIT)?;
        }
        let mut correlated = 1.0;
        for _ in 0..2 {
            let rows = problem.rows(&solved.z, points)?;
            let residuals: Vec<f64> = rows.iter().map(|it| it.0).collect();
            let square = residuals.iter().map(|it| it * it).sum::<f64>() / residuals.len() as f64;
            correlated = alike(points, &residuals);
            problem.weight = 1.0 / (correlated * square);
            solved = problem.minimise(solved.z, LIMIT)?;
        }
        let rows = problem.rows(&solved.z, points)?;
        let square = rows.iter().map(|it| it.0 * it.0).sum::<f64>() / rows.len() as f64;
        let inverse = solved.normal.matrix.clone().cholesky()?.inverse();
        let covariance = clustered(&inverse, points, &rows, problem.weight);
        (self.coefficients, self.terms) = problem.at(&solved.z);
        self.residuals.push(Residuals {
            channel,
            points: points.len(),
            rms: square.sqrt(),
            correlated,
            status: solved.status,
            iterations: solved.iterations,
        });
        let spread = Spread::of(points, &rows, &solved.normal, problem.weight);
        self.channels.push(ChannelFit { channel, free, z: solved.z, covariance, spread });
        Some(())
    }

    /// Puts the channels together: estimates, covariance and draws.
    fn join(&mut self, options: &Options) {
        let count = self.channels.iter().map(|it| it.free.len()).sum();
        self.covariance = DMatrix::zeros(count, count);
        for fitted in &self.channels {
            let begin = self.estimates.len();
            for (k, free) in fitted.free.iter().enumerate() {
                for (l, other) in fitted.free.iter().enumerate() {
                    self.covariance[(begin + k, begin + l)] =
                        fitted.covariance[(k, l)] * free.std * other.std;
                }
                self.estimates.push(estimate(free, fitted.z[k], fitted.covariance[(k, k)].sqrt()));
            }
        }
        let mut random = Pcg64Mcg::seed_from_u64(options.seed);
        let factors: Vec<_> =
            self.channels.iter().map(|it| it.covariance.clone().cholesky()).collect();
        self.draws = (0..options.draws)
            .map(|_| {
                let draw = |(fitted, factor): (
                    &ChannelFit,
                    &Option<nalgebra::Cholesky<f64, nalgebra::Dyn>>,
                )| {
                    let e =
                        DVector::from_fn(fitted.z.len(), |_, _| StandardNormal.sample(&mut random));
                    let moved =
                        factor.as_ref().map_or(fitted.z.clone(), |it| &fitted.z + it.l() * e);
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
    pub fn predict(&self, channel: Channel, point: &Point) -> Option<f64> {
        self.channels.iter().find(|it| it.channel == channel)?;
        Some(plain(&self.coefficients, self.terms, self.reference)?.value(channel, point))
    }

    /// Values of a channel at points, each with half the width of the band that holds 95 % of measured means [N, N m].
    pub fn bands(&self, channel: Channel, points: &[Point]) -> Option<Vec<[f64; 2]>> {
        let fitted = self.channels.iter().find(|it| it.channel == channel)?;
        let problem = Problem {
            channel,
            points,
            free: &fitted.free,
            coefficients: self.coefficients,
            terms: self.terms,
            reference: self.reference,
            weight: 1.0,
        };
        let rows = problem.rows(&fitted.z, points)?;
        let band = |(point, (residual, by)): (&Point, (f64, DVector<f64>))| {
            let model = (&fitted.covariance * &by).dot(&by);
            let variance = fitted.spread.variance(point, model);
            [residual + channel.measured(point), NORMAL_95 * variance.sqrt()]
        };
        Some(points.iter().zip(rows).map(band).collect())
    }
}

/// What the pure curves say about the fall of F_y with slip ratio before combined slip is measured: forces that depend on normalised slips
/// alone (Pacejka, section 4.3.4) halve at κ = (μ_x / K_x) √(1.9² + 3 (K_y α / μ_y)²), with stiffnesses K divided by load.
fn by_similarity(c: &Coefficients, mut free: Vec<FreeCoefficient>) -> Vec<FreeCoefficient> {
    let along = (c.PKX1 / c.PDX1).abs();
    let across = (c.PKY1 * (c.PKY4 * (1.0 / c.PKY2).atan()).sin() / c.PDY1).abs();
    let half = 1.9 / along;
    // The cosine of the weight halves where its angle is 60 degrees.
    let slope = (std::f64::consts::FRAC_PI_3 / 1.05).tan() / half;
    for it in &mut free {
        match it.what.name() {
            "RBY1" => (it.mean, it.std) = (slope, 0.2 * slope),
            "RBY2" => (it.mean, it.std) = (0.91 * across, 0.18 * across),
            _ => {}
        }
    }
    free
}

fn estimate(free: &FreeCoefficient, z: f64, ratio: f64) -> Estimate {
    let verdict = Verdict::from_width(ratio);
    let what = match verdict {
        Verdict::Identified => "the data narrow it",
        Verdict::Weak => "the data narrow it a little, the prior says the rest",
        Verdict::NotIdentifiable => "the data say no more than the prior",
    };
    let name = match free.what {
        FitTarget::Key(key) => key.name,
        FitTarget::Term(_) => free.what.name(),
    };
    Estimate {
        name,
        value: free.mean + free.std * z,
        std: free.std * ratio,
        prior_std: free.std,
        verdict,
        reason: format!("{what}: {:.0} % of the prior's width", 100.0 * ratio),
    }
}

/// How many neighbours miss alike: the integrated autocorrelation of the residuals within blocks, up to its first zero.
fn alike(points: &[Point], residuals: &[f64]) -> f64 {
    let mut sums = [[0.0; 2]; 64];
    let mut begin = 0;
    for block in
        points.chunk_by(|a, b| (a.sample.run, a.sample.block) == (b.sample.run, b.sample.block))
    {
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
    let positive =
        sums[1..].iter().map(|sum| mean(sum) / mean(&sums[0])).take_while(|it| *it > 0.0);
    1.0 + 2.0 * positive.sum::<f64>()
}
