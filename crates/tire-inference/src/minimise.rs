//! Finds the smallest sum of squares in the box near a point, if wanted with a quantity drawn to a value.
//!
//! The minimum of squares + weight (q − target)² is also the smallest sum of squares among all tires with its q: every
//! point it ends at is on the profile of q, wherever it is left.
#![allow(non_snake_case, reason = "symbols as in Pacejka, Tire and Vehicle Dynamics")]

use nalgebra::{SMatrix, SVector};

use crate::compressed::CompressedSamples;
use crate::parameters::{COUNT, Theta};
use crate::prior::Prior;
use crate::quantity::Quantity;

const ITERATIONS: usize = 60;

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
    let cost =
        |theta: &Theta| data.residual_squares(theta) + drawn.map_or(0.0, |drawn| drawn.target_penalty(theta));
    let mut theta = clamp_to_box(prior, start);
    let mut least = cost(&theta);
    let mut damping = 1e-3;
    let negligible = 1e-5 / data.effective_count().max(1) as f64;
    for _ in 0..ITERATIONS {
        let (gradient, hessian) = gradient_and_hessian(data, &theta, drawn);
        let free = movable_parameters(prior, &theta, &gradient);
        let mut gain = 0.0;
        while damping < 1e9 {
            let moved = levenberg_marquardt_step(prior, &theta, &gradient, &hessian, &free, damping);
            let value = moved.as_ref().map_or(f64::INFINITY, &cost);
            if let (Some(moved), true) = (moved, value < least) {
                gain = least - value;
                (theta, least) = (moved, value);
                damping = (damping / 10.0).max(1e-9);
                break;
            }
            damping *= 8.0;
        }
        if gain <= negligible * least {
            break;
        }
    }
    (theta, data.residual_squares(&theta))
}

fn clamp_to_box(prior: &Prior, theta: &Theta) -> Theta {
    std::array::from_fn(|i| {
        if prior.free[i] { theta[i].clamp(prior.bounds.lower[i], prior.bounds.upper[i]) } else { theta[i] }
    })
}

type Gradient = SVector<f64, COUNT>;
type Hessian = SMatrix<f64, COUNT, COUNT>;

/// Half the gradient and half the Hessian in the coordinates of the steps.
fn gradient_and_hessian(
    data: &CompressedSamples,
    theta: &Theta,
    drawn: Option<&QuantityTarget>,
) -> (Gradient, Hessian) {
    let near = data.gauss_newton_expansion(theta);
    let (mut gradient, mut hessian) = (near.gradient, near.hessian);
    if let Some(drawn) = drawn {
        let by = SVector::from(drawn.quantity.gradient(theta));
        gradient += by * (drawn.weight * (drawn.quantity.value(theta) - drawn.value));
        hessian += by * by.transpose() * drawn.weight;
    }
    let stretch = Gradient::from_fn(|i, _| if i < 3 { theta[i] } else { 1.0 });
    (gradient.component_mul(&stretch), Hessian::from_fn(|i, j| hessian[(i, j)] * stretch[i] * stretch[j]))
}

/// Parameters that may move.
fn movable_parameters(prior: &Prior, theta: &Theta, gradient: &Gradient) -> [bool; COUNT] {
    std::array::from_fn(|i| {
        let below = theta[i] <= prior.bounds.lower[i] && gradient[i] > 0.0;
        let above = theta[i] >= prior.bounds.upper[i] && gradient[i] < 0.0;
        prior.free[i] && !below && !above
    })
}

fn levenberg_marquardt_step(
    prior: &Prior,
    theta: &Theta,
    gradient: &Gradient,
    hessian: &Hessian,
    free: &[bool; COUNT],
    damping: f64,
) -> Option<Theta> {
    let scale =
        Gradient::from_fn(|i, _| if free[i] && hessian[(i, i)] > 0.0 { hessian[(i, i)].sqrt() } else { 0.0 });
    let system = Hessian::from_fn(|i, j| match (scale[i] * scale[j] > 0.0, i == j) {
        (true, true) => 1.0 + damping,
        (true, false) => hessian[(i, j)] / (scale[i] * scale[j]),
        (false, same) => f64::from(u8::from(same)),
    });
    let right = Gradient::from_fn(|i, _| if scale[i] > 0.0 { -gradient[i] / scale[i] } else { 0.0 });
    let solved = system.cholesky()?.solve(&right);
    let moved = std::array::from_fn(|i| {
        let along = if scale[i] > 0.0 { solved[i] / scale[i] } else { 0.0 };
        if i < 3 { theta[i] * along.clamp(-1.0, 1.0).exp() } else { theta[i] + along.clamp(-1.0, 1.0) }
    });
    Some(clamp_to_box(prior, &moved))
}
