//! Maps the box of both axles' parameters to coordinates without bounds in which a likelihood of driving is nearly normal.
//!
//! They are the logits of the indices of B, C, D and E between their bounds, but for one shear: along a ridge of equal stiffness
//! B C D, which data leave open longest, B falls as C and D rise. To its logit is added what that fall changes in it, to first order at
//! one tire, so that the ridge is straight.

use nalgebra::{DMatrix, DVector};
use tire_inference::axles::{Axle, Axles};
use tire_inference::bounds::Bounds;
use tire_inference::parameters::TireParameters;

use crate::tires::{self, SIZE, Tires, parameter_indices};

/// A start this close to a bound, as a share of the range of tires of the literature, is moved inside: the logit of the bound itself
/// is infinite.
const INSIDE: f64 = 0.01;
/// Closer to a bound than this the logit is too bent to shear by its slope.
const BENT: f64 = 0.1;

/// The coordinates of a box.
pub struct UnboundedCoordinates {
    lower: [f64; SIZE],
    width: [f64; SIZE],
    /// The least share of the box that a start is away from a bound.
    inside: [f64; SIZE],
    /// By how much the logit of B falls with ln C and ln D along the ridge, of each axle.
    fall: Axles<f64>,
}

impl UnboundedCoordinates {
    /// Of a box with these corners, straight along the ridges of some tires.
    pub fn new([lower, upper]: &[DVector<f64>; 2], tires: &Tires) -> Self {
        let fall = Axles::from_fn(|axle| {
            let (at, tire) = (parameter_indices(axle), tires[axle]);
            let width = upper[at.B] - lower[at.B];
            let share = ((tire.B - lower[at.B]) / width).clamp(BENT, 1.0 - BENT);
            tire.B / (width * share * (1.0 - share))
        });
        let width: [f64; SIZE] = std::array::from_fn(|i| upper[i] - lower[i]);
        let known = TireParameters::<f64>::PARAMETERS.map(|parameter| {
            let [low, high] = Bounds::GOBLIRSCH.range(parameter);
            high - low
        });
        let inside = |i: usize| INSIDE * (known[i % known.len()] / width[i]).min(1.0);
        Self { lower: std::array::from_fn(|i| lower[i]), width, inside: std::array::from_fn(inside), fall }
    }

    /// The point of some parameters.
    pub fn z_from_tires(&self, tires: &Tires) -> DVector<f64> {
        let theta = tires::to_array(*tires);
        let mut z = DVector::from_fn(SIZE, |i, _| {
            let inside = self.inside[i];
            let share = ((theta[i] - self.lower[i]) / self.width[i]).clamp(inside, 1.0 - inside);
            (share / (1.0 - share)).ln()
        });
        for axle in Axle::ALL {
            let at = parameter_indices(axle);
            let [C, D] = [at.C, at.D].map(|i| self.lower[i] + self.width[i] * logistic(z[i]));
            z[at.B] += self.fall[axle] * (C * D).ln();
        }
        z
    }

    /// The parameters at a point, and the logarithm of their volume for one of the coordinates: ln |det ∂θ/∂z|. `None` where numbers
    /// end.
    pub fn tires_from_z(&self, z: &DVector<f64>) -> Option<(Tires, f64)> {
        let (logits, theta) = self.logits_and_parameters(z);
        let log_volume = |i: usize| {
            let far = logits[i].abs();
            self.width[i].ln() - far - 2.0 * (-far).exp().ln_1p()
        };
        let log_volume: f64 = (0..SIZE).map(log_volume).sum();
        (theta.iter().all(|x| x.is_finite()) && log_volume.is_finite())
            .then_some((tires::from_array(theta), log_volume))
    }

    /// Less the Hessian of the posterior's logarithm at a point, from that of the cost by the parameters, without second
    /// derivatives of the map: positive definite.
    pub fn transform_information(&self, z: &DVector<f64>, by_parameters: &DMatrix<f64>) -> DMatrix<f64> {
        let (logits, theta) = self.logits_and_parameters(z);
        let slopes = self.logit_derivatives(&logits);
        let box_term = |i: usize| 2.0 * slopes[i] / self.width[i];
        let by_logits = DMatrix::from_fn(SIZE, SIZE, |i, j| {
            by_parameters[(i, j)] * slopes[i] * slopes[j] + if i == j { box_term(i) } else { 0.0 }
        });
        let shear = self.shear_matrix(&theta, &slopes);
        shear.tr_mul(&by_logits) * shear
    }

    /// Derivatives of the parameters by the coordinates at a point.
    pub fn jacobian(&self, z: &DVector<f64>) -> DMatrix<f64> {
        let (logits, theta) = self.logits_and_parameters(z);
        let slopes = self.logit_derivatives(&logits);
        DMatrix::from_diagonal(&DVector::from_column_slice(&slopes)) * self.shear_matrix(&theta, &slopes)
    }

    /// The gradient of the posterior's logarithm at a point, from that of the cost by the parameters.
    pub fn transform_gradient(&self, z: &DVector<f64>, by_parameters: &DVector<f64>) -> DVector<f64> {
        let (logits, theta) = self.logits_and_parameters(z);
        let slopes = self.logit_derivatives(&logits);
        let by_logits =
            DVector::from_fn(SIZE, |i, _| 1.0 - 2.0 * logistic(logits[i]) - by_parameters[i] * slopes[i]);
        self.shear_matrix(&theta, &slopes).tr_mul(&by_logits)
    }

