//! Chooses the tire that is published: one whose curve and whose numbers the posterior does not reject.

use numerics::statistics::std;

use crate::kernel::value;
use crate::parameters::Theta;
use crate::posterior::PosteriorSamples;
use crate::posterior::report::Band;
use crate::prior::Prior;
use crate::verdict::{Judgement, Verdict};

/// What a published tire has to agree with.
#[derive(Clone, Copy)]
pub struct Agreement<'a> {
    /// Intervals and means.
    pub judgements: &'a [Judgement],
    /// The band of the curves.
    pub band: Option<&'a Band>,
    /// Draws, of which one is published where a fit does not agree.
    pub posterior: &'a PosteriorSamples,
    /// Typical values of what the data cannot tell.
    pub prior: &'a Prior,
}

impl Agreement<'_> {
    /// Whether all numbers of a tire are in their intervals, and its curve in the band.
    pub fn holds(&self, theta: &Theta) -> bool {
        self.violations(theta) == 0
    }

    /// A fitted tire, or the nearest draw where the posterior rejects that and the draw less.
    pub fn published(&self, fitted: Theta) -> Theta {
        if self.holds(&fitted) {
            return fitted;
        }
        let better = |theta: &Theta| self.violations(theta) < self.violations(&fitted);
        self.nearest().filter(better).unwrap_or(fitted)
    }

    fn violations(&self, theta: &Theta) -> usize {
        let outside = |judgement: &&Judgement| {
            let [low, high] = judgement.interval;
            !(low..=high).contains(&judgement.quantity.value(theta))
        };
        let beyond = |band: &&Band| {
            let edges = band.lower.iter().zip(&band.upper);
            let at = band.slip.iter().zip(edges);
            at.filter(|(slip, (low, high))| !(**low..=**high).contains(&value(theta, **slip)))
                .count()
        };
        self.judgements.iter().filter(outside).count() + self.band.iter().map(beyond).sum::<usize>()
    }

    /// The draw that agrees best, and of those the nearest one to what is known: to the mean of what the data tell, to typical
    /// values of what they cannot.
    pub fn nearest(&self) -> Option<Theta> {
        let units: Vec<f64> =
            self.judgements.iter().map(|judgement| self.unit(judgement)).collect();
        let distance = |theta: &Theta| -> f64 {
            let of = |(judgement, unit): (&Judgement, &f64)| {
                let expected = match (judgement.verdict, judgement.quantity.parameter()) {
                    (Verdict::NotIdentifiable, Some(parameter)) => {
                        self.prior.centre[parameter as usize]
                    }
                    _ => judgement.mean,
                };
                ((judgement.quantity.value(theta) - expected) / unit).powi(2)
            };
            self.judgements.iter().zip(&units).map(of).sum()
        };
        let ranked = self
            .posterior
            .samples
            .iter()
            .map(|theta| (self.violations(theta), distance(theta), theta));
        ranked.min_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1))).map(|(.., theta)| *theta)
    }

    fn unit(&self, judgement: &Judgement) -> f64 {
        let unit = match (judgement.verdict, judgement.quantity.parameter()) {
            (Verdict::NotIdentifiable, Some(parameter)) => self.prior.unit(parameter),
            _ => std(&self.posterior.values(judgement.quantity)),
        };
        unit.max(f64::MIN_POSITIVE)
    }

    /// The tire of the means.
    pub fn mean(&self) -> Theta {
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
    use numerics::statistics::{interval, mean};

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
            let values = posterior.values(quantity);
            let (mean, std) = (mean(&values), std(&values));
            let (width_ratio, interval) = (0.1, interval(values));
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
            known.judge(&prior, "")
        };
        let quantities = [Parameter::C, Parameter::D].map(Quantity::Parameter);
        let judgements: Vec<_> = quantities.into_iter().chain([Quantity::K]).map(known).collect();
        let band = Band::new(&posterior, [-0.2, 0.2], 21);
        let agreement = Agreement {
            judgements: &judgements,
            band: Some(&band),
            posterior: &posterior,
            prior: &prior,
        };
        let inside = posterior.samples[105];
        assert_eq!(agreement.published(inside), inside);
        let rejected = [12.0, 1.55, 1.9, 0.1, 0.0, 0.0];
        assert!(!agreement.holds(&rejected));
        let published = agreement.published(rejected);
        assert!(agreement.holds(&published) && posterior.samples.contains(&published));
        // Draws that agree no better are no reason to leave the fit.
        let none = PosteriorSamples { samples: vec![[40.0, 2.9, 2.9, -9.0, 0.0, 0.0]] };
        let agreement = Agreement { posterior: &none, ..agreement };
        assert_eq!(agreement.published(rejected), rejected);
        let wider = band.clone().holding(&rejected);
        let alone = Agreement { judgements: &[], band: Some(&wider), ..agreement };
        assert!(alone.holds(&rejected));
    }
}
