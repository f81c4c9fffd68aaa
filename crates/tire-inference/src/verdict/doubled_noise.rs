//! Judges a quantity as data of twice the noise would: a posterior that is narrow by the luck of its noise opens there.
//!
//! Where a long tail goes to one side, as that of E towards 1, some draws of the noise cut it off: their posteriors look as if the data
//! decided, and lie beside the truth. A curve that the data do decide gets twice as wide under twice the noise, and is as far from the prior.

#![allow(non_snake_case, reason = "symbols as in Pacejka, Tire and Vehicle Dynamics")]

use numerics::identifiability::{MAX_PRIOR_SHIFT, MAX_WIDTH_IDENTIFIED, NEGLIGIBLE_PRIOR_SHIFT};
use serde::Serialize;

use crate::compressed::CompressedSamples;
use crate::parameters::{Parameter, Theta};
use crate::posterior::tempered::{self, TemperingOptions};
use crate::posterior::{PosteriorSamples, SamplingOptions, draw_posterior};
use crate::prior::Prior;
use crate::quantity::Quantity;
use crate::verdict::{posterior_width_ratio, prior_shift};

/// The weight of each sample, with twice its noise.
const SHARE: f64 = 0.25;
/// Draws: a mean is known to three hundredths of a width.
const DRAWS: usize = 1024;
/// Standard deviations of a move by another prior below which twice the noise brings none that counts.
const FAR: f64 = 0.1;

/// Whether a quantity is so near to the limits of (c) that twice the noise may be beyond them.
pub fn is_near(prior_shift: f64, width_ratio: f64) -> bool {
    prior_shift >= FAR && prior_shift * width_ratio >= NEGLIGIBLE_PRIOR_SHIFT
}

/// What data of twice the noise would leave of a quantity.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct DoubledNoise {
    /// Criterion (a) of them.
    pub width_ratio: f64,
    /// Criterion (c) of them.
    pub prior_shift: f64,
    /// The same move as a share of what (a) compares with; of B that of C, if it is larger: their product is known by K.
    pub moved: f64,
}

impl DoubledNoise {
    /// Whether they would tell it as well as twice the noise allows: it makes an ordinary posterior twice as wide, and the prior
    /// moves it four times as far.
    pub fn is_identified(&self) -> bool {
        let unmoved = self.prior_shift < MAX_PRIOR_SHIFT || self.moved < 4.0 * NEGLIGIBLE_PRIOR_SHIFT;
        self.width_ratio < 2.0 * MAX_WIDTH_IDENTIFIED && unmoved
    }
}

/// The posterior of data of twice the noise.
pub struct DoubledNoisePosterior(PosteriorSamples);

impl DoubledNoisePosterior {
    /// `best` is the likeliest tire.
    pub fn new(data: &CompressedSamples, prior: &Prior, best: &Theta) -> Self {
        let data = data.clone().with_effective_share(SHARE);
        // A grid with shifts takes seconds.
        Self(match prior.free[Parameter::S_h as usize] || prior.free[Parameter::S_v as usize] {
            true => {
                let usual = TemperingOptions::default();
                tempered::draw_tempered(&data, prior, &TemperingOptions { members: DRAWS / 2, ..usual })
            }
            false => {
                let few = SamplingOptions { draws: DRAWS, ..SamplingOptions::default() };
                draw_posterior(&data, prior, &[*best], &few).posterior
            }
        })
    }

    /// What it leaves of a quantity, of which `before` draws the prior.
    pub fn statistics(&self, quantity: Quantity, prior: &Prior, before: &PosteriorSamples) -> DoubledNoise {
        let own = |quantity: Quantity| {
            let values = self.0.quantity_values(quantity);
            let width_ratio = posterior_width_ratio(quantity, prior, &values, before);
            let prior_shift = prior_shift(prior, &self.0, &values);
            DoubledNoise { width_ratio, prior_shift, moved: width_ratio * prior_shift }
        };
        let found = own(quantity);
        let with_C = quantity == Quantity::Parameter(Parameter::B) && prior.free[Parameter::C as usize];
        if !with_C {
            return found;
        }
        let C = own(Quantity::Parameter(Parameter::C));
        let prior_shift = found.prior_shift.max(C.prior_shift);
        DoubledNoise { moved: found.moved.max(C.moved), prior_shift, ..found }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::synthetic::{SyntheticExcitation, synthetic_samples};

    #[test]
    fn twice_the_noise_doubles_what_the_data_decide() {
        let excitation =
            SyntheticExcitation { samples: 1500, slip_std: 0.0, ..SyntheticExcitation::default() };
        let (data, prior) = (CompressedSamples::new(&synthetic_samples(&excitation, 1.0)), Prior::lateral());
        let few = SamplingOptions { draws: DRAWS, ..SamplingOptions::default() };
        let posterior = draw_posterior(&data, &prior, &[excitation.truth], &few).posterior;
        let before = PosteriorSamples {
            samples: prior.restricted_to_literature().space_filling_points(1024).collect(),
        };
        let doubled = DoubledNoisePosterior::new(&data, &prior, &excitation.truth);
        for quantity in [Quantity::Parameter(Parameter::D), Quantity::K, Quantity::Peak] {
            let noisier = doubled.statistics(quantity, &prior, &before);
            let once = posterior_width_ratio(quantity, &prior, &posterior.quantity_values(quantity), &before);
            let ratio = noisier.width_ratio / once;
            assert!((1.8..2.2).contains(&ratio), "{quantity:?}: {ratio} times as wide");
            assert!(noisier.is_identified(), "{quantity:?}: {noisier:?}");
        }
    }

    #[test]
    fn what_the_prior_moves_is_not_told() {
        let told = DoubledNoise { width_ratio: 0.5, prior_shift: 0.2, moved: 0.1 };
        assert!(told.is_identified());
        assert!(!DoubledNoise { prior_shift: 0.3, ..told }.is_identified());
        assert!(DoubledNoise { prior_shift: 0.3, moved: 0.03, ..told }.is_identified());
        assert!(!DoubledNoise { width_ratio: 0.7, ..told }.is_identified());
        assert!(!DoubledNoise { width_ratio: f64::NAN, ..told }.is_identified());
    }
}
