//! Checks the filter against batch estimation, statistics and numerical abuse.

use approx::assert_relative_eq;
use nalgebra::{DMatrix, DVector, Matrix1, Matrix2, Vector2};
use proptest::array::{uniform4, uniform8, uniform16};
use proptest::prelude::*;

use super::*;
use crate::discretise;

/// Standard normal numbers from a 64-bit linear congruential generator (Knuth) and Box and Muller.
struct Noise(u64);

impl Noise {
    fn uniform(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        ((self.0 >> 11) as f64 + 0.5) / (1u64 << 53) as f64
    }

    fn normal(&mut self) -> f64 {
        (-2.0 * self.uniform().ln()).sqrt() * (TAU * self.uniform()).cos()
    }
}

/// A random covariance with eigenvalues above `floor`.
fn covariance<const N: usize>(entries: &[f64], floor: f64) -> SMatrix<f64, N, N> {
    let B = SMatrix::<f64, N, N>::from_row_slice(entries);
    B * B.transpose() + SMatrix::identity() * floor
}

fn inverse<const N: usize>(P: SMatrix<f64, N, N>) -> SMatrix<f64, N, N> {
    P.try_inverse().expect("well conditioned")
}

/// Position and velocity of a point whose velocity walks randomly.
fn random_walk() -> (Matrix2<f64>, Matrix2<f64>) {
    let A = Matrix2::new(0.0, 1.0, 0.0, -0.5);
    discretise(&A, &Matrix2::new(0.0, 0.0, 0.0, 0.3), 0.1)
}

proptest! {
    #[test]
    fn equals_the_information_form(
        p in uniform16(-2.0..2.0f64), r in uniform4(-1.0..1.0f64),
        h in uniform8(-2.0..2.0f64), x in uniform4(-5.0..5.0f64), y in [-5.0..5.0f64, -5.0..5.0f64],
    ) {
        let prior = Gaussian { mean: SVector::from(x), cov: covariance::<4>(&p, 0.1) };
        let R = covariance::<2>(&r, 0.05);
        let H = SMatrix::<f64, 2, 4>::from_row_slice(&h);
        let y = Vector2::from(y);
        let residual = y - H * prior.mean;
        let (posterior, _) = measurement_update(&prior, &residual, &H, &R).expect("covariances");

        let (Y, W) = (inverse(prior.cov), H.transpose() * inverse(R));
        let cov = inverse(Y + W * H);
        let mean = cov * (Y * prior.mean + W * y);
        prop_assert!((posterior.cov - cov).norm() <= 1e-9 * cov.norm());
        prop_assert!((posterior.mean - mean).norm() <= 1e-8 * (1.0 + mean.norm()));
    }

    #[test]
    fn likelihood_is_the_normal_density(
        p in uniform4(-2.0..2.0f64), r in uniform4(-1.0..1.0f64), v in [-3.0..3.0f64, -3.0..3.0f64],
    ) {
        let prior = Gaussian { mean: SVector::zeros(), cov: covariance::<2>(&p, 0.1) };
        let R = covariance::<2>(&r, 0.1);
        let residual = Vector2::from(v);
        let (_, i) = measurement_update(&prior, &residual, &Matrix2::identity(), &R).expect("covariances");
        let S = prior.cov + R;
        let nis = (residual.transpose() * inverse(S) * residual)[0];
        let density = (-0.5 * nis).exp() / (TAU * S.determinant().sqrt());
        prop_assert_eq!(i.residual, residual);
        assert_relative_eq!(i.cov, S, max_relative = 1e-14);
        assert_relative_eq!(i.nis, nis, max_relative = 1e-10);
        assert_relative_eq!(i.log_likelihood, density.ln(), max_relative = 1e-10, epsilon = 1e-12);
    }
}

#[test]
fn filtering_equals_one_batch_of_bayes() {
    // All states and measurements of a few steps are one Gaussian vector; its conditional mean and
    // covariance of the last state are what the recursion must give.
    const T: usize = 6;
    let (F, Q) = random_walk();
    let H = SMatrix::<f64, 1, 2>::new(1.0, 0.2);
    let R = Matrix1::new(0.04);
    let start = Gaussian { mean: Vector2::new(1.0, -1.0), cov: Matrix2::new(0.5, 0.1, 0.1, 0.8) };
    let ys = [0.9, 1.1, 0.4, 0.2, 0.3, -0.4];

    let mut recursive = start;
    let mut prior = start;
    for (k, y) in ys.iter().enumerate() {
        if k > 0 {
            prior = predict(&recursive, F * recursive.mean, &F, &Q);
        }
        let residual = Matrix1::new(*y) - H * prior.mean;
        (recursive, _) = measurement_update(&prior, &residual, &H, &R).expect("covariances");
    }

    let mut mean = DVector::<f64>::zeros(2 * T);
    let mut cov = DMatrix::<f64>::zeros(2 * T, 2 * T);
    let (mut m, mut P) = (start.mean, start.cov);
    for k in 0..T {
        if k > 0 {
            m = F * m;
            P = F * P * F.transpose() + Q;
        }
        mean.fixed_rows_mut::<2>(2 * k).copy_from(&m);
        let mut cross = P;
        for j in k..T {
            cov.fixed_view_mut::<2, 2>(2 * j, 2 * k).copy_from(&cross);
            cov.fixed_view_mut::<2, 2>(2 * k, 2 * j).copy_from(&cross.transpose());
            cross = F * cross;
        }
    }
    let mut all_H = DMatrix::<f64>::zeros(T, 2 * T);
    for k in 0..T {
        all_H.fixed_view_mut::<1, 2>(k, 2 * k).copy_from(&H);
    }
    let S = &all_H * &cov * all_H.transpose() + DMatrix::identity(T, T) * R[0];
    let gain = &cov * all_H.transpose() * S.try_inverse().expect("positive definite");
    let mean = &mean + &gain * (DVector::from_row_slice(&ys) - &all_H * &mean);
    let cov = &cov - &gain * all_H * &cov;
    assert_relative_eq!(recursive.mean, mean.fixed_rows::<2>(2 * T - 2).into_owned(), max_relative = 1e-11);
    assert_relative_eq!(
        recursive.cov,
        cov.fixed_view::<2, 2>(2 * T - 2, 2 * T - 2).into_owned(),
        max_relative = 1e-10
    );
}

