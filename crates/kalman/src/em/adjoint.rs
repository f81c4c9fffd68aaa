//! Carries what later measurements say about a state back through a recording.
#![allow(non_snake_case, reason = "matrices are written as in the equations")]

use nalgebra::{SMatrix, SVector};

use crate::forward::{CorrectionGain, PassError, correct_at_once, correct_prediction, forward_sweep};
use crate::gaussian::{Gaussian, congruence, product};
use crate::step::{LinearStep, NoiseParameters};

/// A filtered recording, with what the way back needs of it.
pub(crate) struct CorrectedRecording<const N: usize, const M: usize> {
    /// Gain of each step.
    pub gains: Vec<CorrectionGain<N, M>>,
    /// State of the first step, given its measurement.
    pub first: Gaussian<N>,
    /// Logarithm of the density of the whole recording.
    pub log_likelihood: f64,
}

impl<const N: usize, const M: usize> CorrectedRecording<N, M> {
    /// Of no steps yet.
    pub fn empty(start: Gaussian<N>) -> Self {
        Self { gains: Vec::new(), first: start, log_likelihood: 0.0 }
    }

    /// Filters into the memory of an earlier pass; with `at_once`, each gain is that of all components together.
    pub fn filter_into(
        &mut self,
        steps: &[LinearStep<N, M>],
        parameters: &NoiseParameters<N, M>,
        at_once: bool,
    ) -> Result<(), PassError> {
        self.gains.resize(steps.len(), CorrectionGain::default());
        self.log_likelihood = 0.0;
        forward_sweep(steps, parameters, |k, prior, step| {
            let gain = Some(&mut self.gains[k]);
            let (posterior, fit) = match at_once {
                true => correct_at_once(prior, step, &parameters.R, gain)?,
                false => correct_prediction(prior, step, &parameters.R, gain)?,
            };
            if k == 0 {
                self.first = posterior;
            }
            self.log_likelihood += fit.log_likelihood;
            Ok(posterior)
        })
    }
}

/// What later measurements say about a state with the mean x and the covariance P: given them as well, the
/// mean is x + P r and the covariance P − P N P (de Jong 1989; Bryson and Frazier 1963).
#[derive(Clone, Copy, Debug)]
pub(crate) struct AdjointState<const N: usize> {
    pub r: SVector<f64, N>,
    pub N: SMatrix<f64, N, N>,
}

impl<const N: usize> AdjointState<N> {
    /// After the last measurement.
    pub fn zero() -> Self {
        Self { r: SVector::zeros(), N: SMatrix::zeros() }
    }

    /// r rᵀ − N.
    #[inline]
    pub fn information(&self) -> SMatrix<f64, N, N> {
        self.r * self.r.transpose() - self.N
    }

    /// The state given all measurements.
    pub fn smooth(&self, x: &Gaussian<N>) -> Gaussian<N> {
        Gaussian { mean: x.mean + x.cov * self.r, cov: congruence(&x.cov, &-self.N, &x.cov) }
    }

    /// Before the transition `F`.
    #[inline]
    pub fn before_transition(&mut self, F: &SMatrix<f64, N, N>) {
        let F_T = F.transpose();
        *self = Self { r: F_T * self.r, N: congruence(&F_T, &self.N, &SMatrix::zeros()) };
    }

    /// Before a measurement. Returns what all measurements say about its noise, with the mean 0 and the covariance R otherwise; of
    /// components one by one, only what they say about each on its own.
    #[inline]
    pub fn before_measurement<const M: usize>(
        &mut self,
        H: &SMatrix<f64, M, N>,
        gain: &CorrectionGain<N, M>,
    ) -> AdjointState<M> {
        if gain.one_by_one { self.before_each(H, gain) } else { self.before_all(H, gain) }
    }

    #[inline]
    fn before_each<const M: usize>(
        &mut self,
        H: &SMatrix<f64, M, N>,
        gain: &CorrectionGain<N, M>,
    ) -> AdjointState<M> {
        let mut v = AdjointState::zero();
        for i in (0..M).rev().filter(|i| gain.is_measured(*i)) {
            let (h, K) = (H.row(i).transpose(), gain.K.column(i));
            let NK = self.N * K;
            let (u, D) = (gain.weighted[i] - K.dot(&self.r), gain.S_inverse[(i, i)] + K.dot(&NK));
            // (I − h Kᵀ) N (I − K hᵀ) + h hᵀ / s, in a form that is symmetric to the last bit.
            let m = NK - h * (0.5 * D);
            for b in 0..N {
                for a in 0..N {
                    self.N[(a, b)] -= h[a] * m[b] + m[a] * h[b];
                }
            }
            self.r += h * u;
            (v.r[i], v.N[(i, i)]) = (u, D);
        }
        v
    }

    /// The same for components that share noise, or are so precise that differences lose their digits. As with Joseph's form, N stays
    /// positive semidefinite under any rounding of K.
    fn before_all<const M: usize>(
        &mut self,
        H: &SMatrix<f64, M, N>,
        gain: &CorrectionGain<N, M>,
    ) -> AdjointState<M> {
        let H: SMatrix<f64, M, N> =
            SMatrix::from_fn(|i, j| if gain.is_measured(i) { H[(i, j)] } else { 0.0 });
        let (K_T, H_T) = (gain.K.transpose(), H.transpose());
        let v =
            AdjointState { r: gain.weighted - K_T * self.r, N: congruence(&K_T, &self.N, &gain.S_inverse) };
        let I_KH = SMatrix::identity() - product(&gain.K, &H);
        self.r += H_T * v.r;
        let own = congruence(&H_T, &gain.S_inverse, &SMatrix::zeros());
        self.N = congruence(&I_KH.transpose(), &self.N, &own);
        v
    }
}
