//! Smooths a filtered recording: each state given all measurements, earlier and later ones.
#![allow(non_snake_case, reason = "matrices are written as in the equations")]

use nalgebra::{Cholesky, SMatrix};

use crate::forward::{FilteredRecording, PassError};
use crate::gaussian::{Gaussian, product, symmetric_part};
use crate::step::LinearStep;

/// A smoothed recording.
#[derive(Clone, Debug, PartialEq)]
pub struct SmoothedRecording<const N: usize> {
    /// State of each step, given all measurements.
    pub states: Vec<Gaussian<N>>,
    /// Cov(x_{k+1}, x_k) given all measurements, of each step but the last.
    pub lag_one: Vec<SMatrix<f64, N, N>>,
}

/// Smooths a filtered recording.
///
/// x_{k|T} = x_{k|k} + J (x_{k+1|T} − x_{k+1|k}) and P_{k|T} = P_{k|k} + J (P_{k+1|T} − P_{k+1|k}) Jᵀ
/// with J = P_{k|k} F_kᵀ P_{k+1|k}⁻¹ (Rauch, Tung and Striebel 1965); the covariance with the next
/// state is P_{k+1|T} Jᵀ.
///
/// # Errors
///
/// [`PassError::Prior`] if a predicted covariance is singular.
///
/// # Panics
///
/// If `filtered` is not of these steps.
pub fn smooth_recording<const N: usize, const M: usize>(
    steps: &[LinearStep<N, M>],
    filtered: &FilteredRecording<N>,
) -> Result<SmoothedRecording<N>, PassError> {
    assert_eq!(steps.len(), filtered.posterior.len(), "steps of the filtered recording");
    let mut states = Vec::with_capacity(steps.len());
    let mut lag_one = Vec::with_capacity(steps.len().saturating_sub(1));
    let Some(mut next) = filtered.posterior.last().copied() else {
        return Ok(SmoothedRecording { states, lag_one });
    };
    states.push(next);
    for k in (0..steps.len() - 1).rev() {
        let smoothed = smooth_with_gain(&filtered.posterior[k], &steps[k].F, &filtered.prior[k + 1], &next);
        let (state, J) = smoothed.ok_or(PassError::Prior { step: k + 1 })?;
        lag_one.push(next.cov * J.transpose());
        states.push(state);
        next = state;
    }
    states.reverse();
    lag_one.reverse();
    Ok(SmoothedRecording { states, lag_one })
}

/// The state of a step given all measurements, from its filtered state, the transition `F` to the next step, and that step's state as
/// it was predicted and as it is given all measurements. `None` if the predicted covariance is singular.
pub fn smooth_step<const N: usize>(
    filtered: &Gaussian<N>,
    F: &SMatrix<f64, N, N>,
    predicted: &Gaussian<N>,
    next: &Gaussian<N>,
) -> Option<Gaussian<N>> {
    smooth_with_gain(filtered, F, predicted, next).map(|(state, _)| state)
}

/// The same, and the gain J.
#[inline]
fn smooth_with_gain<const N: usize>(
    filtered: &Gaussian<N>,
    F: &SMatrix<f64, N, N>,
    predicted: &Gaussian<N>,
    next: &Gaussian<N>,
) -> Option<(Gaussian<N>, SMatrix<f64, N, N>)> {
    let inverse = Cholesky::new(predicted.cov)?.inverse();
    let J = product(&product(&filtered.cov, &F.transpose()), &inverse);
    let state = Gaussian {
        mean: filtered.mean + J * (next.mean - predicted.mean),
        cov: symmetric_part(
            &(filtered.cov + product(&product(&J, &(next.cov - predicted.cov)), &J.transpose())),
        ),
    };
    Some((state, J))
}

#[cfg(test)]
mod tests;
