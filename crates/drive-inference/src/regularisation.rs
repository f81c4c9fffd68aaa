//! Adds prior expectations to a cost of both tires: typical values, and similarity of the two axles.

use nalgebra::DVector;
use numerics::sqp;
use tire_inference::axles::Axle;
use tire_inference::parameters::TireParameters;
use tire_inference::prior::Prior;
use tire_inference::regularisation::{AxleCoupling, Regularisation};

use crate::tires::{Tires, from_vector, parameter_indices};

/// What is expected of both tires.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TireRegularisation {
    regularisation: Option<Regularisation>,
    coupling: AxleCoupling,
}

impl TireRegularisation {
    /// In the units of a prior: λ_reg draws each tire to its typical values, λ_sim both to each other.
    pub fn new(prior: &Prior, regularisation: f64, axle_coupling: f64) -> Self {
        Self {
            regularisation: Regularisation::towards_typical(prior, regularisation),
            coupling: AxleCoupling::new(prior, axle_coupling),
        }
    }

    /// What it costs.
    pub fn cost(&self, tires: &Tires) -> f64 {
        let of_tire = |tire: &TireParameters| {
            self.regularisation.map_or(0.0, |expected| expected.cost_and_gradient(&tire.to_theta()).0)
        };
        let [front, rear] = [tires.front.into_array(), tires.rear.into_array()];
        let parameters = TireParameters::<f64>::PARAMETERS.into_iter().zip(front.into_iter().zip(rear));
        let coupling =
            parameters.map(|(p, (front, rear))| self.coupling.cost_and_derivatives(p, front, rear)[0]);
        of_tire(&tires.front) + of_tire(&tires.rear) + coupling.sum::<f64>()
    }

    /// Adds it to a model in the parameters of both tires and whatever follows.
    pub fn add_to_model(&self, x: &DVector<f64>, model: &mut sqp::QuadraticModel) {
        let tires = from_vector(x);
        model.cost += self.cost(&tires);
        if let Some(expected) = self.regularisation {
            for axle in Axle::ALL {
                let (_, gradient) = expected.cost_and_gradient(&tires[axle].to_theta());
                for (i, index) in parameter_indices(axle).into_array().into_iter().enumerate() {
                    model.gradient[index] += gradient[i];
                    model.hessian[(index, index)] += expected.weight * expected.towards.precision[i][i];
                }
            }
        }
        let [front, rear] =
            [parameter_indices(Axle::Front), parameter_indices(Axle::Rear)].map(|at| at.into_array());
        for (i, parameter) in TireParameters::<f64>::PARAMETERS.into_iter().enumerate() {
            let (f, r) = (front[i], rear[i]);
            let [_, slope, bend] = self.coupling.cost_and_derivatives(parameter, x[f], x[r]);
            for (own, other, sign) in [(f, r, 1.0), (r, f, -1.0)] {
                model.gradient[own] += sign * slope;
                model.hessian[(own, own)] += bend;
                model.hessian[(own, other)] -= bend;
            }
        }
    }
}
