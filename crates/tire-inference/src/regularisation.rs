//! Draws the parameters of a tire towards expected values, and those of both axles towards each other.
//!
//! The unit of a parameter is the standard deviation that it has if it is uniform within its box: it has no scale of its own, and is
//! there for parameters whose typical value is 0.

use crate::parameters::{Normal, Parameter, Theta};
use crate::prior::Prior;

/// ½ weight (θ − mean)ᵀ precision (θ − mean), to be added to a cost.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Regularisation {
    /// Expected values.
    pub towards: Normal,
    /// λ_reg: the variance of the noise, if the result is to be the most probable one.
    pub weight: f64,
}

impl Regularisation {
    /// Towards the typical values of a prior; `None` without a weight.
    pub fn towards_typical(prior: &Prior, weight: f64) -> Option<Self> {
        let towards = Normal::diagonal(prior.centre, parameter_units(prior));
        (weight > 0.0).then_some(Self { towards, weight })
    }

    /// What it adds to a cost, and its gradient. The Hessian is `weight` times the precision.
    pub fn cost_and_gradient(&self, theta: &Theta) -> (f64, Theta) {
        let (distance, gradient) = self.towards.squared_mahalanobis_distance(theta);
        (0.5 * self.weight * distance, gradient.map(|slope| self.weight * slope))
    }

    /// Whether its numbers make sense.
    pub fn is_valid(&self) -> bool {
        let numbers = self.towards.precision.iter().flatten().chain(&self.towards.mean);
        numbers.chain([&self.weight]).all(|number| number.is_finite()) && self.weight >= 0.0
    }
}

/// ½ weight Σ ((θ_front − θ_rear)/unit)², to be added to a cost.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AxleCoupling {
    /// λ_sim: 0 leaves the axles apart.
    pub weight: f64,
    /// Unit of a difference, for each parameter; infinite where the axles may differ at will.
    pub unit: Theta,
}

impl AxleCoupling {
    /// In the units of a prior.
    pub fn new(prior: &Prior, weight: f64) -> Self {
        Self { weight, unit: parameter_units(prior) }
    }

    /// What a parameter of both axles adds to a cost, its derivative with respect to that of the front axle, and the second one.
    pub fn cost_and_derivatives(&self, parameter: Parameter, front: f64, rear: f64) -> [f64; 3] {
        let unit = self.unit[parameter as usize];
        let difference = (front - rear) / unit;
        let slope = self.weight * difference;
        [0.5 * slope * difference, slope / unit, self.weight / (unit * unit)]
    }

    /// Whether its numbers make sense.
    pub fn is_valid(&self) -> bool {
        let units = self.unit.iter().all(|unit| *unit > 0.0);
        self.weight >= 0.0 && self.weight.is_finite() && units
    }
}

fn parameter_units(prior: &Prior) -> Theta {
    Parameter::ALL.map(|parameter| prior.difference_unit(parameter))
}

#[cfg(test)]
mod tests {
    use approx::assert_relative_eq;

    use super::*;

    #[test]
    fn one_unit_away_costs_half_the_weight_wherever_the_typical_value_is() {
        let prior = Prior::lateral();
        let regularisation = Regularisation::towards_typical(&prior, 3.0).expect("a weight");
        let coupling = AxleCoupling::new(&prior, 3.0);
        for parameter in Parameter::ALL {
            let (from, unit) = (prior.centre[parameter as usize], prior.difference_unit(parameter));
            let mut theta = prior.centre;
            theta[parameter as usize] += unit;
            let (cost, gradient) = regularisation.cost_and_gradient(&theta);
            assert_relative_eq!(cost, 1.5, max_relative = 1e-9);
            assert_relative_eq!(gradient[parameter as usize] * unit, 3.0, max_relative = 1e-9);
            let [cost, slope, bend] = coupling.cost_and_derivatives(parameter, from + unit, from);
            assert_relative_eq!(cost, 1.5, max_relative = 1e-9);
            assert_relative_eq!(slope * unit, 3.0, max_relative = 1e-9);
            assert_relative_eq!(bend * unit * unit, 3.0, max_relative = 1e-9);
        }
        assert_eq!(Regularisation::towards_typical(&prior, 0.0), None);
    }
}
