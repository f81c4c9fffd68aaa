//! The cost of the parameters that logs have in common, and of what each has of its own.

use nalgebra::{DMatrix, DVector};
use numerics::loss::Loss;
use numerics::sqp::{Model, Objective};
use rayon::prelude::*;

use crate::car::information::{Errors, Information};
use crate::car::parameters::{COUNT, Car, Prior, VARYING, Vector};
use crate::car::section::Section;
use crate::predictor::State;

/// A reading of a rollout is worth this much: its neighbours share their errors for half a second or so.
const WORTH: f64 = 0.08;
/// Beyond this many standard deviations an error pulls no more.
const LOSS: Loss = Loss::Huber { threshold: 3.0 };
/// Farthest that a log may be from the others, in standard deviations.
const FARTHEST: f64 = 4.0;

/// Sum over logs of the cost of their rollouts, and of the priors of θ and b. The unknowns are (θ − mean)/std and b/s_b of each log, for
/// parameters that differ.
pub struct Hierarchy<'a> {
    car: &'a Car,
    prior: &'a Prior,
    sections: &'a [Section],
    /// Standard deviations of the errors of v_y [m/s] and yaw rate [rad/s].
    noise: State,
    varying: Vec<usize>,
}

impl<'a> Hierarchy<'a> {
    /// Of sections whose errors have these standard deviations of v_y [m/s] and yaw rate [rad/s].
    pub fn new(car: &'a Car, prior: &'a Prior, sections: &'a [Section], noise: State) -> Self {
        let varying = (0..VARYING).filter(|i| prior.between[*i] > 0.0).collect();
        Self { car, prior, sections, noise, varying }
    }

    /// Number of unknowns.
    pub fn unknowns(&self) -> usize {
        COUNT + self.sections.len() * self.varying.len()
    }

    /// Bounds of the unknowns.
    pub fn bounds(&self) -> [DVector<f64>; 2] {
        [0, 1].map(|side| {
            DVector::from_fn(self.unknowns(), |i, _| match i < COUNT {
                true => (self.prior.bounds[side][i] - self.prior.mean[i]) / self.prior.std[i],
                false => [-FARTHEST, FARTHEST][side],
            })
        })
    }

    /// θ.
    pub fn common(&self, x: &DVector<f64>) -> Vector {
        std::array::from_fn(|i| self.prior.mean[i] + self.prior.std[i] * x[i])
    }

    /// The parameters of a section.
    pub fn own(&self, x: &DVector<f64>, section: usize) -> Vector {
        let mut own = self.common(x);
        for (k, i) in self.varying.iter().enumerate() {
            own[*i] += self.prior.between[*i] * x[self.place(section, k)];
        }
        own
    }

    /// Errors of all rollouts of a section.
    pub fn errors(&self, x: &DVector<f64>, section: usize) -> Vec<Errors> {
        let (own, section) = (self.own(x, section), &self.sections[section]);
        let one = |start: &usize| {
            let rows = (*start, section.ahead);
            Errors::new(&section.driven, self.car, &own, rows, self.noise)
        };
        section.starts.par_iter().map(one).collect()
    }

    fn place(&self, section: usize, k: usize) -> usize {
        COUNT + section * self.varying.len() + k
    }

    fn information(&self, x: &DVector<f64>, section: usize) -> Information {
        let weight = WORTH * self.sections[section].weight;
        let errors = self.errors(x, section);
        // In order: a sum does not depend on who was faster.
        errors.iter().fold(Information::default(), |sum, errors| {
            sum.plus(Information::of(errors, LOSS, weight))
        })
    }
}

impl Objective for Hierarchy<'_> {
    fn model(&self, x: &DVector<f64>) -> Model {
        let n = self.unknowns();
        let mut cost = 0.5 * x.norm_squared();
        let mut gradient = x.clone();
        let mut hessian = DMatrix::identity(n, n);
        let all: Vec<Information> =
            (0..self.sections.len()).into_par_iter().map(|j| self.information(x, j)).collect();
        for (j, information) in all.iter().enumerate() {
            // Which unknowns a section sees: parameter, place, scale.
            let common = (0..COUNT).map(|i| (i, i, self.prior.std[i]));
            let own = self.varying.iter().enumerate();
            let own = own.map(|(k, i)| (*i, self.place(j, k), self.prior.between[*i]));
            let seen: Vec<(usize, usize, f64)> = common.chain(own).collect();
            cost += information.cost;
            for (i, at, scale) in &seen {
                gradient[*at] += scale * information.gradient[*i];
                for (k, to, other) in &seen {
                    hessian[(*at, *to)] += scale * other * information.hessian[(*i, *k)];
                }
            }
        }
        Model { cost, gradient, hessian, scale: (2.0 * cost).sqrt() }
    }
}
