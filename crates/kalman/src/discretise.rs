//! Turns continuous linear dynamics and noise into those of one sample period.
#![allow(non_snake_case, reason = "matrices are written as in the equations")]

use nalgebra::SMatrix;

use crate::gaussian::symmetric_part;

/// 1 / k! for k = 0 to 16.
const INVERSE_FACTORIALS: [f64; 17] = {
    let mut c = [1.0; 17];
    let mut k = 1;
    while k < 17 {
        c[k] = c[k - 1] / k as f64;
        k += 1;
    }
    c
};

/// Largest 1-norm for which 16 Taylor terms of the exponential leave less than a rounding error:
/// 0.7^17 / 17! = 7e-18.
const TAYLOR_REACH: f64 = 0.7;

/// Largest 1-norm of A h for which [`noise_series`] converges fast: its terms fall like
/// 1 / (k + 1)!.
const NOISE_REACH: f64 = 0.5;

/// Largest column sum of absolute values.
#[inline]
fn norm_1<const N: usize>(A: &SMatrix<f64, N, N>) -> f64 {
    A.column_iter().map(|column| column.iter().map(|a| a.abs()).sum()).fold(0.0, f64::max)
}

/// Number of halvings that bring a norm below a reach.
#[inline]
fn halving_count(norm: f64, reach: f64) -> i32 {
    if norm > reach && norm.is_finite() { (norm / reach).log2().ceil() as i32 } else { 0 }
}

/// Taylor polynomial of degree 16 of the exponential, in powers of X⁴ (Paterson and Stockmeyer
/// 1973), which takes six products instead of fifteen.
#[inline]
fn exponential_near_zero<const N: usize>(X: &SMatrix<f64, N, N>) -> SMatrix<f64, N, N> {
    let c = &INVERSE_FACTORIALS;
    let X2 = X * X;
    let X3 = X2 * X;
    let X4 = X2 * X2;
    let block = |k: usize| {
        let mut p = X * c[k + 1] + X2 * c[k + 2] + X3 * c[k + 3];
        for i in 0..N {
            p[(i, i)] += c[k];
        }
        p
    };
    let mut p = block(12) + X4 * c[16];
    for k in [8, 4, 0] {
        p = block(k) + X4 * p;
    }
    p
}

/// Transition matrix F = e^(A h) of x' = A x over the period `h` [s], to rounding error.
///
/// Scaling and squaring (Moler and Van Loan 2003, method 3): e^X = (e^(X / 2^s))^(2^s). Without
/// scaling, up to a 1-norm of A h of 0.7, this costs six matrix products; each doubling of the norm
/// costs one more. Entries that are not finite stay so.
#[inline]
pub fn transition_matrix<const N: usize>(A: &SMatrix<f64, N, N>, h: f64) -> SMatrix<f64, N, N> {
    let s = halving_count(norm_1(A) * h.abs(), TAYLOR_REACH);
    let mut F = exponential_near_zero(&(A * (h * 0.5f64.powi(s))));
    for _ in 0..s {
        F *= F;
    }
    F
}

/// Series of Q_d over a short period: Σ h^(k+1) / (k+1)! Lᵏ(Q_c) with L(X) = A X + X Aᵀ.
fn noise_series<const N: usize>(
    A: &SMatrix<f64, N, N>,
    Q_c: &SMatrix<f64, N, N>,
    h: f64,
) -> SMatrix<f64, N, N> {
    let mut term = Q_c * h;
    let mut sum = term;
    // With a norm of A h of 0.5 the 19th term is 1 / 20! of the first.
    for k in 1..20 {
        let half = A * term * (h / (k + 1) as f64);
        term = half + half.transpose();
        sum += term;
        if norm_1(&term) <= f64::EPSILON * 0.01 * norm_1(&sum) {
            break;
        }
    }
    sum
}

/// Transition matrix F and noise covariance Q_d of x' = A x + w over the period `h` [s], to
/// rounding error.
///
/// w is white with the symmetric spectral density `Q_c` [square of the state's unit per second],
/// and Q_d = ∫₀ʰ e^(As) Q_c e^(Aᵀs) ds (the integral of Van Loan 1978). A short period is summed as
/// a series and then doubled by Q(2h) = Q(h) + F(h) Q(h) F(h)ᵀ, F(2h) = F(h)², which adds
/// covariances only and so keeps digits that the inverse in Van Loan's block exponential loses for
/// stiff A.
#[inline]
pub fn discretise<const N: usize>(
    A: &SMatrix<f64, N, N>,
    Q_c: &SMatrix<f64, N, N>,
    h: f64,
) -> (SMatrix<f64, N, N>, SMatrix<f64, N, N>) {
    let s = halving_count(norm_1(A) * h.abs(), NOISE_REACH);
    let short = h * 0.5f64.powi(s);
    let mut F = exponential_near_zero(&(A * short));
    let mut Q_d = noise_series(A, Q_c, short);
    for _ in 0..s {
        Q_d += F * Q_d * F.transpose();
        F *= F;
    }
    (F, symmetric_part(&Q_d))
}

