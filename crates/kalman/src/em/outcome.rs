//! Reports the result of an estimation of noises.
#![allow(non_snake_case, reason = "matrices are written as in the equations")]

use std::error::Error;
use std::fmt;

use nalgebra::SVector;

use crate::forward::PassError;
use crate::step::NoiseParameters;

/// How an estimation ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum EmStatus {
    /// A step of EM gained less than the tolerance.
    Converged,
    /// The limit of evaluations was reached before: the estimate may still move.
    EvaluationLimit,
    /// The caller stopped it.
    Stopped,
}

/// A step of EM after which the recording was less probable, which contradicts theory: numbers
/// were lost.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct LikelihoodFall {
    /// Number of the evaluation.
    pub evaluation: usize,
    /// By how much the log-likelihood fell [nat].
    pub fall: f64,
}

/// Noises that were estimated.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct EmEstimate<const N: usize, const M: usize> {
    /// The most probable start, Q and R.
    pub parameters: NoiseParameters<N, M>,
    /// How the estimation ended.
    pub status: EmStatus,
    /// Log-likelihood [nat] of each accepted estimate, from the first guess to `parameters`.
    pub log_likelihood: Vec<f64>,
    /// Number of passes over the recording.
    pub evaluations: usize,
    /// Number of extrapolations that were rejected, as they made the recording less probable.
    pub rejected: usize,
    /// Steps of EM after which the log-likelihood was lower by more than 1e-9 of itself.
    pub violations: Vec<LikelihoodFall>,
    /// Derivative of the log-likelihood with respect to the logarithm of each variance in Q, zero
    /// for those that are known. By Fisher's identity it needs no more than an E-step. It is
    /// negative for a variance that is held by its floor.
    pub slope_Q: SVector<f64, N>,
    /// The same for R.
    pub slope_R: SVector<f64, M>,
}

/// Failure to estimate noises.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum EmError {
    /// A pass over the recording failed.
    Pass(PassError),
    /// A covariance of which the variances alone are free has other entries too.
    NotDiagonal(&'static str),
    /// A lower bound is not a positive number.
    Floor(&'static str),
}

impl fmt::Display for EmError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Pass(source) => source.fmt(f),
            Self::NotDiagonal(name) => {
                write!(f, "{name} is not diagonal: free all of it, or give its diagonal alone")
            }
            Self::Floor(name) => write!(f, "floor of {name} is not positive in every entry"),
        }
    }
}

impl Error for EmError {
    fn source(&self) -> Option<&(dyn Error + 'static)> {
        match self {
            Self::Pass(source) => Some(source),
            Self::NotDiagonal(_) | Self::Floor(_) => None,
        }
    }
}

impl From<PassError> for EmError {
    fn from(source: PassError) -> Self {
        Self::Pass(source)
    }
}
