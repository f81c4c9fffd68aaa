//! Linearises a nonlinear model along a recording.
#![allow(non_snake_case, reason = "matrices are written as in the equations")]

use nalgebra::{SMatrix, SVector};

use crate::filter::predict;
use crate::forward::{PassError, correct_prediction};
use crate::step::{LinearStep, NoiseParameters};

/// A nonlinear model: x_{k+1} = f_k(x_k) + w_k, y_k = h_k(x_k) + v_k. The inputs are its own.
pub trait NonlinearModel<const N: usize, const M: usize> {
    /// f_k(x), and its Jacobian there.
    fn transition(&self, k: usize, x: &SVector<f64, N>) -> (SVector<f64, N>, SMatrix<f64, N, N>);

    /// h_k(x), and its Jacobian there.
    fn measurement(&self, k: usize, x: &SVector<f64, N>) -> (SVector<f64, M>, SMatrix<f64, M, N>);
}

impl<const N: usize, const M: usize> LinearStep<N, M> {
    /// A step that is measured as `y`, tangent to the model at x; it leads nowhere yet.
    fn from_measurement(
        model: &impl NonlinearModel<N, M>,
        k: usize,
        x: &SVector<f64, N>,
        y: &SVector<f64, M>,
    ) -> Self {
        let (predicted, H) = model.measurement(k, x);
        LinearStep { y: y - (predicted - H * x), H, F: SMatrix::identity(), b: SVector::zeros() }
    }

    /// The same step, that leads to the next one along the tangent to the model at x.
    fn with_transition(self, model: &impl NonlinearModel<N, M>, k: usize, x: &SVector<f64, N>) -> Self {
        let (after, F) = model.transition(k, x);
        LinearStep { F, b: after - F * x, ..self }
    }
}

/// Tangents to a model along a trajectory, one state for each of the samples `measured`.
///
/// Along a smoothed trajectory, smoothing the result once more is one step of Gauss and Newton
/// towards the most probable trajectory.
pub fn linearise_along_trajectory<const N: usize, const M: usize>(
    model: &impl NonlinearModel<N, M>,
    measured: &[SVector<f64, M>],
    trajectory: &[SVector<f64, N>],
) -> Vec<LinearStep<N, M>> {
    let last = measured.len().saturating_sub(1);
    let tangent = |(k, (y, x)): (usize, (&SVector<f64, M>, &SVector<f64, N>))| {
        let step = LinearStep::from_measurement(model, k, x, y);
        if k < last { step.with_transition(model, k, x) } else { step }
    };
    measured.iter().zip(trajectory).enumerate().map(tangent).collect()
}

/// Tangents to a model where an extended Kalman filter has them: the measurement at the predicted
/// state, the transition at the corrected one. [`filter_forward`](crate::filter_forward()) over them is that filter.
///
/// # Errors
///
/// [`PassError`] if a covariance is lost on the way, with the step.
pub fn linearise_by_extended_filter<const N: usize, const M: usize>(
    model: &impl NonlinearModel<N, M>,
    measured: &[SVector<f64, M>],
    parameters: &NoiseParameters<N, M>,
) -> Result<Vec<LinearStep<N, M>>, PassError> {
    let mut prior = parameters.start;
    let mut steps = Vec::with_capacity(measured.len());
    for (k, y) in measured.iter().enumerate() {
        let step = LinearStep::from_measurement(model, k, &prior.mean, y);
        let (posterior, _) = correct_prediction(&prior, &step, &parameters.R, None)
            .map_err(|source| PassError::Update { step: k, source })?;
        if k + 1 == measured.len() {
            steps.push(step);
            break;
        }
        let step = step.with_transition(model, k, &posterior.mean);
        prior = predict(&posterior, step.F * posterior.mean + step.b, &step.F, &parameters.Q);
        steps.push(step);
    }
    Ok(steps)
}
