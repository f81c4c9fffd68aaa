//! Poses the problem of prediction errors, and fits tires, errors and noises from one start.

use numerics::sqp::{self, Limits, Minimum};
use tire_inference::bounds::Bounds;
use vehicle::Vehicle;

use crate::error::Error;
use crate::error_selection::{ErrorSelection, Mode};
use crate::global::{COARSE, FINE, Optima, Search};
use crate::joint_posterior::JointPosterior;
use crate::likelihood::{DriveNoise, Likelihood, Unknowns};
use crate::noise_estimate::Noise;
use crate::progress::Cancellation;
use crate::regularisation::TireRegularisation;
use crate::tires::Tires;
use preparation::{Drive, SystematicError, SystematicErrors};

/// Most rounds of noises after all else.
const ROUNDS: usize = 3;
/// Fall of the cost by other noises that is not worth a round [nat].
const SETTLED: f64 = 0.5;

/// What is maximised.
pub struct Problem<'a> {
    /// The car; its own tires are not used.
    pub car: &'a Vehicle,
    /// The recordings.
    pub recordings: &'a [Drive],
    /// The box of each axle.
    pub bounds: Bounds,
    /// What is expected of the tires.
    pub expected: TireRegularisation,
    /// How the noises are found.
    pub noise: Noise,
    /// Standard deviations of errors before any data; 0 where there are none.
    pub std: SystematicErrors,
    /// Which errors are estimated.
    pub search: ErrorSelection,
    /// Ends the work.
    pub cancel: Cancellation,
}

/// An optimum with what belongs to it.
#[derive(Clone)]
pub struct Fit {
    /// Errors that are estimated.
    pub active: Vec<SystematicError>,
    /// The likelihood near their delays.
    pub likelihood: Likelihood,
    /// The noises.
    pub noise: DriveNoise,
    /// Over tires and errors.
    pub minimum: Minimum,
    /// Whether only the rows count that are left with any delay.
    delayed: bool,
}

impl Problem<'_> {
    /// Errors that are estimated in any case.
    pub fn always(&self) -> Vec<SystematicError> {
        let on =
            |cause: &SystematicError| self.search.of(*cause) == Mode::On && self.std[*cause] > 0.0;
        SystematicError::ALL.into_iter().filter(on).collect()
    }

    /// The likelihood, with channels moved by the delays among some causes.
    pub fn likelihood(&self, delayed: Option<&SystematicErrors>) -> Likelihood {
        let mut likelihood = match delayed {
            Some(causes) => Likelihood::delayed(self.car, self.recordings, causes),
            None => Likelihood::new(self.car, self.recordings),
        };
        likelihood.cancel = self.cancel.clone();
        likelihood
    }

    /// The cost of tires and causes.
    pub fn joint<'b>(
        &self,
        likelihood: &'b Likelihood,
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
    pub fn search(
        &self,
        likelihood: &Likelihood,
        noise: DriveNoise,
        held: SystematicErrors,
        starts: &[Tires],
    ) -> Result<Optima, Error> {
        let joint = JointPosterior { held, ..self.joint(likelihood, noise, &[]) };
        Search { joint, bounds: self.bounds, noise: self.noise }.run(starts)
    }

    /// What a fit found.
    pub fn unknowns(&self, fit: &Fit) -> Unknowns {
        self.joint(&fit.likelihood, fit.noise, &fit.active).unknowns(&fit.minimum.x)
    }

    /// Fits tires and some causes roughly, and the noises in turn with them: on all rows, if no sensor errs.
    pub fn fit(&self, active: Vec<SystematicError>, start: Unknowns) -> Fit {
        let of_car = active.iter().all(|cause| SystematicError::CAR.contains(cause));
        self.fit_rows(active, start, !of_car, (ROUNDS, COARSE))
    }

    /// The same on the rows that are left with any delay.
    pub fn refit(&self, active: Vec<SystematicError>, start: Unknowns) -> Fit {
        self.fit_rows(active, start, true, (ROUNDS, COARSE))
    }

    /// The same under the noises of the start, as well as a comparison needs it.
    pub fn trial(&self, active: Vec<SystematicError>, start: Unknowns) -> Fit {
        self.fit_rows(active, start, true, (0, COARSE))
    }

    /// The causes and rows of a rough fit with all digits, from a start.
    pub fn finish(&self, rough: &Fit, start: Unknowns) -> Fit {
        self.fit_rows(rough.active.clone(), start, rough.delayed, (ROUNDS, FINE))
    }

    fn fit_rows(
        &self,
        active: Vec<SystematicError>,
        start: Unknowns,
        delayed: bool,
        (rounds, limits): (usize, Limits),
    ) -> Fit {
        let mut at = start;
        let mut evaluations = 0;
        let mut best: Option<Fit> = None;
        for round in 0..=rounds {
            let likelihood = self.likelihood(delayed.then_some(&at.causes));
            if round > 0 {
                let (noise, more) = self.noise.refine(&likelihood, &at);
                evaluations += more;
                let better = Unknowns { noise, ..at };
                let settled = likelihood.cost(&at) - likelihood.cost(&better) < SETTLED;
                let serves = |fit: &Fit| fit.likelihood.serves(&at.causes, self.recordings);
                if settled && best.as_ref().is_some_and(serves) {
                    break;
                }
                at = better;
            }
            let joint = self.joint(&likelihood, at.noise, &active);
            let [lower, upper] = joint.corners(&self.bounds);
            let from = joint.point(&at.tires, &at.causes);
            let minimum = sqp::minimise(&joint, &lower, &upper, &from, limits);
            evaluations += minimum.evaluations;
            at = joint.unknowns(&minimum.x);
            let noise = at.noise;
            best = Some(Fit { active: active.clone(), likelihood, noise, minimum, delayed });
        }
        let mut fit = best.unwrap_or_else(|| unreachable!("the first round always fits"));
        fit.minimum.evaluations = evaluations;
        fit
    }
}
