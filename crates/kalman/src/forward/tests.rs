//! Checks the filter pass: its likelihood, its two ways to correct, its linearisation.

use nalgebra::{Cholesky, Matrix2, Matrix3, Vector2};
use proptest::prelude::*;

use super::*;
use crate::dense::{arbitrary_cases, diagonal_cases, log_density};
use crate::{NonlinearModel, linearise_along_trajectory, linearise_by_extended_filter, measurement_update};

proptest! {
    #[test]
    fn likelihood_is_the_density_of_the_whole_recording((steps, p) in arbitrary_cases(8)) {
        let filtered = filter_forward(&steps, &p).expect("covariances");
        let density = log_density(&steps, &p);
        let error = (filtered.log_likelihood - density).abs();
        prop_assert!(error <= 1e-11 * (1.0 + density.abs()), "{} of {}", error, density);
        let measured: usize = steps.iter().map(|s| s.y.iter().filter(|y| !y.is_nan()).count()).sum();
        prop_assert_eq!(filtered.fit.iter().map(|fit| fit.observed).sum::<usize>(), measured);
    }

    #[test]
    fn components_one_by_one_are_the_same_as_at_once((steps, p) in diagonal_cases(1)) {
        let step = &steps[0];
        let (a, fit_a) = correct_one_by_one(&p.start, step, &p.R, None).expect("a diagonal R");
        let (b, fit_b) = correct_at_once(&p.start, step, &p.R, None).expect("covariances");
        let scale = 1.0 + fit_b.log_likelihood.abs() + fit_b.nis;
        prop_assert!((fit_a.log_likelihood - fit_b.log_likelihood).abs() <= 1e-13 * scale);
        prop_assert!((fit_a.nis - fit_b.nis).abs() <= 1e-13 * scale);
        prop_assert_eq!(fit_a.observed, fit_b.observed);
        prop_assert!((a.mean - b.mean).amax() <= 1e-12 * (1.0 + b.mean.amax()));
        prop_assert!((a.cov - b.cov).amax() <= 1e-13 * p.start.cov.amax());
        prop_assert_eq!(a.cov, a.cov.transpose());
    }
}

/// Position and velocity, the position measured, at steps of one second.
fn moving(y: f64) -> LinearStep<2, 1> {
    LinearStep {
        y: SVector::from([y]),
        H: SMatrix::<f64, 1, 2>::new(1.0, 0.0),
        F: Matrix2::new(1.0, 1.0, 0.0, 1.0),
        b: SVector::zeros(),
    }
}

fn parameters(start: f64, q: f64, r: f64) -> NoiseParameters<2, 1> {
    NoiseParameters {
        start: Gaussian { mean: SVector::zeros(), cov: Matrix2::identity() * start },
        Q: Matrix2::identity() * q,
        R: SMatrix::<f64, 1, 1>::new(r),
    }
}

#[test]
fn covariance_survives_a_sensor_that_is_far_better_than_the_prediction() {
    // 1e16 between the variances of start and sensor: a plain subtraction would leave nothing.
    let steps: Vec<_> = (0..50).map(|k| moving(f64::from(k))).collect();
    let filtered = filter_forward(&steps, &parameters(1e8, 1e-12, 1e-8)).expect("covariances");
    for (k, state) in filtered.posterior.iter().enumerate() {
        assert!(Cholesky::new(state.cov).is_some(), "step {k}: {}", state.cov);
        assert!(state.cov[(0, 0)] <= 1.0001e-8, "step {k}: {}", state.cov);
    }
    assert!((filtered.posterior[49].mean - Vector2::new(49.0, 1.0)).amax() < 1e-6);
}

#[test]
fn what_is_broken_is_an_error_with_its_step() {
    let mut steps = vec![moving(0.0); 5];
    steps[3].y[0] = f64::INFINITY;
    let p = parameters(1.0, 1.0, 1.0);
    let error = |source| Err(PassError::Update { step: 3, source });
    assert_eq!(filter_forward(&steps, &p), error(UpdateError::NotFinite));
    steps[3] = moving(f64::NAN);
    assert_eq!(filter_forward(&steps, &p).map(|f| f.fit[3]), Ok(StepFit::default()));
    let indefinite = NoiseParameters { Q: -p.Q, ..p };
    assert!(matches!(filter_forward(&steps, &indefinite), Err(PassError::Update { .. })));
}

