//! Poses the problem of prediction errors, and fits tires, errors and noises from one start.

use numerics::sqp::{self, SqpLimits, SqpMinimum};
use tire_inference::bounds::Bounds;
use vehicle::SingleTrackCar;

use crate::error::Error;
use crate::error_selection::{ErrorSelection, EstimationMode};
use crate::global::{COARSE, FINE, GlobalOptima, GlobalSearch};
use crate::joint_posterior::JointPosterior;
use crate::likelihood::{DriveLikelihood, DriveNoise, DriveUnknowns};
use crate::noise_estimate::NoiseSpecification;
use crate::progress::CancellationFlag;
use crate::regularisation::TireRegularisation;
use crate::tires::Tires;
use preparation::{Drive, SystematicError, SystematicErrors};

/// Most rounds of noises after all else.
const ROUNDS: usize = 3;
/// Fall of the cost by other noises that is not worth a round [nat].
const SETTLED: f64 = 0.5;

/// What is maximised.
#[derive(Clone)]
pub struct PredictionErrorProblem<'a> {
    /// The car; its own tires are not used.
    pub car: &'a SingleTrackCar,
    /// The recordings.
    pub recordings: &'a [Drive],
    /// The box of each axle.
    pub bounds: Bounds,
    /// What is expected of the tires.
    pub expected: TireRegularisation,
    /// How the noises are found.
    pub noise: NoiseSpecification,
    /// Standard deviations of errors before any data; 0 where there are none.
    pub std: SystematicErrors,
    /// Which errors are estimated.
    pub search: ErrorSelection,
    /// Ends the work.
    pub cancel: CancellationFlag,
}

/// An optimum with what belongs to it.
#[derive(Clone)]
pub struct PredictionErrorFit {
    /// Errors that are estimated.
    pub active: Vec<SystematicError>,
    /// The likelihood near their delays.
    pub likelihood: DriveLikelihood,
    /// The noises.
    pub noise: DriveNoise,
    /// Over tires and errors.
    pub minimum: SqpMinimum,
    /// Whether only the rows count that are left with any delay.
    delayed: bool,
}

impl PredictionErrorProblem<'_> {
    /// Errors that are estimated in any case.
    pub fn always_estimated_errors(&self) -> Vec<SystematicError> {
        let on = |cause: &SystematicError| {
            self.search.mode(*cause) == EstimationMode::On && self.std[*cause] > 0.0
        };
        SystematicError::ALL.into_iter().filter(on).collect()
    }

    /// The likelihood, with channels moved by the delays among some unknowns.
    pub fn build_likelihood(&self, delayed: Option<&DriveUnknowns>) -> DriveLikelihood {
        let mut likelihood = match delayed {
            Some(at) => DriveLikelihood::with_delays(self.car, self.recordings, at),
            None => DriveLikelihood::new(self.car, self.recordings),
        };
        likelihood.cancel = self.cancel.clone();
        likelihood
    }

    /// The cost of tires and causes.
    pub fn joint_posterior<'b>(
        &self,
        likelihood: &'b DriveLikelihood,
        noise: DriveNoise,
        active: &[SystematicError],
    ) -> JointPosterior<'b> {
        let (expected, std) = (self.expected, self.std);
        let held = SystematicErrors::default();
        JointPosterior { likelihood, noise, expected, active: active.to_vec(), held, std }
    }

    /// Looks for all optima over the tires, with errors held.
    ///
    /// # Errors
    ///
    /// [`Error::NoStart`] if no start gave a finite cost.
    pub fn search_tires(
        &self,
        likelihood: &DriveLikelihood,
        noise: DriveNoise,
        held: SystematicErrors,
        starts: &[Tires],
    ) -> Result<GlobalOptima, Error> {
        let joint = JointPosterior { held, ..self.joint_posterior(likelihood, noise, &[]) };
        GlobalSearch { joint, bounds: self.bounds, noise: self.noise }.find_optima(starts)
    }

    /// What a fit found.
    pub fn fitted_unknowns(&self, fit: &PredictionErrorFit) -> DriveUnknowns {
        self.joint_posterior(&fit.likelihood, fit.noise, &fit.active).unknowns_at(&fit.minimum.x)
    }

    /// Fits tires and some causes roughly, and the noises in turn with them: on all rows, if no sensor errs.
    pub fn fit_roughly(&self, active: Vec<SystematicError>, start: DriveUnknowns) -> PredictionErrorFit {
        let of_car = active.iter().all(|cause| SystematicError::CAR.contains(cause));
        self.fit_rows(active, start, !of_car, ROUNDS, COARSE)
    }

    /// The same on the rows that are left with any delay.
    pub fn fit_delayed_rows(&self, active: Vec<SystematicError>, start: DriveUnknowns) -> PredictionErrorFit {
        self.fit_rows(active, start, true, ROUNDS, COARSE)
    }

    /// The same under the noises of the start, as well as a comparison needs it.
    pub fn fit_at_fixed_noise(
        &self,
        active: Vec<SystematicError>,
        start: DriveUnknowns,
    ) -> PredictionErrorFit {
        self.fit_rows(active, start, true, 0, COARSE)
    }

    /// Fits the tires alone under the noises of the start, on all rows.
    pub fn fit_tires_at_fixed_noise(&self, start: DriveUnknowns) -> PredictionErrorFit {
        self.fit_rows(Vec::new(), start, false, 0, COARSE)
    }

    /// The causes and rows of a rough fit with all digits, from a start.
    pub fn refine_fit(&self, rough: &PredictionErrorFit, start: DriveUnknowns) -> PredictionErrorFit {
        self.fit_rows(rough.active.clone(), start, rough.delayed, ROUNDS, FINE)
    }

    fn fit_rows(
        &self,
        active: Vec<SystematicError>,
        start: DriveUnknowns,
        delayed: bool,
        rounds: usize,
        limits: SqpLimits,
    ) -> PredictionErrorFit {
        let mut at = start;
        let mut evaluations = 0;
        let mut best: Option<PredictionErrorFit> = None;
        for round in 0..=rounds {
            let likelihood = self.build_likelihood(delayed.then_some(&at));
            if round > 0 {
                let (noise, more) = self.noise.estimate_noise(&likelihood, &at);
                evaluations += more;
                let better = DriveUnknowns { noise, ..at };
                let settled = likelihood.cost(&at) - likelihood.cost(&better) < SETTLED;
                let serves = |fit: &PredictionErrorFit| fit.likelihood.is_valid_for(&at, self.recordings);
                if settled && best.as_ref().is_some_and(serves) {
                    break;
                }
                at = better;
            }
            let joint = self.joint_posterior(&likelihood, at.noise, &active);
            let [lower, upper] = joint.box_corners(&self.bounds);
            let from = joint.x_from_parameters(&at.tires, &at.causes);
            let minimum = sqp::minimise_sqp(&joint, &lower, &upper, &from, limits);
            evaluations += minimum.evaluations;
            at = joint.unknowns_at(&minimum.x);
            let noise = at.noise;
            best = Some(PredictionErrorFit { active: active.clone(), likelihood, noise, minimum, delayed });
        }
        let mut fit = best.unwrap_or_else(|| unreachable!("the first round always fits"));
        fit.minimum.evaluations = evaluations;
        fit
    }
}
