//! Says how a tire curve is to be identified.

use numerics::loss::Loss;
use preparation::direction::Direction;
use preparation::samples::Samples;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::fit::{
    Constraints, FitError, FitOptions, Problem, SlipNoise, Solution, least_squares, nelder_mead,
};
use crate::parameters::Normal;
use crate::plausibility;
use crate::prior::Prior;
use crate::regularisation::Regularisation;
use crate::variational::Optimiser;

/// Method of the fit.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Method {
    /// Constrained least squares from several starts; the uncertainty is that of the exact posterior.
    LeastSquares,
    /// Simplex search of Nelder and Mead within the bounds, for comparison with the literature.
    NelderMead,
    /// Stochastic variational inference: a normal distribution in place of the posterior, or the posterior itself where the
    /// diagnosis rejects it.
    Svi,
    /// Mean of the exact posterior.
    Reference,
}

impl Method {
    /// As in reports.
    pub fn name(self) -> &'static str {
        match self {
            Self::LeastSquares => "least_squares",
            Self::NelderMead => "nelder_mead",
            Self::Svi => "svi",
            Self::Reference => "reference",
        }
    }

    /// For people.
    pub fn title(self) -> &'static str {
        match self {
            Self::LeastSquares => "least squares",
            Self::NelderMead => "Nelder-Mead",
            Self::Svi => "variational inference",
            Self::Reference => "exact posterior",
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
    /// What draws the fit towards typical values.
    pub regularisation: Option<Regularisation>,
    /// What an earlier run or a test bench found. It counts as data: in the fit, the posterior and the verdicts.
    pub prior_from_file: Option<Normal>,
    /// How residuals count.
    pub loss: Loss,
    /// Noise in the slip.
    pub slip_noise: Option<SlipNoise>,
    /// Whether parameters that the data cannot tell are held at the prior.
    pub hold: bool,
    /// How the optimum is searched.
    pub options: FitOptions,
    /// How variational inference raises its bound.
    pub svi: Optimiser,
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
            regularisation: None,
            prior_from_file: None,
            loss: Loss::Square,
            slip_noise: None,
            hold: true,
            options: FitOptions::default(),
            svi: Optimiser::default(),
        }
    }

    /// What is fitted, with what is known in `prior`. The prior from a file counts if it has a weight: the variance of the noise
    /// for a sum of squares, 1 for a likelihood.
    pub fn problem<'a>(
        &self,
        samples: &'a Samples,
        prior: &Prior,
        weight: Option<f64>,
    ) -> Problem<'a> {
        let found = self.prior_from_file.zip(weight);
        let found = found.map(|(towards, weight)| Regularisation { towards, weight });
        Problem {
            samples,
            bounds: prior.bounds,
            free: prior.free,
            held: prior.centre,
            regularisation: self.regularisation.into_iter().chain(found).collect(),
            constraints: self.constraints,
            loss: self.loss,
            slip_noise: self.slip_noise,
        }
    }

    /// Looks for mistakes that need no fit: in the samples and the settings, and then whether a tire can have made the samples.
    ///
    /// # Errors
    /// With the first mistake, see [`FitError`].
    pub fn check(&self, samples: &Samples) -> Result<(), FitError> {
        self.problem(samples, &self.prior, None).check()?;
        plausibility::check(samples, self.direction)
    }

    /// Fits by a method, which Nelder and Mead do without constraints and noise in the slip. What is about the posterior
    /// starts from least squares.
    ///
    /// # Errors
    /// If samples or settings leave nothing to fit, see [`FitError`].
    pub fn fit(
        &self,
        samples: &Samples,
        prior: &Prior,
        method: Method,
    ) -> Result<Solution, FitError> {
        let mut solution = self.fit_once(samples, prior, method, None)?;
        if self.prior_from_file.is_some() {
            // The noise of the free fit, then that of the one that knows of the prior: its estimate hardly moves again.
            for _ in 0..2 {
                let variance = Some(self.loss.variance(solution.noise_std));
                solution = self.fit_once(samples, prior, method, variance)?;
            }
        }
        Ok(solution)
    }

    fn fit_once(
        &self,
        samples: &Samples,
        prior: &Prior,
        method: Method,
        variance: Option<f64>,
    ) -> Result<Solution, FitError> {
        let weight = match method {
            Method::LeastSquares if self.slip_noise.is_some() => Some(1.0),
            _ => variance,
        };
        let problem = self.problem(samples, prior, weight);
        match method {
            Method::LeastSquares | Method::Svi | Method::Reference => {
                least_squares(&problem, &self.options)
            }
            Method::NelderMead => {
                let constraints = Constraints::default();
                let plain = Problem { constraints, slip_noise: None, ..problem };
                nelder_mead::fit(&plain, &FitOptions { start: Some(prior.centre), ..self.options })
            }
        }
    }
}
