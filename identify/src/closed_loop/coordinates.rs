//! Maps the box of both axles' parameters to coordinates in which a likelihood of driving is nearly normal.
//!
//! Of each axle: ln K and ln D, which data tell almost independently of the rest, K = B C D being the stiffness per load, and
//! the logits of the places of C and E between their bounds.

use nalgebra::{DMatrix, DVector};

use super::likelihood::Theta8;

/// A start this close to a bound, as a share of the box, is moved inside: the logit of the bound itself is infinite.
const INSIDE: f64 = 0.01;
/// Curvature of a prior that is hardly there, in ln K and ln D: where data tell nothing, the box decides, which is not much wider.
const WIDE: f64 = 1.0;

/// The box: lowest and highest parameters.
pub struct Coordinates<'a>(pub &'a [DVector<f64>; 2]);

impl Coordinates<'_> {
    fn edge(&self, i: usize) -> [f64; 2] {
        [self.0[0][i], self.0[1][i] - self.0[0][i]]
    }

    /// The point of some parameters.
    pub fn point(&self, theta: &Theta8) -> DVector<f64> {
        let mut z = DVector::zeros(8);
        for o in [0, 4] {
            z[o] = (theta[o] * theta[o + 1] * theta[o + 2]).ln();
            z[o + 2] = theta[o + 2].ln();
            for i in [o + 1, o + 3] {
                let [low, width] = self.edge(i);
                let share = ((theta[i] - low) / width).clamp(INSIDE, 1.0 - INSIDE);
                z[i] = (share / (1.0 - share)).ln();
            }
        }
        z
    }

    /// The parameters at a point, and the logarithm of their volume for one of the coordinates: ln |det ∂θ/∂z|. `None` outside
    /// of the box.
    pub fn parameters(&self, z: &DVector<f64>) -> Option<(Theta8, f64)> {
        let mut theta: Theta8 = [0.0; 8];
        let mut log_volume = 0.0;
        for o in [0, 4] {
            for i in [o + 1, o + 3] {
                let [low, width] = self.edge(i);
                let share = 1.0 / (1.0 + (-z[i]).exp());
                theta[i] = low + width * share;
                log_volume += (width * share * (1.0 - share)).ln();
            }
            theta[o + 2] = z[o + 2].exp();
            theta[o] = z[o].exp() / (theta[o + 1] * theta[o + 2]);
            log_volume += (theta[o] * theta[o + 2]).ln();
        }
        let inside = |i: usize| (self.0[0][i]..=self.0[1][i]).contains(&theta[i]);
        ((0..8).all(inside) && log_volume.is_finite()).then_some((theta, log_volume))
    }

    /// Less the Hessian of the posterior's logarithm at a point, from that of the cost by the parameters, without second
    /// derivatives of the map: positive definite.
    pub fn information(&self, z: &DVector<f64>, by_parameters: &DMatrix<f64>) -> DMatrix<f64> {
        let mut J = DMatrix::zeros(8, 8);
        let mut prior = DVector::zeros(8);
        for o in [0, 4] {
            let mut theta = [0.0; 4];
            for i in [1, 3] {
                let [low, width] = self.edge(o + i);
                let share = 1.0 / (1.0 + (-z[o + i]).exp());
                theta[i] = low + width * share;
                J[(o + i, o + i)] = width * share * (1.0 - share);
                prior[o + i] = 2.0 * share * (1.0 - share);
            }
            theta[2] = z[o + 2].exp();
            theta[0] = z[o].exp() / (theta[1] * theta[2]);
            J[(o + 2, o + 2)] = theta[2];
            J[(o, o)] = theta[0];
            J[(o, o + 1)] = -theta[0] / theta[1] * J[(o + 1, o + 1)];
            J[(o, o + 2)] = -theta[0];
            (prior[o], prior[o + 2]) = (WIDE, WIDE);
        }
        J.tr_mul(by_parameters) * &J + DMatrix::from_diagonal(&prior)
    }
}

#[cfg(test)]
mod tests {
    use approx::assert_relative_eq;
    use proptest::prelude::*;

    use super::*;

    fn corners() -> [DVector<f64>; 2] {
        let both = |side: [f64; 4]| DVector::from_fn(8, |i, _| side[i % 4]);
        [both([5.0, 1.0, 0.5, -1.0]), both([40.0, 2.8, 3.0, 1.0])]
    }

    proptest! {
        #[test]
        fn a_point_and_its_parameters_belong_together(
            front in (5.1..39.9f64, 1.05..2.75f64, 0.51..2.9f64, -0.95..0.95f64),
            rear in (5.1..39.9f64, 1.05..2.75f64, 0.51..2.9f64, -0.95..0.95f64),
        ) {
            let theta = [front.0, front.1, front.2, front.3, rear.0, rear.1, rear.2, rear.3];
            let corners = corners();
            let coordinates = Coordinates(&corners);
            let z = coordinates.point(&theta);
            let (back, log_volume) = coordinates.parameters(&z).expect("inside");
            for (back, theta) in back.iter().zip(theta) {
                prop_assert!((back - theta).abs() < 1e-12 * (1.0 + theta.abs()));
            }
            // The information of a cost ½ |θ|² is JᵀJ, whose determinant is that of the volume, squared.
            let prior = coordinates.information(&z, &DMatrix::zeros(8, 8));
            let product = coordinates.information(&z, &DMatrix::identity(8, 8)) - prior;
            prop_assert!((product.determinant().ln() - 2.0 * log_volume).abs() < 1e-8);
        }
    }

    #[test]
    fn the_volume_is_that_of_differences() {
        let corners = corners();
        let coordinates = Coordinates(&corners);
        let z = coordinates.point(&[18.0, 1.6, 1.5, 0.5, 25.0, 1.9, 1.7, 0.9]);
        let mut J = DMatrix::zeros(8, 8);
        for j in 0..8 {
            let moved = |step: f64| {
                let mut z = z.clone();
                z[j] += step;
                DVector::from_column_slice(&coordinates.parameters(&z).expect("inside").0)
            };
            J.set_column(j, &((moved(1e-5) - moved(-1e-5)) / 2e-5));
        }
        let (_, log_volume) = coordinates.parameters(&z).expect("inside");
        assert_relative_eq!(J.determinant().abs().ln(), log_volume, max_relative = 1e-8);
    }

    #[test]
    fn outside_of_the_box_is_nothing() {
        let corners = corners();
        let coordinates = Coordinates(&corners);
        let mut z = coordinates.point(&[39.0, 1.6, 1.5, 0.5, 25.0, 1.9, 1.7, 0.9]);
        assert!(coordinates.parameters(&z).is_some());
        z[0] += 0.05;
        assert!(coordinates.parameters(&z).is_none());
        z[0] = f64::NAN;
        assert!(coordinates.parameters(&z).is_none());
    }
}
