//! Makes a cost of one curve for the optimiser: from logarithms of B, C and D to the Magic Formula and back.
#![allow(non_snake_case, reason = "symbols as in Pacejka, Tire and Vehicle Dynamics")]

use std::borrow::Cow;
use std::f64::consts::FRAC_PI_2;

use nalgebra::{DMatrix, DVector};
use numerics::loss::Loss;
use numerics::sqp::{LinearisedInequality, Objective, QuadraticModel};
use preparation::samples::CurveSamples;

use crate::bounds::Bounds;
use crate::compressed::CompressedSamples;
use crate::fit::{CurveConstraints, CurveFitProblem};
use crate::kernel::{self, CostDerivatives};
use crate::parameters::{COUNT, Parameter, Theta};
use crate::regularisation::Regularisation;

/// Fewer samples times starts are quicker as they are: compressing takes as long as some passes over them.
const MANY: usize = 4000;
/// So many samples lead as near to an optimum of a loss that is no square as all of them.
const SOME: usize = 4096;
/// Residuals that are this small beside the forces are rounding, not noise.
const ROUNDING: f64 = 1e-4;

/// Which parameters are unknowns, and how: B, C and D as logarithms, the others as they are.
#[derive(Clone, Debug)]
pub struct CurveVariables {
    /// Places of the free parameters.
    pub free: Vec<usize>,
    held: Theta,
    bounds: Bounds,
}

impl CurveVariables {
    /// The unknowns of a problem.
    pub fn new(problem: &CurveFitProblem) -> Self {
        let free = problem.free_parameters().into_iter().map(|p| p as usize).collect();
        Self { free, held: problem.held, bounds: problem.bounds }
    }

    /// From parameters to unknowns.
    pub fn x_from_theta(&self, theta: &Theta) -> DVector<f64> {
        DVector::from_iterator(
            self.free.len(),
            self.free.iter().map(|&i| if is_log(i) { theta[i].ln() } else { theta[i] }),
        )
    }

    /// From unknowns to parameters, on the bounds to the last bit.
    pub fn theta_from_x(&self, x: &[f64]) -> Theta {
        let mut theta = self.held;
        for (&i, &x) in self.free.iter().zip(x) {
            let (lower, upper) = (self.bounds.lower[i], self.bounds.upper[i]);
            theta[i] = if !is_log(i) {
                x
            } else if x <= lower.ln() {
                lower
            } else if x >= upper.ln() {
                upper
            } else {
                x.exp().clamp(lower, upper)
            };
        }
        theta
    }

    /// dθ/dx of each unknown.
    pub fn theta_derivatives(&self, theta: &Theta) -> Vec<f64> {
        self.free.iter().map(|&i| if is_log(i) { theta[i] } else { 1.0 }).collect()
    }

    /// The bounds of the unknowns.
    pub fn variable_bounds(&self) -> (DVector<f64>, DVector<f64>) {
        (self.x_from_theta(&self.bounds.lower), self.x_from_theta(&self.bounds.upper))
    }

    /// Stiffness and peak slip as inequalities of order 1: ln BCD between its limits, and the sine's argument at the limits of
    /// the peak slip on the right side of π/2, where the sine peaks.
    pub fn constraint_inequalities(
        &self,
        theta: &Theta,
        constraints: &CurveConstraints,
    ) -> Vec<LinearisedInequality> {
        let [B, C, D, ..] = *theta;
        let mut rows = Vec::new();
        let mut add = |sign: f64, value: f64, by_theta: Theta| {
            let slopes = self.theta_derivatives(theta);
            let gradient = self.free.iter().zip(slopes).map(|(&i, slope)| sign * by_theta[i] * slope);
            rows.push(LinearisedInequality {
                value: sign * value,
                gradient: DVector::from_iterator(self.free.len(), gradient),
            });
        };
        if let Some([low, high]) = constraints.stiffness {
            let stiffness = B.ln() + C.ln() + D.ln();
            let by_theta = [1.0 / B, 1.0 / C, 1.0 / D, 0.0, 0.0, 0.0];
            add(1.0, stiffness - low.ln(), by_theta);
            add(-1.0, stiffness - high.ln(), by_theta);
        }
        for (limit, sign) in
            constraints.peak_slip.into_iter().flat_map(|[low, high]| [(low, -1.0), (high, 1.0)])
        {
            if limit.is_finite() {
                let (argument, by_theta) = kernel::sine_argument(theta, limit);
                add(sign, argument - FRAC_PI_2, by_theta);
            }
        }
        rows
    }
}

/// Whether a parameter is fitted as its logarithm.
fn is_log(parameter: usize) -> bool {
    parameter <= Parameter::D as usize
}

/// Adds what is expected to a model.
pub fn add_regularisation(
    model: &mut QuadraticModel,
    unknowns: &CurveVariables,
    theta: &Theta,
    regularisation: &[Regularisation],
) {
    let slopes = unknowns.theta_derivatives(theta);
    for expected in regularisation {
        let (cost, gradient) = expected.cost_and_gradient(theta);
        model.cost += cost;
        for (k, &i) in unknowns.free.iter().enumerate() {
            model.gradient[k] += gradient[i] * slopes[k];
            for (l, &j) in unknowns.free.iter().enumerate() {
                let precision = expected.towards.precision[i][j];
                model.hessian[(k, l)] += expected.weight * precision * slopes[k] * slopes[l];
            }
        }
    }
}

