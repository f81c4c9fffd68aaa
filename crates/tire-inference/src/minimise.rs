//! Finds the smallest sum of squares in the box near a point, if wanted with a quantity drawn to a value.
//!
//! The minimum of squares + weight (q − target)² is also the smallest sum of squares among all tires with its q: every
//! point it ends at is on the profile of q, wherever it is left.
#![allow(non_snake_case, reason = "symbols as in Pacejka, Tire and Vehicle Dynamics")]

use nalgebra::{Const, SVector};
use numerics::levenberg_marquardt::{
    LevenbergMarquardtOptions, NormalEquations, SquaredCost, minimise_levenberg_marquardt,
};

use crate::compressed::CompressedSamples;
use crate::parameters::{COUNT, Theta};
use crate::prior::Prior;
use crate::quantity::Quantity;

/// Draws a quantity to a value.
#[derive(Clone, Copy, Debug)]
pub struct QuantityTarget {
    /// What is drawn.
    pub quantity: Quantity,
    /// Whereto.
    pub value: f64,
    /// How strongly, in the unit of the squares per square of the quantity.
    pub weight: f64,
}

impl QuantityTarget {
    fn target_penalty(&self, theta: &Theta) -> f64 {
        self.weight * (self.quantity.value(theta) - self.value).powi(2)
    }
}

/// A minimum: the tire and its sum of squares, without what draws the quantity.
///
/// Levenberg-Marquardt with steps in ln B, ln C, ln D, E and the shifts; parameters on a bound that the gradient presses
/// them against rest there. Where the quantity is a parameter itself, hold the parameter instead.
pub fn minimise_squares(
    data: &CompressedSamples,
    prior: &Prior,
    start: &Theta,
    drawn: Option<&QuantityTarget>,
) -> (Theta, f64) {
    let options = LevenbergMarquardtOptions {
        iterations: 60,
        rejections: 16,
        increase: 8.0,
        decrease: 0.1,
        relative_tolerance: 1e-5 / data.effective_count().max(1) as f64,
        ..Default::default()
    };
    let search = BoxSearch { data, prior, drawn };
    let start = search.clamp_to_box(&SVector::from(*start));
    let theta = minimise_levenberg_marquardt(&search, start, &options).x.into();
    (theta, data.residual_squares(&theta))
}

struct BoxSearch<'a> {
    data: &'a CompressedSamples,
    prior: &'a Prior,
    drawn: Option<&'a QuantityTarget>,
}

type Coordinates = SVector<f64, COUNT>;

impl SquaredCost<Const<COUNT>> for BoxSearch<'_> {
    fn cost(&self, theta: &Coordinates) -> f64 {
        let theta = theta.as_ref();
        self.data.residual_squares(theta) + self.drawn.map_or(0.0, |drawn| drawn.target_penalty(theta))
    }

    fn normal_equations(&self, theta: &Coordinates) -> Option<NormalEquations<Const<COUNT>>> {
        let near = self.data.gauss_newton_expansion(theta.as_ref());
        let (mut matrix, mut gradient) = (near.hessian, near.gradient);
        if let Some(drawn) = self.drawn {
            let by = SVector::from(drawn.quantity.gradient(theta.as_ref()));
            gradient += by * (drawn.weight * (drawn.quantity.value(theta.as_ref()) - drawn.value));
            matrix += by * by.transpose() * drawn.weight;
        }
        let stretch = Coordinates::from_fn(|i, _| if i < 3 { theta[i] } else { 1.0 });
        gradient.component_mul_assign(&stretch);
        matrix.component_mul_assign(&(stretch * stretch.transpose()));
        for i in 0..COUNT {
            let below = theta[i] <= self.prior.bounds.lower[i] && gradient[i] > 0.0;
            let above = theta[i] >= self.prior.bounds.upper[i] && gradient[i] < 0.0;
            if !self.prior.free[i] || below || above {
                matrix[(i, i)] = 0.0;
            }
        }
        Some(NormalEquations { matrix, gradient })
    }

    fn point_after_step(&self, theta: &Coordinates, step: &Coordinates) -> Coordinates {
        let step = step.map(|it| it.clamp(-1.0, 1.0));
        let moved = |i: usize, _| if i < 3 { theta[i] * step[i].exp() } else { theta[i] + step[i] };
        self.clamp_to_box(&Coordinates::from_fn(moved))
    }
}

impl BoxSearch<'_> {
    fn clamp_to_box(&self, theta: &Coordinates) -> Coordinates {
        let Prior { bounds, free, .. } = self.prior;
        Coordinates::from_fn(|i, _| {
            if free[i] { theta[i].clamp(bounds.lower[i], bounds.upper[i]) } else { theta[i] }
        })
    }
}