/// A pendulum with the angle and the rate as state, pushed by an input, its angle seen from aside.
struct Pendulum {
    push: Vec<f64>,
}

impl NonlinearModel<2, 1> for Pendulum {
    fn transition(&self, k: usize, x: &Vector2<f64>) -> (Vector2<f64>, Matrix2<f64>) {
        let h = 0.1;
        let after = Vector2::new(x[0] + h * x[1], x[1] + h * (self.push[k] - x[0].sin()));
        (after, Matrix2::new(1.0, h, -h * x[0].cos(), 1.0))
    }

    fn measurement(&self, _: usize, x: &Vector2<f64>) -> (SVector<f64, 1>, SMatrix<f64, 1, 2>) {
        (SVector::from([x[0].sin()]), SMatrix::<f64, 1, 2>::new(x[0].cos(), 0.0))
    }
}

fn swing() -> (Pendulum, Vec<SVector<f64, 1>>) {
    let time = (0..60).map(|k| 0.1 * f64::from(k));
    let push = time.clone().map(|t| (1.3 * t).cos()).collect();
    (Pendulum { push }, time.map(|t| SVector::from([0.5 * (0.9 * t).sin()])).collect())
}

#[test]
fn forward_over_an_extended_linearisation_is_the_extended_filter() {
    let (model, measured) = swing();
    let p = parameters(0.5, 1e-3, 1e-2);
    let steps = linearise_by_extended_filter(&model, &measured, &p).expect("covariances");
    let filtered = filter_forward(&steps, &p).expect("covariances");
    let (mut prior, mut log_likelihood) = (p.start, 0.0);
    for (k, y) in measured.iter().enumerate() {
        let (h, H) = model.measurement(k, &prior.mean);
        let (posterior, innovation) = measurement_update(&prior, &(y - h), &H, &p.R).expect("covariances");
        log_likelihood += innovation.log_likelihood;
        assert!((filtered.posterior[k].mean - posterior.mean).amax() < 1e-12, "step {k}");
        assert!((filtered.posterior[k].cov - posterior.cov).amax() < 1e-13, "step {k}");
        let (f, F) = model.transition(k, &posterior.mean);
        prior = predict(&posterior, f, &F, &p.Q);
    }
    assert!((filtered.log_likelihood - log_likelihood).abs() < 1e-10);
}

#[test]
fn smoothing_along_what_was_smoothed_finds_the_most_probable_trajectory() {
    let (model, measured) = swing();
    let p = parameters(0.5, 1e-3, 1e-2);
    let mut steps = linearise_by_extended_filter(&model, &measured, &p).expect("covariances");
    let mut trajectory: Vec<Vector2<f64>> = Vec::new();
    for _ in 0..12 {
        let filtered = filter_forward(&steps, &p).expect("covariances");
        let smoothed = crate::smooth_recording(&steps, &filtered).expect("covariances");
        trajectory = smoothed.states.iter().map(|state| state.mean).collect();
        steps = linearise_along_trajectory(&model, &measured, &trajectory);
    }
    let gradient = |k: usize, x: &[Vector2<f64>]| {
        let (h, H) = model.measurement(k, &x[k]);
        let mut g = H.transpose() * (h - measured[k]) / p.R[0];
        if k == 0 {
            g += (x[0] - p.start.mean) / p.start.cov[0];
        } else {
            g += (x[k] - model.transition(k - 1, &x[k - 1]).0) / p.Q[0];
        }
        if k + 1 < x.len() {
            let (f, F) = model.transition(k, &x[k]);
            g -= F.transpose() * (x[k + 1] - f) / p.Q[0];
        }
        g.amax()
    };
    for k in 0..trajectory.len() {
        let slope = gradient(k, &trajectory);
        assert!(slope < 1e-6, "step {k}: {slope}");
    }
}

#[test]
fn a_diagonal_differs_from_a_full_matrix() {
    assert!(is_diagonal(&Matrix3::from_diagonal_element(2.0)));
    assert!(!is_diagonal(&Matrix3::new(1.0, 0.0, 0.0, 0.0, 1.0, 1e-300, 0.0, 1e-300, 1.0)));
}
