//! Fits a tire curve to samples by least squares: in bounds, under constraints of physics, from several starts.

mod curve;
mod deconvolution;
mod error;
pub mod joint;
mod multistart;
pub mod nelder_mead;
pub mod slip_noise;
mod solution;

use nalgebra::DVector;
use numerics::sqp;

pub use error::FitError;
pub use joint::joint_least_squares;
pub use slip_noise::SlipNoise;
pub use solution::Solution;

use numerics::loss::Loss;
use preparation::samples::Samples;

use crate::bounds::Bounds;
use crate::parameters::{COUNT, Parameter, Theta};
use crate::prior::Prior;
use crate::regularisation::Regularisation;
use curve::CurveCost;
use solution::{Part, ResidualNoise};

/// What physics says beside the bounds, as lowest and highest value.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Constraints {
    /// Stiffness B C D per unit of load.
    pub stiffness: Option<[f64; 2]>,
    /// Slip where the force peaks, in the unit of the slip; infinite for no upper limit.
    pub peak_slip: Option<[f64; 2]>,
}

/// What is fitted to what.
#[derive(Clone, Debug)]
pub struct Problem<'a> {
    /// Points of the curve.
    pub samples: &'a Samples,
    /// The box, borders included.
    pub bounds: Bounds,
    /// Which parameters are fitted, in the order of [`Parameter`].
    pub free: [bool; COUNT],
    /// Values of those that are not.
    pub held: Theta,
    /// What is expected before any data.
    pub regularisation: Vec<Regularisation>,
    /// What physics says.
    pub constraints: Constraints,
    /// How residuals count.
    pub loss: Loss,
    /// Noise in the slip, which makes plain least squares too soft a tire.
    pub slip_noise: Option<SlipNoise>,
}

impl<'a> Problem<'a> {
    /// Plain least squares with the usual prior of a longitudinal curve: for B, C, D and E, without shifts.
    pub fn new(samples: &'a Samples) -> Self {
        let Prior { bounds, free, centre } = Prior::longitudinal();
        Self {
            samples,
            bounds,
            free,
            held: centre,
            regularisation: Vec::new(),
            constraints: Constraints::default(),
            loss: Loss::Square,
            slip_noise: None,
        }
    }

    /// Looks for mistakes that do not depend on the optimiser.
    ///
    /// # Errors
    /// With the first of them.
    pub fn check(&self) -> Result<(), FitError> {
        error::check(self)
    }

    /// The free parameters.
    pub fn free_parameters(&self) -> Vec<Parameter> {
        Parameter::ALL.into_iter().filter(|&p| self.free[p as usize]).collect()
    }
}

/// How the optimum is searched.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FitOptions {
    /// How many starts, the one below included.
    pub starts: usize,
    /// The first start, where wanted; the others spread over the box.
    pub start: Option<Theta>,
    /// Chooses the other starts.
    pub seed: u64,
    /// Most steps from each start.
    pub iterations: usize,
}

impl Default for FitOptions {
    fn default() -> Self {
        Self { starts: 8, start: None, seed: 0, iterations: 500 }
    }
}

impl FitOptions {
    /// One start, at these values.
    pub fn from_start(start: Theta) -> Self {
        Self { starts: 1, start: Some(start), ..Self::default() }
    }
}

/// Fits the free parameters.
///
/// B, C and D are fitted as logarithms, in which the stiffness is linear. Bounds and an active limit of the stiffness are met
/// to the last bits. A result that did not converge is returned as such, see [`Solution::convergence`].
///
/// # Errors
/// If the samples, bounds or constraints leave nothing to fit; see [`FitError`].
pub fn least_squares(problem: &Problem, options: &FitOptions) -> Result<Solution, FitError> {
    error::check(problem)?;
    if let Some(noise) = problem.slip_noise {
        return slip_noise::fit(problem, noise, options);
    }
    let cost = CurveCost::new(problem);
    let rough = CurveCost::rough(problem, options.starts);
    let rough = rough.as_ref().map(|cost| cost as &dyn sqp::Objective);
    let starts: Vec<DVector<f64>> = multistart::starts(&problem.bounds, &problem.held, options)
        .iter()
        .map(|theta| cost.unknowns(theta))
        .collect();
    let (lower, upper) = (cost.lower(), cost.upper());
    let search = multistart::search(&cost, rough, &lower, &upper, &starts, options)?;
    let optima = search.optima.iter().map(|m| (cost.theta(&m.x), m.model.cost)).collect();
    let part = Part::of(&search.best, 0, cost.unknowns.free.len());
    let noise = ResidualNoise::of(problem, &cost.theta(&search.best.x), part.fitted);
    Ok(part.solution(problem, &noise, search.convergence(), optima))
}
