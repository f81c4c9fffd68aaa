//! Maximises the likelihood of prediction errors over the parameters of both tires, the noises, and errors of sensors and car.

use nalgebra::{DMatrix, DVector};
use numerics::convergence::Convergence;
use numerics::sqp::{self, Minimum};
use tire_inference::parameters::Bounds;
use vehicle::Vehicle;

use crate::cause::{Cause, Causes};
use crate::error::Error;
use crate::global::{FINE, Optima, Search};
use crate::joint::Joint;
use crate::likelihood::{DriveNoise, Likelihood, Unknowns};
use crate::noises::Noise;
use crate::progress::Cancellation;
use crate::recording::Drive;
use crate::regularisation::Expected;
use crate::search::{convergence, different};
use crate::selection::{self, Addition};
use crate::tires::{Tires, from_vector};

/// Most rounds of noises after all else.
const ROUNDS: usize = 3;
/// Fall of the cost by other noises that is not worth a round [nat].
const SETTLED: f64 = 0.5;

/// The maximum.
#[derive(Clone)]
pub struct Maximum {
    /// The likelihood, with channels moved by the delays that were found.
    pub likelihood: Likelihood,
    /// Tires, errors and noises, estimated or as given.
    pub unknowns: Unknowns,
    /// Errors that were estimated, in the order of the minimum's variables.
    pub active: Vec<Cause>,
    /// Gain of what the data asked for [nat].
    pub gains: Vec<(Addition, f64)>,
    /// The minimum of the negative logarithm, for its second derivatives.
    pub minimum: Minimum,
    /// Different optima, best first.
    pub optima: Vec<Optimum>,
    /// How it was reached.
    pub convergence: Convergence,
}

/// One of several optima.
#[derive(Clone, Debug)]
pub struct Optimum {
    /// Tires and errors.
    pub x: DVector<f64>,
    /// The cost there.
    pub cost: f64,
    /// Its second derivatives.
    pub hessian: DMatrix<f64>,
}

/// What is maximised.
pub struct Problem<'a> {
    /// The car; its own tires are not used.
    pub car: &'a Vehicle,
    /// The recordings.
    pub recordings: &'a [Drive],
    /// The box of each axle.
    pub bounds: Bounds,
    /// What is expected of the tires.
    pub expected: Expected,
    /// How the noises are found.
    pub noise: Noise,
    /// Standard deviations of errors before any data; 0 where there are none.
    pub std: Causes,
    /// Which errors are estimated.
    pub search: selection::Wanted,
    /// Ends the work.
    pub cancel: Cancellation,
}

/// An optimum with what belongs to it.
#[derive(Clone)]
pub struct Fit {
    /// Errors that are estimated.
    pub active: Vec<Cause>,
    /// The likelihood near their delays.
    pub likelihood: Likelihood,
    /// The noises.
    pub noise: DriveNoise,
    /// Over tires and errors.
    pub minimum: Minimum,
}

