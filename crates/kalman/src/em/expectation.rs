//! Computes the expected second moments of the noises: the E-step.
#![allow(non_snake_case, reason = "matrices are written as in the equations")]

use nalgebra::SMatrix;

use super::adjoint::{AdjointState, CorrectedRecording};
use crate::gaussian::{Gaussian, symmetric_part};
use crate::step::{LinearStep, NoiseParameters};

/// Second moments of the noises, given all measurements and the parameters of that smoothing.
#[derive(Clone, Copy, Debug)]
pub(crate) struct NoiseMoments<const N: usize, const M: usize> {
    /// First state, given all measurements.
    pub start: Gaussian<N>,
    /// Mean of E[w wᵀ] over the transitions.
    pub Q: SMatrix<f64, N, N>,
    /// Mean of E[v vᵀ] over the steps, or the variances alone, each over the steps that measured
    /// it.
    pub R: SMatrix<f64, M, M>,
    /// Number of transitions.
    pub transitions: usize,
    /// Number of measurements that the mean of each component of v is over.
    pub measured: [usize; M],
}

/// Goes back through a filtered recording, and keeps the second moments of the noises only; those of v as a matrix if
/// `joint_R`, else its variances.
///
/// With r = P_{k+1|k}⁻¹ (x_{k+1|T} − x_{k+1|k}) and N = P_{k+1|k}⁻¹ (P_{k+1|k} − P_{k+1|T})
/// P_{k+1|k}⁻¹ the noise of a transition has the mean Q r and the covariance Q − Q N Q (de Jong and
/// Shephard 1995), so that its moments need one sum, of r rᵀ − N. It equals the sum of
/// d dᵀ + P_{k+1|T} − P_{k+1,k|T} Fᵀ − F P_{k+1,k|T}ᵀ + F P_{k|T} Fᵀ, d = x_{k+1|T} − F x_{k|T} − b
/// (Shumway and Stoffer 1982), which subtracts covariances of states to find a noise that may be
/// many digits smaller; this form subtracts the information of the measurements from Q. It inverts no
/// covariance of a state, which may be singular.
///
/// The noise of a measurement likewise has the mean R u and the covariance R − R D R, with u = S⁻¹ ν − Kᵀ r and
/// D = S⁻¹ + Kᵀ N K. Absent components have no part in u and D, but noise that they share with others has one in R u.
pub(crate) fn expected_noise_moments<const N: usize, const M: usize>(
    steps: &[LinearStep<N, M>],
    filtered: &CorrectedRecording<N, M>,
    parameters: &NoiseParameters<N, M>,
    joint_R: bool,
) -> NoiseMoments<N, M> {
    let mut later = AdjointState::zero();
    let (mut sum_w, mut sum_v) = (SMatrix::zeros(), SMatrix::zeros());
    let mut measured = [0; M];
    let mut start = filtered.first;
    for (k, (step, gain)) in steps.iter().zip(&filtered.gains).enumerate().rev() {
        if k + 1 < steps.len() {
            sum_w += later.information();
            later.before_transition(&step.F);
        }
        if k == 0 {
            start = later.smooth(&filtered.first);
        }
        sum_v += later.before_measurement(&step.H, gain).information();
        for (count, y) in measured.iter_mut().zip(&step.y) {
            *count += usize::from(!y.is_nan());
        }
    }
    let transitions = steps.len() - 1;
    let Q = second_moment(&parameters.Q, &(sum_w / transitions as f64));
    if joint_R {
        measured = [steps.len(); M];
    }
    let mean_v = SMatrix::from_fn(|i, j| match joint_R || i == j {
        true => sum_v[(i, j)] / measured[i].max(1) as f64,
        false => 0.0,
    });
    let R = second_moment(&parameters.R, &mean_v);
    NoiseMoments { start, Q, R, transitions, measured }
}

/// Second moment of a noise with the covariance C, given the mean information about it.
fn second_moment<const D: usize>(
    C: &SMatrix<f64, D, D>,
    information: &SMatrix<f64, D, D>,
) -> SMatrix<f64, D, D> {
    symmetric_part(&(C + C * information * C))
}
