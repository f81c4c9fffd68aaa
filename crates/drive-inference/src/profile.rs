//! Profiles the likelihood of drives in a parameter, or in the stiffness, of one axle.

use nalgebra::{DMatrix, DVector};
use numerics::convergence::Status;
use numerics::sqp::{self, Limits};
use rayon::prelude::*;
use tire_inference::axles::Axle;
use tire_inference::profile::{Point, Profile, ProfileLikelihood, profile};
use tire_inference::quantity::Quantity;

use crate::laplace::{LaplaceApproximation, StiffnessCost};
use crate::tires::indices;

const LIMITS: Limits = Limits { iterations: 20, target: 1e-4, tolerance: 1e-3, damping: 1e-5 };

/// Profiles quantities of axles, several at once; `None` for what is no parameter and not the stiffness.
pub fn profiles(
    laplace: &LaplaceApproximation,
    quantities: &[(Axle, Quantity)],
) -> Vec<Option<Profile>> {
    let one = |(axle, quantity): &(Axle, Quantity)| match quantity {
        Quantity::Parameter(parameter) => {
            let index = *indices(*axle).into_array().get(*parameter as usize)?;
            Some(profile(&Variables::new(laplace), index))
        }
        Quantity::K => {
            let objective = StiffnessCost { objective: laplace.objective, axle: *axle };
            let laplace = laplace.with_stiffness(&objective, *axle);
            Some(profile(&Variables::new(&laplace), indices(*axle).B))
        }
        _ => None,
    };
    quantities.par_iter().map(one).collect()
}

/// The variables of a cost, each of which can be held.
struct Variables<'a> {
    laplace: &'a LaplaceApproximation<'a>,
    covariance: DMatrix<f64>,
}

impl<'a> Variables<'a> {
    fn new(laplace: &'a LaplaceApproximation<'a>) -> Self {
        Self { laplace, covariance: laplace.in_box() }
    }
}

impl ProfileLikelihood for Variables<'_> {
    type X = DVector<f64>;
    /// The index of a variable.
    type Quantity = usize;

    fn best(&self, index: usize) -> Point<DVector<f64>> {
        let LaplaceApproximation { x, cost, .. } = self.laplace;
        Point { value: x[index], x: x.clone(), cost: *cost, converged: true }
    }

    fn rivals(&self, _: usize) -> Vec<f64> {
        Vec::new()
    }

    fn range(&self, index: usize) -> [f64; 2] {
        [self.laplace.corners[0][index], self.laplace.corners[1][index]]
    }

    fn spread(&self, index: usize) -> f64 {
        self.covariance[(index, index)].max(0.0).sqrt()
    }

    fn rise(&self, cost: f64, least: f64) -> f64 {
        2.0 * (cost - least)
    }

    fn weight(&self, _: f64) -> f64 {
        0.0
    }

    /// From a neighbour moved along the ridge.
    fn hold(&self, index: usize, target: f64, _: f64, from: &DVector<f64>) -> Point<DVector<f64>> {
        let objective = self.laplace.objective;
        let [mut lower, mut upper] = self.laplace.corners.clone();
        (lower[index], upper[index]) = (target, target);
        let within =
            |x: DVector<f64>| DVector::from_fn(x.len(), |i, _| x[i].clamp(lower[i], upper[i]));
        let along = self.covariance.column(index) / self.covariance[(index, index)].max(1e-300);
        // On a flat ridge the straight way along it may lead off it, and staying is the better start.
        let moved = within(from + along * (target - from[index]));
        let stayed = within(from.clone());
        let better = objective.cost(&moved) <= objective.cost(&stayed);
        let start = if better { moved } else { stayed };
        let minimum = sqp::minimise(objective, &lower, &upper, &start, LIMITS);
        Point {
            value: target,
            cost: minimum.model.cost,
            converged: minimum.status == Status::Converged,
            x: minimum.x,
        }
    }
}
