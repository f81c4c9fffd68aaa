//! Carries a Gaussian state through time and corrects it by measurements.
#![allow(non_snake_case, reason = "matrices are written as in the equations")]

use std::error::Error;
use std::f64::consts::TAU;
use std::fmt;

use nalgebra::{Cholesky, Const, SMatrix, SVector};
use serde::{Deserialize, Serialize};

use crate::gaussian::{Gaussian, congruence, product, symmetric_part};

/// Innovation of a measurement with `M` components: its difference from the prediction, and how probable that is.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct Innovation<const M: usize> {
    /// Measured minus predicted, ν.
    pub residual: SVector<f64, M>,
    /// Predicted covariance of the residual, S = H P Hᵀ + R.
    pub cov: SMatrix<f64, M, M>,
    /// Normalised innovation squared, νᵀ S⁻¹ ν: χ² with `M` degrees of freedom if the model is
    /// right.
    pub nis: f64,
    /// Logarithm of the density N(ν; 0, S).
    pub log_likelihood: f64,
}

/// Failure to use a measurement.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum UpdateError {
    /// The residual or its covariance holds an infinity or NaN: the measurement or the filter is
    /// broken.
    NotFinite,
    /// The covariance of the residual is not positive definite: P or R is not a covariance.
    NotPositiveDefinite,
}

impl fmt::Display for UpdateError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::NotFinite => "innovation or its covariance is not finite",
            Self::NotPositiveDefinite => "innovation covariance is not positive definite",
        })
    }
}

impl Error for UpdateError {}

/// Prediction over one period: the given mean, and the covariance F P Fᵀ + Q.
///
/// `mean_after` is F x of a linear model, or the integrated state of a nonlinear one, of which `F`
/// [N × N] is then the transition matrix of the linearisation. `Q` [N × N] is the covariance of the
/// noise.
#[inline]
pub fn predict<const N: usize>(
    before: &Gaussian<N>,
    mean_after: SVector<f64, N>,
    F: &SMatrix<f64, N, N>,
    Q: &SMatrix<f64, N, N>,
) -> Gaussian<N> {
    Gaussian { mean: mean_after, cov: congruence(F, &before.cov, Q) }
}

/// Correction by a measurement y = h(x) + noise, given its residual y − h(mean).
///
/// `H` [M × N] is the Jacobian of h at the mean and `R` [M × M] the covariance of the noise. With
/// the gain K = P Hᵀ S⁻¹ the covariance is Joseph's (I − K H) P (I − K H)ᵀ + K R Kᵀ, which stays
/// positive semidefinite under any rounding of K (Bar-Shalom et al., Estimation with
/// Applications to Tracking and Navigation, section 5.2).
///
/// # Errors
///
/// [`UpdateError::NotFinite`] for a residual or an S with an infinity or NaN,
/// [`UpdateError::NotPositiveDefinite`] if S has no Cholesky factor.
#[inline]
pub fn measurement_update<const N: usize, const M: usize>(
    prior: &Gaussian<N>,
    residual: &SVector<f64, M>,
    H: &SMatrix<f64, M, N>,
    R: &SMatrix<f64, M, M>,
) -> Result<(Gaussian<N>, Innovation<M>), UpdateError> {
    let update = JosephUpdate::of(prior, residual, H, R)?;
    Ok((update.posterior, update.innovation))
}

/// A correction in Joseph's form, with what it was calculated from.
pub(crate) struct JosephUpdate<const N: usize, const M: usize> {
    pub posterior: Gaussian<N>,
    pub innovation: Innovation<M>,
    /// Gain P Hᵀ S⁻¹.
    pub K: SMatrix<f64, N, M>,
    /// Factor of S.
    pub factor: Cholesky<f64, Const<M>>,
    /// S⁻¹ ν.
    pub weighted: SVector<f64, M>,
}

impl<const N: usize, const M: usize> JosephUpdate<N, M> {
    #[inline]
    pub(crate) fn of(
        prior: &Gaussian<N>,
        residual: &SVector<f64, M>,
        H: &SMatrix<f64, M, N>,
        R: &SMatrix<f64, M, M>,
    ) -> Result<Self, UpdateError> {
        let HP = product(H, &prior.cov);
        let S = symmetric_part(&(product(&HP, &H.transpose()) + R));
        if !residual.iter().chain(S.iter()).all(|x| x.is_finite()) {
            return Err(UpdateError::NotFinite);
        }
        let factor = Cholesky::new(S).ok_or(UpdateError::NotPositiveDefinite)?;

        let K = factor.solve(&HP).transpose();
        let I_KH = SMatrix::identity() - product(&K, H);
        let from_noise = congruence(&K, R, &SMatrix::zeros());
        let posterior =
            Gaussian { mean: prior.mean + K * residual, cov: congruence(&I_KH, &prior.cov, &from_noise) };

        let weighted = factor.solve(residual);
        let nis = residual.dot(&weighted);
        let ln_det = factor.ln_determinant();
        let innovation = Innovation {
            residual: *residual,
            cov: S,
            nis,
            log_likelihood: -0.5 * (nis + ln_det + M as f64 * TAU.ln()),
        };
        Ok(Self { posterior, innovation, K, factor, weighted })
    }
}

#[cfg(test)]
mod tests;
