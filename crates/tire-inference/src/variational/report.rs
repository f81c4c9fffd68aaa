//! Says what a fitted normal distribution found, and whether to trust it.

use numerics::convergence::OptimisationStatus;
use numerics::psis::{HIGHEST_K_HAT, WeightDiagnosis};
use numerics::statistics::{central_95_percent_interval, mean, std};
use numerics::text::format_significant;
use numerics::variational::assessment::GaussianFitAssessment;
use serde::Serialize;

use crate::parameters::Parameter;
use crate::posterior::PosteriorSamples;
use crate::prior::Prior;
use crate::quantity::{PerQuantity, Quantity};

/// What the normal distribution itself said, and how well it matches the posterior.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct VariationalReport {
    /// Whether it can stand for the posterior.
    pub trusted: bool,
    /// Why not, in a sentence.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub warning: Option<String>,
    /// Means under it.
    pub mean: PerQuantity,
    /// Standard deviations under it.
    pub std: PerQuantity,
    /// Middle 95 % under it.
    pub interval: PerQuantity<[f64; 2]>,
    /// Rows and columns of `covariance`.
    pub parameters: Vec<Parameter>,
    /// Covariance of the parameters under it.
    pub covariance: Vec<Vec<f64>>,
    /// Mean of the standard deviation of the noise of the friction coefficient [-].
    pub noise_std: f64,
    /// How its fit ended.
    pub status: OptimisationStatus,
    /// How far the fit is from the optimum, without a unit, see [`numerics::variational::gaussian::DensityComparison::gradient_norm`].
    pub gradient_norm: f64,
    /// Steps that were taken.
    pub steps: usize,
    /// Points that stood for the standard normal distribution.
    pub points: usize,
    /// Evaluations of the likelihood.
    pub evaluations: usize,
    /// Evidence lower bound [nat], over fresh draws; but for a constant.
    pub elbo: f64,
    /// The same over the fit's own points, step by step.
    pub elbo_trace: Vec<f64>,
    /// Of the weights that would correct it.
    #[serde(flatten)]
    pub diagnosis: WeightDiagnosis,
    /// Of the weights that do, on draws with heavier tails.
    pub correction: WeightDiagnosis,
    /// Wall time [s].
    pub seconds: f64,
}

impl VariationalReport {
    /// Of a fit and the draws from it: of one tire, with weights of draws that start from it.
    pub fn new(
        judged: &GaussianFitAssessment,
        correction: WeightDiagnosis,
        gaussian: &PosteriorSamples,
        prior: &Prior,
        noise_std: f64,
    ) -> Self {
        let GaussianFitAssessment { fitted, points, draws, seconds } = judged;
        let PosteriorSummary { mean, std, interval } = PosteriorSummary::from_posterior(gaussian, prior);
        let free: Vec<_> = prior.free_parameters().collect();
        Self {
            trusted: true,
            warning: None,
            mean,
            std,
            interval,
            covariance: gaussian.covariance(&free),
            parameters: free,
            noise_std,
            status: fitted.status,
            gradient_norm: fitted.gradient_norm,
            steps: fitted.steps,
            points: *points,
            evaluations: fitted.evaluations + draws.points.len(),
            elbo: draws.elbo,
            elbo_trace: fitted.trace.clone(),
            diagnosis: draws.diagnosis,
            correction,
            seconds: *seconds,
        }
    }

    /// Takes into account what the fit itself cannot see.
    pub fn apply_evidence(&mut self, suspicion: &NonNormalityEvidence) {
        let weights = [&self.diagnosis, &self.correction];
        self.warning = distrust_warning(self.status, self.gradient_norm, weights, suspicion);
        self.trusted = self.warning.is_none();
    }
}

/// Numbers of a distribution.
pub struct PosteriorSummary {
    /// Means.
    pub mean: PerQuantity,
    /// Standard deviations.
    pub std: PerQuantity,
    /// Middle 95 %.
    pub interval: PerQuantity<[f64; 2]>,
}

impl PosteriorSummary {
    /// Of draws, for all parameters that are free and what follows from them.
    pub fn from_posterior(posterior: &PosteriorSamples, prior: &Prior) -> Self {
        let quantities = prior.free_parameters().map(Quantity::Parameter).chain(Quantity::DERIVED);
        let mut summary =
            Self { mean: PerQuantity::new(), std: PerQuantity::new(), interval: PerQuantity::new() };
        for quantity in quantities {
            let values = posterior.quantity_values(quantity);
            summary.mean.insert(quantity, mean(&values));
            summary.std.insert(quantity, std(&values));
            summary.interval.insert(quantity, central_95_percent_interval(values));
        }
        summary
    }
}

/// What else is known that a normal distribution cannot show.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct NonNormalityEvidence {
    /// Parameters whose best values are on a bound.
    pub at_bound: Vec<Parameter>,
    /// Optima or modes that the data do not decide between.
    pub modes: usize,
    /// Errors of sensors and car that it has only follow the tires, so that it is too narrow.
    pub errors: usize,
}

/// Why a normal distribution is not to be trusted; `None` if it is.
fn distrust_warning(
    status: OptimisationStatus,
    gradient_norm: f64,
    weights: [&WeightDiagnosis; 2],
    suspicion: &NonNormalityEvidence,
) -> Option<String> {
    let mut reasons = Vec::new();
    if status != OptimisationStatus::Converged {
        let norm = format_significant(gradient_norm, 2);
        reasons.push(format!("its fit did not converge (gradient norm {norm})"));
    }
    if let Some(far) = weights.into_iter().find(|diagnosis| !diagnosis.is_close()) {
        let WeightDiagnosis { k_hat, effective_share, .. } = far;
        let [k_hat, share] = [*k_hat, 100.0 * effective_share].map(|x| format_significant(x, 2));
        reasons.push(format!(
            "it does not cover the posterior (k-hat {k_hat}, to be below {HIGHEST_K_HAT}; {share} % of its draws count)"
        ));
    }
    if !suspicion.at_bound.is_empty() {
        let names: Vec<&str> = suspicion.at_bound.iter().map(|p| p.symbol()).collect();
        reasons.push(format!("the posterior ends at a bound of {}", names.join(", ")));
    }
    if suspicion.modes > 1 {
        reasons.push(format!("the data do not decide between {} modes", suspicion.modes));
    }
    if suspicion.errors > 0 {
        reasons.push(format!(
            "{} errors of sensors and car follow the tires in it, so that it is too narrow",
            suspicion.errors
        ));
    }
    let reasons = reasons.join("; ");
    (!reasons.is_empty()).then(|| format!("The normal distribution is not to be trusted: {reasons}."))
}
