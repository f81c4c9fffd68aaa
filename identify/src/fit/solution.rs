//! Says what a fit found: values, noise, covariance.

use nalgebra::{DMatrix, DVector};

use super::Problem;
use super::curve::CurveCost;
use super::multistart::Search;
use super::sqp::Minimum;
use crate::kernel;
use crate::loss::Loss;
use crate::parameters::{Parameter, Theta};
use crate::result::Convergence;

/// What a fit found.
#[derive(Clone, Debug, PartialEq)]
pub struct Solution {
    /// All parameters, the held ones included.
    pub theta: Theta,
    /// Cost at the optimum: losses, prior and coupling.
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
    pub convergence: Convergence,
    /// The different optima that the starts led to, best first, with their costs. Far from a bound several of them say that the
    /// data do not decide.
    pub optima: Vec<(Theta, f64)>,
}

impl Solution {
    /// Standard deviation of a free parameter.
    pub fn std(&self, parameter: Parameter) -> Option<f64> {
        let place = self.free.iter().position(|&p| p == parameter)?;
        Some(self.covariance[(place, place)].sqrt())
    }
}

/// The solution for one curve.
pub fn of_curve(
    problem: &Problem,
    cost: &CurveCost,
    search: &Search,
    optima: Vec<(Theta, f64)>,
) -> Solution {
    let theta = cost.theta(&search.best.x);
    let tied =
        search.best.at_bound.iter().filter(|b| **b).count() + search.best.active_rows.nrows();
    let noise = Noise::of(problem, &theta, search.best.x.len().saturating_sub(tied));
    let slopes = DVector::from_vec(cost.unknowns.slopes(&theta));
    let (free, at_bound) = places(problem, &search.best.at_bound);
    Solution {
        theta,
        cost: search.best.model.cost,
        noise_std: noise.std,
        free,
        covariance: scale_rows(&inverse_on_active(&search.best), &slopes) * noise.factor,
        at_bound,
        convergence: search.convergence(),
        optima,
    }
}

/// The free parameters, and those of them on a bound.
pub fn places(problem: &Problem, at_bound: &[bool]) -> (Vec<Parameter>, Vec<Parameter>) {
    let free = problem.free_parameters();
    let bound = free.iter().zip(at_bound).filter(|(_, b)| **b).map(|(p, _)| *p).collect();
    (free, bound)
}

/// diag(slopes) M diag(slopes).
pub fn scale_rows(matrix: &DMatrix<f64>, slopes: &DVector<f64>) -> DMatrix<f64> {
    matrix.component_mul(&(slopes * slopes.transpose()))
}

/// Inverse of the Hessian on what bounds and active constraints leave free, 0 elsewhere: the corner of the inverse of
/// [H Aᵀ; A 0] for the free unknowns.
pub fn inverse_on_active(minimum: &Minimum) -> DMatrix<f64> {
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
    let mut result = DMatrix::zeros(n, n);
    // A parameter without any effect on the cost has a variance that is not a number.
    let inverse = DMatrix::from_fn(f + m, f + m, entry).try_inverse();
    for (a, &i) in free.iter().enumerate() {
        for (b, &j) in free.iter().enumerate() {
            result[(i, j)] =
                inverse.as_ref().map_or(f64::NAN, |v| v[(a, b)] / (width[a] * width[b]));
        }
    }
    result
}

/// Noise of the samples around a curve.
pub struct Noise {
    pub std: f64,
    /// Covariance of the unknowns over the inverse of the Hessian.
    pub factor: f64,
}

impl Noise {
    /// For squares the residual variance; for the other losses its robust counterparts (Huber and Ronchetti, Robust
    /// Statistics, section 7.6): median of absolute residuals, and Σψ²/(Σψ')² relative to the weights in the Hessian.
    pub fn of(problem: &Problem, theta: &Theta, fitted: usize) -> Self {
        let samples = problem.samples;
        let count = samples.weight.iter().filter(|&&w| w > 0.0).count();
        let spare = count.saturating_sub(fitted).max(1) as f64;
        let residuals = || {
            let points = samples.slip.iter().zip(&samples.force).zip(&samples.weight);
            points.filter(|(_, w)| **w > 0.0).map(|((s, f), w)| (kernel::value(theta, *s) - f, *w))
        };
        let loss = problem.loss;
        if loss == Loss::Square {
            let variance = 2.0 * kernel::cost(samples, theta, loss) / spare;
            return Self { std: variance.sqrt(), factor: variance };
        }
        let mut sizes: Vec<f64> = residuals().map(|(r, w)| r.abs() * w.sqrt()).collect();
        let middle = sizes.len() / 2;
        let median = *sizes.select_nth_unstable_by(middle, f64::total_cmp).1;
        let (mut squares, mut weights, mut curvatures) = (0.0, 0.0, 0.0);
        for (r, w) in residuals() {
            let weight = loss.weight(r);
            squares += w * (weight * r).powi(2);
            weights += weight;
            curvatures += loss.curvature(r);
        }
        let n = count as f64;
        Self {
            std: 1.482_602_218_505_602 * median,
            factor: squares / spare * (weights / n) / (curvatures / n).powi(2),
        }
    }
}
