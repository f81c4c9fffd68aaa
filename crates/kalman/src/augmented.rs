//! The extended Kalman filter with an augmented state, over any kind of number: a base state that a process model moves, a coloured noise
//! of each sensor as further states, and measurements with independent noises that are taken in one after the other.
//!
//! The mean of the base state moves by the trapezoidal rule of fourth order, x₁ = x₀ + h/2 (f₀ + f₁) + h²/12 (A₀ f₀ − A₁ f₁), with one
//! step of Newton's method from a Taylor series of third order. Its covariance moves with the derivative of that,
//! F = (I − A₁ h/2 + A₁² h²/12)⁻¹ (I + A₀ h/2 + A₀² h²/12), for constant A the second diagonal Padé approximant of e^(Ah), which is
//! stable for any A h and off by (A h)⁵/720. Two linearisations are all that a step needs. To take measurements one after the other
//! whitens them in that order: residual over standard deviation is the innovation multiplied by the inverse Cholesky factor of its
//! covariance.
//!
//! Sizes: `M` states have rates and come first; with those that stand still they are the `S` states of the model; with a coloured noise
//! of each of the `C` sensors they are all `N` states, where `N` is `S` or `S + C`.
#![allow(non_snake_case, reason = "matrices are written as in the equations")]
#![allow(clippy::needless_range_loop, reason = "indices as in the equations")]

use elementary::scalar::Scalar;
use nalgebra::{SMatrix, SVector};
use serde::Serialize;

use crate::gaussian::Gaussian;

/// Mean and covariance of a state.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StateEstimate<T, const N: usize> {
    /// Mean.
    pub x: [T; N],
    /// Covariance, symmetric.
    pub P: [[T; N]; N],
}

impl<T: Scalar, const N: usize> StateEstimate<T, N> {
    /// P ← F P Fᵀ, where F has these rows for the first `M` states, in its first `S` columns, and is the identity elsewhere.
    #[inline(always)]
    pub fn propagate_covariance<const M: usize, const S: usize>(&mut self, F: &[[T; S]; M]) {
        let P = &mut self.P;
        let mut FP = [[P[0][0]; N]; M];
        for i in 0..M {
            for j in 0..N {
                FP[i][j] = F[i][0] * P[0][j];
                for k in 1..S {
                    FP[i][j] = FP[i][j].add_product(F[i][k], P[k][j]);
                }
            }
        }
        for i in 0..M {
            for j in i..M {
                let mut entry = FP[i][0] * F[j][0];
                for k in 1..S {
                    entry = entry.add_product(FP[i][k], F[j][k]);
                }
                P[i][j] = entry;
                P[j][i] = entry;
            }
            for j in M..N {
                P[i][j] = FP[i][j];
                P[j][i] = FP[i][j];
            }
        }
    }

    /// One step of a state n that is a Gauss–Markov process of first order: n ← φ n + w, with the variance of w.
    #[inline(always)]
    pub fn propagate_gauss_markov(&mut self, state: usize, correlation: T, variance: T) {
        self.x[state] = self.x[state] * correlation;
        for j in 0..N {
            self.P[state][j] = self.P[state][j] * correlation;
            self.P[j][state] = self.P[j][state] * correlation;
        }
        self.P[state][state] = self.P[state][state] + variance;
    }

    /// Takes in a measurement with this residual and its variance, which has these covariances with the states.
    #[inline(always)]
    pub fn update(&mut self, cross_covariance: &[T; N], residual: T, variance: T) {
        let inverse = variance.recip();
        for j in 0..N {
            let gain = cross_covariance[j] * inverse;
            self.x[j] = self.x[j].add_product(gain, residual);
            for l in j..N {
                let less = self.P[j][l].subtract_product(gain, cross_covariance[l]);
                self.P[j][l] = less;
                self.P[l][j] = less;
            }
        }
    }
}

impl<const N: usize> From<&StateEstimate<f64, N>> for Gaussian<N> {
    fn from(estimate: &StateEstimate<f64, N>) -> Self {
        Self { mean: SVector::from(estimate.x), cov: SMatrix::from_fn(|i, j| estimate.P[i][j]) }
    }
}

/// The linearisation of a process model at a state.
pub trait Linearisation<T, const M: usize, const S: usize> {
    /// Rates of the first `M` states [1/s].
    fn rates(&self) -> &[T; M];

    /// Their derivatives by the state [1/s], `M` × `S`.
    fn jacobian(&self) -> &[[T; S]; M];
}