    /// The logits at a point, and the parameters.
    fn logits_and_parameters(&self, z: &DVector<f64>) -> (DVector<f64>, [f64; SIZE]) {
        let mut logits = z.clone();
        let mut theta = [0.0; SIZE];
        for axle in Axle::ALL {
            let at = parameter_indices(axle);
            for i in [at.C, at.D, at.E] {
                theta[i] = self.lower[i] + self.width[i] * logistic(z[i]);
            }
            logits[at.B] -= self.fall[axle] * (theta[at.C] * theta[at.D]).ln();
            theta[at.B] = self.lower[at.B] + self.width[at.B] * logistic(logits[at.B]);
        }
        (logits, theta)
    }

    /// dθ/d(logit) of each parameter.
    fn logit_derivatives(&self, logits: &DVector<f64>) -> [f64; SIZE] {
        std::array::from_fn(|i| {
            let share = logistic(logits[i]);
            self.width[i] * share * (1.0 - share)
        })
    }

    /// Derivatives of the logits by the coordinates.
    fn shear_matrix(&self, theta: &[f64; SIZE], slopes: &[f64; SIZE]) -> DMatrix<f64> {
        let mut shear = DMatrix::identity(SIZE, SIZE);
        for axle in Axle::ALL {
            let at = parameter_indices(axle);
            for i in [at.C, at.D] {
                shear[(at.B, i)] = -self.fall[axle] * slopes[i] / theta[i];
            }
        }
        shear
    }
}

fn logistic(z: f64) -> f64 {
    1.0 / (1.0 + (-z).exp())
}

#[cfg(test)]
mod tests {
    use approx::assert_relative_eq;
    use proptest::prelude::*;

    use super::*;

    const TIRES: Tires = Tires {
        front: TireParameters { B: 18.0, C: 1.6, D: 1.5, E: 0.5 },
        rear: TireParameters { B: 25.0, C: 1.9, D: 1.7, E: 0.9 },
    };

    fn coordinates() -> UnboundedCoordinates {
        UnboundedCoordinates::new(&tires::box_corners(&Bounds::GOBLIRSCH), &TIRES)
    }

    proptest! {
        #[test]
        fn a_point_and_its_parameters_belong_together(
            front in (5.4..39.6f64, 1.03..2.97f64, 0.14..1.96f64, -0.97..0.97f64),
            rear in (5.4..39.6f64, 1.03..2.97f64, 0.14..1.96f64, -0.97..0.97f64),
        ) {
            let theta = [front.0, front.1, front.2, front.3, rear.0, rear.1, rear.2, rear.3];
            let coordinates = coordinates();
            let z = coordinates.z_from_tires(&tires::from_array(theta));
            let (back, log_volume) = coordinates.tires_from_z(&z).expect("finite");
            for (back, theta) in tires::to_array(back).iter().zip(theta) {
                prop_assert!((back - theta).abs() < 1e-12 * (1.0 + theta.abs()));
            }
            // The information of a cost ½ |θ|² is JᵀJ, whose determinant is that of the volume, squared.
            let prior = coordinates.transform_information(&z, &DMatrix::zeros(8, 8));
            let product = coordinates.transform_information(&z, &DMatrix::identity(8, 8)) - prior;
            prop_assert!((product.determinant().ln() - 2.0 * log_volume).abs() < 1e-8);
        }
    }

    #[test]
    fn the_derivatives_are_those_of_differences() {
        let coordinates = coordinates();
        let z = coordinates.z_from_tires(&TIRES) + DVector::from_element(8, 0.2);
        // Of a cost Σ (i + 1) θ_i.
        let by_parameters = DVector::from_fn(8, |i, _| i as f64 + 1.0);
        let log = |z: &DVector<f64>| {
            let (theta, log_volume) = coordinates.tires_from_z(z).expect("finite");
            log_volume - by_parameters.dot(&tires::to_vector(&theta))
        };
        let gradient = coordinates.transform_gradient(&z, &by_parameters);
        for i in 0..8 {
            let moved = |step: f64| {
                let mut z = z.clone();
                z[i] += step;
                log(&z)
            };
            let difference = (moved(1e-5) - moved(-1e-5)) / 2e-5;
            assert_relative_eq!(gradient[i], difference, max_relative = 1e-7, epsilon = 1e-7);
        }
    }

    #[test]
    fn the_ridge_of_equal_stiffness_is_straight() {
        let coordinates = coordinates();
        let here = coordinates.z_from_tires(&TIRES);
        let mut along = TIRES;
        // 1 % more C, 1 % less B.
        (along.front.B, along.front.C) = (TIRES.front.B / 1.01, TIRES.front.C * 1.01);
        let change = coordinates.z_from_tires(&along) - &here;
        let logit = |B: f64| ((B - 5.0) / (40.0 - B)).ln();
        assert!(change[0].abs() < 0.02 * (logit(along.front.B) - logit(TIRES.front.B)).abs());
        assert!(change[1] > 0.0 && change.rows(2, 6).amax() < 1e-12);
    }

    #[test]
    fn all_points_are_in_the_box_and_what_is_no_point_is_nothing() {
        let coordinates = coordinates();
        let far = DVector::from_element(8, 30.0);
        let (theta, _) = coordinates.tires_from_z(&far).expect("finite");
        assert!((5.0..=40.0).contains(&theta.front.B) && (1.0..=3.0).contains(&theta.front.C));
        assert!(coordinates.tires_from_z(&DVector::from_element(8, f64::NAN)).is_none());
    }
}
