//! The cost of the parameters that logs have in common, and of what each has of its own.

use nalgebra::{DMatrix, DVector};
use numerics::loss::Loss;
use numerics::sqp::{Objective, QuadraticModel};
use rayon::prelude::*;

use crate::car::information::{RolloutErrors, SecondOrderCost};
use crate::car::parameters::{COUNT, CarSpecification, ParameterPrior, ParameterVector, VARYING};
use crate::car::section::DriveSection;
use crate::predictor::LateralState;

/// A reading of a rollout is worth this much: its neighbours share their errors for half a second or so.
const WORTH: f64 = 0.08;
/// Beyond this many standard deviations an error pulls no more.
const LOSS: Loss = Loss::Huber { threshold: 3.0 };
/// Farthest that a log may be from the others, in standard deviations.
const FARTHEST: f64 = 4.0;

/// Sum over logs of the cost of their rollouts, and of the priors of θ and b. The unknowns are (θ − mean)/std and b/s_b of each log, for
/// parameters that differ.
pub struct HierarchicalCost<'a> {
    car: &'a CarSpecification,
    prior: &'a ParameterPrior,
    sections: &'a [DriveSection],
    /// Standard deviations of the errors of v_y [m/s] and yaw rate [rad/s].
    noise: LateralState,
    varying: Vec<usize>,
}

impl<'a> HierarchicalCost<'a> {
    /// Of sections whose errors have these standard deviations of v_y [m/s] and yaw rate [rad/s].
    pub fn new(
        car: &'a CarSpecification,
        prior: &'a ParameterPrior,
        sections: &'a [DriveSection],
        noise: LateralState,
    ) -> Self {
        let varying = (0..VARYING).filter(|i| prior.between[*i] > 0.0).collect();
        Self { car, prior, sections, noise, varying }
    }

    /// Number of unknowns.
    pub fn unknown_count(&self) -> usize {
        COUNT + self.sections.len() * self.varying.len()
    }

    /// Bounds of the unknowns.
    pub fn unknown_bounds(&self) -> [DVector<f64>; 2] {
        [0, 1].map(|side| {
            DVector::from_fn(self.unknown_count(), |i, _| match i < COUNT {
                true => (self.prior.bounds[side][i] - self.prior.mean[i]) / self.prior.std[i],
                false => [-FARTHEST, FARTHEST][side],
            })
        })
    }

    /// θ.
    pub fn common_parameters(&self, x: &DVector<f64>) -> ParameterVector {
        std::array::from_fn(|i| self.prior.mean[i] + self.prior.std[i] * x[i])
    }

    /// The parameters of a section.
    pub fn section_parameters(&self, x: &DVector<f64>, section: usize) -> ParameterVector {
        let mut own = self.common_parameters(x);
        for (k, i) in self.varying.iter().enumerate() {
            own[*i] += self.prior.between[*i] * x[self.unknown_index(section, k)];
        }
        own
    }

    /// Errors of all rollouts of a section.
    pub fn section_errors(&self, x: &DVector<f64>, section: usize) -> Vec<RolloutErrors> {
        let (own, section) = (self.section_parameters(x, section), &self.sections[section]);
        let one = |start: &usize| {
            RolloutErrors::new(&section.driven, self.car, &own, *start, section.ahead, self.noise)
        };
        section.starts.par_iter().map(one).collect()
    }

    fn unknown_index(&self, section: usize, k: usize) -> usize {
        COUNT + section * self.varying.len() + k
    }

    fn section_cost(&self, x: &DVector<f64>, section: usize) -> SecondOrderCost {
        let weight = WORTH * self.sections[section].weight;
        let errors = self.section_errors(x, section);
        // In order: a sum does not depend on who was faster.
        errors.iter().fold(SecondOrderCost::default(), |sum, errors| {
            sum.plus(SecondOrderCost::from_errors(errors, LOSS, weight))
        })
    }
}

impl Objective for HierarchicalCost<'_> {
    fn model(&self, x: &DVector<f64>) -> QuadraticModel {
        let n = self.unknown_count();
        let mut cost = 0.5 * x.norm_squared();
        let mut gradient = x.clone();
        let mut hessian = DMatrix::identity(n, n);
        let all: Vec<SecondOrderCost> =
            (0..self.sections.len()).into_par_iter().map(|j| self.section_cost(x, j)).collect();
        for (j, information) in all.iter().enumerate() {
            // Which unknowns a section sees: parameter, place, scale.
            let common = (0..COUNT).map(|i| (i, i, self.prior.std[i]));
            let own = self.varying.iter().enumerate();
            let own = own.map(|(k, i)| (*i, self.unknown_index(j, k), self.prior.between[*i]));
            let seen: Vec<(usize, usize, f64)> = common.chain(own).collect();
            cost += information.cost;
            for (i, at, scale) in &seen {
                gradient[*at] += scale * information.gradient[*i];
                for (k, to, other) in &seen {
                    hessian[(*at, *to)] += scale * other * information.hessian[(*i, *k)];
                }
            }
        }
        QuadraticModel { cost, gradient, hessian, scale: (2.0 * cost).sqrt() }
    }
}
