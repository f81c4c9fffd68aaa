//! Fits a normal distribution with full covariance to the posterior of prediction errors: variational inference. The result is judged
//! by weights, and is where weighted draws start from.

use nalgebra::{DMatrix, DVector};
use numerics::low_discrepancy::normal_points;
use numerics::psis::WeightDiagnosis;
use numerics::sqp::Objective;
use numerics::variational::LogDensity;
use numerics::variational::assessment::{self, GaussianFitAssessment};
use numerics::variational::gaussian::Gaussian;
use numerics::variational::newton::{self, NewtonLimits};
use rayon::prelude::*;
use tire_inference::axles::{Axle, Axles};
use tire_inference::parameters::TireParameters;
use tire_inference::posterior::PosteriorSamples;
use tire_inference::prior::Prior;
use tire_inference::variational::report::{NonNormalityEvidence, VariationalReport};

use crate::coordinates::UnboundedCoordinates;
use crate::laplace::{LaplaceApproximation, inverse_hessian};
use crate::tires::{SIZE, Tires, from_vector, parameter_indices, to_vector};

/// Points that stand for the standard normal distribution: with their exact covariance they find a normal posterior exactly.
const POINTS: usize = 64;
/// Draws that judge the fit, as many as the posterior gives.
const DRAWS: usize = 2048;
const LIMITS: NewtonLimits = NewtonLimits { tolerance: 1e-2, steps: 15 };

/// The posterior of both axles and of the errors that were estimated with them: the prior of the tires is flat in the box,
/// noises are held. A point is that of the tires, then the errors as [`crate::joint_posterior::JointPosterior`] has them.
pub struct DriveLogPosterior<'a> {
    /// The cost.
    pub objective: &'a dyn Objective,
    /// Errors that are variables after the tires.
    pub errors: usize,
    /// The least cost.
    pub cost: f64,
    /// Of the box.
    pub coordinates: &'a UnboundedCoordinates,
}

impl DriveLogPosterior<'_> {
    /// The tires of a point.
    pub fn tires_at(&self, z: &DVector<f64>) -> Option<Tires> {
        Some(self.coordinates.tires_from_z(&tire_coordinates(z))?.0)
    }

    /// The parameters at which the cost is to be evaluated, and the logarithm of the volume there.
    fn parameters_at(&self, z: &DVector<f64>) -> Option<(DVector<f64>, f64)> {
        let (tires, log_volume) = self.coordinates.tires_from_z(&tire_coordinates(z))?;
        let mut x = z.clone();
        x.rows_mut(0, SIZE).copy_from(&to_vector(&tires));
        Some((x, log_volume))
    }

    /// A normal distribution about a minimum with these second derivatives.
    pub fn normal_at_minimum(
        &self,
        x: &DVector<f64>,
        hessian: &DMatrix<f64>,
    ) -> (DVector<f64>, DMatrix<f64>) {
        let errors = x.len() - SIZE;
        let mut z = x.clone();
        let point = self.coordinates.z_from_tires(&from_vector(x));
        z.rows_mut(0, SIZE).copy_from(&point);
        let of_tires = hessian.view((0, 0), (SIZE, SIZE)).into_owned();
        let cross = hessian.view((0, SIZE), (SIZE, errors));
        let cross = self.coordinates.jacobian(&point).tr_mul(&cross);
        let mut information = hessian.clone();
        let own = self.coordinates.transform_information(&point, &of_tires);
        information.view_mut((0, 0), (SIZE, SIZE)).copy_from(&own);
        information.view_mut((0, SIZE), (SIZE, errors)).copy_from(&cross);
        information.view_mut((SIZE, 0), (errors, SIZE)).copy_from(&cross.transpose());
        (z, inverse_hessian(&information))
    }
}

/// The coordinates of the tires.
fn tire_coordinates(z: &DVector<f64>) -> DVector<f64> {
    z.rows(0, SIZE).into_owned()
}

