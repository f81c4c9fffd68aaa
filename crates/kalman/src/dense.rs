//! Solves a recording as one dense problem: the reference of the tests.
#![allow(non_snake_case, reason = "matrices are written as in the equations")]

use std::f64::consts::TAU;

use nalgebra::{DMatrix, DVector, SMatrix, SVector};
use proptest::collection::vec;
use proptest::prelude::*;

use crate::{Gaussian, LinearStep, NoiseParameters};

/// A system of three states and two measurements.
pub(crate) type LinearSystemCase = (Vec<LinearStep<3, 2>>, NoiseParameters<3, 2>);

/// A covariance with eigenvalues above `floor`.
pub(crate) fn covariance_from_entries<const D: usize>(entries: &[f64], floor: f64) -> SMatrix<f64, D, D> {
    let B = SMatrix::<f64, D, D>::from_row_slice(entries);
    B * B.transpose() + SMatrix::identity() * floor
}

/// A step from 20 numbers in −1 to 1 and two flags for what is absent.
fn step_from_numbers(x: &[f64], absent: [bool; 2]) -> LinearStep<3, 2> {
    let y = SVector::<f64, 2>::from_row_slice(&x[..2]) * 3.0;
    LinearStep {
        y: y.zip_map(&SVector::from(absent), |y, absent| if absent { f64::NAN } else { y }),
        H: SMatrix::from_row_slice(&x[2..8]),
        F: SMatrix::from_row_slice(&x[8..17]),
        b: SVector::from_row_slice(&x[17..20]),
    }
}

/// Any system that changes from step to step, with gaps in what was measured.
pub(crate) fn arbitrary_cases(steps: usize) -> impl Strategy<Value = LinearSystemCase> {
    let numbers = move |n: usize| vec(-1.0..1.0f64, n);
    let absent = vec(proptest::bool::weighted(0.2), 2 * steps);
    (numbers(20 * steps), absent, numbers(3 + 9 + 9 + 4)).prop_map(|(all, absent, p)| {
        let flags = absent.chunks(2).map(|a| [a[0], a[1]]);
        let steps = all.chunks(20).zip(flags).map(|(x, absent)| step_from_numbers(x, absent)).collect();
        let start = Gaussian {
            mean: SVector::from_row_slice(&p[..3]),
            cov: covariance_from_entries::<3>(&p[3..12], 0.2),
        };
        let (Q, R) =
            (covariance_from_entries::<3>(&p[12..21], 0.1), covariance_from_entries::<2>(&p[21..], 0.1));
        (steps, NoiseParameters { start, Q, R })
    })
}

/// The same with noises that share nothing.
pub(crate) fn diagonal_cases(steps: usize) -> impl Strategy<Value = LinearSystemCase> {
    arbitrary_cases(steps).prop_map(|(steps, p)| {
        let Q = SMatrix::from_diagonal(&p.Q.diagonal());
        let R = SMatrix::from_diagonal(&p.R.diagonal());
        (steps, NoiseParameters { Q, R, ..p })
    })
}

/// Rows of a least-squares problem, each group with the inverse of its covariance.
struct LeastSquaresRows {
    information: DMatrix<f64>,
    right: DVector<f64>,
}

impl LeastSquaresRows {
    /// Adds rows A x = c whose error has the covariance C.
    fn add_rows(&mut self, A: &DMatrix<f64>, c: &DVector<f64>, C: &DMatrix<f64>) {
        let weight = C.clone().try_inverse().expect("a covariance");
        self.information += A.transpose() * &weight * A;
        self.right += A.transpose() * weight * c;
    }
}

fn to_dynamic_matrix<const A: usize, const B: usize>(x: &SMatrix<f64, A, B>) -> DMatrix<f64> {
    DMatrix::from_column_slice(A, B, x.as_slice())
}

/// Components that were measured.
fn measured_components<const N: usize, const M: usize>(step: &LinearStep<N, M>) -> Vec<usize> {
    (0..M).filter(|i| !step.y[*i].is_nan()).collect()
}

