//! Filters a recording and computes its likelihood.
#![allow(non_snake_case, reason = "matrices are written as in the equations")]

use std::error::Error;
use std::f64::consts::TAU;
use std::fmt;

use nalgebra::{SMatrix, SVector};

use crate::filter::{JosephUpdate, UpdateError, predict};
use crate::gaussian::Gaussian;
use crate::step::{LinearStep, NoiseParameters};

/// Failure of a pass over a recording.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum PassError {
    /// The measurement of a step could not be used.
    Update {
        /// Index of the step.
        step: usize,
        /// The cause.
        source: UpdateError,
    },
    /// The predicted covariance of a step is not positive definite, and has no inverse for the smoother:
    /// give Q, or the start, some noise in every state.
    Prior {
        /// Index of the step.
        step: usize,
    },
    /// There are fewer steps than the two that a transition needs.
    TooShort {
        /// Number of steps.
        steps: usize,
    },
}

impl fmt::Display for PassError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Update { step, source } => write!(f, "step {step}: {source}"),
            Self::Prior { step } => write!(
                f,
                "step {step}: predicted covariance is not positive definite; \
                 give every state some noise in Q or at the start"
            ),
            Self::TooShort { steps } => {
                write!(f, "a recording needs two steps or more, this one has {steps}")
            }
        }
    }
}

impl Error for PassError {
    fn source(&self) -> Option<&(dyn Error + 'static)> {
        match self {
            Self::Update { source, .. } => Some(source),
            Self::Prior { .. } | Self::TooShort { .. } => None,
        }
    }
}

/// Agreement of one step with its prediction.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct StepFit {
    /// Normalised innovation squared (NIS): χ² with `observed` degrees of freedom if the model is right.
    pub nis: f64,
    /// Logarithm of the density of the measurement, given all measurements before it.
    pub log_likelihood: f64,
    /// Number of components that were measured.
    pub observed: usize,
}

/// A filtered recording.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FilteredRecording<const N: usize> {
    /// State of each step, given the measurements before it.
    pub prior: Vec<Gaussian<N>>,
    /// State of each step, given the measurements up to it.
    pub posterior: Vec<Gaussian<N>>,
    /// Agreement of each step with its prediction.
    pub fit: Vec<StepFit>,
    /// Logarithm of the density of the whole recording.
    pub log_likelihood: f64,
}

/// Filters a recording.
///
/// # Errors
///
/// [`PassError::Update`] for a measurement that is infinite or a covariance that is lost.
pub fn filter_forward<const N: usize, const M: usize>(
    steps: &[LinearStep<N, M>],
    parameters: &NoiseParameters<N, M>,
) -> Result<FilteredRecording<N>, PassError> {
    let mut filtered = FilteredRecording {
        prior: Vec::with_capacity(steps.len()),
        posterior: Vec::with_capacity(steps.len()),
        fit: Vec::with_capacity(steps.len()),
        log_likelihood: 0.0,
    };
    forward_sweep(steps, parameters, |_, prior, step| {
        let (posterior, fit) = correct_prediction(prior, step, &parameters.R, None)?;
        filtered.prior.push(*prior);
        filtered.posterior.push(posterior);
        filtered.fit.push(fit);
        filtered.log_likelihood += fit.log_likelihood;
        Ok(posterior)
    })?;
    Ok(filtered)
}

/// Goes from the first step to the last: `correct` turns each prediction into the state given the measurement.
#[inline]
pub(crate) fn forward_sweep<const N: usize, const M: usize>(
    steps: &[LinearStep<N, M>],
    parameters: &NoiseParameters<N, M>,
    mut correct: impl FnMut(usize, &Gaussian<N>, &LinearStep<N, M>) -> Result<Gaussian<N>, UpdateError>,
) -> Result<(), PassError> {
    let mut prior = parameters.start;
    for (k, step) in steps.iter().enumerate() {
        let posterior = correct(k, &prior, step).map_err(|source| PassError::Update { step: k, source })?;
        prior = predict(&posterior, step.F * posterior.mean + step.b, &step.F, &parameters.Q);
    }
    Ok(())
}

/// What a correction leaves to the smoother of the noises; zero for absent components.
#[derive(Clone, Copy, Debug)]
pub(crate) struct CorrectionGain<const N: usize, const M: usize> {
    /// Whether P and ν of each component are those given the components before it, so that S is diagonal.
    pub one_by_one: bool,
    /// Gain P Hᵀ S⁻¹.
    pub K: SMatrix<f64, N, M>,
    /// S⁻¹.
    pub S_inverse: SMatrix<f64, M, M>,
    /// S⁻¹ ν.
    pub weighted: SVector<f64, M>,
}

impl<const N: usize, const M: usize> CorrectionGain<N, M> {
    /// True for a component that was measured.
    pub(crate) fn is_measured(&self, i: usize) -> bool {
        self.S_inverse[(i, i)] != 0.0
    }
}

