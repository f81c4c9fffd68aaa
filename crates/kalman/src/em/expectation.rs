//! Computes the expected second moments of the noises: the E-step, fused with the smoother.
#![allow(non_snake_case, reason = "matrices are written as in the equations")]

use nalgebra::{Cholesky, SMatrix, SVector};

use crate::forward::{FilteredRecording, PassError, measurement_residual};
use crate::gaussian::{Gaussian, product, symmetric_part};
use crate::rts::{SmootherLink, backward_sweep};
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

/// Smooths, and keeps the second moments of the noises only; those of v as a matrix if `joint_R`,
/// else its variances.
///
/// With r = P_{k+1|k}⁻¹ (x_{k+1|T} − x_{k+1|k}) and N = P_{k+1|k}⁻¹ (P_{k+1|k} − P_{k+1|T})
/// P_{k+1|k}⁻¹ the noise of a transition has the mean Q r and the covariance Q − Q N Q (de Jong and
/// Shephard 1995), so that its moments need one sum, of r rᵀ − N. It equals the sum of
/// d dᵀ + P_{k+1|T} − P_{k+1,k|T} Fᵀ − F P_{k+1,k|T}ᵀ + F P_{k|T} Fᵀ, d = x_{k+1|T} − F x_{k|T} − b
/// (Shumway and Stoffer 1982), which subtracts covariances of states to find a noise that may be
/// many digits smaller; this form subtracts the information of the measurements from Q.
pub(crate) fn expected_noise_moments<const N: usize, const M: usize>(
    steps: &[LinearStep<N, M>],
    filtered: &FilteredRecording<N>,
    parameters: &NoiseParameters<N, M>,
    joint_R: bool,
) -> Result<NoiseMoments<N, M>, PassError> {
    let mut information = SMatrix::<f64, N, N>::zeros();
    let mut v = MeasurementNoise::new(&parameters.R, joint_R);
    let mut start = parameters.start;
    backward_sweep(steps, filtered, |k, state, link| {
        if let Some(SmootherLink { inverse, shift, shrink, .. }) = link {
            let r = inverse * shift;
            information += r * r.transpose() + product(&product(&inverse, &shrink), &inverse);
        }
        v.add_step(&steps[k], state);
        start = *state;
    })?;
    let transitions = steps.len() - 1;
    let (R, measured) = v.mean_moment(steps.len());
    let Q = parameters.Q;
    let information = symmetric_part(&information) / transitions as f64;
    Ok(NoiseMoments { start, Q: symmetric_part(&(Q + Q * information * Q)), R, transitions, measured })
}

/// Sum of E[v vᵀ] over the steps.
struct MeasurementNoise<'a, const M: usize> {
    R: &'a SMatrix<f64, M, M>,
    joint: bool,
    sum: SMatrix<f64, M, M>,
    measured: [usize; M],
}

impl<'a, const M: usize> MeasurementNoise<'a, M> {
    fn new(R: &'a SMatrix<f64, M, M>, joint: bool) -> Self {
        Self { R, joint, sum: SMatrix::zeros(), measured: [0; M] }
    }

    #[inline]
    fn add_step<const N: usize>(&mut self, step: &LinearStep<N, M>, state: &Gaussian<N>) {
        let e = measurement_residual(step, &state.mean);
        let HP = product(&step.H, &state.cov);
        if self.joint {
            self.sum += self.complete_moment(step, &(e * e.transpose() + HP * step.H.transpose()));
            return;
        }
        for i in (0..M).filter(|i| !step.y[*i].is_nan()) {
            self.sum[(i, i)] += e[i] * e[i] + HP.row(i).dot(&step.H.row(i));
            self.measured[i] += 1;
        }
    }

    /// E[v vᵀ] of a step, the noise of absent components included: given the others, v_a has the
    /// mean B v_o and the covariance R_aa − B R_oa with B = R_ao R_oo⁻¹.
    fn complete_moment<const N: usize>(
        &self,
        step: &LinearStep<N, M>,
        moment: &SMatrix<f64, M, M>,
    ) -> SMatrix<f64, M, M> {
        let absent = step.y.map(f64::is_nan);
        if !absent.iter().any(|a| *a) {
            return *moment;
        }
        // Rows of the observed components are those of the identity, so that B is M × M here.
        let observed = |i: usize, j: usize| !absent[i] && !absent[j];
        let R_oo = SMatrix::from_fn(|i, j| match (observed(i, j), i == j) {
            (true, _) => self.R[(i, j)],
            (false, same) => f64::from(u8::from(same)),
        });
        let R_all_o: SMatrix<f64, M, M> =
            SMatrix::from_fn(|i, j| if absent[j] { 0.0 } else { self.R[(i, j)] });
        // R_oo is a part of a covariance that the forward pass has factorised.
        let Some(factor) = Cholesky::new(R_oo) else { return SMatrix::from_element(f64::NAN) };
        let B = factor.solve(&R_all_o.transpose()).transpose();
        let seen = SMatrix::from_fn(|i, j| if observed(i, j) { moment[(i, j)] } else { 0.0 });
        symmetric_part(&(B * seen * B.transpose() + self.R - B * R_all_o.transpose()))
    }

    fn mean_moment(self, steps: usize) -> (SMatrix<f64, M, M>, [usize; M]) {
        if self.joint {
            return (symmetric_part(&self.sum) / steps as f64, [steps; M]);
        }
        let mean = SVector::from_fn(|i, _| match self.measured[i] {
            0 => self.R[(i, i)],
            n => self.sum[(i, i)] / n as f64,
        });
        (SMatrix::from_diagonal(&mean), self.measured)
    }
}
