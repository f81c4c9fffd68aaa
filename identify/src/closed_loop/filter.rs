//! One step of the extended Kalman filter that has the Magic Formula inside, for numbers that carry derivatives.
//!
//! The mean is integrated by Runge-Kutta steps. Its covariance moves with the Jacobian A at the middle of the step, through the
//! second diagonal Padé approximant of e^(Ah), which is stable for any A h and off by (A h)⁵/720. Measurements have
//! independent noises and are taken one after the other, which whitens them in that order: residual over standard deviation is
//! the innovation multiplied by the inverse Cholesky factor of its covariance.

use vehicle::Vehicle;

use super::car::{Held, Linear, Tires, linearise, rates};
use super::scalar::Scalar;

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

/// What stays the same from sample to sample.
pub struct Filter<'a, T> {
    /// The car; its own tires are not used.
    pub car: &'a Vehicle,
    /// The tires.
    pub tires: Tires<T>,
    /// The noises.
    pub noise: Variances<T>,
}

impl<T: Scalar> Filter<'_, T> {
    /// The state at the middle and at the end of a step of `h` [s] in 2 `half` Runge-Kutta steps.
    #[inline(always)]
    fn integrate(&self, x: &[T; 4], u: &Held, h: f64, half: usize) -> [[T; 4]; 2] {
        let step = h / (2 * half) as f64;
        let mut x = *x;
        let mut middle = x;
        for i in 0..2 * half {
            if i == half {
                middle = x;
            }
            let ahead =
                |h: f64, k: &[T; 3]| [x[0] + k[0] * h, x[1] + k[1] * h, x[2] + k[2] * h, x[3]];
            let k1 = rates(self.car, &self.tires, &x, u);
            let k2 = rates(self.car, &self.tires, &ahead(0.5 * step, &k1), u);
            let k3 = rates(self.car, &self.tires, &ahead(0.5 * step, &k2), u);
            let k4 = rates(self.car, &self.tires, &ahead(step, &k3), u);
            for i in 0..3 {
                x[i] = x[i] + (k1[i] + (k2[i] + k3[i]) * 2.0 + k4[i]) * (step / 6.0);
            }
        }
        [middle, x]
    }

    /// Predicts over `h` [s] under a held input, and corrects by what is measured at the end.
    #[inline(always)]
    pub fn step(
        &self,
        belief: &mut Belief<T>,
        u: &Held,
        h: f64,
        half: usize,
        measured: &[f64; 4],
    ) -> Innovation<T> {
        let [middle, end] = self.integrate(&belief.x, u, h, half);
        let F = transition(&linearise(self.car, &self.tires, &middle, u).A, h);
        belief.P = predicted(&F, &belief.P);
        for i in 0..4 {
            belief.P[i][i] = belief.P[i][i] + self.noise.process[i] * h;
        }
        belief.x = end;
        let Linear { a_y, C, .. } = linearise(self.car, &self.tires, &end, u);
        self.correct(belief, &end, a_y, &C, measured)
    }

    #[inline(always)]
    fn correct(
        &self,
        belief: &mut Belief<T>,
        prior: &[T; 4],
        a_y: T,
        C: &[T; 4],
        measured: &[f64; 4],
    ) -> Innovation<T> {
        let zero = T::constant(0.0);
        let mut innovation = Innovation { residual: [zero; 4], variance: [zero; 4] };
        for i in 0..4 {
            let P = &belief.P;
            // Covariance of the state with the measured quantity, and what is expected of the latter.
            let (with, expected) = if i < 3 {
                (P[i], belief.x[i])
            } else {
                let mut with = [zero; 4];
                let mut expected = a_y;
                for j in 0..4 {
                    expected = expected + C[j] * (belief.x[j] - prior[j]);
                    with[j] = C[0] * P[0][j] + C[1] * P[1][j] + C[2] * P[2][j] + C[3] * P[3][j];
                }
                (with, expected)
            };
            let own = if i < 3 {
                with[i]
            } else {
                C[0] * with[0] + C[1] * with[1] + C[2] * with[2] + C[3] * with[3]
            };
            let variance = own + self.noise.sensor[i];
            let inverse = variance.recip();
            let residual = -expected + measured[i];
            for j in 0..4 {
                let gain = with[j] * inverse;
                belief.x[j] = belief.x[j] + gain * residual;
                for (l, with) in with.iter().enumerate().skip(j) {
                    let less = belief.P[j][l] - gain * *with;
                    belief.P[j][l] = less;
                    belief.P[l][j] = less;
                }
            }
            innovation.residual[i] = residual;
            innovation.variance[i] = variance;
        }
        innovation
    }
}

/// The first three rows of F = I + h N⁻¹ A with N = I − A h/2 + A² h²/12; the fourth is that of the identity.
#[inline(always)]
fn transition<T: Scalar>(A: &[[T; 4]; 3], h: f64) -> [[T; 4]; 3] {
    let zero = T::constant(0.0);
    let mut N = [[zero; 3]; 3];
    for i in 0..3 {
        for j in 0..3 {
            let square = A[i][0] * A[0][j] + A[i][1] * A[1][j] + A[i][2] * A[2][j];
            N[i][j] = square * (h * h / 12.0) - A[i][j] * (0.5 * h);
        }
        N[i][i] = N[i][i] + 1.0;
    }
    // Cramer's rule: columns of the adjugate are cross products of rows.
    let cross = |a: [T; 3], b: [T; 3]| {
        [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
    };
    let adjugate = [cross(N[1], N[2]), cross(N[2], N[0]), cross(N[0], N[1])];
    let determinant =
        N[0][0] * adjugate[0][0] + N[0][1] * adjugate[0][1] + N[0][2] * adjugate[0][2];
    let scale = determinant.recip() * h;
    let mut F = [[zero; 4]; 3];
    for j in 0..4 {
        let column = [A[0][j] * scale, A[1][j] * scale, A[2][j] * scale];
        for i in 0..3 {
            F[i][j] = adjugate[0][i] * column[0]
                + adjugate[1][i] * column[1]
                + adjugate[2][i] * column[2];
        }
    }
    for (i, row) in F.iter_mut().enumerate() {
        row[i] = row[i] + 1.0;
    }
    F
}

/// F P Fᵀ, with the fourth row of F being that of the identity.
#[inline(always)]
fn predicted<T: Scalar>(F: &[[T; 4]; 3], P: &[[T; 4]; 4]) -> [[T; 4]; 4] {
    let mut FP = [[T::constant(0.0); 4]; 3];
    for i in 0..3 {
        for j in 0..4 {
            FP[i][j] =
                F[i][0] * P[0][j] + F[i][1] * P[1][j] + F[i][2] * P[2][j] + F[i][3] * P[3][j];
        }
    }
    let mut after = *P;
    for i in 0..3 {
        for j in i..3 {
            let entry =
                FP[i][0] * F[j][0] + FP[i][1] * F[j][1] + FP[i][2] * F[j][2] + FP[i][3] * F[j][3];
            after[i][j] = entry;
            after[j][i] = entry;
        }
        after[i][3] = FP[i][3];
        after[3][i] = FP[i][3];
    }
    after
}