#[cfg(test)]
mod tests {
    use approx::assert_relative_eq;
    use nalgebra::{DMatrix, Matrix1, Matrix2, SVector};
    use proptest::array::uniform16;
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn double_integrator() {
        let A = Matrix2::new(0.0, 1.0, 0.0, 0.0);
        for h in [1e-4, 0.01, 0.9, 7.0] {
            let (F, Q_d) = discretise(&A, &Matrix2::new(0.0, 0.0, 0.0, 2.0), h);
            assert_relative_eq!(F, Matrix2::new(1.0, h, 0.0, 1.0), max_relative = 1e-15);
            let expected = Matrix2::new(h * h * h / 3.0, h * h / 2.0, h * h / 2.0, h) * 2.0;
            assert_relative_eq!(Q_d, expected, max_relative = 1e-14);
            assert_eq!(transition_matrix(&A, h)[(0, 1)], F[(0, 1)]);
        }
    }

    #[test]
    fn stiff_poles() {
        // Yaw pole of a car, 1086 m/s² over its speed, at 5 and at 1 m/s.
        for p in [1086.0 / 5.0, 1086.0] {
            let h = 0.01;
            let (F, Q_d) = discretise(&Matrix1::new(-p), &Matrix1::new(3.0), h);
            assert_relative_eq!(F[0], (-p * h).exp(), max_relative = 1e-13);
            let expected = -3.0 * (-2.0 * p * h).exp_m1() / (2.0 * p);
            assert_relative_eq!(Q_d[0], expected, max_relative = 1e-14);
        }
    }

    #[test]
    fn rotation() {
        let A = Matrix2::new(0.0, -1.0, 1.0, 0.0);
        for h in [0.3, 1.0, 30.0, -2.0] {
            let (sin, cos) = f64::sin_cos(h);
            let expected = Matrix2::new(cos, -sin, sin, cos);
            assert_relative_eq!(transition_matrix(&A, h), expected, epsilon = 1e-13);
        }
        // Isotropic noise does not see the rotation.
        let (_, Q_d) = discretise(&A, &Matrix2::identity(), 30.0);
        assert_relative_eq!(Q_d, Matrix2::identity() * 30.0, epsilon = 1e-12);
    }

    #[test]
    fn zero_dynamics_integrate_the_density() {
        let Q_c = Matrix2::new(2.0, 0.5, 0.5, 1.0);
        let (F, Q_d) = discretise(&Matrix2::zeros(), &Q_c, 0.25);
        assert_eq!((F, Q_d), (Matrix2::identity(), Q_c * 0.25));
    }

    #[test]
    fn what_is_not_finite_stays_visible() {
        let A = Matrix2::new(f64::NAN, 1.0, 0.0, f64::INFINITY);
        assert!(transition_matrix(&A, 0.01).iter().any(|f| !f.is_finite()));
    }

    /// Van Loan 1978, theorem 1, with the exponential of nalgebra: (F, Q_d) from the block matrix
    /// of 2 N.
    fn van_loan<const N: usize>(
        A: &SMatrix<f64, N, N>,
        Q_c: &SMatrix<f64, N, N>,
        h: f64,
    ) -> (SMatrix<f64, N, N>, SMatrix<f64, N, N>) {
        let mut block = DMatrix::zeros(2 * N, 2 * N);
        block.view_mut((0, 0), (N, N)).copy_from(&(-A * h));
        block.view_mut((0, N), (N, N)).copy_from(&(Q_c * h));
        block.view_mut((N, N), (N, N)).copy_from(&(A.transpose() * h));
        let exponential = block.exp();
        let F: SMatrix<f64, N, N> = exponential.fixed_view::<N, N>(N, N).transpose();
        (F, F * exponential.fixed_view::<N, N>(0, N))
    }

    proptest! {
        #[test]
        fn agrees_with_van_loan(
            a in uniform16(-10.0..10.0f64), b in uniform16(-1.0..1.0f64), h in 1e-3..0.2f64,
        ) {
            let A = SMatrix::<f64, 4, 4>::from_row_slice(&a);
            let B = SMatrix::<f64, 4, 4>::from_row_slice(&b);
            let Q_c = B * B.transpose();
            let (F, Q_d) = discretise(&A, &Q_c, h);
            let (F_ref, Q_ref) = van_loan(&A, &Q_c, h);
            prop_assert!((F - F_ref).norm() <= 1e-12 * F_ref.norm());
            // The reference multiplies e^(-A h) and e^(A h), and loses digits with the product of
            // norms.
            let loss = transition_matrix(&A, -h).norm() * F.norm();
            prop_assert!((Q_d - Q_ref).norm() <= 1e-13 * loss * Q_d.norm());
            prop_assert_eq!(Q_d, Q_d.transpose());
        }

        #[test]
        fn periods_compose(a in uniform16(-20.0..20.0f64), h in 1e-3..0.1f64) {
            let A = SMatrix::<f64, 4, 4>::from_row_slice(&a);
            let Q_c = SMatrix::from_diagonal(&SVector::from([1.0, 0.0, 2.0, 0.5]));
            let ((F, Q), (F_1, Q_1)) = (discretise(&A, &Q_c, h), discretise(&A, &Q_c, 0.3 * h));
            let (F_2, Q_2) = discretise(&A, &Q_c, 0.7 * h);
            let loss = F_2.norm() * F_1.norm() / F.norm();
            prop_assert!((F - F_2 * F_1).norm() <= 1e-13 * loss * F.norm());
            let composed = F_2 * Q_1 * F_2.transpose() + Q_2;
            prop_assert!((Q - composed).norm() <= 1e-12 * composed.norm());
        }
    }
}
