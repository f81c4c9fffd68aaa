//! One step of the extended Kalman filter with the Magic Formula inside, generic over numbers with derivatives.
//!
//! The mean moves by the trapezoidal rule of fourth order, x₁ = x₀ + h/2 (f₀ + f₁) + h²/12 (A₀ f₀ − A₁ f₁), with one step of
//! Newton's method from a Taylor series of third order. Its covariance moves with the derivative of that,
//! F = (I − A₁ h/2 + A₁² h²/12)⁻¹ (I + A₀ h/2 + A₀² h²/12), for constant A the second diagonal Padé approximant of e^(Ah), which is
//! stable for any A h and off by (A h)⁵/720. Two linearisations are all that a step needs. Measurements have independent noises
//! and are taken one after the other, which whitens them in that order: residual over standard deviation is the innovation
//! multiplied by the inverse Cholesky factor of its covariance.

use numerics::scalar::Scalar;

use crate::algebra::{self, ahead, defect, move_along, side, times};
use crate::car::{Car, Held, Linear, linearise};
use crate::sensors::Sensors;
use crate::tires::Tires;

/// Variances of the noises.
#[derive(Clone, Copy, Debug)]
pub struct Variances<T> {
    /// Growth of the variances of v_x, v_y, r and ξ_x [their squares per second].
    pub process: [T; 4],
    /// Of the measured v_x, v_y, r and a_y [their squares].
    pub sensor: [T; 4],
}

/// State and covariance.
#[derive(Clone, Copy, Debug)]
pub struct Belief<T> {
    /// v_x, v_y, r, ξ_x.
    pub x: [T; 4],
    /// Covariance, symmetric.
    pub P: [[T; 4]; 4],
}

/// Residuals of v_x, v_y, r and a_y, each given those before it, and their variances.
#[derive(Clone, Copy, Debug)]
pub struct Innovation<T> {
    /// Measured less expected.
    pub residual: [T; 4],
    /// Variance of that.
    pub variance: [T; 4],
}

/// What stays the same from sample to sample. With `ERRORS` the sensors err, which takes longer.
pub struct Filter<T, const ERRORS: bool> {
    /// The car.
    pub car: Car<T>,
    /// The tires.
    pub tires: Tires<T>,
    /// The noises.
    pub noise: Variances<T>,
    /// The errors of the sensors.
    pub sensors: Sensors<T>,
}

impl<T: Scalar, const ERRORS: bool> Filter<T, ERRORS> {
    /// Moves state and covariance over `h` [s] under a held input. The measured acceleration is linearised at the state that is
    /// returned, which is near the one that was moved to.
    #[inline(always)]
    fn predict(&self, belief: &mut Belief<T>, u: &Held<T>, h: f64) -> ([T; 4], Linear<T>) {
        let x = belief.x;
        let start = linearise(&self.car, &self.tires, &x, u);
        let second = times(&start.A, &start.rates);
        let rates = [start.rates, second, times(&start.A, &second)];
        let near = ahead(&x, &rates, h);
        let end = linearise(&self.car, &self.tires, &near, u);
        let bent = times(&end.A, &end.rates);
        let [M, N] = [side(&start.A, 0.5 * h), side(&end.A, -0.5 * h)];
        let inverse = inverse(&N);
        let zero = x[0].constant(0.0);
        let off = defect(&rates, &end.rates, &bent, h);
        belief.x = near;
        let mut F = [[zero; 4]; 3];
        for i in 0..3 {
            let row = &inverse[i];
            belief.x[i] = near[i] - dot(row, &off);
            for j in 0..3 {
                F[i][j] = dot(row, &[M[0][j], M[1][j], M[2][j]]);
            }
            F[i][3] = dot(row, &[M[0][3] - N[0][3], M[1][3] - N[1][3], M[2][3] - N[2][3]]);
        }
        move_along(&F, &mut belief.P);
        for i in 0..4 {
            belief.P[i][i] = belief.P[i][i].plus_scaled(self.noise.process[i], h);
        }
        (near, end)
    }

    /// Predicts over `h` [s] under a held input in `steps`, and corrects by what is measured at the end.
    #[inline(always)]
    pub fn step(
        &self,
        belief: &mut Belief<T>,
        u: &Held<T>,
        h: f64,
        steps: usize,
        measured: &[f64; 4],
    ) -> Innovation<T> {
        let part = h / steps as f64;
        let mut left = steps;
        // One call: each is a copy of all that is called.
        let (near, end) = loop {
            let there = self.predict(belief, u, part);
            left -= 1;
            if left == 0 {
                break there;
            }
        };
        self.correct(belief, &near, &end, measured)
    }

    /// Takes in the measurements, which are linear about the state `prior`.
    #[inline(always)]
    fn correct(
        &self,
        belief: &mut Belief<T>,
        prior: &[T; 4],
        at: &Linear<T>,
        measured: &[f64; 4],
    ) -> Innovation<T> {
        let zero = at.a_y.constant(0.0);
        let mut innovation = Innovation { residual: [zero; 4], variance: [zero; 4] };
        for i in 0..4 {
            let P = &belief.P;
            // Covariance of the state with the measured quantity, what is expected of the latter, and its variance.
            let (with, expected, own) = if i < 3 && !ERRORS {
                (P[i], belief.x[i], P[i][i])
            } else {
                let (mut expected, H) = if ERRORS {
                    let motion = [prior[0], prior[1], prior[2]];
                    self.sensors.measure(i, &motion, at)
                } else {
                    (at.a_y, at.C)
                };
                let mut with = [zero; 4];
                for j in 0..4 {
                    expected = expected.plus(H[j], belief.x[j] - prior[j]);
                    with[j] =
                        dot(&[H[0], H[1], H[2]], &[P[0][j], P[1][j], P[2][j]]).plus(H[3], P[3][j]);
                }
                let own =
                    dot(&[H[0], H[1], H[2]], &[with[0], with[1], with[2]]).plus(H[3], with[3]);
                (with, expected, own)
            };
            let variance = own + self.noise.sensor[i];
            let residual = -expected + measured[i];
            algebra::correct(&mut belief.x, &mut belief.P, &with, residual, variance);
            innovation.residual[i] = residual;
            innovation.variance[i] = variance;
        }
        innovation
    }
}

#[inline(always)]
fn dot<T: Scalar>(a: &[T; 3], b: &[T; 3]) -> T {
    (a[0] * b[0]).plus(a[1], b[1]).plus(a[2], b[2])
}

#[inline(always)]
fn cross<T: Scalar>(a: &[T; 4], b: &[T; 4]) -> [T; 3] {
    [
        (a[1] * b[2]).minus(a[2], b[1]),
        (a[2] * b[0]).minus(a[0], b[2]),
        (a[0] * b[1]).minus(a[1], b[0]),
    ]
}

/// Inverse of the first three columns, by Cramer's rule: columns of the adjugate are cross products of rows.
#[inline(always)]
fn inverse<T: Scalar>(N: &[[T; 4]; 3]) -> [[T; 3]; 3] {
    let adjugate = [cross(&N[1], &N[2]), cross(&N[2], &N[0]), cross(&N[0], &N[1])];
    let scale = dot(&[N[0][0], N[0][1], N[0][2]], &adjugate[0]).recip();
    let mut inverse = [[scale; 3]; 3];
    for i in 0..3 {
        for j in 0..3 {
            inverse[i][j] = adjugate[j][i] * scale;
        }
    }
    inverse
}
