//! Identifies one tire curve: fits it, judges what the data can tell, holds the rest at the prior and fits again.

use std::time::Instant;

use serde::Deserialize;

use crate::compressed::Compressed;
use crate::direction::Direction;
use crate::estimate::{Fitted, assemble, hold, to_hold};
use crate::fit::{
    self, Constraints, FitError, Options, Problem, SlipNoise, Solution, least_squares, nelder_mead,
};
use crate::loss::Loss;
use crate::parameters::Theta;
use crate::posterior::Posterior;
use crate::posterior::tempered;
use crate::prior::Prior;
use crate::result::{Estimate, Status};
use crate::samples::Samples;
use crate::verdict::{Evidence, Judgement, judge};

/// A way to find the values.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Method {
    /// Constrained least squares from several starts.
    LeastSquares,
    /// The simplex of Nelder and Mead, in bounds only: the yardstick of the literature.
    NelderMead,
}

impl Method {
    /// As in reports.
    pub fn name(self) -> &'static str {
        match self {
            Self::LeastSquares => "least_squares",
            Self::NelderMead => "nelder_mead",
        }
    }
}

/// How a curve is identified.
#[derive(Clone, Debug)]
pub struct Settings {
    /// Which force.
    pub direction: Direction,
    /// What is known before any data.
    pub prior: Prior,
    /// What physics says beside the bounds.
    pub constraints: Constraints,
    /// A pull of the fit towards typical values.
    pub ridge: Option<fit::Prior>,
    /// How residuals count.
    pub loss: Loss,
    /// Noise in the slip.
    pub slip_noise: Option<SlipNoise>,
    /// Whether parameters that the data cannot tell are held at the prior.
    pub hold: bool,
    /// How the optimum is searched.
    pub options: Options,
}

impl Settings {
    /// Plain least squares with the usual prior.
    pub fn new(direction: Direction) -> Self {
        let prior = match direction {
            Direction::Lateral => Prior::lateral(),
            Direction::Longitudinal => Prior::longitudinal(),
        };
        Self {
            direction,
            prior,
            constraints: Constraints::default(),
            ridge: None,
            loss: Loss::Square,
            slip_noise: None,
            hold: true,
            options: Options::default(),
        }
    }

    fn problem<'a>(&self, samples: &'a Samples, prior: &Prior) -> Problem<'a> {
        Problem {
            samples,
            bounds: prior.bounds,
            free: prior.free,
            held: prior.centre,
            prior: self.ridge,
            constraints: self.constraints,
            loss: self.loss,
            slip_noise: self.slip_noise,
        }
    }

    fn fit(&self, samples: &Samples, prior: &Prior, method: Method) -> Result<Solution, FitError> {
        let problem = self.problem(samples, prior);
        match method {
            Method::LeastSquares => least_squares(&problem, &self.options),
            Method::NelderMead => {
                let constraints = Constraints::default();
                let plain = Problem { constraints, slip_noise: None, ..problem };
                nelder_mead::fit(&plain, &self.options)
            }
        }
    }
}

/// What was found of a curve.
#[derive(Clone, Debug)]
pub struct Found {
    /// Least squares with everything free.
    pub free: Theta,
    /// By method, in the order that was asked for.
    pub estimates: Vec<(Method, Estimate)>,
    /// What the data can tell.
    pub judgements: Vec<Judgement>,
    /// Draws, with everything free.
    pub posterior: Posterior,
}

/// Identifies a curve by each of the methods. The uncertainty is the same for all of them: it is that of the data and of what was
/// known before, not one of a method.
///
/// # Errors
/// When there is nothing to fit, see [`FitError`].
pub fn identify(
    samples: &Samples,
    settings: &Settings,
    methods: &[Method],
) -> Result<Found, FitError> {
    let begin = Instant::now();
    let Settings { prior, direction, .. } = settings;
    let free = settings.fit(samples, prior, Method::LeastSquares)?;
    let slip_range = samples.slip_range().ok_or(FitError::Empty)?;
    let data = Compressed::new(samples);
    let seed = settings.options.seed;
    let posterior = tempered::draw(&data, prior, &tempered::Options { seed, ..Default::default() });
    let noise_std = free.noise_std;
    let evidence = Evidence { data: &data, slip_range, noise_std, direction: *direction };
    let judgements = judge(&evidence, prior, &posterior, &free.theta);
    let fixed = if settings.hold { to_hold(&judgements) } else { Vec::new() };
    let common = begin.elapsed().as_secs_f64();
    let mut estimates = Vec::new();
    for &method in methods {
        let begin = Instant::now();
        let solution = match method {
            Method::LeastSquares if fixed.is_empty() => free.clone(),
            _ => settings.fit(samples, &hold(prior, &fixed), method)?,
        };
        let fitted = Fitted {
            theta: solution.theta,
            noise_std: solution.noise_std,
            at_bound: solution.at_bound,
            convergence: solution.convergence,
        };
        let estimate = assemble(fitted, &fixed, &judgements, &posterior, slip_range, samples.len());
        let seconds = common + begin.elapsed().as_secs_f64();
        estimates.push((method, Estimate { seconds, ..estimate }));
    }
    Ok(Found { free: free.theta, estimates, judgements, posterior })
}

/// Whether all fits converged.
pub fn converged(found: &Found) -> bool {
    found.estimates.iter().all(|(_, estimate)| estimate.convergence.status == Status::Converged)
}
