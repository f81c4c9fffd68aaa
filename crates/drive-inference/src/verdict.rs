//! Judges what the drives can tell of both tires, by the rule of [`tire_inference::verdict`].

use nalgebra::{DMatrix, DVector};
use numerics::convergence::ConvergenceReport;
use numerics::identifiability::MAX_WIDTH_IDENTIFIED;
use numerics::statistics::{NORMAL_95, central_95_percent_interval, std};
use preparation::direction::ForceDirection;
use tire_inference::axles::{Axle, Axles};
use tire_inference::estimate::point::PosteriorAgreement;
use tire_inference::estimate::{TireEstimate, values_by_quantity};
use tire_inference::model::{ModelFit, ModelVerdict};
use tire_inference::parameters::{Theta, TireParameters, magic_formula_from_theta};
use tire_inference::posterior::PosteriorSamples;
use tire_inference::posterior::report::UncertaintySource;
use tire_inference::prior::Prior;
use tire_inference::profile::LikelihoodProfile;
use tire_inference::quantity::Quantity;
use tire_inference::verdict::{
    ActiveBounds, Identifiability, QuantityIdentifiability, QuantityStatistics, cap_absent_peak,
    posterior_width_ratio, prior_shift, width_ratio_from_std,
};

use crate::laplace::{LaplaceApproximation, axle_submatrix};
use crate::posterior_samples::TireDraws;
use crate::profile::likelihood_profiles;
use crate::tires::{from_vector, parameter_block, parameter_indices};

/// Draws of the prior.
const BEFORE: usize = 4096;
/// Rise of the likelihood along a profile that tells of another optimum.
const BETTER: f64 = 1.0;

/// Both axles' results.
pub struct TireJudge<'a> {
    /// The maximum, its cost and its surroundings.
    pub laplace: &'a LaplaceApproximation<'a>,
    /// Whether the model fits, which every verdict inherits.
    pub model: &'a ModelVerdict,
    /// What the bounds do to each tire.
    pub pressed: &'a Axles<ActiveBounds>,
    /// Draws, of the posterior if there is one.
    pub draws: &'a TireDraws,
    /// The bound of Cramér and Rao: inverse second derivatives of the likelihood alone.
    pub covariance: &'a DMatrix<f64>,
    /// Whether profiles are followed.
    pub profile: bool,
    /// What is known of each tire before any data.
    pub prior: Prior,
    /// Smallest and largest slip angle of each axle [rad].
    pub slip_range: Axles<[f64; 2]>,
    /// Samples that were used.
    pub samples: usize,
    /// Standard deviation of the noise of the friction coefficient.
    pub noise_std: f64,
    /// How the maximum was found.
    pub convergence: ConvergenceReport,
    /// Wall time [s].
    pub seconds: f64,
}

