//! Fits a curve to slips that are themselves noisy, by maximum likelihood.
//!
//! A measured slip x stands for true slips s. To second order the mean force there is f(m) + ½ V f''(m), with the mean m and the
//! variance V of s given x; its variance is σ_y² + f'² σ_x². All of f, f' and f'' depend on the parameters, and so do all terms
//! of the likelihood, the logarithm of the variance included.

#![allow(non_snake_case, reason = "symbols as in Pacejka, Tire and Vehicle Dynamics")]

use nalgebra::{Const, DMatrix, DVector, U1};
use num_dual::{Derivative, DualSVec64};
use numerics::sqp::{LinearisedInequality, Objective, QuadraticModel};
use rayon::prelude::*;
use vehicle::MagicFormula;

use crate::fit::curve::{CurveVariables, add_regularisation};
use crate::fit::deconvolution::{TrueSlipMoments, true_slip_moments};
use crate::fit::solution::{CurveMinimum, ResidualNoise};
use crate::fit::{CurveFitProblem, FitError, FitOptions, FitSolution, least_squares, multistart};
use crate::kernel::{CurveDerivatives, curve_derivatives};
use crate::parameters::{COUNT, Theta};

/// ResidualNoise in the slip, and which of its consequences are taken into account. Leaving one out is for studies: without `calibrate`
/// and `curvature` the stiffness comes out too low.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SlipNoise {
    /// Standard deviation, in the unit of the slip.
    pub std: f64,
    /// Standard deviation of the noise of the force column, if it is known; else it is estimated.
    pub force_std: Option<f64>,
    /// Regression calibration: the curve is taken at the mean of the true slip, not at the measured one.
    pub calibrate: bool,
    /// A curved curve is lower around its peak on average than in the middle.
    pub curvature: bool,
    /// Where the curve is steep, noise in the slip is noise in the force.
    pub variance: bool,
}

impl SlipNoise {
    /// All of it, with unknown noise of the force.
    pub fn new(std: f64) -> Self {
        Self { std, force_std: None, calibrate: true, curvature: true, variance: true }
    }
}

/// Samples whose sums one thread makes.
const CHUNK: usize = 1024;
/// The noise of the force is at least this share of the residuals: noise in the slip cannot explain those at the peak.
const LEAST_NOISE: f64 = 0.02;

type ParameterDual = DualSVec64<COUNT>;

/// Plain least squares first, then the likelihood from each of its optima.
pub fn fit_with_slip_noise(
    problem: &CurveFitProblem,
    noise: SlipNoise,
    options: &FitOptions,
) -> Result<FitSolution, FitError> {
    if let Some(std) = noise.force_std
        && !(std > 0.0 && std.is_finite())
    {
        return Err(FitError::Setting {
            setting: "slip_noise.force_std",
            problem: "must be finite and above 0",
        });
    }
    let plain = least_squares(&CurveFitProblem { slip_noise: None, ..problem.clone() }, options)?;
    let spread = plain.noise_std.max(f64::MIN_POSITIVE);
    let cost = SlipNoiseLikelihood::new(problem, noise);
    let (lower, upper) = cost.unknowns.variable_bounds();
    let with_noise = |x: DVector<f64>, std: f64| if noise.force_std.is_some() { x } else { x.push(std.ln()) };
    let starts: Vec<DVector<f64>> =
        plain.optima.iter().map(|(theta, _)| with_noise(cost.unknowns.x_from_theta(theta), spread)).collect();
    let (lower, upper) = (with_noise(lower, LEAST_NOISE * spread), with_noise(upper, 2.0 * spread));
    let search = multistart::search_from_starts(&cost, None, &lower, &upper, &starts, options)?;
    let count = cost.unknowns.free.len();
    let part = CurveMinimum::from_minimum(&search.best, 0, count);
    let std = cost.force_std(&search.best.x);
    let optima = search.optima.iter().map(|m| (cost.theta_from_x(&m.x), m.model.cost)).collect();
    let mut convergence = search.convergence();
    convergence.starts = plain.convergence.starts;
    convergence.evaluations += plain.convergence.evaluations;
    convergence.optima = convergence.optima.max(plain.convergence.optima);
    Ok(part.to_solution(problem, &ResidualNoise { std, factor: 1.0 }, convergence, optima))
}