/// How the first `M` of `S` states move; the others stand still but for their noise.
pub trait ProcessModel<T, const M: usize, const S: usize> {
    /// What acts on the state at an instant.
    type Input;
    /// The model at a state.
    type Linearisation: Linearisation<T, M, S>;
    /// States with process noise.
    const NOISY: &'static [usize];

    /// The model at a state under an input.
    fn linearise(&self, x: &[T; S], input: &Self::Input) -> Self::Linearisation;
}

/// An input over one step.
pub trait InputSegment<U> {
    /// The input at the end of a part of the step, which is given by shares from 0 to 1, after that at its start with which the mean of both
    /// is the mean over the part: so the trapezoidal rule is exact for inputs that act linearly, however they move.
    fn equivalent_ends(&self, part: [f64; 2]) -> [U; 2];
}

/// An input that stays the same during a step.
#[derive(Clone, Copy, Debug)]
pub struct ZeroOrderHold<U>(pub U);

impl<U: Copy> InputSegment<U> for ZeroOrderHold<U> {
    #[inline(always)]
    fn equivalent_ends(&self, _: [f64; 2]) -> [U; 2] {
        [self.0; 2]
    }
}

/// What sensors show at a state.
pub trait MeasurementModel<T, L, const S: usize> {
    /// Each of the first channels shows the state of its index as it is.
    const DIRECT: usize;

    /// What a channel is expected to show at a state with this linearisation, and the derivatives of that by the state.
    fn predict_measurement(&self, channel: usize, x: &[T; S], linearised: &L) -> (T, [T; S]);
}

/// Noise of a sensor of which a share of the variance lasts: n ← φ n + w from row to row, beside a white noise.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct ColouredNoise<T> {
    /// Correlation φ from row to row.
    pub correlation: T,
    /// Share of the variance that lasts.
    pub share: T,
}

impl ColouredNoise<f64> {
    /// Noise of which nothing lasts.
    pub const WHITE: Self = Self { correlation: 0.0, share: 0.0 };
}

impl<T> ColouredNoise<T> {
    /// The same in other numbers.
    pub fn map<U>(self, f: impl Fn(T) -> U) -> ColouredNoise<U> {
        ColouredNoise { correlation: f(self.correlation), share: f(self.share) }
    }
}

/// Residuals of the sensors, each given those before it, and their variances.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Innovations<T, const C: usize> {
    /// Measured less expected.
    pub residual: [T; C],
    /// Variance of that.
    pub variance: [T; C],
}

/// What stays the same from step to step.
#[derive(Clone, Copy, Debug)]
pub struct AugmentedFilter<P, Z, T, const K: usize, const C: usize> {
    /// How the state moves.
    pub process: P,
    /// What sensors show.
    pub measurement: Z,
    /// Growth of the variances of [`ProcessModel::NOISY`] states [squares of their units per second].
    pub process_noise: [T; K],
    /// Variances of the noises of the sensors, of what lasts and of what does not.
    pub sensor_noise: [T; C],
    /// How much of these lasts; not used without states for it.
    pub coloured_noise: [ColouredNoise<T>; C],
}

impl<P, Z, T: Scalar, const K: usize, const C: usize> AugmentedFilter<P, Z, T, K, C> {
    /// Predicts over `h` [s] under inputs in some sub-steps, and takes in what is measured at the end. A value that is no number is not
    /// there: its residual is 0 and its variance 1.
    #[inline(always)]
    pub fn step<const M: usize, const S: usize, const N: usize>(
        &self,
        estimate: &mut StateEstimate<T, N>,
        inputs: &impl InputSegment<P::Input>,
        h: f64,
        substeps: usize,
        measured: &[f64; C],
    ) -> Innovations<T, C>
    where
        P: ProcessModel<T, M, S>,
        Z: MeasurementModel<T, P::Linearisation, S>,
    {
        let part = h / substeps as f64;
        let mut done = 0;
        // One call: each is a copy of all that is called.
        let (near, end) = loop {
            done += 1;
            let shares = [done - 1, done].map(|parts| parts as f64 / substeps as f64);
            let there = self.predict(estimate, &inputs.equivalent_ends(shares), part);
            if done == substeps {
                break there;
            }
        };
        if N > S {
            for i in 0..C {
                let ColouredNoise { correlation, share } = self.coloured_noise[i];
                let lasting = self.sensor_noise[i] * share;
                let fresh = lasting.subtract_product(lasting, correlation * correlation);
                estimate.propagate_gauss_markov(S + i, correlation, fresh);
            }
        }
        self.update(estimate, &near, &end, measured)
    }

