//! Tells means and widths of the posterior, or of the normal distribution in its place where that can be trusted.

use numerics::convergence::{Convergence, Status};
use preparation::samples::Samples;

use crate::compressed::CompressedSamples;
use crate::estimate::point::Agreement;
use crate::estimate::{Estimate, per_quantity};
use crate::fit::Solution;
use crate::posterior::report::{PosteriorReport, UncertaintySource};
use crate::quantity::PerQuantity;
use crate::settings::Settings;
use crate::variational::report::{Summary, Suspicion};
use crate::variational::{self, Start, Variational};
use crate::verdict::Judgement;

/// Optima whose likelihood is lower than the best by a factor of e to this number do not count as modes.
const COMPETITIVE: f64 = 10.0;
/// Neither do modes of a smaller share of the posterior.
const SHARE: f64 = 0.01;

/// What was found of one curve so far.
pub struct BayesianFit<'a> {
    /// The samples that the posterior is of.
    pub samples: &'a Samples,
    /// The same.
    pub data: &'a CompressedSamples,
    pub settings: &'a Settings,
    /// The best fit with everything free.
    pub best: &'a Solution,
    pub judgements: &'a [Judgement],
    pub report: &'a PosteriorReport,
    /// What is reported of the best fit.
    pub plain: Estimate,
    /// What the best fit took, and the draws [s].
    pub seconds: [f64; 2],
    /// What a published tire has to agree with.
    pub agreement: Agreement<'a>,
}

impl BayesianFit<'_> {
    /// The posterior's own numbers.
    pub fn reference(&self) -> Estimate {
        let PosteriorReport { levels, cells, .. } = *self.report;
        let status =
            if self.report.is_exact() { Status::Converged } else { Status::IterationLimit };
        Estimate {
            mean: self.means(),
            convergence: Convergence {
                status,
                iterations: levels,
                evaluations: cells,
                kkt_residual: None,
                trace: Vec::new(),
                ..self.best.convergence.clone()
            },
            seconds: self.seconds.iter().sum(),
            source: self.report.source(),
            posterior: Some(self.report.clone()),
            ..self.plain.clone()
        }
    }

    /// The means, if they make a tire that agrees with all of the posterior; else the draw nearest to them.
    fn means(&self) -> PerQuantity {
        let agreement = &self.agreement;
        let rejected = !agreement.holds(&agreement.mean());
        match agreement.nearest().filter(|_| rejected) {
            Some(theta) => {
                per_quantity(self.judgements, |judgement| judgement.quantity.value(&theta))
            }
            None => per_quantity(self.judgements, |judgement| judgement.mean),
        }
    }

    /// The normal distribution in place of the posterior, judged by all that is known.
    pub fn variational(&self) -> Variational {
        let Settings { prior, options, svi: optimiser, .. } = self.settings;
        let best = (&self.best.theta, self.best.noise_std);
        let start = Start { samples: self.samples, data: self.data, prior, best };
        let mut variational = variational::fit(start, *optimiser, options.seed);
        variational.report.seconds += self.seconds[0];
        variational.report.suspect(&Suspicion {
            at_bound: self.best.at_bound.clone(),
            modes: self.modes(),
            errors: 0,
        });
        variational
    }

    /// The numbers of its corrected draws, or those of the posterior where it is not to be trusted.
    pub fn svi(&self, variational: &Variational) -> Estimate {
        let report = &variational.report;
        let base = if report.trusted {
            let prior = &self.settings.prior;
            let Summary { mean, std, interval } = Summary::of(&variational.corrected, prior);
            let free: Vec<_> = prior.free().collect();
            Estimate {
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
            self.reference()
        };
        let convergence = Convergence {
            status: report.status,
            iterations: report.steps,
            evaluations: report.evaluations,
            kkt_residual: None,
            // The evidence lower bound is reported with the normal distribution.
            trace: Vec::new(),
            ..self.best.convergence.clone()
        };
        Estimate { convergence, seconds: report.seconds, svi: Some(report.clone()), ..base }
    }

    /// Optima that the data do not rule out, or modes of the posterior, whichever are more.
    fn modes(&self) -> usize {
        let squares: Vec<f64> =
            self.best.optima.iter().map(|(theta, _)| self.data.squares(theta)).collect();
        let least = squares.iter().copied().fold(f64::INFINITY, f64::min);
        let rise = |squares: &f64| 0.5 * self.data.count() as f64 * (squares / least).ln();
        let competitive = squares.iter().filter(|squares| rise(squares) < COMPETITIVE).count();
        competitive.max(self.report.modes.iter().filter(|mode| mode.mass > SHARE).count())
    }
}
