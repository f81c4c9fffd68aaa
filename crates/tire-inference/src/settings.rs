//! Says how a tire curve is to be identified.

use numerics::loss::Loss;
use preparation::direction::ForceDirection;
use preparation::samples::CurveSamples;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::fit::{
    CurveConstraints, CurveFitProblem, FitError, FitOptions, FitSolution, SlipNoise, least_squares,
    nelder_mead,
};
use crate::parameters::Normal;
use crate::plausibility;
use crate::prior::Prior;
use crate::regularisation::Regularisation;
use crate::variational::ElboOptimiser;

/// Method of the fit.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum FitMethod {
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

impl FitMethod {
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
pub struct IdentificationSettings {
    /// Which force.
    pub direction: ForceDirection,
    /// What is known before any data.
    pub prior: Prior,
    /// Whether the sides of the default box may move, see [`Self::extend_bounds`].
    pub extensible: bool,
    /// What physics says beside the bounds.
    pub constraints: CurveConstraints,
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
    pub svi: ElboOptimiser,
}

impl IdentificationSettings {
    /// Plain least squares with the usual prior.
    pub fn new(direction: ForceDirection) -> Self {
        let prior = match direction {
            ForceDirection::Lateral => Prior::lateral(),
            ForceDirection::Longitudinal => Prior::longitudinal(),
        };
        Self {
            direction,
            prior,
            extensible: true,
            constraints: CurveConstraints::default(),
            regularisation: None,
            prior_from_file: None,
            loss: Loss::Square,
            slip_noise: None,
            hold: true,
            options: FitOptions::default(),
            svi: ElboOptimiser::default(),
        }
    }

    /// What is fitted, with what is known in `prior`. The prior from a file counts if it has a weight: the variance of the noise
    /// for a sum of squares, 1 for a likelihood.
    pub fn fit_problem<'a>(
        &self,
        samples: &'a CurveSamples,
        prior: &Prior,
        weight: Option<f64>,
    ) -> CurveFitProblem<'a> {
        let found = self.prior_from_file.zip(weight);
        let found = found.map(|(towards, weight)| Regularisation { towards, weight });
        CurveFitProblem {
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
    pub fn check(&self, samples: &CurveSamples) -> Result<(), FitError> {
        self.fit_problem(samples, &self.prior, None).check()?;
        plausibility::check_plausibility(samples, self.direction)
    }

    /// Fits by a method, which Nelder and Mead do without constraints and noise in the slip. What is about the posterior
    /// starts from least squares.
    ///
    /// # Errors
    /// If samples or settings leave nothing to fit, see [`FitError`].
    pub fn fit(
        &self,
        samples: &CurveSamples,
        prior: &Prior,
        method: FitMethod,
    ) -> Result<FitSolution, FitError> {
        let mut solution = self.fit_once(samples, prior, method, None)?;
        if self.prior_from_file.is_some() {
            // The noise of the free fit, then that of the one that knows of the prior: its estimate hardly moves again.
            for _ in 0..2 {
                let variance = Some(self.loss.cost_divisor(solution.noise_std));
                solution = self.fit_once(samples, prior, method, variance)?;
            }
        }
        Ok(solution)
    }

    fn fit_once(
        &self,
        samples: &CurveSamples,
        prior: &Prior,
        method: FitMethod,
        variance: Option<f64>,
    ) -> Result<FitSolution, FitError> {
        let weight = match method {
            FitMethod::LeastSquares if self.slip_noise.is_some() => Some(1.0),
            _ => variance,
        };
        let problem = self.fit_problem(samples, prior, weight);
        match method {
            FitMethod::LeastSquares | FitMethod::Svi | FitMethod::Reference => {
                least_squares(&problem, &self.options)
            }
            FitMethod::NelderMead => {
                let constraints = CurveConstraints::default();
                let plain = CurveFitProblem { constraints, slip_noise: None, ..problem };
                nelder_mead::fit_nelder_mead(
                    &plain,
                    &FitOptions { start: Some(prior.centre), ..self.options },
                )
            }
        }
    }
}
