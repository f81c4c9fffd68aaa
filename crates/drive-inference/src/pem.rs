//! Maximises the likelihood of prediction errors over the parameters of both tires, the noises, and errors of sensors and car.

use nalgebra::{DMatrix, DVector};
use numerics::convergence::ConvergenceReport;
use numerics::sqp::{self, SqpMinimum};

use crate::error::Error;
use crate::global::{FINE, GlobalOptima};
use crate::input_selection;
use crate::likelihood::{DriveLikelihood, DriveUnknowns};
use crate::model_selection::{self, ModelExtension};
use crate::problem::{PredictionErrorFit, PredictionErrorProblem};
use crate::search::{convergence_report, distinct_minima};
use crate::tires::{Tires, from_vector};
use preparation::{Drive, InputInterpolations, SystematicError, SystematicErrors};

/// How often inputs between rows are chosen again.
const MOST_INPUTS: usize = 2;

/// The best fit of a formulation with what belongs to it.
#[derive(Clone)]
pub struct SelectedFit {
    /// The likelihood, with channels moved by the delays that were found.
    pub likelihood: DriveLikelihood,
    /// Tires, errors and noises, estimated or as given.
    pub unknowns: DriveUnknowns,
    /// Errors that were estimated, in the order of the minimum's variables.
    pub active: Vec<SystematicError>,
    /// Gain of what the data asked for [nat].
    pub gains: Vec<(ModelExtension, f64)>,
    /// The minimum of the negative logarithm, for its second derivatives.
    pub minimum: SqpMinimum,
    /// Different optima, best first.
    pub optima: Vec<LocalLikelihoodOptimum>,
    /// How it was reached.
    pub convergence: ConvergenceReport,
    /// How the inputs move between rows.
    pub interpolation: InputInterpolations,
}

impl SelectedFit {
    /// The cost with what each addition has to gain [nat].
    fn penalised_cost(&self) -> f64 {
        self.minimum.model.cost + model_selection::ENOUGH * self.gains.len() as f64
    }
}

/// One of several optima.
#[derive(Clone, Debug)]
pub struct LocalLikelihoodOptimum {
    /// Tires and errors.
    pub x: DVector<f64>,
    /// The cost there.
    pub cost: f64,
    /// Its second derivatives.
    pub hessian: DMatrix<f64>,
}

impl PredictionErrorProblem<'_> {
    /// Maximises from all starts. Where the data ask for errors, inputs between rows are chosen again, as they were chosen before the errors
    /// were known.
    ///
    /// # Errors
    ///
    /// [`Error::NoStart`] if no start gave a finite cost.
    pub fn maximise_likelihood(&self, starts: &[Tires]) -> Result<SelectedFit, Error> {
        let mut best = self.maximise_under_inputs(starts)?;
        let mut recordings = self.recordings.to_vec();
        for _ in 0..MOST_INPUTS {
            if best.gains.is_empty() || self.cancel.is_cancelled() {
                break;
            }
            let problem = PredictionErrorProblem { recordings: &recordings, ..self.clone() };
            let Some(likelier) = input_selection::likelier_interpolations(&problem, &best.unknowns) else {
                break;
            };
            recordings = input_selection::with_interpolations(self.recordings, likelier);
            let problem = PredictionErrorProblem { recordings: &recordings, ..self.clone() };
            let other = problem.maximise_under_inputs(&[best.unknowns.tires])?;
            if other.penalised_cost() >= best.penalised_cost() {
                break;
            }
            best = other;
        }
        Ok(best)
    }

    /// Maximises from all starts and from others along their ridges.
    fn maximise_under_inputs(&self, starts: &[Tires]) -> Result<SelectedFit, Error> {
        let plain = self.build_likelihood(None);
        let first =
            self.search_tires(&plain, self.noise.initial_noise(), SystematicErrors::default(), starts)?;
        let GlobalOptima { noise, mut starts, mut evaluations, minima } = first;
        let tires: Vec<Tires> = minima.iter().map(|m| from_vector(&m.x)).collect();
        let active = self.always_estimated_errors();
        let mut start = DriveUnknowns::new(&tires[0], &noise);
        if active.iter().any(|cause| SystematicError::TIRES.contains(cause)) {
            start.causes.set_initial_relaxation();
        }
        let first = self.fit_roughly(active, start);
        evaluations += first.minimum.evaluations;
        let (fit, gains) = model_selection::select_errors(self, first);
        let mut fits = vec![self.refine_fit(&fit, self.fitted_unknowns(&fit))];
        evaluations += fits[0].minimum.evaluations;
        let mut others = tires[1..].to_vec();
        if !gains.is_empty() {
            // What was an optimum for wrong sensors need not be one for the right ones.
            let DriveUnknowns { causes, tires, noise, .. } = self.fitted_unknowns(&fits[0]);
            let likelihood = &fits[0].likelihood;
            let again = self.search_tires(likelihood, noise, causes, &[tires])?;
            (starts, evaluations) = (starts + again.starts, evaluations + again.evaluations);
            others = again.minima.iter().map(|m| from_vector(&m.x)).collect();
        }
        for tires in others {
            let start = DriveUnknowns { tires, ..self.fitted_unknowns(&fits[0]) };
            // On the rows of the first, as their costs are compared.
            let other = self.refine_fit(&fits[0], start);
            evaluations += other.minimum.evaluations;
            fits.push(other);
        }
        Ok(self.best_maximum(fits, gains, starts, evaluations))
    }

    /// The best of several fits with the same causes. The others are measured under its noise.
    fn best_maximum(
        &self,
        fits: Vec<PredictionErrorFit>,
        gains: Vec<(ModelExtension, f64)>,
        starts: usize,
        evaluations: usize,
    ) -> SelectedFit {
        let mut fits = fits;
        fits.sort_by(|a, b| a.minimum.model.cost.total_cmp(&b.minimum.model.cost));
        let mut rest = fits.split_off(1);
        let PredictionErrorFit { active, likelihood, noise, minimum, .. } = fits.remove(0);
        let joint = self.joint_posterior(&likelihood, noise, &active);
        let [lower, upper] = joint.box_corners(&self.bounds);
        let mut minima = vec![minimum];
        for fit in rest.drain(..) {
            minima.push(sqp::minimise_sqp(&joint, &lower, &upper, &fit.minimum.x, FINE));
        }
        let minima = distinct_minima(minima, f64::INFINITY);
        let minimum = minima[0].clone();
        let unknowns = joint.unknowns_at(&minimum.x);
        let optimum = |SqpMinimum { x, model, .. }: SqpMinimum| LocalLikelihoodOptimum {
            x,
            cost: model.cost,
            hessian: model.hessian,
        };
        let optima: Vec<_> = minima.into_iter().map(optimum).collect();
        let convergence = convergence_report(&minimum, starts, optima.len(), evaluations);
        let interpolation = Drive::common_interpolation(self.recordings);
        SelectedFit { unknowns, active, gains, minimum, optima, convergence, likelihood, interpolation }
    }
}