impl<const N: usize, const M: usize> Default for CorrectionGain<N, M> {
    fn default() -> Self {
        Self {
            one_by_one: true,
            K: SMatrix::zeros(),
            S_inverse: SMatrix::zeros(),
            weighted: SVector::zeros(),
        }
    }
}

/// Smallest share of the noise in the variance of an innovation for a correction by plain subtraction, which
/// then keeps six digits of the difference.
const PLAIN_SUBTRACTION: f64 = 1e-10;

/// Corrects a prediction by the measurement of a step, and writes down the gain if asked to.
#[inline]
pub(crate) fn correct_prediction<const N: usize, const M: usize>(
    prior: &Gaussian<N>,
    step: &LinearStep<N, M>,
    R: &SMatrix<f64, M, M>,
    mut gain: Option<&mut CorrectionGain<N, M>>,
) -> Result<(Gaussian<N>, StepFit), UpdateError> {
    match correct_one_by_one(prior, step, R, gain.as_deref_mut()) {
        Some(corrected) => Ok(corrected),
        None => correct_at_once(prior, step, R, gain),
    }
}

/// True if no component shares noise with another one.
#[inline]
pub(crate) fn is_diagonal<const M: usize>(R: &SMatrix<f64, M, M>) -> bool {
    (0..M).all(|j| (0..M).all(|i| i == j || R[(i, j)] == 0.0))
}

/// The correction as one of each component after the other, which needs no factorisation.
///
/// None if components share noise, or if a prediction is so uncertain, or so wrong, that the difference of
/// covariances would lose its digits.
#[inline]
fn correct_one_by_one<const N: usize, const M: usize>(
    prior: &Gaussian<N>,
    step: &LinearStep<N, M>,
    R: &SMatrix<f64, M, M>,
    mut gain: Option<&mut CorrectionGain<N, M>>,
) -> Option<(Gaussian<N>, StepFit)> {
    if !is_diagonal(R) {
        return None;
    }
    let mut x = *prior;
    let mut fit = StepFit::default();
    if let Some(gain) = gain.as_deref_mut() {
        *gain = CorrectionGain::default();
    }
    for i in 0..M {
        if step.y[i].is_nan() {
            continue;
        }
        let h = step.H.row(i).transpose();
        let p = x.cov * h;
        let s = h.dot(&p) + R[(i, i)];
        let e = step.y[i] - h.dot(&x.mean);
        let usable = R[(i, i)] >= PLAIN_SUBTRACTION * s && s > 0.0 && s < f64::INFINITY;
        if !usable || !e.is_finite() {
            return None;
        }
        x.mean += p * (e / s);
        // Both factors alike, so that the product is symmetric to the last bit.
        let root = p / s.sqrt();
        x.cov -= root * root.transpose();
        fit.nis += e * e / s;
        fit.log_likelihood -= 0.5 * (e * e / s + s.ln() + TAU.ln());
        fit.observed += 1;
        if let Some(gain) = gain.as_deref_mut() {
            gain.K.set_column(i, &(p / s));
            gain.S_inverse[(i, i)] = s.recip();
            gain.weighted[i] = e / s;
        }
    }
    Some((x, fit))
}

/// The correction by Joseph's form. An absent component gets noise of its own and no sensitivity, so that it
/// has no effect.
pub(crate) fn correct_at_once<const N: usize, const M: usize>(
    prior: &Gaussian<N>,
    step: &LinearStep<N, M>,
    R: &SMatrix<f64, M, M>,
    gain: Option<&mut CorrectionGain<N, M>>,
) -> Result<(Gaussian<N>, StepFit), UpdateError> {
    let (mut H, mut R) = (step.H, *R);
    let mut residual = step.y - step.H * prior.mean;
    let absent = step.y.map(f64::is_nan);
    for i in (0..M).filter(|i| absent[*i]) {
        residual[i] = 0.0;
        H.row_mut(i).fill(0.0);
        R.row_mut(i).fill(0.0);
        R.column_mut(i).fill(0.0);
        R[(i, i)] = 1.0;
    }
    let JosephUpdate { posterior, innovation, K, factor, weighted } =
        JosephUpdate::of(prior, &residual, &H, &R)?;
    if let Some(gain) = gain {
        *gain = CorrectionGain { one_by_one: false, K, S_inverse: factor.inverse(), weighted };
        for i in (0..M).filter(|i| absent[*i]) {
            gain.S_inverse[(i, i)] = 0.0;
        }
    }
    let missing = absent.iter().filter(|absent| **absent).count();
    let log_likelihood = innovation.log_likelihood + 0.5 * missing as f64 * TAU.ln();
    Ok((posterior, StepFit { nis: innovation.nis, log_likelihood, observed: M - missing }))
}

#[cfg(test)]
mod tests;
