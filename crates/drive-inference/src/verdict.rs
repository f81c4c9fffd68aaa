//! Judges what the drives can tell of both tires, by the rule of [`tire_inference::verdict`].

use nalgebra::{DMatrix, DVector};
use numerics::convergence::Convergence;
use numerics::identifiability::MAX_WIDTH_IDENTIFIED;
use numerics::statistics::{NORMAL_95, interval, std};
use tire_inference::axles::{Axle, Axles};
use tire_inference::estimate::point::Agreement;
use tire_inference::estimate::{Estimate, per_quantity};
use tire_inference::model::{Fit, ModelVerdict};
use tire_inference::parameters::{Theta, TireParameters, curve};
use tire_inference::posterior::PosteriorSamples;
use tire_inference::posterior::report::UncertaintySource;
use tire_inference::prior::Prior;
use tire_inference::profile::Profile;
use tire_inference::quantity::Quantity;
use tire_inference::verdict::{
    ActiveBounds, Judgement, QuantityStatistics, Verdict, prior_shift, width, width_of_std,
};

use crate::laplace::{LaplaceApproximation, of_axle};
use crate::posterior_samples::TireDraws;
use crate::profile::profiles;
use crate::tires::{block, from_vector, indices};

/// Draws of the prior.
const BEFORE: usize = 4096;
/// Rise of the likelihood along a profile that tells of another optimum.
const BETTER: f64 = 1.0;

/// Both axles' results.
pub struct Judge<'a> {
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
    pub convergence: Convergence,
    /// Wall time [s].
    pub seconds: f64,
}

