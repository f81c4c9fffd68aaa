//! Describes a recording as a linear model that changes from step to step, with unknown noise.
#![allow(non_snake_case, reason = "matrices are written as in the equations")]

use nalgebra::{SMatrix, SVector};

use crate::gaussian::Gaussian;

/// One sample of a recording, and the model around it.
///
/// With the state x_k the recording is y_k = H_k x_k + v_k and x_{k+1} = F_k x_k + b_k + w_k.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LinearStep<const N: usize, const M: usize> {
    /// Measurement less its part that does not depend on the state, such as the feed-through of an input.
    /// NaN stands for an absent component.
    pub y: SVector<f64, M>,
    /// Derivative of the measurement with respect to the state.
    pub H: SMatrix<f64, M, N>,
    /// Transition from this step to the next one; that of the last step is not used.
    pub F: SMatrix<f64, N, N>,
    /// Part of the transition that does not depend on the state, such as the effect of an input.
    pub b: SVector<f64, N>,
}

/// The Gaussian quantities of a recording: the state at its first sample, before its measurement, and the
/// noises.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NoiseParameters<const N: usize, const M: usize> {
    /// State at the first step before its measurement.
    pub start: Gaussian<N>,
    /// Covariance of w, the noise of one transition.
    pub Q: SMatrix<f64, N, N>,
    /// Covariance of v, the noise of one measurement.
    pub R: SMatrix<f64, M, M>,
}