    /// Moves state and covariance over `h` [s] between two inputs. Its rate adds h²/12 (∂f₀/∂u − ∂f₁/∂u) u' to the rule, which is left out:
    /// it is 0 where inputs act linearly. Measurements are linearised at the state that is returned, which is
    /// near the one that was moved to.
    #[inline(always)]
    fn predict<const M: usize, const S: usize, const N: usize>(
        &self,
        estimate: &mut StateEstimate<T, N>,
        [before, after]: &[P::Input; 2],
        h: f64,
    ) -> ([T; S], P::Linearisation)
    where
        P: ProcessModel<T, M, S>,
    {
        let mut x = [estimate.x[0]; S];
        x.copy_from_slice(&estimate.x[..S]);
        let start = self.process.linearise(&x, before);
        let first = *start.rates();
        let second = multiply_leading_columns(start.jacobian(), &first);
        let third = multiply_leading_columns(start.jacobian(), &second);
        let mut near = x;
        for i in 0..M {
            let tail = (second[i] * (h * h / 2.0)).add_scaled(third[i], h * h * h / 6.0);
            near[i] = (x[i] + tail).add_scaled(first[i], h);
        }
        let end = self.process.linearise(&near, after);
        let rates = end.rates();
        let change = multiply_leading_columns(end.jacobian(), rates);
        // What the Taylor series is off by in the trapezoidal rule.
        let mut residual = first;
        for i in 0..M {
            residual[i] = ((first[i] - rates[i]) * (0.5 * h))
                .add_scaled(change[i].add_scaled(second[i], 5.0), h * h / 12.0)
                .add_scaled(third[i], h * h * h / 6.0);
        }
        let mut F = half_step(start.jacobian(), 0.5 * h);
        let back = half_step(end.jacobian(), -0.5 * h);
        for i in 0..M {
            // Columns of states that stand still belong to the right-hand side.
            for j in M..S {
                F[i][j] = F[i][j] - back[i][j];
            }
        }
        solve_leading_columns(back, &mut F, &mut residual);
        estimate.x[..S].copy_from_slice(&near);
        for i in 0..M {
            estimate.x[i] = near[i] - residual[i];
        }
        estimate.propagate_covariance(&F);
        for k in 0..K {
            let state = P::NOISY[k];
            estimate.P[state][state] = estimate.P[state][state].add_scaled(self.process_noise[k], h);
        }
        (near, end)
    }

    /// Takes in the measurements, which are linear about the state `prior`.
    #[inline(always)]
    fn update<L, const S: usize, const N: usize>(
        &self,
        estimate: &mut StateEstimate<T, N>,
        prior: &[T; S],
        linearised: &L,
        measured: &[f64; C],
    ) -> Innovations<T, C>
    where
        Z: MeasurementModel<T, L, S>,
    {
        let zero = prior[0].constant(0.0);
        let mut innovations = Innovations { residual: [zero; C], variance: [zero; C] };
        for i in 0..C {
            if measured[i].is_nan() {
                innovations.variance[i] = zero.constant(1.0);
                continue;
            }
            let StateEstimate { x, P } = &*estimate;
            // Covariance of the states with the measured quantity, what is expected of the latter, and its variance.
            let (cross_covariance, expected, own) = if N == S && i < Z::DIRECT {
                (P[i], x[i], P[i][i])
            } else {
                let (mut expected, H) = self.measurement.predict_measurement(i, prior, linearised);
                let mut cross = [zero; N];
                if N > S {
                    expected = expected + x[S + i];
                    cross = P[S + i];
                }
                for k in 0..S {
                    expected = expected.add_product(H[k], x[k] - prior[k]);
                    for j in 0..N {
                        cross[j] = cross[j].add_product(H[k], P[k][j]);
                    }
                }
                let mut own = H[0] * cross[0];
                for k in 1..S {
                    own = own.add_product(H[k], cross[k]);
                }
                (cross, expected, own)
            };
            let mut variance = own + self.sensor_noise[i];
            if N > S {
                let lasting = self.coloured_noise[i].share;
                variance =
                    (variance + cross_covariance[S + i]).subtract_product(self.sensor_noise[i], lasting);
            }
            let residual = -expected + measured[i];
            estimate.update(&cross_covariance, residual, variance);
            innovations.residual[i] = residual;
            innovations.variance[i] = variance;
        }
        innovations
    }
}

/// The first `M` columns of A times a vector: how rates change as the states move on.
#[inline(always)]
fn multiply_leading_columns<T: Scalar, const M: usize, const S: usize>(
    A: &[[T; S]; M],
    v: &[T; M],
) -> [T; M] {
    let mut product = *v;
    for i in 0..M {
        product[i] = A[i][0] * v[0];
        for j in 1..M {
            product[i] = product[i].add_product(A[i][j], v[j]);
        }
    }
    product
}