impl Problem<'_> {
    /// Maximises from all starts and from others along their ridges.
    ///
    /// # Errors
    ///
    /// [`Error::NoStart`] if no start gave a finite cost.
    pub fn maximise(&self, starts: &[Tires]) -> Result<Maximum, Error> {
        let plain = self.likelihood(&Causes::default(), &[]);
        let first = self.search(&plain, self.noise.first(), Causes::default(), starts)?;
        let Optima { noise, mut starts, mut evaluations, minima } = first;
        let tires: Vec<Tires> = minima.iter().map(|m| from_vector(&m.x)).collect();
        let active = self.always();
        let start = Unknowns { tires: tires[0], causes: Causes::default(), noise };
        let first = self.fit(active, start);
        evaluations += first.minimum.evaluations;
        let (fit, gains) = selection::select(self, first);
        let mut fits = vec![fit];
        let mut others = tires[1..].to_vec();
        if !gains.is_empty() {
            // What was an optimum for wrong sensors need not be one for the right ones.
            let Unknowns { causes, tires, noise } = self.unknowns(&fits[0]);
            let likelihood = &fits[0].likelihood;
            let again = self.search(likelihood, noise, causes, &[tires])?;
            (starts, evaluations) = (starts + again.starts, evaluations + again.evaluations);
            others = again.minima.iter().map(|m| from_vector(&m.x)).collect();
        }
        for tires in others {
            let start = Unknowns { tires, ..self.unknowns(&fits[0]) };
            let other = self.fit(fits[0].active.clone(), start);
            evaluations += other.minimum.evaluations;
            fits.push(other);
        }
        Ok(self.best(fits, gains, starts, evaluations))
    }

    /// Errors that are estimated in any case.
    fn always(&self) -> Vec<Cause> {
        Cause::CAR.into_iter().filter(|cause| self.std[*cause] > 0.0).collect()
    }

    /// The likelihood near the delays among some causes.
    fn likelihood(&self, causes: &Causes, active: &[Cause]) -> Likelihood {
        let estimated = active.iter().any(|cause| !Cause::CAR.contains(cause));
        let mut likelihood = if estimated {
            Likelihood::delayed(self.car, self.recordings, causes)
        } else {
            Likelihood::new(self.car, self.recordings)
        };
        likelihood.cancel = self.cancel.clone();
        likelihood
    }

    /// The cost of tires and causes.
    pub fn joint<'b>(
        &self,
        likelihood: &'b Likelihood,
        noise: DriveNoise,
        active: &[Cause],
    ) -> Joint<'b> {
        let (expected, std) = (self.expected, self.std);
        let held = Causes::default();
        Joint { likelihood, noise, expected, active: active.to_vec(), held, std }
    }

    fn search(
        &self,
        likelihood: &Likelihood,
        noise: DriveNoise,
        held: Causes,
        starts: &[Tires],
    ) -> Result<Optima, Error> {
        let joint = Joint { held, ..self.joint(likelihood, noise, &[]) };
        Search { joint, bounds: self.bounds, noise: self.noise }.run(starts)
    }

    /// What a fit found.
    pub fn unknowns(&self, fit: &Fit) -> Unknowns {
        self.joint(&fit.likelihood, fit.noise, &fit.active).unknowns(&fit.minimum.x)
    }

    /// Fits tires and some causes, and the noises in turn with them.
    pub fn fit(&self, active: Vec<Cause>, start: Unknowns) -> Fit {
        let likelihood = |causes: &Causes| self.likelihood(causes, &active);
        self.fit_with(&likelihood, &active, start)
    }

    /// The same on the rows that are left with any delays.
    pub fn refit(&self, active: Vec<Cause>, start: Unknowns) -> Fit {
        let likelihood = |causes: &Causes| self.likelihood(causes, &Cause::ALL);
        self.fit_with(&likelihood, &active, start)
    }

    fn fit_with(
        &self,
        likelihood: &dyn Fn(&Causes) -> Likelihood,
        active: &[Cause],
        start: Unknowns,
    ) -> Fit {
        let mut at = start;
        let mut evaluations = 0;
        let mut best: Option<Fit> = None;
        for round in 0..=ROUNDS {
            let likelihood = likelihood(&at.causes);
            if round > 0 {
                let (noise, more) = self.noise.refine(&likelihood, &at);
                evaluations += more;
                let better = Unknowns { noise, ..at };
                if likelihood.cost(&at) - likelihood.cost(&better) < SETTLED {
                    break;
                }
                at = better;
            }
            let joint = self.joint(&likelihood, at.noise, active);
            let [lower, upper] = joint.corners(&self.bounds);
            let from = joint.point(&at.tires, &at.causes);
            let minimum = sqp::minimise(&joint, &lower, &upper, &from, FINE);
            evaluations += minimum.evaluations;
            at = joint.unknowns(&minimum.x);
            let noise = at.noise;
            best = Some(Fit { active: active.to_vec(), likelihood, noise, minimum });
        }
        let mut fit = best.unwrap_or_else(|| unreachable!("the first round always fits"));
        fit.minimum.evaluations = evaluations;
        fit
    }

    /// The best of several fits with the same causes. The others are measured under its noise.
    fn best(
        &self,
        fits: Vec<Fit>,
        gains: Vec<(Addition, f64)>,
        starts: usize,
        evaluations: usize,
    ) -> Maximum {
        let mut fits = fits;
        fits.sort_by(|a, b| a.minimum.model.cost.total_cmp(&b.minimum.model.cost));
        let mut rest = fits.split_off(1);
        let Fit { active, likelihood, noise, minimum } = fits.remove(0);
        let joint = self.joint(&likelihood, noise, &active);
        let [lower, upper] = joint.corners(&self.bounds);
        let mut minima = vec![minimum];
        for fit in rest.drain(..) {
            minima.push(sqp::minimise(&joint, &lower, &upper, &fit.minimum.x, FINE));
        }
        let minima = different(minima, f64::INFINITY);
        let minimum = minima[0].clone();
        let unknowns = joint.unknowns(&minimum.x);
        let optimum = |Minimum { x, model, .. }: Minimum| Optimum {
            x,
            cost: model.cost,
            hessian: model.hessian,
        };
        let optima: Vec<_> = minima.into_iter().map(optimum).collect();
        let convergence = convergence(&minimum, starts, optima.len(), evaluations);
        Maximum { unknowns, active, gains, minimum, optima, convergence, likelihood }
    }
}