impl TireJudge<'_> {
    /// The estimates of both axles.
    pub fn axle_estimates(&self) -> Axles<TireEstimate> {
        let before = PosteriorSamples {
            samples: self.prior.restricted_to_literature().space_filling_points(BEFORE).collect(),
        };
        let mut known = Axles::from_fn(|axle| self.quantity_statistics(axle, &before));
        let better = if self.profile { self.add_profiles(&mut known) } else { 0.0 };
        let mut estimates = Axles::from_fn(|axle| self.axle_estimate(axle, &known[axle]));
        for axle in Axle::ALL {
            // Met on the way along a profile: one more optimum than the starts had found.
            estimates[axle].convergence.optima += usize::from(better > BETTER);
        }
        estimates
    }

    /// Adds profiles; the largest rise to a better optimum on their way.
    fn add_profiles(&self, known: &mut Axles<Vec<QuantityStatistics>>) -> f64 {
        // What is not narrowed down is not identifiable, whatever its profile.
        let narrowed = |known: &QuantityStatistics| known.width_ratio < MAX_WIDTH_IDENTIFIED;
        let mut better: f64 = 0.0;
        for axle in Axle::ALL {
            let mut narrowed: Vec<&mut QuantityStatistics> =
                known[axle].iter_mut().filter(|known| narrowed(known)).collect();
            let quantities: Vec<_> = narrowed.iter().map(|known| (axle, known.quantity)).collect();
            let found = likelihood_profiles(self.laplace, &quantities);
            for (known, profile) in narrowed.iter_mut().zip(found) {
                let Some(profile) = profile else { continue };
                better = better.max(profile.improvement);
                if self.posterior_draws(axle).is_none() {
                    known.interval = self.profile_interval(known, &profile);
                }
                known.profile = Some(profile);
            }
        }
        better
    }

    /// The interval by profile, where that was followed to its end; else the wider one of profile and curvature.
    fn profile_interval(&self, known: &QuantityStatistics, profile: &LikelihoodProfile) -> [f64; 2] {
        let [low, high] = [profile.lower.at, profile.upper.at];
        if profile.converged {
            [low, high]
        } else {
            [low.min(known.interval[0]), high.max(known.interval[1])]
        }
    }

    /// The draws of an axle, if they are from the posterior.
    fn posterior_draws(&self, axle: Axle) -> Option<&PosteriorSamples> {
        self.draws.posterior_draws().map(|axles| &axles[axle])
    }

    fn quantity_statistics(&self, axle: Axle, before: &PosteriorSamples) -> Vec<QuantityStatistics> {
        let theta = from_vector(&self.laplace.x)[axle].to_theta();
        let one = |quantity: Quantity| {
            let mean = quantity.value(&theta);
            match self.posterior_draws(axle) {
                Some(posterior) => {
                    let values = posterior.quantity_values(quantity);
                    QuantityStatistics {
                        quantity,
                        mean,
                        std: std(&values),
                        width_ratio: posterior_width_ratio(quantity, &self.prior, &values, before),
                        profile: None,
                        rival: None,
                        noisier: None,
                        prior_shift: Some(prior_shift(&self.prior, posterior, &values)),
                        interval: central_95_percent_interval(values),
                    }
                }
                None => {
                    let std = self.quantity_std(axle, quantity);
                    let [low, high] = quantity.range_in_prior(&self.prior);
                    QuantityStatistics {
                        quantity,
                        mean,
                        std,
                        width_ratio: width_ratio_from_std(quantity, &self.prior, std, before),
                        profile: None,
                        rival: None,
                        noisier: None,
                        prior_shift: None,
                        interval: [(mean - NORMAL_95 * std).max(low), (mean + NORMAL_95 * std).min(high)],
                    }
                }
            }
        };
        self.prior.free_parameters().map(Quantity::Parameter).chain(Quantity::DERIVED).map(one).collect()
    }

    /// Standard deviation by the curvature of the likelihood.
    fn quantity_std(&self, axle: Axle, quantity: Quantity) -> f64 {
        match quantity {
            Quantity::Parameter(parameter) => {
                let index = parameter_indices(axle).into_array()[parameter as usize];
                self.covariance[(index, index)].max(0.0).sqrt()
            }
            Quantity::K => self.laplace.stiffness_std(axle),
            _ => {
                let theta = from_vector(&self.laplace.x)[axle].to_theta();
                let gradient = DVector::from_column_slice(&quantity.gradient(&theta)[..4]);
                let covariance = axle_submatrix(&self.laplace.in_box(), axle);
                gradient.dot(&(covariance * &gradient)).max(0.0).sqrt()
            }
        }
    }

    fn axle_estimate(&self, axle: Axle, known: &[QuantityStatistics]) -> TireEstimate {
        let judgements = self.axle_judgements(axle, known);
        let free: Vec<_> = self.prior.free_parameters().collect();
        let at_bound = self.laplace.at_bound(parameter_indices(axle)).into_array();
        let at_bound = TireParameters::<f64>::PARAMETERS.iter().zip(at_bound).filter(|(_, is)| *is);
        let rows = || parameter_block(axle);
        let of_likelihood = || rows().map(|i| rows().map(|j| self.covariance[(i, j)]).collect()).collect();
        TireEstimate {
            mean: values_by_quantity(&judgements, |judgement| judgement.mean),
            std: values_by_quantity(&judgements, |judgement| judgement.std),
            interval: values_by_quantity(&judgements, |judgement| judgement.interval),
            parameters: free.clone(),
            covariance: match self.posterior_draws(axle) {
                Some(posterior) => posterior.covariance(&free),
                None => of_likelihood(),
            },
            at_bound: at_bound.map(|(parameter, _)| *parameter).collect(),
            fixed: Vec::new(),
            identified: values_by_quantity(&judgements, |judgement| {
                self.model.cap_verdict(judgement.verdict)
            }),
            reason: values_by_quantity(&judgements, |judgement| self.verdict_reason(judgement)),
            slip_range: self.slip_range[axle],
            samples: self.samples,
            noise_std: self.noise_std,
            convergence: self.convergence.clone(),
            seconds: self.seconds,
            source: self
                .posterior_draws(axle)
                .map_or(UncertaintySource::Likelihood, |_| UncertaintySource::Importance),
            posterior: self.draws.reports.as_ref().map(|reports| reports[axle].clone()),
            svi: self.draws.svi.as_ref().map(|(_, reports)| reports[axle].clone()),
        }
    }

    /// Verdicts about the tire that is published: the best one, or the nearest draw where the posterior rejects that.
    fn axle_judgements(&self, axle: Axle, known: &[QuantityStatistics]) -> Vec<QuantityIdentifiability> {
        let advice = self.describe_slip_reach(axle, known);
        let about = |tire: &Theta| -> Vec<QuantityIdentifiability> {
            let judge = |known: &QuantityStatistics| {
                let known = QuantityStatistics { mean: known.quantity.value(tire), ..known.clone() };
                self.pressed[axle].cap_judgement(known.into_judgement(&self.prior, &advice))
            };
            let mut judgements: Vec<_> = known.iter().map(judge).collect();
            cap_absent_peak(&mut judgements, self.slip_range[axle], ForceDirection::Lateral);
            judgements
        };
        let best = from_vector(&self.laplace.x)[axle].to_theta();
        let judgements = about(&best);
        let band = self.draws.reports.as_ref().and_then(|reports| reports[axle].band.as_ref());
        let posterior = &self.draws.axles[axle];
        let agreement = PosteriorAgreement { judgements: &judgements, band, posterior, prior: &self.prior };
        let published = agreement.publishable_tire(best);
        if published == best { judgements } else { about(&published) }
    }

    /// Why a quantity has its verdict.
    fn verdict_reason(&self, judgement: &QuantityIdentifiability) -> String {
        match self.model.verdict {
            ModelFit::Fits => judgement.reason.clone(),
            ModelFit::DoesNotFit => format!("{} {}", self.model.sentence, judgement.reason),
        }
    }

    /// How far the slip went, in words. The peak is that of the estimate where the data know it, else that of a typical tire of
    /// this stiffness.
    fn describe_slip_reach(&self, axle: Axle, known: &[QuantityStatistics]) -> String {
        let tire = from_vector(&self.laplace.x)[axle];
        let parameters = known.iter().filter(|known| known.quantity.parameter().is_some());
        let mut verdicts = parameters.map(QuantityStatistics::verdict);
        let (curve, whose) = if verdicts.all(|verdict| verdict != Identifiability::NotIdentifiable) {
            (tire.to_magic_formula(), "the peak slip")
        } else {
            let mut typical = self.prior.centre;
            typical[0] = tire.stiffness() / (typical[1] * typical[2]);
            (magic_formula_from_theta(&typical), "the peak slip of a typical tire of this stiffness")
        };
        let slip = self.slip_range[axle].iter().fold(0.0_f64, |most, slip| most.max(slip.abs()));
        let share = curve.peak_slip().map_or(String::new(), |peak| {
            format!(", {:.0} % of {whose}, {peak:.4} rad", 100.0 * slip / peak)
        });
        format!("In these drives slip reached {slip:.4} rad{share}.")
    }
}