struct SlipNoiseLikelihood<'a> {
    problem: &'a CurveFitProblem<'a>,
    noise: SlipNoise,
    unknowns: CurveVariables,
    truth: Vec<TrueSlipMoments>,
    count: f64,
}

impl<'a> SlipNoiseLikelihood<'a> {
    fn new(problem: &'a CurveFitProblem, noise: SlipNoise) -> Self {
        let samples = problem.samples;
        let as_measured = |&x: &f64| TrueSlipMoments { mean: x, variance: noise.std * noise.std };
        let truth = if noise.calibrate {
            true_slip_moments(&samples.slip, noise.std)
        } else {
            samples.slip.iter().map(as_measured).collect()
        };
        let count = samples.weight.iter().filter(|&&w| w > 0.0).count() as f64;
        Self { problem, noise, unknowns: CurveVariables::new(problem), truth, count }
    }

    fn theta_from_x(&self, x: &DVector<f64>) -> Theta {
        self.unknowns.theta_from_x(&x.as_slice()[..self.unknowns.free.len()])
    }

    fn force_std(&self, x: &DVector<f64>) -> f64 {
        self.noise.force_std.unwrap_or_else(|| x[self.unknowns.free.len()].exp())
    }

    /// Adds one sample: −ln of its normal density, the derivatives, and their expected squares (Fisher's information).
    fn add_sample(
        &self,
        sums: &mut LikelihoodSums,
        i: usize,
        curve: &MagicFormula<ParameterDual>,
        force_variance: f64,
        slopes: &[f64],
    ) {
        let samples = self.problem.samples;
        if samples.weight[i] == 0.0 {
            return;
        }
        let CurveDerivatives { value, slope, curvature } =
            curve_derivatives(curve, ParameterDual::from(self.truth[i].mean));
        let mean =
            if self.noise.curvature { value + curvature * (0.5 * self.truth[i].variance) } else { value };
        let spread = if self.noise.variance {
            slope * slope * self.noise.std.powi(2)
        } else {
            ParameterDual::from(0.0)
        };
        let own = force_variance / samples.weight[i];
        let variance = spread.re + own;
        let residual = mean.re - samples.force[i];
        let by = |dual: &ParameterDual, k: usize| match (&dual.eps.0, self.unknowns.free.get(k)) {
            (Some(eps), Some(&parameter)) => eps[parameter] * slopes[k],
            _ => 0.0,
        };
        let share = residual * residual / variance;
        sums.cost += 0.5 * (share + variance.ln());
        let n = sums.gradient.len();
        let free = self.unknowns.free.len();
        for k in 0..n {
            // The last unknown, if there is one more, is ln σ_y.
            sums.by_mean[k] = by(&mean, k);
            sums.by_variance[k] = if k < free { by(&spread, k) } else { 2.0 * own };
            sums.gradient[k] +=
                (residual * sums.by_mean[k] + 0.5 * (1.0 - share) * sums.by_variance[k]) / variance;
            for l in 0..=k {
                let by_variances = 0.5 * sums.by_variance[k] * sums.by_variance[l] / variance;
                sums.hessian[(k, l)] += (sums.by_mean[k] * sums.by_mean[l] + by_variances) / variance;
            }
        }
    }
}

/// Sums over samples; the last two are room for one of them.
#[derive(Clone)]
struct LikelihoodSums {
    cost: f64,
    gradient: DVector<f64>,
    hessian: DMatrix<f64>,
    by_mean: DVector<f64>,
    by_variance: DVector<f64>,
}

