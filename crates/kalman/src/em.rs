//! Estimates the noises of a linear model from a recording by expectation maximisation (EM).
#![allow(non_snake_case, reason = "matrices are written as in the equations")]

use nalgebra::{Cholesky, SMatrix, SVector};

use crate::forward::{PassError, is_diagonal};
use crate::step::{LinearStep, NoiseParameters};

mod adjoint;
mod expectation;
mod maximise;
mod outcome;
mod squarem;

use adjoint::CorrectedRecording;
use expectation::{NoiseMoments, expected_noise_moments};
pub use maximise::CovarianceStructure;
pub use outcome::{EmError, EmEstimate, EmStatus, LikelihoodFall};
use squarem::{EmPath, LogCovarianceChart};

/// Whether the state before the first measurement is estimated as well.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum InitialStateUpdate {
    /// It is known as well as given.
    Fixed,
    /// Its mean is estimated, its covariance is known.
    Mean,
    /// Both are estimated. One sample determines no covariance: it shrinks for as long as EM
    /// goes on.
    MeanAndCovariance,
}

/// Maximum-likelihood estimation of Q, R and the start from a recording.
///
/// The model of the steps does not depend on the noises: an extended filter would linearise
/// elsewhere in each iteration, and the likelihood would no longer be that of one model, nor rise.
/// For a nonlinear model, fit, linearise again with what was found, and fit again.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EmSettings<const N: usize, const M: usize> {
    /// The free entries of Q.
    pub Q: CovarianceStructure<N>,
    /// The free entries of R.
    pub R: CovarianceStructure<M>,
    /// The free parts of the start.
    pub start: InitialStateUpdate,
    /// Lower bounds of Q: Q − diag(`floor_Q`) stays positive semidefinite. In its units, above 0.
    pub floor_Q: SVector<f64, N>,
    /// Lower bounds of R, likewise.
    pub floor_R: SVector<f64, M>,
    /// Gain of one EM step in log-likelihood [nat] below which the estimate has converged.
    pub tolerance: f64,
    /// Limit of the number of times that the recording is filtered.
    pub max_evaluations: usize,
    /// Whether to extrapolate (SQUAREM, Varadhan and Roland 2008): the same maximum in fewer
    /// evaluations.
    pub accelerate: bool,
}

impl<const N: usize, const M: usize> Default for EmSettings<N, M> {
    fn default() -> Self {
        Self {
            Q: CovarianceStructure::DIAGONAL,
            R: CovarianceStructure::DIAGONAL,
            start: InitialStateUpdate::Fixed,
            floor_Q: SVector::repeat(1e-15),
            floor_R: SVector::repeat(1e-15),
            tolerance: 1e-5,
            max_evaluations: 1000,
            accelerate: true,
        }
    }
}

/// Relative fall of the log-likelihood that rounding explains.
const ROUNDING: f64 = 1e-9;

/// Growth of the longest step ahead with each one that was taken at that length.
const LONGER: f64 = 4.0;

impl<const N: usize, const M: usize> EmSettings<N, M> {
    /// Estimates from a first guess. A guess is better too large than too small: the steps of EM are
    /// proportional to a variance, so that a tiny one seems to have converged.
    ///
    /// # Errors
    ///
    /// [`EmError::Pass`] with the step if a covariance is lost or a measurement is infinite,
    /// [`EmError::NotDiagonal`] and [`EmError::Floor`] if guess and options do not fit.
    pub fn fit(
        &self,
        steps: &[LinearStep<N, M>],
        guess: &NoiseParameters<N, M>,
    ) -> Result<EmEstimate<N, M>, EmError> {
        self.fit_while(steps, guess, || true)
    }

