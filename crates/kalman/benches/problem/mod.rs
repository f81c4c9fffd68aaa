//! Simulates a recording of a car with ten unknown variances: six states, four sensors, 100 Hz.
#![allow(non_snake_case, reason = "matrices are written as in the equations")]

use kalman::{Gaussian, LinearStep, NoiseParameters, transition_matrix};
use nalgebra::{Matrix4, Matrix6, SMatrix, Vector4, Vector6};
use rand::{RngExt, SeedableRng};
use rand_distr::StandardNormal;
use rand_pcg::Pcg64;

/// The model of six states and four measurements.
pub type Recording = Vec<LinearStep<6, 4>>;

/// Period of the samples [s].
const PERIOD: f64 = 0.01;

/// Standard deviations of [v_x, v_y, r, ξ_x / m, ξ_y / m, ξ_ψ / I] per transition and of
/// [v_x, v_y, r, a_y], squared.
pub fn truth() -> NoiseParameters<6, 4> {
    let Q = Vector6::new(1e-4, 1e-4, 1e-5, 0.02, 0.02, 0.01);
    let R = Vector4::new(0.01, 0.005, 1e-4, 0.05);
    NoiseParameters {
        start: Gaussian { mean: Vector6::zeros(), cov: Matrix6::identity() },
        Q: Matrix6::from_diagonal(&Q),
        R: Matrix4::from_diagonal(&R),
    }
}

/// Every variance of Q thirty times too large, and of R twenty times too small.
pub fn guess() -> NoiseParameters<6, 4> {
    let truth = truth();
    NoiseParameters { Q: truth.Q * 30.0, R: truth.R * 0.05, ..truth }
}

/// Rates and sensors of a single-track car at a speed [m/s]; ξ are accelerations.
fn car(v_x: f64) -> (Matrix6<f64>, SMatrix<f64, 4, 6>) {
    let (m, I, l_f, l_r, C_f, C_r) = (720.0, 1000.0, 1.7, 1.3, 1.2e5, 1.5e5);
    let moment = C_f * l_f - C_r * l_r;
    let (Y_v, Y_r) = (-(C_f + C_r) / (m * v_x), -moment / (m * v_x));
    let mut A = Matrix6::zeros();
    A[(0, 0)] = -0.8 / m;
    A[(1, 1)] = Y_v;
    A[(1, 2)] = Y_r - v_x;
    A[(2, 1)] = -moment / (I * v_x);
    A[(2, 2)] = -(C_f * l_f * l_f + C_r * l_r * l_r) / (I * v_x);
    let mut H = SMatrix::zeros();
    for i in 0..3 {
        A[(i, i + 3)] = 1.0;
        H[(i, i)] = 1.0;
    }
    (H[(3, 1)], H[(3, 2)], H[(3, 4)]) = (Y_v, Y_r, 1.0);
    (A, H)
}

/// A recording of the model with the true noises, at a speed that swings between 25 and 55 m/s.
pub fn record(steps: usize, seed: u64) -> Recording {
    let mut rng = Pcg64::seed_from_u64(seed);
    let truth = truth();
    let (q, r) = (truth.Q.diagonal().map(f64::sqrt), truth.R.diagonal().map(f64::sqrt));
    let mut x = Vector6::zeros();
    let mut sample = |k: usize| {
        let (A, H) = car(40.0 + 15.0 * (0.3 * PERIOD * k as f64).sin());
        let F = transition_matrix(&A, PERIOD);
        let y = H * x + Vector4::from_fn(|i, _| r[i] * rng.sample::<f64, _>(StandardNormal));
        x = F * x + Vector6::from_fn(|i, _| q[i] * rng.sample::<f64, _>(StandardNormal));
        LinearStep { y, H, F, b: Vector6::zeros() }
    };
    (0..steps).map(&mut sample).collect()
}