impl Objective for SlipNoiseLikelihood<'_> {
    fn model(&self, x: &DVector<f64>) -> QuadraticModel {
        let theta = self.theta_from_x(x);
        let slopes = self.unknowns.theta_derivatives(&theta);
        let variance = self.force_std(x).powi(2);
        let dual: [ParameterDual; COUNT] = std::array::from_fn(|i| {
            ParameterDual::new(theta[i], Derivative::derivative_generic(Const::<COUNT>, U1, i))
        });
        let [B, C, D, E, S_h, S_v] = dual;
        let curve = MagicFormula { B, C, D, E, S_h, S_v };
        let n = x.len();
        let none = LikelihoodSums {
            cost: 0.0,
            gradient: DVector::zeros(n),
            hessian: DMatrix::zeros(n, n),
            by_mean: DVector::zeros(n),
            by_variance: DVector::zeros(n),
        };
        let samples = self.truth.len();
        let chunk = |c: usize| {
            let mut sums = none.clone();
            (c * CHUNK..((c + 1) * CHUNK).min(samples))
                .for_each(|i| self.add_sample(&mut sums, i, &curve, variance, &slopes));
            sums
        };
        let parts: Vec<LikelihoodSums> = (0..samples.div_ceil(CHUNK)).into_par_iter().map(chunk).collect();
        let mut model = QuadraticModel {
            cost: 0.0,
            gradient: none.gradient,
            hessian: none.hessian,
            scale: self.count.sqrt(),
        };
        for part in parts {
            model.cost += part.cost;
            model.gradient += part.gradient;
            model.hessian += part.hessian;
        }
        model.hessian.fill_upper_triangle_with_lower_triangle();
        add_regularisation(&mut model, &self.unknowns, &theta, &self.problem.regularisation);
        model
    }

    fn inequalities(&self, x: &DVector<f64>) -> Vec<LinearisedInequality> {
        let rows = self.unknowns.constraint_inequalities(&self.theta_from_x(x), &self.problem.constraints);
        let extend = |row: LinearisedInequality| LinearisedInequality {
            gradient: row.gradient.resize_vertically(x.len(), 0.0),
            ..row
        };
        rows.into_iter().map(extend).collect()
    }
}

#[cfg(test)]
mod tests {
    use approx::assert_relative_eq;
    use preparation::samples::CurveSamples;

    use super::*;

    #[test]
    fn the_gradient_is_that_of_the_likelihood() {
        let slip: Vec<f64> = (0..200).map(|i| 0.002 * f64::from(i) - 0.1).collect();
        let force = slip.iter().map(|x| 1.4 * (25.0 * x).tanh() + 0.1 * (1e3 * x).sin()).collect();
        let mut samples = CurveSamples::new(slip, force);
        samples.weight.iter_mut().enumerate().for_each(|(i, w)| *w = (i % 3) as f64);
        let problem = CurveFitProblem { free: [true; COUNT], ..CurveFitProblem::new(&samples) };
        let parts = [(true, true, true), (false, false, true), (false, true, false)];
        for (calibrate, curvature, variance) in parts {
            let noise = SlipNoise { calibrate, curvature, variance, ..SlipNoise::new(0.01) };
            let cost = SlipNoiseLikelihood::new(&problem, noise);
            let x = cost.unknowns.x_from_theta(&[14.0, 1.8, 1.4, 0.5, 0.003, -0.02]).push(0.07_f64.ln());
            let gradient = cost.model(&x).gradient;
            for k in 0..x.len() {
                let at = |step: f64| {
                    let mut moved = x.clone();
                    moved[k] += step;
                    cost.model(&moved).cost
                };
                let slope = (at(1e-5) - at(-1e-5)) / 2e-5;
                assert_relative_eq!(gradient[k], slope, epsilon = 1e-5, max_relative = 1e-6);
            }
        }
    }
}
