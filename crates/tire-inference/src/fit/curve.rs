//! Makes a cost of one curve for the optimiser: from logarithms of B, C and D to the Magic Formula and back.
#![allow(non_snake_case, reason = "symbols as in Pacejka, Tire and Vehicle Dynamics")]

use std::borrow::Cow;
use std::f64::consts::FRAC_PI_2;

use nalgebra::{DMatrix, DVector};
use numerics::loss::Loss;
use numerics::sqp::{Inequality, Model, Objective};
use preparation::samples::Samples;

use crate::bounds::Bounds;
use crate::compressed::CompressedSamples;
use crate::fit::{Constraints, Problem};
use crate::kernel::{self, Pass};
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
pub struct Unknowns {
    /// Places of the free parameters.
    pub free: Vec<usize>,
    held: Theta,
    bounds: Bounds,
}

impl Unknowns {
    /// The unknowns of a problem.
    pub fn new(problem: &Problem) -> Self {
        let free = problem.free_parameters().into_iter().map(|p| p as usize).collect();
        Self { free, held: problem.held, bounds: problem.bounds }
    }

    /// From parameters to unknowns.
    pub fn of(&self, theta: &Theta) -> DVector<f64> {
        DVector::from_iterator(
            self.free.len(),
            self.free.iter().map(|&i| if is_log(i) { theta[i].ln() } else { theta[i] }),
        )
    }

    /// From unknowns to parameters, on the bounds to the last bit.
    pub fn theta(&self, x: &[f64]) -> Theta {
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
    pub fn slopes(&self, theta: &Theta) -> Vec<f64> {
        self.free.iter().map(|&i| if is_log(i) { theta[i] } else { 1.0 }).collect()
    }

    /// The bounds of the unknowns.
    pub fn bounds(&self) -> (DVector<f64>, DVector<f64>) {
        (self.of(&self.bounds.lower), self.of(&self.bounds.upper))
    }

    /// Stiffness and peak slip as inequalities of order 1: ln BCD between its limits, and the sine's argument at the limits of
    /// the peak slip on the right side of π/2, where the sine peaks.
    pub fn inequalities(&self, theta: &Theta, constraints: &Constraints) -> Vec<Inequality> {
        let [B, C, D, ..] = *theta;
        let mut rows = Vec::new();
        let mut add = |sign: f64, value: f64, by_theta: Theta| {
            let slopes = self.slopes(theta);
            let gradient =
                self.free.iter().zip(slopes).map(|(&i, slope)| sign * by_theta[i] * slope);
            rows.push(Inequality {
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
pub fn regularise(
    model: &mut Model,
    unknowns: &Unknowns,
    theta: &Theta,
    regularisation: &[Regularisation],
) {
    let slopes = unknowns.slopes(theta);
    for expected in regularisation {
        let (cost, gradient) = expected.at(theta);
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
enum Data<'a> {
    /// All samples, or some, each for as many as it stands for.
    Samples(Cow<'a, Samples>),
    /// For squares alone.
    CompressedSamples(Box<CompressedSamples>),
}

/// Samples at even steps in the order of the slip, of the weight of all.
fn some(samples: &Samples) -> Samples {
    let mut some = samples.pick(&samples.rows_by_slip(SOME));
    let whole = |samples: &Samples| samples.weight.iter().sum::<f64>();
    let each = whole(samples) / whole(&some).max(f64::MIN_POSITIVE);
    some.weight.iter_mut().for_each(|weight| *weight *= each);
    some
}

/// Sum of the losses of one curve, with what is expected of it.
pub struct CurveCost<'a> {
    data: Data<'a>,
    free: [bool; COUNT],
    loss: Loss,
    regularisation: &'a [Regularisation],
    constraints: Constraints,
    pub unknowns: Unknowns,
    /// What residuals of rounding would cost.
    floor: f64,
}

impl<'a> CurveCost<'a> {
    pub fn new(problem: &'a Problem<'a>) -> Self {
        Self::of(problem, Data::Samples(Cow::Borrowed(problem.samples)))
    }

    /// Nearly the same cost for next to nothing, where that many starts or samples make it worth while.
    pub fn rough(problem: &'a Problem<'a>, starts: usize) -> Option<Self> {
        let samples = problem.samples;
        let data = match problem.loss {
            Loss::Square if samples.len() * starts >= MANY => {
                Data::CompressedSamples(Box::new(CompressedSamples::new(samples)))
            }
            Loss::Huber { .. } | Loss::StudentT { .. } if samples.len() >= 4 * SOME => {
                Data::Samples(Cow::Owned(some(samples)))
            }
            _ => return None,
        };
        Some(Self::of(problem, data))
    }

    fn of(problem: &'a Problem<'a>, data: Data<'a>) -> Self {
        let samples = problem.samples;
        let energy: f64 = samples.force.iter().zip(&samples.weight).map(|(f, w)| w * f * f).sum();
        Self {
            data,
            free: problem.free,
            loss: problem.loss,
            regularisation: &problem.regularisation,
            constraints: problem.constraints,
            unknowns: Unknowns::new(problem),
            floor: ROUNDING * energy.sqrt() + f64::MIN_POSITIVE,
        }
    }

    /// From unknowns to parameters.
    pub fn theta(&self, x: &DVector<f64>) -> Theta {
        self.unknowns.theta(x.as_slice())
    }

    /// From parameters to unknowns.
    pub fn unknowns(&self, theta: &Theta) -> DVector<f64> {
        self.unknowns.of(theta)
    }

    /// The cost alone.
    pub fn cost(&self, theta: &Theta) -> f64 {
        let own = match &self.data {
            Data::Samples(samples) => kernel::cost(samples, theta, self.loss),
            Data::CompressedSamples(data) => 0.5 * data.squares(theta),
        };
        own + self.regularisation.iter().map(|expected| expected.at(theta).0).sum::<f64>()
    }

    fn pass(&self, theta: &Theta) -> Pass {
        match &self.data {
            Data::Samples(samples) => kernel::pass(samples, theta, &self.free, self.loss),
            Data::CompressedSamples(data) => {
                let near = data.quadratic(theta);
                Pass {
                    cost: 0.5 * near.squares,
                    gradient: near.gradient.into(),
                    hessian: near.hessian.into(),
                }
            }
        }
    }

    pub fn lower(&self) -> DVector<f64> {
        self.unknowns.bounds().0
    }

    pub fn upper(&self) -> DVector<f64> {
        self.unknowns.bounds().1
    }
}

impl Objective for CurveCost<'_> {
    fn model(&self, x: &DVector<f64>) -> Model {
        let theta = self.theta(x);
        let pass = self.pass(&theta);
        let slopes = self.unknowns.slopes(&theta);
        let free = &self.unknowns.free;
        let n = free.len();
        let mut model = Model {
            cost: pass.cost,
            gradient: DVector::from_fn(n, |k, _| pass.gradient[free[k]] * slopes[k]),
            hessian: DMatrix::from_fn(n, n, |k, l| {
                pass.hessian[free[k]][free[l]] * slopes[k] * slopes[l]
            }),
            scale: 0.0,
        };
        regularise(&mut model, &self.unknowns, &theta, self.regularisation);
        model.scale = (2.0 * model.cost).sqrt() + self.floor;
        model
    }

    fn inequalities(&self, x: &DVector<f64>) -> Vec<Inequality> {
        self.unknowns.inequalities(&self.theta(x), &self.constraints)
    }
}
