//! Maximises the likelihood of prediction errors over the parameters of both tires, the noises, and errors of sensors and car.

use nalgebra::{DMatrix, DVector};
use numerics::convergence::Convergence;
use numerics::sqp::{self, Minimum};

use crate::error::Error;
use crate::global::{FINE, Optima};
use crate::likelihood::{Likelihood, Unknowns};
use crate::model_selection::{self, ModelExtension};
use crate::problem::{Fit, Problem};
use crate::search::{convergence, different};
use crate::tires::{Tires, from_vector};
use preparation::{SystematicError, SystematicErrors};

/// The maximum.
#[derive(Clone)]
pub struct Maximum {
    /// The likelihood, with channels moved by the delays that were found.
    pub likelihood: Likelihood,
    /// Tires, errors and noises, estimated or as given.
    pub unknowns: Unknowns,
    /// Errors that were estimated, in the order of the minimum's variables.
    pub active: Vec<SystematicError>,
    /// Gain of what the data asked for [nat].
    pub gains: Vec<(ModelExtension, f64)>,
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

impl Problem<'_> {
    /// Maximises from all starts and from others along their ridges.
    ///
    /// # Errors
    ///
    /// [`Error::NoStart`] if no start gave a finite cost.
    pub fn maximise(&self, starts: &[Tires]) -> Result<Maximum, Error> {
        let plain = self.likelihood(None);
        let first = self.search(&plain, self.noise.first(), SystematicErrors::default(), starts)?;
        let Optima { noise, mut starts, mut evaluations, minima } = first;
        let tires: Vec<Tires> = minima.iter().map(|m| from_vector(&m.x)).collect();
        let active = self.always();
        let mut start = Unknowns { tires: tires[0], causes: SystematicErrors::default(), noise };
        if active.iter().any(|cause| SystematicError::TIRES.contains(cause)) {
            start.causes.start_relaxation();
        }
        let first = self.fit(active, start);
        evaluations += first.minimum.evaluations;
        let (fit, gains) = model_selection::select(self, first);
        let mut fits = vec![self.finish(&fit, self.unknowns(&fit))];
        evaluations += fits[0].minimum.evaluations;
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
            // On the rows of the first, as their costs are compared.
            let other = self.finish(&fits[0], start);
            evaluations += other.minimum.evaluations;
            fits.push(other);
        }
        Ok(self.best(fits, gains, starts, evaluations))
    }

    /// The best of several fits with the same causes. The others are measured under its noise.
    fn best(
        &self,
        fits: Vec<Fit>,
        gains: Vec<(ModelExtension, f64)>,
        starts: usize,
        evaluations: usize,
    ) -> Maximum {
        let mut fits = fits;
        fits.sort_by(|a, b| a.minimum.model.cost.total_cmp(&b.minimum.model.cost));
        let mut rest = fits.split_off(1);
        let Fit { active, likelihood, noise, minimum, .. } = fits.remove(0);
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