impl Judge<'_> {
    /// The estimates of both axles.
    pub fn estimates(&self) -> Axles<Estimate> {
        let before = PosteriorSamples { samples: self.prior.literature().fill(BEFORE).collect() };
        let mut known = Axles::new(|axle| self.known(axle, &before));
        let better = if self.profile { self.follow(&mut known) } else { 0.0 };
        let mut estimates = Axles::new(|axle| self.estimate(axle, &known[axle]));
        for axle in Axle::ALL {
            // Met on the way along a profile: one more optimum than the starts had found.
            estimates[axle].convergence.optima += usize::from(better > BETTER);
        }
        estimates
    }

    /// Adds profiles; the largest rise to a better optimum on their way.
    fn follow(&self, known: &mut Axles<Vec<QuantityStatistics>>) -> f64 {
        // What is not narrowed down is not identifiable, whatever its profile.
        let narrowed = |known: &QuantityStatistics| known.width_ratio < MAX_WIDTH_IDENTIFIED;
        let mut better: f64 = 0.0;
        for axle in Axle::ALL {
            let mut narrowed: Vec<&mut QuantityStatistics> =
                known[axle].iter_mut().filter(|known| narrowed(known)).collect();
            let quantities: Vec<_> = narrowed.iter().map(|known| (axle, known.quantity)).collect();
            let found = profiles(self.laplace, &quantities);
            for (known, profile) in narrowed.iter_mut().zip(found) {
                let Some(profile) = profile else { continue };
                better = better.max(profile.improvement);
                if self.exact(axle).is_none() {
                    known.interval = self.along(known, &profile);
                }
                known.profile = Some(profile);
            }
        }
        better
    }

    /// The interval by profile, where that was followed to its end; else the wider one of profile and curvature.
    fn along(&self, known: &QuantityStatistics, profile: &Profile) -> [f64; 2] {
        let [low, high] = [profile.lower.at, profile.upper.at];
        if profile.converged {
            [low, high]
        } else {
            [low.min(known.interval[0]), high.max(known.interval[1])]
        }
    }

    /// The draws of an axle, if they are from the posterior.
    fn exact(&self, axle: Axle) -> Option<&PosteriorSamples> {
        self.draws.exact().map(|axles| &axles[axle])
    }

    fn known(&self, axle: Axle, before: &PosteriorSamples) -> Vec<QuantityStatistics> {
        let theta = from_vector(&self.laplace.x)[axle].theta();
        let one = |quantity: Quantity| {
            let mean = quantity.value(&theta);
            match self.exact(axle) {
                Some(posterior) => {
                    let values = posterior.values(quantity);
                    QuantityStatistics {
                        quantity,
                        mean,
                        std: std(&values),
                        width_ratio: width(quantity, &self.prior, &values, before),
                        profile: None,
                        rival: None,
                        noisier: None,
                        prior_shift: Some(prior_shift(&self.prior, posterior, &values)),
                        interval: interval(values),
                    }
                }
                None => {
                    let std = self.std(axle, quantity);
                    let [low, high] = quantity.range(&self.prior);
                    QuantityStatistics {
                        quantity,
                        mean,
                        std,
                        width_ratio: width_of_std(quantity, &self.prior, std, before),
                        profile: None,
                        rival: None,
                        noisier: None,
                        prior_shift: None,
                        interval: [
                            (mean - NORMAL_95 * std).max(low),
                            (mean + NORMAL_95 * std).min(high),
                        ],
                    }
                }
            }
        };
        self.prior.free().map(Quantity::Parameter).chain(Quantity::DERIVED).map(one).collect()
    }

    /// Standard deviation by the curvature of the likelihood.
    fn std(&self, axle: Axle, quantity: Quantity) -> f64 {
        match quantity {
            Quantity::Parameter(parameter) => {
                let index = indices(axle).into_array()[parameter as usize];
                self.covariance[(index, index)].max(0.0).sqrt()
            }
            Quantity::K => self.laplace.stiffness_std(axle),
            _ => {
                let theta = from_vector(&self.laplace.x)[axle].theta();
                let gradient = DVector::from_column_slice(&quantity.gradient(&theta)[..4]);
                let covariance = of_axle(&self.laplace.in_box(), axle);
                gradient.dot(&(covariance * &gradient)).max(0.0).sqrt()
            }
        }
    }

    fn estimate(&self, axle: Axle, known: &[QuantityStatistics]) -> Estimate {
        let judgements = self.judgements(axle, known);
        let free: Vec<_> = self.prior.free().collect();
        let at_bound = self.laplace.at_bound(indices(axle)).into_array();
        let at_bound = TireParameters::<f64>::PARAMETERS.iter().zip(at_bound).filter(|(_, is)| *is);
        let rows = || block(axle);
        let of_likelihood =
            || rows().map(|i| rows().map(|j| self.covariance[(i, j)]).collect()).collect();
        Estimate {
            mean: per_quantity(&judgements, |judgement| judgement.mean),
            std: per_quantity(&judgements, |judgement| judgement.std),
            interval: per_quantity(&judgements, |judgement| judgement.interval),
            parameters: free.clone(),
            covariance: match self.exact(axle) {
                Some(posterior) => posterior.covariance(&free),
                None => of_likelihood(),
            },
            at_bound: at_bound.map(|(parameter, _)| *parameter).collect(),
            fixed: Vec::new(),
            identified: per_quantity(&judgements, |judgement| self.model.cap(judgement.verdict)),
            reason: per_quantity(&judgements, |judgement| self.reason(judgement)),
            slip_range: self.slip_range[axle],
            samples: self.samples,
            noise_std: self.noise_std,
            convergence: self.convergence.clone(),
            seconds: self.seconds,
            source: self
                .exact(axle)
                .map_or(UncertaintySource::Likelihood, |_| UncertaintySource::Importance),
            posterior: self.draws.reports.as_ref().map(|reports| reports[axle].clone()),
            svi: self.draws.svi.as_ref().map(|(_, reports)| reports[axle].clone()),
        }
    }

    /// Verdicts about the tire that is published: the best one, or the nearest draw where the posterior rejects that.
    fn judgements(&self, axle: Axle, known: &[QuantityStatistics]) -> Vec<Judgement> {
        let advice = self.reach(axle, known);
        let about = |tire: &Theta| -> Vec<Judgement> {
            let judge = |known: &QuantityStatistics| {
                let known =
                    QuantityStatistics { mean: known.quantity.value(tire), ..known.clone() };
                self.pressed[axle].judge(known.judge(&self.prior, &advice))
            };
            known.iter().map(judge).collect()
        };
        let best = from_vector(&self.laplace.x)[axle].theta();
        let judgements = about(&best);
        let band = self.draws.reports.as_ref().and_then(|reports| reports[axle].band.as_ref());
        let posterior = &self.draws.axles[axle];
        let agreement = Agreement { judgements: &judgements, band, posterior, prior: &self.prior };
        let published = agreement.published(best);
        if published == best { judgements } else { about(&published) }
    }

    /// Why a quantity has its verdict.
    fn reason(&self, judgement: &Judgement) -> String {
        match self.model.verdict {
            Fit::Fits => judgement.reason.clone(),
            Fit::DoesNotFit => format!("{} {}", self.model.sentence, judgement.reason),
        }
    }

    /// How far the slip went, in words. The peak is that of the estimate where the data know it, else that of a typical tire of
    /// this stiffness.
    fn reach(&self, axle: Axle, known: &[QuantityStatistics]) -> String {
        let tire = from_vector(&self.laplace.x)[axle];
        let parameters = known.iter().filter(|known| known.quantity.parameter().is_some());
        let mut verdicts = parameters.map(QuantityStatistics::verdict);
        let (curve, whose) = if verdicts.all(|verdict| verdict != Verdict::NotIdentifiable) {
            (tire.curve(), "the peak slip")
        } else {
            let mut typical = self.prior.centre;
            typical[0] = tire.stiffness() / (typical[1] * typical[2]);
            (curve(&typical), "the peak slip of a typical tire of this stiffness")
        };
        let slip = self.slip_range[axle].iter().fold(0.0_f64, |most, slip| most.max(slip.abs()));
        let share = curve.peak_slip().map_or(String::new(), |peak| {
            format!(", {:.0} % of {whose}, {peak:.4} rad", 100.0 * slip / peak)
        });
        format!("In these drives slip reached {slip:.4} rad{share}.")
    }
}
