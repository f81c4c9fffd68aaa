//! Fits a normal distribution with full covariance to the posterior of prediction errors: variational inference, whose result is judged
//! by weights, and is where weighted draws start from.

use std::time::Instant;

use nalgebra::{DMatrix, DVector};
use numerics::low_discrepancy::{log_normal, normal_points};
use numerics::psis::{self, Diagnosis};
use numerics::variational::LogDensity;
use numerics::variational::gaussian::Gaussian;
use numerics::variational::newton::{self, Fitted, Limits};
use rand::{RngExt, SeedableRng};
use rand_distr::StandardNormal;
use rand_pcg::Pcg64;
use rayon::prelude::*;
use tire_inference::parameters::Parameter;
use tire_inference::posterior::Posterior;
use tire_inference::prior::Prior;
use tire_inference::variational::report::{Report, Summary, Suspicion, warning};

use crate::coordinates::Coordinates;
use crate::likelihood::Theta8;
use crate::profile::Explored;

/// Points that stand for the standard normal distribution: with their exact covariance they find a normal posterior exactly.
const POINTS: usize = 64;
/// Draws that judge the fit.
const DRAWS: usize = 1024;
const LIMITS: Limits = Limits { tolerance: 1e-2, steps: 15 };

/// The posterior of both axles: the prior is flat in the box, noises are held.
pub struct DriveDensity<'a> {
    /// The cost about its minimum.
    pub explored: &'a Explored<'a>,
    /// Of its box.
    pub coordinates: &'a Coordinates,
}

impl DriveDensity<'_> {
    /// Logarithms at several points, less that of the likelihood at the best; −∞ where there is none.
    pub fn logs(&self, points: &[DVector<f64>]) -> Vec<f64> {
        let found: Vec<_> = points.iter().map(|z| self.coordinates.parameters(z)).collect();
        let tires = found.iter().flatten().map(|(theta, _)| DVector::from_column_slice(theta));
        let costs = self.explored.objective.costs(&tires.collect::<Vec<_>>());
        let mut costs = costs.into_iter();
        let mut log = |(_, log_volume): &(Theta8, f64)| {
            costs.next().map(|cost| self.explored.cost - cost + log_volume)
        };
        let logs = found.iter().map(|found| found.as_ref().and_then(&mut log));
        logs.map(|log| log.unwrap_or(f64::NEG_INFINITY)).collect()
    }
}

impl LogDensity for DriveDensity<'_> {
    fn dimension(&self) -> usize {
        8
    }

    fn at(&self, z: &DVector<f64>) -> (f64, DVector<f64>) {
        let Some((theta, log_volume)) = self.coordinates.parameters(z) else {
            return (f64::NEG_INFINITY, DVector::zeros(8));
        };
        let model = self.explored.objective.model(&DVector::from_column_slice(&theta));
        let log = self.explored.cost - model.cost + log_volume;
        (log, self.coordinates.gradient(z, &model.gradient))
    }

    fn all_at(&self, points: &[DVector<f64>]) -> Vec<(f64, DVector<f64>)> {
        points.par_iter().map(|z| self.at(z)).collect()
    }
}

/// A normal distribution in place of the posterior of both axles.
pub struct Variational {
    /// Draws from it, of the front and the rear axle.
    pub gaussian: [Posterior; 2],
    fitted: Fitted,
    diagnosis: Diagnosis,
    elbo: f64,
    seconds: f64,
}

impl Variational {
    /// From a mean and a covariance in the coordinates; `None` if that is not positive definite.
    pub fn fit(
        density: &DriveDensity,
        (mean, covariance): (DVector<f64>, DMatrix<f64>),
        seed: u64,
    ) -> Option<Self> {
        let begin = Instant::now();
        let start = Gaussian { mean, factor: covariance.cholesky()?.l() };
        let fitted = newton::maximise(density, start, &normal_points(8, POINTS, seed), LIMITS);
        // Not the stream of the points.
        let mut random = Pcg64::seed_from_u64(!seed);
        let deviate = |_| DVector::from_fn(8, |_, _| random.sample::<f64, _>(StandardNormal));
        let deviates: Vec<DVector<f64>> = (0..DRAWS).map(deviate).collect();
        let points: Vec<_> = deviates.iter().map(|e| fitted.gaussian.at(e)).collect();
        let log_volume = fitted.gaussian.log_volume();
        let logs = density.logs(&points).into_iter().zip(&deviates);
        let log_weights: Vec<f64> =
            logs.map(|(log, e)| log - (log_normal(e) - log_volume)).collect();
        let gaussian = [0, 4].map(|o| {
            let tires = points.iter().filter_map(|z| density.coordinates.parameters(z));
            Posterior { draws: tires.map(|(theta, _)| of_axle(&theta, o)).collect() }
        });
        Some(Self {
            gaussian,
            fitted,
            diagnosis: psis::smooth(&log_weights).0,
            elbo: log_weights.iter().sum::<f64>() / DRAWS as f64,
            seconds: begin.elapsed().as_secs_f64(),
        })
    }

    /// Its mean and covariance.
    pub fn moments(&self) -> (DVector<f64>, DMatrix<f64>) {
        let Gaussian { mean, factor } = &self.fitted.gaussian;
        (mean.clone(), factor * factor.transpose())
    }

    /// What it says of an axle with a noise of the friction coefficient, weighted draws that start from it having been found to be like
    /// `correction` says, and whether that is to be trusted.
    pub fn report(
        &self,
        axle: usize,
        explored: &Explored,
        noise_std: f64,
        correction: Diagnosis,
        modes: usize,
    ) -> Report {
        let o = 4 * axle;
        let [lower, upper] = &explored.corners;
        let free = &Parameter::ALL[..4];
        let mut prior = Prior::lateral();
        prior.free = std::array::from_fn(|i| i < 4);
        for i in 0..4 {
            (prior.bounds.lower[i], prior.bounds.upper[i]) = (lower[o + i], upper[o + i]);
        }
        let stands = |p: &&Parameter| {
            let i = o + **p as usize;
            explored.x[i] <= lower[i] || explored.x[i] >= upper[i]
        };
        let suspicion =
            Suspicion { at_bound: free.iter().filter(stands).copied().collect(), modes };
        let Fitted { status, gradient_norm, steps, trace, evaluations, .. } = &self.fitted;
        let weights = [&self.diagnosis, &correction];
        let warning = warning((*status, *gradient_norm), weights, &suspicion);
        let Summary { mean, std, interval } = Summary::of(&self.gaussian[axle], &prior);
        Report {
            trusted: warning.is_none(),
            warning,
            mean,
            std,
            interval,
            parameters: free.iter().map(|p| p.name().to_owned()).collect(),
            covariance: self.gaussian[axle].covariance(free),
            noise_std,
            status: *status,
            gradient_norm: *gradient_norm,
            steps: *steps,
            points: POINTS,
            evaluations: evaluations + DRAWS,
            elbo: self.elbo,
            elbo_trace: trace.clone(),
            diagnosis: self.diagnosis,
            correction,
            seconds: self.seconds,
        }
    }
}

/// The tire of the axle whose parameters begin at a place.
pub fn of_axle(theta: &Theta8, o: usize) -> tire_inference::parameters::Theta {
    [theta[o], theta[o + 1], theta[o + 2], theta[o + 3], 0.0, 0.0]
}
