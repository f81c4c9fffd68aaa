//! Smooths a filtered recording: each state given all measurements, earlier and later ones.
#![allow(non_snake_case, reason = "matrices are written as in the equations")]

use nalgebra::{Cholesky, SMatrix, SVector};

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

/// Relation of a step to the next one, given all measurements.
pub(crate) struct SmootherLink<'a, const N: usize> {
    /// The next step's state, given all measurements.
    pub next: &'a Gaussian<N>,
    /// Smoother gain J = P_{k|k} Fᵀ P_{k+1|k}⁻¹.
    pub J: SMatrix<f64, N, N>,
    /// P_{k+1|k}⁻¹.
    pub inverse: SMatrix<f64, N, N>,
    /// x_{k+1|T} − x_{k+1|k}: correction of the next state by later measurements.
    pub shift: SVector<f64, N>,
    /// P_{k+1|T} − P_{k+1|k}.
    pub shrink: SMatrix<f64, N, N>,
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
    let mut states = Vec::with_capacity(steps.len());
    let mut lag_one = Vec::with_capacity(steps.len().saturating_sub(1));
    backward_sweep(steps, filtered, |_, state, link| {
        states.push(*state);
        lag_one.extend(link.map(|link| link.next.cov * link.J.transpose()));
    })?;
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
    smoother_link(filtered, F, predicted, next).map(|(state, _)| state)
}

#[inline]
fn smoother_link<'a, const N: usize>(
    filtered: &Gaussian<N>,
    F: &SMatrix<f64, N, N>,
    predicted: &Gaussian<N>,
    next: &'a Gaussian<N>,
) -> Option<(Gaussian<N>, SmootherLink<'a, N>)> {
    let inverse = Cholesky::new(predicted.cov)?.inverse();
    let J = product(&product(&filtered.cov, &F.transpose()), &inverse);
    let (shift, shrink) = (next.mean - predicted.mean, next.cov - predicted.cov);
    let state = Gaussian {
        mean: filtered.mean + J * shift,
        cov: symmetric_part(&(filtered.cov + product(&product(&J, &shrink), &J.transpose()))),
    };
    Some((state, SmootherLink { next, J, inverse, shift, shrink }))
}

/// Goes from the last step to the first, and shows each smoothed state with its link to the next.
#[inline]
pub(crate) fn backward_sweep<const N: usize, const M: usize>(
    steps: &[LinearStep<N, M>],
    filtered: &FilteredRecording<N>,
    mut visit: impl FnMut(usize, &Gaussian<N>, Option<SmootherLink<'_, N>>),
) -> Result<(), PassError> {
    assert_eq!(steps.len(), filtered.posterior.len(), "steps of the filtered recording");
    let Some(mut next) = filtered.posterior.last().copied() else { return Ok(()) };
    visit(steps.len() - 1, &next, None);
    for k in (0..steps.len() - 1).rev() {
        let linked = smoother_link(&filtered.posterior[k], &steps[k].F, &filtered.prior[k + 1], &next);
        let (state, link) = linked.ok_or(PassError::Prior { step: k + 1 })?;
        visit(k, &state, Some(link));
        next = state;
    }
    Ok(())
}

#[cfg(test)]
mod tests;