/// The first rows of I + A s + A² s²/3.
#[inline(always)]
fn half_step<T: Scalar, const M: usize, const S: usize>(A: &[[T; S]; M], s: f64) -> [[T; S]; M] {
    let mut sum = *A;
    for i in 0..M {
        for j in 0..S {
            let mut square = A[i][0] * A[0][j];
            for k in 1..M {
                square = square.add_product(A[i][k], A[k][j]);
            }
            sum[i][j] = (A[i][j] * s).add_scaled(square, s * s / 3.0);
        }
        sum[i][i] = sum[i][i] + 1.0;
    }
    sum
}

/// Solves L X = right and L y = vector with the first `M` columns of L, which is near the identity or larger on its diagonal: by Cramer's
/// rule for three rows, else by elimination.
#[inline(always)]
fn solve_leading_columns<T: Scalar, const M: usize, const S: usize>(
    mut L: [[T; S]; M],
    right: &mut [[T; S]; M],
    vector: &mut [T; M],
) {
    if M == 3 {
        // No closures: those are not always inlined into the code for wide vectors.
        let inverse = inverse_3x3([
            [L[0][0], L[0][1], L[0][2]],
            [L[1][0], L[1][1], L[1][2]],
            [L[2][0], L[2][1], L[2][2]],
        ]);
        let (a, b, c) = (right[0], right[1], right[2]);
        let v = [vector[0], vector[1], vector[2]];
        for i in 0..3 {
            vector[i] = dot(&inverse[i], &v);
            for j in 0..S {
                right[i][j] = dot(&inverse[i], &[a[j], b[j], c[j]]);
            }
        }
        return;
    }
    for pivot in 0..M {
        let inverse = L[pivot][pivot].recip();
        for j in pivot..M {
            L[pivot][j] = L[pivot][j] * inverse;
        }
        for j in 0..S {
            right[pivot][j] = right[pivot][j] * inverse;
        }
        vector[pivot] = vector[pivot] * inverse;
        for i in 0..M {
            if i == pivot {
                continue;
            }
            let factor = L[i][pivot];
            for j in pivot..M {
                L[i][j] = L[i][j].subtract_product(factor, L[pivot][j]);
            }
            for j in 0..S {
                right[i][j] = right[i][j].subtract_product(factor, right[pivot][j]);
            }
            vector[i] = vector[i].subtract_product(factor, vector[pivot]);
        }
    }
}

#[inline(always)]
fn dot<T: Scalar>(a: &[T; 3], b: &[T; 3]) -> T {
    (a[0] * b[0]).add_product(a[1], b[1]).add_product(a[2], b[2])
}

#[inline(always)]
fn cross<T: Scalar>(a: &[T; 3], b: &[T; 3]) -> [T; 3] {
    [
        (a[1] * b[2]).subtract_product(a[2], b[1]),
        (a[2] * b[0]).subtract_product(a[0], b[2]),
        (a[0] * b[1]).subtract_product(a[1], b[0]),
    ]
}

/// Inverse by Cramer's rule: columns of the adjugate are cross products of rows.
#[inline(always)]
fn inverse_3x3<T: Scalar>(L: [[T; 3]; 3]) -> [[T; 3]; 3] {
    let adjugate = [cross(&L[1], &L[2]), cross(&L[2], &L[0]), cross(&L[0], &L[1])];
    let scale = dot(&L[0], &adjugate[0]).recip();
    let mut inverse = [[scale; 3]; 3];
    for i in 0..3 {
        for j in 0..3 {
            inverse[i][j] = adjugate[j][i] * scale;
        }
    }
    inverse
}

#[cfg(test)]
mod tests {
    use approx::assert_relative_eq;
    use nalgebra::{SMatrix, SVector};

    use super::*;
    use crate::{measurement_update, predict, transition_matrix};

    /// x' = A x of `M` states, driven by a last one that stands still.
    struct Linear<const M: usize, const S: usize>([[f64; S]; M]);

    struct StateLinearisation<const M: usize, const S: usize> {
        rates: [f64; M],
        A: [[f64; S]; M],
    }

    impl<const M: usize, const S: usize> Linearisation<f64, M, S> for StateLinearisation<M, S> {
        fn rates(&self) -> &[f64; M] {
            &self.rates
        }

        fn jacobian(&self) -> &[[f64; S]; M] {
            &self.A
        }
    }

