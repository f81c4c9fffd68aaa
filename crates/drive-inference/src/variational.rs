//! Fits a normal distribution with full covariance to the posterior of prediction errors: variational inference. The result is judged
//! by weights, and is where weighted draws start from.

use nalgebra::{DMatrix, DVector};
use numerics::low_discrepancy::normal_points;
use numerics::psis::Diagnosis;
use numerics::variational::LogDensity;
use numerics::variational::gaussian::Gaussian;
use numerics::variational::judged::{self, Judged};
use numerics::variational::newton::{self, Limits};
use rayon::prelude::*;
use tire_inference::axles::{Axle, Axles};
use tire_inference::parameters::TireParameters;
use tire_inference::posterior::PosteriorSamples;
use tire_inference::prior::Prior;
use tire_inference::variational::report::{Suspicion, VariationalReport};

use crate::coordinates::Coordinates;
use crate::explored::Explored;
use crate::tires::{SIZE, indices, to_vector};

/// Points that stand for the standard normal distribution: with their exact covariance they find a normal posterior exactly.
const POINTS: usize = 64;
/// Draws that judge the fit, as many as the posterior gives.
const DRAWS: usize = 2048;
const LIMITS: Limits = Limits { tolerance: 1e-2, steps: 15 };

/// The posterior of both axles: the prior is flat in the box, noises are held.
pub struct DriveDensity<'a> {
    /// The cost about its minimum.
    pub explored: &'a Explored<'a>,
    /// Of its box.
    pub coordinates: &'a Coordinates,
}

impl LogDensity for DriveDensity<'_> {
    fn dimension(&self) -> usize {
        SIZE
    }

    fn at(&self, z: &DVector<f64>) -> (f64, DVector<f64>) {
        let Some((tires, log_volume)) = self.coordinates.parameters(z) else {
            return (f64::NEG_INFINITY, DVector::zeros(SIZE));
        };
        let model = self.explored.objective.model(&to_vector(&tires));
        let log = self.explored.cost - model.cost + log_volume;
        (log, self.coordinates.gradient(z, &model.gradient))
    }

    /// Less that of the likelihood at the best; −∞ where there is none.
    fn logs(&self, points: &[DVector<f64>]) -> Vec<f64> {
        let found: Vec<_> = points.iter().map(|z| self.coordinates.parameters(z)).collect();
        let tires = found.iter().flatten().map(|(tires, _)| to_vector(tires));
        let costs = self.explored.objective.costs(&tires.collect::<Vec<_>>());
        let mut costs = costs.into_iter();
        let mut log =
            |log_volume: f64| costs.next().map(|cost| self.explored.cost - cost + log_volume);
        let logs = found.iter().map(|found| found.as_ref().and_then(|(_, volume)| log(*volume)));
        logs.map(|log| log.unwrap_or(f64::NEG_INFINITY)).collect()
    }

    fn all_at(&self, points: &[DVector<f64>]) -> Vec<(f64, DVector<f64>)> {
        points.par_iter().map(|z| self.at(z)).collect()
    }
}

/// A normal distribution in place of the posterior of both axles.
pub struct Variational {
    /// Draws from it.
    pub gaussian: Axles<PosteriorSamples>,
    judged: Judged,
}

impl Variational {
    /// From a mean and a covariance in the coordinates; `None` if that is not positive definite.
    pub fn fit(
        density: &DriveDensity,
        (mean, covariance): (DVector<f64>, DMatrix<f64>),
        seed: u64,
    ) -> Option<Self> {
        let start = Gaussian { mean, factor: covariance.cholesky()?.l() };
        let fit = |count: usize| {
            let points = normal_points(SIZE, count, seed);
            newton::maximise(density, start.clone(), &points, LIMITS)
        };
        let judged = judged::fit(density, fit, [POINTS; 2], |_| false, (DRAWS, seed));
        let gaussian = Axles::new(|axle| {
            let points = judged.draws.points.iter();
            let tires = points.filter_map(|z| density.coordinates.parameters(z));
            PosteriorSamples { samples: tires.map(|(tires, _)| tires[axle].theta()).collect() }
        });
        Some(Self { gaussian, judged })
    }

    /// Its mean and covariance.
    pub fn moments(&self) -> (DVector<f64>, DMatrix<f64>) {
        let Gaussian { mean, factor } = &self.judged.fitted.gaussian;
        (mean.clone(), factor * factor.transpose())
    }

    /// What it says of an axle with a noise of the friction coefficient, weighted draws that start from it having been found to be like
    /// `correction` says, and whether that is to be trusted.
    pub fn report(
        &self,
        axle: Axle,
        (explored, prior): (&Explored, &Prior),
        noise_std: f64,
        correction: Diagnosis,
        modes: usize,
    ) -> VariationalReport {
        let at_bound = explored.at_bound(indices(axle));
        let at_bound = at_bound.into_array().into_iter().zip(TireParameters::<f64>::PARAMETERS);
        let at_bound = at_bound.filter_map(|(stands, parameter)| stands.then_some(parameter));
        let suspicion = Suspicion { at_bound: at_bound.collect(), modes };
        let posterior = &self.gaussian[axle];
        let mut report =
            VariationalReport::new(&self.judged, correction, posterior, prior, noise_std);
        report.suspect(&suspicion);
        report
    }
}