impl LogDensity for DriveLogPosterior<'_> {
    fn dimension(&self) -> usize {
        SIZE + self.errors
    }

    fn log_density_and_gradient(&self, z: &DVector<f64>) -> (f64, DVector<f64>) {
        let Some((x, log_volume)) = self.parameters_at(z) else {
            return (f64::NEG_INFINITY, DVector::zeros(z.len()));
        };
        let model = self.objective.model(&x);
        let mut gradient = -&model.gradient;
        let of_tires = model.gradient.rows(0, SIZE).into_owned();
        gradient
            .rows_mut(0, SIZE)
            .copy_from(&self.coordinates.transform_gradient(&tire_coordinates(z), &of_tires));
        (self.cost - model.cost + log_volume, gradient)
    }

    /// Less that of the likelihood at the best; −∞ where there is none.
    fn log_densities(&self, points: &[DVector<f64>]) -> Vec<f64> {
        let found: Vec<_> = points.iter().map(|z| self.parameters_at(z)).collect();
        let places: Vec<_> = found.iter().flatten().map(|(x, _)| x.clone()).collect();
        let mut costs = self.objective.costs(&places).into_iter();
        let mut log = |log_volume: f64| costs.next().map(|cost| self.cost - cost + log_volume);
        let logs = found.iter().map(|found| found.as_ref().and_then(|(_, volume)| log(*volume)));
        logs.map(|log| log.unwrap_or(f64::NEG_INFINITY)).collect()
    }

    fn log_densities_and_gradients(&self, points: &[DVector<f64>]) -> Vec<(f64, DVector<f64>)> {
        points.par_iter().map(|z| self.log_density_and_gradient(z)).collect()
    }
}

/// A normal distribution in place of the posterior of both axles.
pub struct VariationalTirePosterior {
    /// Draws from it.
    pub gaussian: Axles<PosteriorSamples>,
    judged: GaussianFitAssessment,
}

impl VariationalTirePosterior {
    /// From a mean and a covariance in the coordinates; `None` if that is not positive definite.
    pub fn fit(
        density: &DriveLogPosterior,
        mean: DVector<f64>,
        covariance: DMatrix<f64>,
        seed: u64,
    ) -> Option<Self> {
        let start = Gaussian { mean, factor: covariance.cholesky()?.l() };
        let fit = |count: usize| {
            let points = normal_points(SIZE, count, seed);
            newton::maximise_elbo(density, start.clone(), &points, LIMITS)
        };
        let judged = assessment::fit_and_assess_gaussian(density, fit, [POINTS; 2], |_| false, DRAWS, seed);
        let gaussian = Axles::from_fn(|axle| {
            let points = judged.draws.points.iter();
            let tires = points.filter_map(|z| density.tires_at(z));
            PosteriorSamples { samples: tires.map(|tires| tires[axle].to_theta()).collect() }
        });
        Some(Self { gaussian, judged })
    }

    /// Its mean and covariance.
    pub fn mean_and_covariance(&self) -> (DVector<f64>, DMatrix<f64>) {
        let Gaussian { mean, factor } = &self.judged.fitted.gaussian;
        (mean.clone(), factor * factor.transpose())
    }

    /// What it says of an axle with a noise of the friction coefficient, weighted draws that start from it having been found to be like
    /// `correction` says, and whether that is to be trusted.
    pub fn axle_report(
        &self,
        axle: Axle,
        laplace: &LaplaceApproximation,
        prior: &Prior,
        noise_std: f64,
        correction: WeightDiagnosis,
        [modes, errors]: [usize; 2],
    ) -> VariationalReport {
        let at_bound = laplace.at_bound(parameter_indices(axle));
        let at_bound = at_bound.into_array().into_iter().zip(TireParameters::<f64>::PARAMETERS);
        let at_bound = at_bound.filter_map(|(stands, parameter)| stands.then_some(parameter));
        let suspicion = NonNormalityEvidence { at_bound: at_bound.collect(), modes, errors };
        let posterior = &self.gaussian[axle];
        let mut report = VariationalReport::new(&self.judged, correction, posterior, prior, noise_std);
        report.apply_evidence(&suspicion);
        report
    }
}