/// Mean and covariance of all states at once, from the normal equations of the trajectory.
pub(crate) fn dense_trajectory<const N: usize, const M: usize>(
    steps: &[LinearStep<N, M>],
    p: &NoiseParameters<N, M>,
) -> (DVector<f64>, DMatrix<f64>) {
    let n = N * steps.len();
    let mut rows = LeastSquaresRows { information: DMatrix::zeros(n, n), right: DVector::zeros(n) };
    let vector = |x: &SVector<f64, N>| DVector::from_column_slice(x.as_slice());
    let mut A = DMatrix::zeros(N, n);
    A.view_mut((0, 0), (N, N)).fill_with_identity();
    rows.add_rows(&A, &vector(&p.start.mean), &to_dynamic_matrix(&p.start.cov));
    for (k, step) in steps.iter().enumerate() {
        let measured = measured_components(step);
        if !measured.is_empty() {
            let mut A = DMatrix::zeros(measured.len(), n);
            A.columns_mut(N * k, N).copy_from(&to_dynamic_matrix(&step.H).select_rows(&measured));
            let y = DVector::from_iterator(measured.len(), measured.iter().map(|i| step.y[*i]));
            let R = to_dynamic_matrix(&p.R).select_rows(&measured).select_columns(&measured);
            rows.add_rows(&A, &y, &R);
        }
        if k + 1 < steps.len() {
            let mut A = DMatrix::zeros(N, n);
            A.columns_mut(N * k, N).copy_from(&to_dynamic_matrix(&-step.F));
            A.columns_mut(N * (k + 1), N).fill_with_identity();
            rows.add_rows(&A, &vector(&step.b), &to_dynamic_matrix(&p.Q));
        }
    }
    let cov = rows.information.try_inverse().expect("a start with a covariance");
    (&cov * rows.right, cov)
}

/// Mean and covariance, given all measurements, of the start less its mean, each w, and each v, as one vector. No covariance but that
/// of the measurements is inverted, so that those of start and w may be singular.
pub(crate) fn dense_noises<const N: usize, const M: usize>(
    steps: &[LinearStep<N, M>],
    p: &NoiseParameters<N, M>,
) -> (DVector<f64>, DMatrix<f64>) {
    let T = steps.len();
    let n = (N + M) * T;
    let mut C = DMatrix::zeros(n, n);
    for k in 0..T {
        let of_state = if k == 0 { &p.start.cov } else { &p.Q };
        C.view_mut((N * k, N * k), (N, N)).copy_from(of_state);
        C.view_mut((N * T + M * k, N * T + M * k), (M, M)).copy_from(&p.R);
    }
    // The state is x = X ξ + m with the vector of noises ξ, the measurements G ξ + e.
    let (mut X, mut m) = (DMatrix::zeros(N, n), p.start.mean);
    let (mut G, mut e) = (DMatrix::zeros(M * T, n), DVector::zeros(M * T));
    for (k, step) in steps.iter().enumerate() {
        X.view_mut((0, N * k), (N, N)).fill_with_identity();
        let mut rows = G.rows_mut(M * k, M);
        rows.copy_from(&(step.H * &X));
        rows.view_mut((0, N * T + M * k), (M, M)).fill_with_identity();
        e.rows_mut(M * k, M).copy_from(&(step.y - step.H * m));
        X = to_dynamic_matrix(&step.F) * X;
        m = step.F * m + step.b;
    }
    let measured: Vec<usize> = (0..M * T).filter(|i| !e[*i].is_nan()).collect();
    let (G, e) = (G.select_rows(&measured), e.select_rows(&measured));
    let GC = &G * &C;
    let factor = (&GC * G.transpose()).cholesky().expect("positive definite");
    (GC.transpose() * factor.solve(&e), &C - GC.transpose() * factor.solve(&GC))
}

/// Logarithm of the density of all measurements as one Gaussian vector.
pub(crate) fn log_density<const N: usize, const M: usize>(
    steps: &[LinearStep<N, M>],
    p: &NoiseParameters<N, M>,
) -> f64 {
    let T = steps.len();
    let mut mean = DVector::zeros(M * T);
    let mut cov = DMatrix::zeros(M * T, M * T);
    let (mut m, mut P) = (p.start.mean, p.start.cov);
    for j in 0..T {
        mean.rows_mut(M * j, M).copy_from(&(steps[j].H * m));
        let mut cross = P;
        for k in j..T {
            let block = steps[k].H * cross * steps[j].H.transpose();
            cov.view_mut((M * k, M * j), (M, M)).copy_from(&block);
            cov.view_mut((M * j, M * k), (M, M)).copy_from(&block.transpose());
            cross = steps[k].F * cross;
        }
        let mut own = cov.view_mut((M * j, M * j), (M, M));
        own += p.R;
        (m, P) = (steps[j].F * m + steps[j].b, steps[j].F * P * steps[j].F.transpose() + p.Q);
    }
    let of = |(k, step): (usize, &LinearStep<N, M>)| {
        measured_components(step).into_iter().map(|i| M * k + i).collect::<Vec<_>>()
    };
    let measured: Vec<usize> = steps.iter().enumerate().flat_map(of).collect();
    let y = DVector::from_iterator(M * T, steps.iter().flat_map(|s| s.y.iter().copied()));
    let e = (y - mean).select_rows(&measured);
    let factor = cov.select_rows(&measured).select_columns(&measured).cholesky();
    let factor = factor.expect("positive definite");
    -0.5 * (e.dot(&factor.solve(&e)) + factor.ln_determinant() + e.len() as f64 * TAU.ln())
}