    impl<const M: usize, const S: usize> ProcessModel<f64, M, S> for Linear<M, S> {
        type Input = ();
        type Linearisation = StateLinearisation<M, S>;
        const NOISY: &'static [usize] = &[0, 1];

        fn linearise(&self, x: &[f64; S], (): &()) -> StateLinearisation<M, S> {
            let row = |i: usize| (0..S).map(|j| self.0[i][j] * x[j]).sum();
            StateLinearisation { rates: std::array::from_fn(row), A: self.0 }
        }
    }

    /// The first two states, the second of them with a gain.
    struct TwoStates;

    impl<L, const S: usize> MeasurementModel<f64, L, S> for TwoStates {
        const DIRECT: usize = 1;

        fn predict_measurement(&self, channel: usize, x: &[f64; S], _: &L) -> (f64, [f64; S]) {
            let gain = [1.0, 1.3][channel];
            let mut H = [0.0; S];
            H[channel] = gain;
            (gain * x[channel], H)
        }
    }

    /// Against a filter of matrices with all states at once, with measurements that follow no law.
    fn compare<const M: usize, const S: usize, const N: usize>(A: [[f64; S]; M], shares: [f64; 2]) {
        let h = 0.02;
        let (process_noise, sensor_noise) = ([0.3, 0.2], [0.04, 0.09]);
        let coloured_noise = shares.map(|share| ColouredNoise { correlation: 0.8, share });
        let filter = AugmentedFilter {
            process: Linear(A),
            measurement: TwoStates,
            process_noise,
            sensor_noise,
            coloured_noise,
        };
        let lasting = |i: usize| sensor_noise[i] * shares[i];
        let mut estimate = StateEstimate { x: [0.1; N], P: [[0.0; N]; N] };
        for i in 0..N {
            estimate.P[i][i] = if i < S { 1.0 } else { lasting(i - S) };
        }
        let mut reference = Gaussian::from(&estimate);
        let mut whole = SMatrix::<f64, N, N>::zeros();
        let mut Q = SMatrix::<f64, N, N>::zeros();
        for i in 0..M {
            for j in 0..S {
                whole[(i, j)] = A[i][j];
            }
        }
        let mut F = transition_matrix(&whole, h);
        for i in 0..2 {
            Q[(i, i)] = process_noise[i] * h;
            if N > S {
                F[(S + i, S + i)] = 0.8;
                Q[(S + i, S + i)] = lasting(i) * (1.0 - 0.64);
            }
        }
        let mut H = SMatrix::<f64, 2, N>::zeros();
        (H[(0, 0)], H[(1, 1)]) = (1.0, 1.3);
        let mut R = SMatrix::<f64, 2, 2>::from_diagonal(&SVector::from(sensor_noise));
        if N > S {
            (H[(0, S)], H[(1, S + 1)]) = (1.0, 1.0);
            (0..2).for_each(|i| R[(i, i)] -= lasting(i));
        }
        for k in 0..200 {
            let measured = [(0.3 * f64::from(k)).sin(), (0.11 * f64::from(k * k)).cos()];
            let innovations = filter.step(&mut estimate, &ZeroOrderHold(()), h, 1, &measured);
            let prior = predict(&reference, F * reference.mean, &F, &Q);
            let residual = SVector::from(measured) - H * prior.mean;
            let (posterior, expected) = measurement_update(&prior, &residual, &H, &R).expect("a covariance");
            reference = posterior;
            let nis: f64 = (0..2).map(|i| innovations.residual[i].powi(2) / innovations.variance[i]).sum();
            assert_relative_eq!(nis, expected.nis, max_relative = 1e-6, epsilon = 1e-9);
            for i in 0..N {
                assert_relative_eq!(estimate.x[i], reference.mean[i], epsilon = 1e-7);
                for j in 0..N {
                    assert_relative_eq!(estimate.P[i][j], reference.cov[(i, j)], epsilon = 1e-7);
                }
            }
        }
    }

    #[test]
    fn it_is_the_filter_of_matrices_with_and_without_coloured_noise() {
        let two = [[-0.5, 1.0, 0.0], [-2.0, -0.4, 1.0]];
        compare::<2, 3, 3>(two, [0.0; 2]);
        compare::<2, 3, 5>(two, [0.5, 0.2]);
        let three = [[-0.5, 1.0, 0.0, 0.2], [-2.0, -0.4, 0.3, 0.0], [0.1, 0.0, -1.0, 1.0]];
        compare::<3, 4, 4>(three, [0.0; 2]);
        compare::<3, 4, 6>(three, [0.5, 0.2]);
    }
}
