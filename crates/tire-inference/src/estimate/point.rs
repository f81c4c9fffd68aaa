//! Chooses the tire that is published: one whose curve and whose numbers the posterior does not reject.

use numerics::statistics::std;

use crate::kernel::friction_coefficient;
use crate::parameters::Theta;
use crate::posterior::PosteriorSamples;
use crate::posterior::report::CurveBand;
use crate::prior::Prior;
use crate::verdict::{Identifiability, QuantityIdentifiability};

/// What a published tire has to agree with.
#[derive(Clone, Copy)]
pub struct PosteriorAgreement<'a> {
    /// Intervals and means.
    pub judgements: &'a [QuantityIdentifiability],
    /// The band of the curves.
    pub band: Option<&'a CurveBand>,
    /// Draws, of which one is published where a fit does not agree.
    pub posterior: &'a PosteriorSamples,
    /// Typical values of what the data cannot tell.
    pub prior: &'a Prior,
}

impl PosteriorAgreement<'_> {
    /// Whether all numbers of a tire are in their intervals, and its curve in the band.
    pub fn is_accepted(&self, theta: &Theta) -> bool {
        self.violation_count(theta) == 0
    }

    /// A fitted tire, or the nearest draw where the posterior rejects that and the draw less.
    pub fn publishable_tire(&self, fitted: Theta) -> Theta {
        if self.is_accepted(&fitted) {
            return fitted;
        }
        let better = |theta: &Theta| self.violation_count(theta) < self.violation_count(&fitted);
        self.nearest_draw().filter(better).unwrap_or(fitted)
    }

    fn violation_count(&self, theta: &Theta) -> usize {
        let outside = |judgement: &&QuantityIdentifiability| {
            let [low, high] = judgement.interval;
            !(low..=high).contains(&judgement.quantity.value(theta))
        };
        let beyond = |band: &&CurveBand| {
            let edges = band.lower.iter().zip(&band.upper);
            let at = band.slip.iter().zip(edges);
            at.filter(|(slip, (low, high))| !(**low..=**high).contains(&friction_coefficient(theta, **slip)))
                .count()
        };
        self.judgements.iter().filter(outside).count() + self.band.iter().map(beyond).sum::<usize>()
    }

    /// The draw that agrees best, and of those the nearest one to what is known: to the mean of what the data tell, to typical
    /// values of what they cannot.
    pub fn nearest_draw(&self) -> Option<Theta> {
        let units: Vec<f64> = self.judgements.iter().map(|judgement| self.distance_unit(judgement)).collect();
        let distance = |theta: &Theta| -> f64 {
            let of = |(judgement, unit): (&QuantityIdentifiability, &f64)| {
                let expected = match (judgement.verdict, judgement.quantity.parameter()) {
                    (Identifiability::NotIdentifiable, Some(parameter)) => {
                        self.prior.centre[parameter as usize]
                    }
                    _ => judgement.mean,
                };
                ((judgement.quantity.value(theta) - expected) / unit).powi(2)
            };
            self.judgements.iter().zip(&units).map(of).sum()
        };
        let ranked =
            self.posterior.samples.iter().map(|theta| (self.violation_count(theta), distance(theta), theta));
        ranked.min_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1))).map(|(.., theta)| *theta)
    }

    fn distance_unit(&self, judgement: &QuantityIdentifiability) -> f64 {
        let unit = match (judgement.verdict, judgement.quantity.parameter()) {
            (Identifiability::NotIdentifiable, Some(parameter)) => self.prior.difference_unit(parameter),
            _ => std(&self.posterior.quantity_values(judgement.quantity)),
        };
        unit.max(f64::MIN_POSITIVE)
    }

    /// The tire of the means.
    pub fn mean_tire(&self) -> Theta {
        let mut theta = self.prior.centre;
        for judgement in self.judgements {
            if let Some(parameter) = judgement.quantity.parameter() {
                theta[parameter as usize] = judgement.mean;
            }
        }
        theta
    }
}

#[cfg(test)]
mod tests {
    use numerics::statistics::{central_95_percent_interval, mean};

    use super::*;
    use crate::parameters::Parameter;
    use crate::quantity::Quantity;
    use crate::verdict::QuantityStatistics;

    /// Tires about one, apart in D and C.
    fn draws() -> PosteriorSamples {
        let draw = |k: i32| {
            let share = f64::from(k % 20) / 20.0;
            [12.0, 1.5 + 0.1 * share, 1.1 + 0.002 * f64::from(k), 0.1, 0.0, 0.0]
        };
        PosteriorSamples { samples: (0..200).map(draw).collect() }
    }

    #[test]
    fn a_fit_that_the_posterior_rejects_gives_way_to_a_draw_that_agrees() {
        let (posterior, prior) = (draws(), Prior::lateral());
        let known = |quantity: Quantity| {
            let values = posterior.quantity_values(quantity);
            let (mean, std) = (mean(&values), std(&values));
            let (width_ratio, interval) = (0.1, central_95_percent_interval(values));
            let (profile, rival, prior_shift, noisier) = (None, None, None, None);
            let known = QuantityStatistics {
                quantity,
                mean,
                std,
                interval,
                width_ratio,
                profile,
                rival,
                prior_shift,
                noisier,
            };
            known.into_judgement(&prior, "")
        };
        let quantities = [Parameter::C, Parameter::D].map(Quantity::Parameter);
        let judgements: Vec<_> = quantities.into_iter().chain([Quantity::K]).map(known).collect();
        let band = CurveBand::new(&posterior, [-0.2, 0.2], 21);
        let agreement = PosteriorAgreement {
            judgements: &judgements,
            band: Some(&band),
            posterior: &posterior,
            prior: &prior,
        };
        let inside = posterior.samples[105];
        assert_eq!(agreement.publishable_tire(inside), inside);
        let rejected = [12.0, 1.55, 1.9, 0.1, 0.0, 0.0];
        assert!(!agreement.is_accepted(&rejected));
        let published = agreement.publishable_tire(rejected);
        assert!(agreement.is_accepted(&published) && posterior.samples.contains(&published));
        // Draws that agree no better are no reason to leave the fit.
        let none = PosteriorSamples { samples: vec![[40.0, 2.9, 2.9, -9.0, 0.0, 0.0]] };
        let agreement = PosteriorAgreement { posterior: &none, ..agreement };
        assert_eq!(agreement.publishable_tire(rejected), rejected);
        let wider = band.clone().widened_to_contain(&rejected);
        let alone = PosteriorAgreement { judgements: &[], band: Some(&wider), ..agreement };
        assert!(alone.is_accepted(&rejected));
    }
}
