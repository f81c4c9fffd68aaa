//! Says what a fit found: values, noise, covariance.

use nalgebra::{DMatrix, DVector};
use numerics::convergence::ConvergenceReport;
use numerics::loss::Loss;
use numerics::sqp::SqpMinimum;

use crate::fit::CurveFitProblem;
use crate::fit::curve::CurveVariables;
use crate::kernel;
use crate::parameters::{Parameter, Theta};

/// What a fit found.
#[derive(Clone, Debug, PartialEq)]
pub struct FitSolution {
    /// All parameters, the held ones included.
    pub theta: Theta,
    /// Cost at the optimum: losses, prior and coupling; with noise in the slip, the negative log-likelihood.
    pub cost: f64,
    /// Standard deviation of the noise of a sample of weight 1, in the unit of the force column.
    pub noise_std: f64,
    /// Rows and columns of the covariance.
    pub free: Vec<Parameter>,
    /// Covariance of the free parameters to first order, from noise and curvature at the optimum. What a bound or an active
    /// constraint decides has none: its rows are 0.
    pub covariance: DMatrix<f64>,
    /// Free parameters that stand on a bound.
    pub at_bound: Vec<Parameter>,
    /// How the optimum was reached.
    pub convergence: ConvergenceReport,
    /// The different optima that the starts led to, best first, with their costs. More than one says that the data hardly
    /// decide between curves.
    pub optima: Vec<(Theta, f64)>,
}

impl FitSolution {
    /// Standard deviation of a free parameter.
    pub fn parameter_std(&self, parameter: Parameter) -> Option<f64> {
        let index = self.free.iter().position(|&p| p == parameter)?;
        Some(self.covariance[(index, index)].sqrt())
    }
}

/// Some of the unknowns of a minimum: those of one curve.
pub struct CurveMinimum {
    /// Their values.
    pub x: DVector<f64>,
    /// Which of them stand on a bound.
    pub at_bound: Vec<bool>,
    /// Their inverse Hessian, see [`inverse_hessian_on_free`].
    pub inverse: DMatrix<f64>,
    /// How many of them nothing but the data decide.
    pub fitted: usize,
}

impl CurveMinimum {
    /// The unknowns `from..from + count` of a minimum.
    pub fn from_minimum(minimum: &SqpMinimum, from: usize, count: usize) -> Self {
        let at_bound = minimum.at_bound[from..from + count].to_vec();
        let held = |row: &usize| minimum.active_rows.row(*row).columns(from, count).amax() > 0.0;
        let tied =
            at_bound.iter().filter(|b| **b).count() + (0..minimum.active_rows.nrows()).filter(held).count();
        Self {
            x: minimum.x.rows(from, count).into_owned(),
            at_bound,
            inverse: inverse_hessian_on_free(minimum).view((from, from), (count, count)).into_owned(),
            fitted: count.saturating_sub(tied),
        }
    }

    /// The solution of the problem that these are the unknowns of.
    pub fn to_solution(
        &self,
        problem: &CurveFitProblem,
        noise: &ResidualNoise,
        convergence: ConvergenceReport,
        optima: Vec<(Theta, f64)>,
    ) -> FitSolution {
        let unknowns = CurveVariables::new(problem);
        let theta = unknowns.theta_from_x(self.x.as_slice());
        let slopes = DVector::from_vec(unknowns.theta_derivatives(&theta));
        let free = problem.free_parameters();
        FitSolution {
            theta,
            cost: convergence.cost,
            noise_std: noise.std,
            at_bound: free.iter().zip(&self.at_bound).filter(|(_, b)| **b).map(|(p, _)| *p).collect(),
            free,
            covariance: self.inverse.component_mul(&(&slopes * slopes.transpose())) * noise.factor,
            convergence,
            optima,
        }
    }
}

/// Inverse of the Hessian on what bounds and active constraints leave free, 0 elsewhere: the corner of the inverse of
/// [H Aᵀ; A 0] for the free unknowns. Not a number where the cost does not depend on an unknown.
fn inverse_hessian_on_free(minimum: &SqpMinimum) -> DMatrix<f64> {
    let n = minimum.x.len();
    let free: Vec<usize> = (0..n).filter(|&i| !minimum.at_bound[i]).collect();
    let (f, m) = (free.len(), minimum.active_rows.nrows());
    let width: Vec<f64> = free.iter().map(|&i| minimum.model.hessian[(i, i)].sqrt()).collect();
    let entry = |i: usize, j: usize| match (i < f, j < f) {
        (true, true) => minimum.model.hessian[(free[i], free[j])] / (width[i] * width[j]),
        (true, false) => minimum.active_rows[(j - f, free[i])] / width[i],
        (false, true) => minimum.active_rows[(i - f, free[j])] / width[j],
        (false, false) => 0.0,
    };
    let inverse = DMatrix::from_fn(f + m, f + m, entry).try_inverse();
    let mut result = DMatrix::zeros(n, n);
    for (a, &i) in free.iter().enumerate() {
        for (b, &j) in free.iter().enumerate() {
            result[(i, j)] = inverse.as_ref().map_or(f64::NAN, |v| v[(a, b)] / (width[a] * width[b]));
        }
    }
    result
}

/// Noise of the samples around a curve.
pub struct ResidualNoise {
    /// Standard deviation.
    pub std: f64,
    /// Covariance of the unknowns over the inverse of the Hessian.
    pub factor: f64,
}

impl ResidualNoise {
    /// For squares the residual variance; for the other losses its robust counterparts (Huber and Ronchetti, Robust
    /// Statistics, section 7.6): median of absolute residuals, and Σψ²/(Σψ')² relative to the weights in the Hessian.
    pub fn estimate(problem: &CurveFitProblem, theta: &Theta, fitted: usize) -> Self {
        let samples = problem.samples;
        let count = samples.weight.iter().filter(|&&w| w > 0.0).count();
        let spare = count.saturating_sub(fitted).max(1) as f64;
        let loss = problem.loss;
        if loss == Loss::Square {
            let variance = 2.0 * kernel::curve_cost(samples, theta, loss) / spare;
            return Self { std: variance.sqrt(), factor: variance };
        }
        let points = samples.slip.iter().zip(&samples.force).zip(&samples.weight).filter(|(_, w)| **w > 0.0);
        let residuals: Vec<(f64, f64)> =
            points.map(|((s, f), w)| (kernel::friction_coefficient(theta, *s) - f, *w)).collect();
        let mut sizes: Vec<f64> = residuals.iter().map(|(r, w)| r.abs() * w.sqrt()).collect();
        let median = *sizes.select_nth_unstable_by(count / 2, f64::total_cmp).1;
        let (mut squares, mut weights, mut curvatures) = (0.0, 0.0, 0.0);
        for (r, w) in residuals {
            let weight = loss.weight(r);
            squares += w * (weight * r).powi(2);
            weights += weight;
            curvatures += loss.curvature(r);
        }
        let n = count as f64;
        // Median of |r| over the standard deviation of a normal distribution: 0.6745.
        let std = median / 0.674_489_750_196_081_7;
        Self { std, factor: squares / spare * (weights / n) / (curvatures / n).powi(2) }
    }
}
