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
pub use solution::FitSolution;

use numerics::loss::Loss;
use preparation::samples::CurveSamples;

use crate::bounds::Bounds;
use crate::parameters::{COUNT, Parameter, Theta};
use crate::prior::Prior;
use crate::regularisation::Regularisation;
use curve::CurveCost;
use solution::{CurveMinimum, ResidualNoise};

/// What physics says beside the bounds, as lowest and highest value.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct CurveConstraints {
    /// Stiffness B C D per unit of load.
    pub stiffness: Option<[f64; 2]>,
    /// Slip where the force peaks, in the unit of the slip; infinite for no upper limit.
    pub peak_slip: Option<[f64; 2]>,
}

/// What is fitted to what.
#[derive(Clone, Debug)]
pub struct CurveFitProblem<'a> {
    /// Points of the curve.
    pub samples: &'a CurveSamples,
    /// The box, borders included.
    pub bounds: Bounds,
    /// Which parameters are fitted, in the order of [`Parameter`].
    pub free: [bool; COUNT],
    /// Values of those that are not.
    pub held: Theta,
    /// What is expected before any data.
    pub regularisation: Vec<Regularisation>,
    /// What physics says.
    pub constraints: CurveConstraints,
    /// How residuals count.
    pub loss: Loss,
    /// Noise in the slip, which makes plain least squares too soft a tire.
    pub slip_noise: Option<SlipNoise>,
}

impl<'a> CurveFitProblem<'a> {
    /// Plain least squares with the usual prior of a longitudinal curve: for B, C, D and E, without shifts.
    pub fn new(samples: &'a CurveSamples) -> Self {
        let Prior { bounds, free, centre } = Prior::longitudinal();
        Self {
            samples,
            bounds,
            free,
            held: centre,
            regularisation: Vec::new(),
            constraints: CurveConstraints::default(),
            loss: Loss::Square,
            slip_noise: None,
        }
    }

    /// Looks for mistakes that do not depend on the optimiser.
    ///
    /// # Errors
    /// With the first of them.
    pub fn check(&self) -> Result<(), FitError> {
        error::check_problem(self)
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
/// to the last bits. A result that did not converge is returned as such, see [`FitSolution::convergence`].
///
/// # Errors
/// If the samples, bounds or constraints leave nothing to fit; see [`FitError`].
pub fn least_squares(problem: &CurveFitProblem, options: &FitOptions) -> Result<FitSolution, FitError> {
    error::check_problem(problem)?;
    if let Some(noise) = problem.slip_noise {
        return slip_noise::fit_with_slip_noise(problem, noise, options);
    }
    let cost = CurveCost::new(problem);
    let rough = CurveCost::approximation(problem, options.starts);
    let rough = rough.as_ref().map(|cost| cost as &dyn sqp::Objective);
    let starts: Vec<DVector<f64>> = multistart::start_points(&problem.bounds, &problem.held, options)
        .iter()
        .map(|theta| cost.x_from_theta(theta))
        .collect();
    let (lower, upper) = (cost.lower_bounds(), cost.upper_bounds());
    let search = multistart::search_from_starts(&cost, rough, &lower, &upper, &starts, options)?;
    let optima = search.optima.iter().map(|m| (cost.theta_from_x(&m.x), m.model.cost)).collect();
    let part = CurveMinimum::from_minimum(&search.best, 0, cost.unknowns.free.len());
    let noise = ResidualNoise::estimate(problem, &cost.theta_from_x(&search.best.x), part.fitted);
    Ok(part.to_solution(problem, &noise, search.convergence(), optima))
}