    /// The same, but stops once `go_on` returns `false`; it is called before each step of EM.
    ///
    /// # Errors
    ///
    /// Those of [`Self::fit`].
    pub fn fit_while(
        &self,
        steps: &[LinearStep<N, M>],
        guess: &NoiseParameters<N, M>,
        mut go_on: impl FnMut() -> bool,
    ) -> Result<EmEstimate<N, M>, EmError> {
        self.check_inputs(steps, guess)?;
        let joint_R = self.R == CovarianceStructure::Full || !is_diagonal(&guess.R);
        let mut run =
            EmRun { steps, joint_R, filtered: CorrectedRecording::empty(guess.start), evaluations: 0 };
        let mut at = run.evaluate_parameters(guess)?;
        let (mut log_likelihood, mut violations) = (vec![at.log_likelihood], Vec::new());
        let (mut rejected, mut longest) = (0, 1.0);
        let status = loop {
            if !go_on() {
                break EmStatus::Stopped;
            }
            if run.evaluations >= self.max_evaluations {
                break EmStatus::EvaluationLimit;
            }
            let one = run.evaluate_parameters(&self.maximise_parameters(&at))?;
            log_likelihood.push(one.log_likelihood);
            let gain = one.log_likelihood - at.log_likelihood;
            if gain < -ROUNDING * at.log_likelihood.abs() {
                violations.push(LikelihoodFall { evaluation: run.evaluations, fall: -gain });
            }
            let before = std::mem::replace(&mut at, one);
            if gain < self.tolerance {
                break EmStatus::Converged;
            }
            if !self.accelerate || run.evaluations >= self.max_evaluations {
                continue;
            }
            let (ahead, alpha) = self.extrapolate(&before.parameters, &at, longest);
            match run.accept_extrapolation(self, &ahead, at.log_likelihood) {
                Some(better) => {
                    at = better;
                    log_likelihood.push(at.log_likelihood);
                    longest *= if alpha >= longest { LONGER } else { 1.0 };
                }
                None => {
                    rejected += 1;
                    longest = (alpha / LONGER).max(1.0);
                }
            }
        };
        Ok(EmEstimate {
            status,
            log_likelihood,
            evaluations: run.evaluations,
            rejected,
            violations,
            slope_Q: log_variance_slope(
                &self.Q,
                &at.parameters.Q,
                &at.moments.Q,
                &[at.moments.transitions; N],
            ),
            slope_R: log_variance_slope(&self.R, &at.parameters.R, &at.moments.R, &at.moments.measured),
            parameters: at.parameters,
        })
    }

    fn check_inputs(&self, steps: &[LinearStep<N, M>], guess: &NoiseParameters<N, M>) -> Result<(), EmError> {
        if matches!(self.Q, CovarianceStructure::Diagonal(_)) && !is_diagonal(&guess.Q) {
            return Err(EmError::NotDiagonal("Q"));
        }
        if matches!(self.R, CovarianceStructure::Diagonal(_)) && !is_diagonal(&guess.R) {
            return Err(EmError::NotDiagonal("R"));
        }
        let positive = |floor: &[f64]| floor.iter().all(|f| *f > 0.0 && f.is_finite());
        if !positive(self.floor_Q.as_slice()) {
            return Err(EmError::Floor("Q"));
        }
        if !positive(self.floor_R.as_slice()) {
            return Err(EmError::Floor("R"));
        }
        if steps.len() < 2 {
            return Err(PassError::TooShort { steps: steps.len() }.into());
        }
        Ok(())
    }

    /// The M-step.
    fn maximise_parameters(&self, at: &EmIterate<N, M>) -> NoiseParameters<N, M> {
        let (old, moments) = (&at.parameters, &at.moments);
        let mut start = old.start;
        if self.start != InitialStateUpdate::Fixed {
            start.mean = moments.start.mean;
        }
        if self.start == InitialStateUpdate::MeanAndCovariance {
            start.cov = moments.start.cov;
        }
        NoiseParameters {
            start,
            Q: self.Q.maximise_covariance(&moments.Q, &old.Q, &self.floor_Q),
            R: self.R.maximise_covariance(&moments.R, &old.R, &self.floor_R),
        }
    }

