//! Checks the smoother against least squares of the whole trajectory.

use nalgebra::{Matrix3, SVector};
use proptest::prelude::*;

use super::*;
use crate::dense::{arbitrary_cases, dense_trajectory};
use crate::{NoiseParameters, filter_forward};

proptest! {
    #[test]
    fn equals_least_squares_of_the_whole_trajectory((steps, p) in arbitrary_cases(7)) {
        let filtered = filter_forward(&steps, &p).expect("covariances");
        let smoothed = smooth_recording(&steps, &filtered).expect("covariances");
        let (mean, cov) = dense_trajectory(&steps, &p);
        let scale = 1.0 + cov.amax() + mean.amax();
        for (k, state) in smoothed.states.iter().enumerate() {
            let error = (mean.rows(3 * k, 3) - state.mean).amax();
            prop_assert!(error <= 1e-10 * scale, "mean of step {}: {}", k, error);
            let error = (cov.view((3 * k, 3 * k), (3, 3)) - state.cov).amax();
            prop_assert!(error <= 1e-10 * scale, "covariance of step {}: {}", k, error);
        }
        prop_assert_eq!(smoothed.lag_one.len(), 6);
        for (k, lag_one) in smoothed.lag_one.iter().enumerate() {
            let error = (cov.view((3 * k + 3, 3 * k), (3, 3)) - lag_one).amax();
            prop_assert!(error <= 1e-10 * scale, "lag one of step {}: {}", k, error);
        }
    }

    #[test]
    fn what_comes_later_never_makes_a_state_less_certain((steps, p) in arbitrary_cases(20)) {
        let filtered = filter_forward(&steps, &p).expect("covariances");
        let smoothed = smooth_recording(&steps, &filtered).expect("covariances");
        for (k, (s, f)) in smoothed.states.iter().zip(&filtered.posterior).enumerate() {
            let gained = (f.cov - s.cov).symmetric_eigenvalues().min();
            prop_assert!(gained >= -1e-12 * f.cov.amax(), "step {}: {}", k, gained);
            prop_assert!(Cholesky::new(s.cov).is_some());
        }
    }
}

#[test]
fn a_prediction_without_noise_is_an_error_with_its_step() {
    let still = LinearStep {
        y: SVector::from([0.0]),
        H: SMatrix::<f64, 1, 3>::new(1.0, 0.0, 0.0),
        F: Matrix3::identity(),
        b: SVector::zeros(),
    };
    let p = NoiseParameters {
        start: Gaussian { mean: SVector::zeros(), cov: Matrix3::identity() },
        Q: Matrix3::zeros(),
        R: SMatrix::identity(),
    };
    let lost = LinearStep { F: Matrix3::zeros(), ..still };
    let steps = [still, still, lost, still];
    let filtered = filter_forward(&steps, &p).expect("a pass");
    assert_eq!(smooth_recording(&steps, &filtered), Err(PassError::Prior { step: 3 }));
}

#[test]
fn nothing_smoothed_is_nothing() {
    let filtered = FilteredRecording::<3>::default();
    let smoothed = smooth_recording::<3, 1>(&[], &filtered).expect("an empty recording");
    assert!(smoothed.states.is_empty() && smoothed.lag_one.is_empty());
}
