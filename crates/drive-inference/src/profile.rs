//! Profiles the likelihood of drives in a parameter, or in the stiffness, of one axle.

use nalgebra::{DMatrix, DVector};
use numerics::convergence::OptimisationStatus;
use numerics::sqp::{self, SqpLimits};
use rayon::prelude::*;
use tire_inference::axles::Axle;
use tire_inference::profile::{LikelihoodProfile, ProfileLikelihood, ProfilePoint, profile_likelihood};
use tire_inference::quantity::Quantity;

use crate::laplace::{LaplaceApproximation, StiffnessCost};
use crate::tires::parameter_indices;

const LIMITS: SqpLimits = SqpLimits { iterations: 20, target: 1e-4, tolerance: 1e-3, damping: 1e-5 };

/// Profiles quantities of axles, several at once; `None` for what is no parameter and not the stiffness.
pub fn likelihood_profiles(
    laplace: &LaplaceApproximation,
    quantities: &[(Axle, Quantity)],
) -> Vec<Option<LikelihoodProfile>> {
    let one = |(axle, quantity): &(Axle, Quantity)| match quantity {
        Quantity::Parameter(parameter) => {
            let index = *parameter_indices(*axle).into_array().get(*parameter as usize)?;
            Some(profile_likelihood(&LaplaceProfile::new(laplace), index))
        }
        Quantity::K => {
            let objective = StiffnessCost { objective: laplace.objective, axle: *axle };
            let laplace = laplace.with_stiffness(&objective, *axle);
            Some(profile_likelihood(&LaplaceProfile::new(&laplace), parameter_indices(*axle).B))
        }
        _ => None,
    };
    quantities.par_iter().map(one).collect()
}

/// The variables of a cost, each of which can be held.
struct LaplaceProfile<'a> {
    laplace: &'a LaplaceApproximation<'a>,
    covariance: DMatrix<f64>,
}

impl<'a> LaplaceProfile<'a> {
    fn new(laplace: &'a LaplaceApproximation<'a>) -> Self {
        Self { laplace, covariance: laplace.in_box() }
    }
}

impl ProfileLikelihood for LaplaceProfile<'_> {
    type ProfileParameters = DVector<f64>;
    /// The index of a variable.
    type Quantity = usize;

    fn optimum(&self, index: usize) -> ProfilePoint<DVector<f64>> {
        let LaplaceApproximation { x, cost, .. } = self.laplace;
        ProfilePoint { value: x[index], x: x.clone(), cost: *cost, converged: true }
    }

    fn rival_values(&self, _: usize) -> Vec<f64> {
        Vec::new()
    }

    fn quantity_range(&self, index: usize) -> [f64; 2] {
        [self.laplace.corners[0][index], self.laplace.corners[1][index]]
    }

    fn approximate_std(&self, index: usize) -> f64 {
        self.covariance[(index, index)].max(0.0).sqrt()
    }

    fn likelihood_ratio_statistic(&self, cost: f64, least: f64) -> f64 {
        2.0 * (cost - least)
    }

    fn target_weight(&self, _: f64) -> f64 {
        0.0
    }

    /// From a neighbour moved along the ridge.
    fn maximise_at(
        &self,
        index: usize,
        target: f64,
        _: f64,
        from: &DVector<f64>,
    ) -> ProfilePoint<DVector<f64>> {
        let objective = self.laplace.objective;
        let [mut lower, mut upper] = self.laplace.corners.clone();
        (lower[index], upper[index]) = (target, target);
        let within = |x: DVector<f64>| DVector::from_fn(x.len(), |i, _| x[i].clamp(lower[i], upper[i]));
        let along = self.covariance.column(index) / self.covariance[(index, index)].max(1e-300);
        // On a flat ridge the straight way along it may lead off it, and staying is the better start.
        let moved = within(from + along * (target - from[index]));
        let stayed = within(from.clone());
        let better = objective.cost(&moved) <= objective.cost(&stayed);
        let start = if better { moved } else { stayed };
        let minimum = sqp::minimise_sqp(objective, &lower, &upper, &start, LIMITS);
        ProfilePoint {
            value: target,
            cost: minimum.model.cost,
            converged: minimum.status == OptimisationStatus::Converged,
            x: minimum.x,
        }
    }
}