/// What a curve is compared with.
enum CurveData<'a> {
    /// All samples, or some, each for as many as it stands for.
    Samples(Cow<'a, CurveSamples>),
    /// For squares alone.
    CompressedSamples(Box<CompressedSamples>),
}

/// Samples at even steps in the order of the slip, of the weight of all.
fn subsample(samples: &CurveSamples) -> CurveSamples {
    let mut some = samples.select_rows(&samples.rows_by_slip(SOME));
    let whole = |samples: &CurveSamples| samples.weight.iter().sum::<f64>();
    let each = whole(samples) / whole(&some).max(f64::MIN_POSITIVE);
    some.weight.iter_mut().for_each(|weight| *weight *= each);
    some
}

/// Sum of the losses of one curve, with what is expected of it.
pub struct CurveCost<'a> {
    data: CurveData<'a>,
    free: [bool; COUNT],
    loss: Loss,
    regularisation: &'a [Regularisation],
    constraints: CurveConstraints,
    pub unknowns: CurveVariables,
    /// What residuals of rounding would cost.
    floor: f64,
}

impl<'a> CurveCost<'a> {
    pub fn new(problem: &'a CurveFitProblem<'a>) -> Self {
        Self::with_data(problem, CurveData::Samples(Cow::Borrowed(problem.samples)))
    }

    /// Nearly the same cost for next to nothing, where that many starts or samples make it worth while.
    pub fn approximation(problem: &'a CurveFitProblem<'a>, starts: usize) -> Option<Self> {
        let samples = problem.samples;
        let data = match problem.loss {
            Loss::Square if samples.len() * starts >= MANY => {
                CurveData::CompressedSamples(Box::new(CompressedSamples::new(samples)))
            }
            Loss::Huber { .. } | Loss::StudentT { .. } if samples.len() >= 4 * SOME => {
                CurveData::Samples(Cow::Owned(subsample(samples)))
            }
            _ => return None,
        };
        Some(Self::with_data(problem, data))
    }

    fn with_data(problem: &'a CurveFitProblem<'a>, data: CurveData<'a>) -> Self {
        let samples = problem.samples;
        let energy: f64 = samples.force.iter().zip(&samples.weight).map(|(f, w)| w * f * f).sum();
        Self {
            data,
            free: problem.free,
            loss: problem.loss,
            regularisation: &problem.regularisation,
            constraints: problem.constraints,
            unknowns: CurveVariables::new(problem),
            floor: ROUNDING * energy.sqrt() + f64::MIN_POSITIVE,
        }
    }

    /// From unknowns to parameters.
    pub fn theta_from_x(&self, x: &DVector<f64>) -> Theta {
        self.unknowns.theta_from_x(x.as_slice())
    }

    /// From parameters to unknowns.
    pub fn x_from_theta(&self, theta: &Theta) -> DVector<f64> {
        self.unknowns.x_from_theta(theta)
    }

    /// The cost alone.
    pub fn cost_of_theta(&self, theta: &Theta) -> f64 {
        let own = match &self.data {
            CurveData::Samples(samples) => kernel::curve_cost(samples, theta, self.loss),
            CurveData::CompressedSamples(data) => 0.5 * data.residual_squares(theta),
        };
        own + self.regularisation.iter().map(|expected| expected.cost_and_gradient(theta).0).sum::<f64>()
    }

    fn cost_derivatives(&self, theta: &Theta) -> CostDerivatives {
        match &self.data {
            CurveData::Samples(samples) => kernel::cost_derivatives(samples, theta, &self.free, self.loss),
            CurveData::CompressedSamples(data) => {
                let near = data.gauss_newton_expansion(theta);
                CostDerivatives {
                    cost: 0.5 * near.squares,
                    gradient: near.gradient.into(),
                    hessian: near.hessian.into(),
                }
            }
        }
    }

    pub fn lower_bounds(&self) -> DVector<f64> {
        self.unknowns.variable_bounds().0
    }

    pub fn upper_bounds(&self) -> DVector<f64> {
        self.unknowns.variable_bounds().1
    }
}

impl Objective for CurveCost<'_> {
    fn model(&self, x: &DVector<f64>) -> QuadraticModel {
        let theta = self.theta_from_x(x);
        let pass = self.cost_derivatives(&theta);
        let slopes = self.unknowns.theta_derivatives(&theta);
        let free = &self.unknowns.free;
        let n = free.len();
        let mut model = QuadraticModel {
            cost: pass.cost,
            gradient: DVector::from_fn(n, |k, _| pass.gradient[free[k]] * slopes[k]),
            hessian: DMatrix::from_fn(n, n, |k, l| pass.hessian[free[k]][free[l]] * slopes[k] * slopes[l]),
            scale: 0.0,
        };
        add_regularisation(&mut model, &self.unknowns, &theta, self.regularisation);
        model.scale = (2.0 * model.cost).sqrt() + self.floor;
        model
    }

    fn inequalities(&self, x: &DVector<f64>) -> Vec<LinearisedInequality> {
        self.unknowns.constraint_inequalities(&self.theta_from_x(x), &self.constraints)
    }
}