    /// The extrapolation of two successive estimates by a step of at most `longest`, and its length.
    fn extrapolate(
        &self,
        before: &NoiseParameters<N, M>,
        at: &EmIterate<N, M>,
        longest: f64,
    ) -> (NoiseParameters<N, M>, f64) {
        let (now, after) = (&at.parameters, self.maximise_parameters(at));
        let (chart_Q, chart_R) =
            (LogCovarianceChart::near(&now.Q, self.Q), LogCovarianceChart::near(&now.R, self.R));
        let Q = EmPath::through(&chart_Q, [&before.Q, &now.Q, &after.Q]);
        let R = EmPath::through(&chart_R, [&before.R, &now.R, &after.R]);
        let ([first_Q, second_Q], [first_R, second_R]) =
            (Q.squared_difference_lengths(), R.squared_difference_lengths());
        let alpha = ((first_Q + first_R) / (second_Q + second_R)).sqrt().max(1.0).min(longest);
        let ahead = NoiseParameters {
            start: after.start,
            Q: chart_Q.to_covariance(&Q.extrapolate(alpha), &now.Q, &self.floor_Q),
            R: chart_R.to_covariance(&R.extrapolate(alpha), &now.R, &self.floor_R),
        };
        (ahead, alpha)
    }
}

/// Parameters, with likelihood and moments of the recording given them.
struct EmIterate<const N: usize, const M: usize> {
    parameters: NoiseParameters<N, M>,
    log_likelihood: f64,
    moments: NoiseMoments<N, M>,
}

/// Passes over one recording, in the same memory.
struct EmRun<'a, const N: usize, const M: usize> {
    steps: &'a [LinearStep<N, M>],
    /// Whether the noises of the measurements are one matrix, estimated or fixed, not each a variance.
    joint_R: bool,
    filtered: CorrectedRecording<N, M>,
    evaluations: usize,
}

impl<const N: usize, const M: usize> EmRun<'_, N, M> {
    fn evaluate_parameters(
        &mut self,
        parameters: &NoiseParameters<N, M>,
    ) -> Result<EmIterate<N, M>, PassError> {
        self.evaluations += 1;
        self.filtered.filter_into(self.steps, parameters, self.joint_R)?;
        let moments = expected_noise_moments(self.steps, &self.filtered, parameters, self.joint_R);
        let log_likelihood = self.filtered.log_likelihood;
        Ok(EmIterate { parameters: *parameters, log_likelihood, moments })
    }

    /// The extrapolated point, or the one after another step of EM, unless the recording is less probable
    /// there. EM mostly corrects an extrapolation that went too far.
    fn accept_extrapolation(
        &mut self,
        em: &EmSettings<N, M>,
        ahead: &NoiseParameters<N, M>,
        than: f64,
    ) -> Option<EmIterate<N, M>> {
        let jump = self.evaluate_parameters(ahead).ok()?;
        if jump.log_likelihood >= than {
            return Some(jump);
        }
        if self.evaluations >= em.max_evaluations {
            return None;
        }
        let mended = self.evaluate_parameters(&em.maximise_parameters(&jump)).ok()?;
        (mended.log_likelihood >= than).then_some(mended)
    }
}

/// n / 2 ((C⁻¹ S)_ii − 1): derivative of the log-likelihood with respect to the logarithm of each
/// variance in C, correlations held (Fisher's identity).
fn log_variance_slope<const D: usize>(
    freedom: &CovarianceStructure<D>,
    C: &SMatrix<f64, D, D>,
    S: &SMatrix<f64, D, D>,
    n: &[usize; D],
) -> SVector<f64, D> {
    let ratio = Cholesky::new(*C).map_or(SMatrix::zeros(), |factor| factor.solve(S));
    let of = |i: usize| 0.5 * n[i] as f64 * (ratio[(i, i)] - 1.0);
    SVector::from_fn(|i, _| if freedom.is_free(i) { of(i) } else { 0.0 })
}

#[cfg(test)]
mod tests;
