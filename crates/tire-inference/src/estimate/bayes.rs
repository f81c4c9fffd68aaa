//! Tells means and widths of the posterior, or of the normal distribution in its place where that can be trusted.

use numerics::convergence::{ConvergenceReport, OptimisationStatus};
use preparation::samples::CurveSamples;

use crate::compressed::CompressedSamples;
use crate::estimate::point::PosteriorAgreement;
use crate::estimate::{TireEstimate, values_by_quantity};
use crate::fit::FitSolution;
use crate::posterior::report::{PosteriorReport, UncertaintySource};
use crate::quantity::PerQuantity;
use crate::settings::IdentificationSettings;
use crate::variational::report::{NonNormalityEvidence, PosteriorSummary};
use crate::variational::{self, VariationalPosterior, VariationalStart};
use crate::verdict::QuantityIdentifiability;

/// Optima whose likelihood is lower than the best by a factor of e to this number do not count as modes.
const COMPETITIVE: f64 = 10.0;
/// Neither do modes of a smaller share of the posterior.
const SHARE: f64 = 0.01;

/// What was found of one curve so far.
pub struct BayesianFit<'a> {
    /// The samples that the posterior is of.
    pub samples: &'a CurveSamples,
    /// The same.
    pub data: &'a CompressedSamples,
    pub settings: &'a IdentificationSettings,
    /// The best fit with everything free.
    pub best: &'a FitSolution,
    pub judgements: &'a [QuantityIdentifiability],
    pub report: &'a PosteriorReport,
    /// What is reported of the best fit.
    pub plain: TireEstimate,
    /// What the best fit took, and the draws [s].
    pub seconds: [f64; 2],
    /// What a published tire has to agree with.
    pub agreement: PosteriorAgreement<'a>,
}

impl BayesianFit<'_> {
    /// The posterior's own numbers.
    pub fn posterior_estimate(&self) -> TireEstimate {
        let PosteriorReport { levels, cells, .. } = *self.report;
        let status = if self.report.is_exact() {
            OptimisationStatus::Converged
        } else {
            OptimisationStatus::IterationLimit
        };
        TireEstimate {
            mean: self.posterior_means(),
            convergence: ConvergenceReport {
                status,
                iterations: levels,
                evaluations: cells,
                kkt_residual: None,
                trace: Vec::new(),
                ..self.best.convergence.clone()
            },
            seconds: self.seconds.iter().sum(),
            source: self.report.uncertainty_source(),
            posterior: Some(self.report.clone()),
            ..self.plain.clone()
        }
    }

    /// The means, if they make a tire that agrees with all of the posterior; else the draw nearest to them.
    fn posterior_means(&self) -> PerQuantity {
        let agreement = &self.agreement;
        let rejected = !agreement.is_accepted(&agreement.mean_tire());
        match agreement.nearest_draw().filter(|_| rejected) {
            Some(theta) => values_by_quantity(self.judgements, |judgement| judgement.quantity.value(&theta)),
            None => values_by_quantity(self.judgements, |judgement| judgement.mean),
        }
    }

    /// The normal distribution in place of the posterior, judged by all that is known.
    pub fn fit_variational(&self) -> VariationalPosterior {
        let IdentificationSettings { prior, options, svi: optimiser, .. } = self.settings;
        let best = (&self.best.theta, self.best.noise_std);
        let start = VariationalStart { samples: self.samples, data: self.data, prior, best };
        let mut variational = variational::fit_variational(start, *optimiser, options.seed);
        variational.report.seconds += self.seconds[0];
        variational.report.apply_evidence(&NonNormalityEvidence {
            at_bound: self.best.at_bound.clone(),
            modes: self.mode_count(),
            errors: 0,
        });
        variational
    }

    /// The numbers of its corrected draws, or those of the posterior where it is not to be trusted.
    pub fn svi_estimate(&self, variational: &VariationalPosterior) -> TireEstimate {
        let report = &variational.report;
        let base = if report.trusted {
            let prior = &self.settings.prior;
            let PosteriorSummary { mean, std, interval } =
                PosteriorSummary::from_posterior(&variational.corrected, prior);
            let free: Vec<_> = prior.free_parameters().collect();
            TireEstimate {
                mean,
                std,
                interval,
                covariance: variational.corrected.covariance(&free),
                noise_std: report.noise_std,
                source: UncertaintySource::Svi,
                posterior: Some(self.report.clone()),
                ..self.plain.clone()
            }
        } else {
            self.posterior_estimate()
        };
        let convergence = ConvergenceReport {
            status: report.status,
            iterations: report.steps,
            evaluations: report.evaluations,
            kkt_residual: None,
            // The evidence lower bound is reported with the normal distribution.
            trace: Vec::new(),
            ..self.best.convergence.clone()
        };
        TireEstimate { convergence, seconds: report.seconds, svi: Some(report.clone()), ..base }
    }

    /// Optima that the data do not rule out, or modes of the posterior, whichever are more.
    fn mode_count(&self) -> usize {
        let squares: Vec<f64> =
            self.best.optima.iter().map(|(theta, _)| self.data.residual_squares(theta)).collect();
        let least = squares.iter().copied().fold(f64::INFINITY, f64::min);
        let rise = |squares: &f64| 0.5 * self.data.effective_count() as f64 * (squares / least).ln();
        let competitive = squares.iter().filter(|squares| rise(squares) < COMPETITIVE).count();
        competitive.max(self.report.modes.iter().filter(|mode| mode.mass > SHARE).count())
    }
}