#[test]
fn static_state_is_recursive_least_squares() {
    let mut noise = Noise(7);
    let mut filter = Gaussian { mean: SVector::<f64, 3>::zeros(), cov: SMatrix::identity() * 1e4 };
    let (mut theta, mut P) = (filter.mean, filter.cov);
    let truth = SVector::from([2.0, -0.5, 0.1]);
    for k in 0..200 {
        let t = 0.02 * f64::from(k);
        let phi = SVector::from([1.0, t, t * t]);
        let y = phi.dot(&truth) + 0.1 * noise.normal();
        let residual = Matrix1::new(y - phi.dot(&filter.mean));
        let (next, _) = measurement_update(&filter, &residual, &phi.transpose(), &Matrix1::new(1.0))
            .expect("covariances");
        filter = next;

        let gain = P * phi / (1.0 + phi.dot(&(P * phi)));
        theta += gain * (y - phi.dot(&theta));
        P -= gain * phi.transpose() * P;
    }
    assert_relative_eq!(filter.mean, theta, max_relative = 1e-7);
    assert_relative_eq!(filter.cov, P, max_relative = 1e-6, epsilon = 1e-9);
    assert!((filter.mean - truth).amax() < 0.1);
}

#[test]
fn covariance_survives_nearly_perfect_sensors() {
    // Six states in units of very different size, four sensors with almost no noise.
    let mut A = SMatrix::<f64, 6, 6>::zeros();
    for (i, pole) in [0.0, -20.0, -35.0].into_iter().enumerate() {
        A[(i, i)] = pole;
        A[(i, i + 3)] = 1e-3;
    }
    A[(1, 2)] = -25.0;
    let density = SVector::from([1e-6, 1e-6, 1e-6, 1e5, 2e6, 2e6]);
    let (F, Q) = discretise(&A, &SMatrix::from_diagonal(&density), 0.01);
    let mut H = SMatrix::<f64, 4, 6>::identity();
    H[(3, 3)] = 0.0;
    H[(3, 1)] = -20.0;
    H[(3, 4)] = 1e-3;
    let R = SMatrix::<f64, 4, 4>::identity() * 1e-14;
    let mut x = Gaussian {
        mean: SVector::zeros(),
        cov: SMatrix::from_diagonal(&SVector::from([1.0, 1.0, 1.0, 1e6, 1e6, 1e6])),
    };
    for k in 0..100_000 {
        x = predict(&x, F * x.mean, &F, &Q);
        (x, _) = measurement_update(&x, &SVector::zeros(), &H, &R).expect("S is positive definite");
        assert_eq!(x.cov, x.cov.transpose());
        if k % 1000 == 999 {
            assert!(Cholesky::new(x.cov).is_some(), "step {k}: {}", x.cov);
        }
    }
}

#[test]
fn nis_of_a_true_model_averages_to_the_number_of_measurements() {
    const STEPS: usize = 20_000;
    let mut noise = Noise(3);
    let (F, Q) = random_walk();
    let driver = Cholesky::new(Q).expect("covariance").l();
    let R = Matrix2::new(0.04, 0.0, 0.0, 0.25);
    let mut filter = Gaussian { mean: Vector2::zeros(), cov: Matrix2::identity() };
    let mut truth = Vector2::new(noise.normal(), noise.normal());
    let mut sum = 0.0;
    for _ in 0..STEPS {
        truth = F * truth + driver * Vector2::new(noise.normal(), noise.normal());
        let y = truth + Vector2::new(0.2 * noise.normal(), 0.5 * noise.normal());
        let prior = predict(&filter, F * filter.mean, &F, &Q);
        let (posterior, innovation) =
            measurement_update(&prior, &(y - prior.mean), &Matrix2::identity(), &R).expect("covariances");
        filter = posterior;
        sum += innovation.nis;
    }
    // Four standard deviations of the mean of a χ² with two degrees of freedom.
    let tolerance = 4.0 * (4.0 / STEPS as f64).sqrt();
    assert_relative_eq!(sum / STEPS as f64, 2.0, epsilon = tolerance);
}

#[test]
fn broken_numbers_are_errors() {
    let of = |variance: f64, residual: f64| {
        let prior = Gaussian { mean: Matrix1::new(0.0), cov: Matrix1::new(variance) };
        let one = Matrix1::new(1.0);
        measurement_update(&prior, &Matrix1::new(residual), &one, &one).map(|_| ())
    };
    assert_eq!(of(1.0, 1.0), Ok(()));
    assert_eq!(of(-1.0, 1.0), Err(UpdateError::NotPositiveDefinite));
    assert_eq!(of(-3.0, 1.0), Err(UpdateError::NotPositiveDefinite));
    assert_eq!(of(1.0, f64::NAN), Err(UpdateError::NotFinite));
    assert_eq!(of(f64::INFINITY, 1.0), Err(UpdateError::NotFinite));
}
