//! Judges what bounds do to a tire: what stands on one, or would be elsewhere in a wider box, is not known from the data.

use numerics::text::format_significant;

use crate::bounds::Bounds;
use crate::compressed::CompressedSamples;
use crate::minimise::minimise_squares;
use crate::parameters::{Parameter, Theta};
use crate::prior::Prior;
use crate::profile::RULED_OUT;
use crate::quantity::Quantity;
use crate::verdict::{Identifiability, MAX_PRIOR_SHIFT, QuantityIdentifiability};

/// A parameter this close to a bound stands on it, as a share of the box.
const CLOSE: f64 = 1e-4;

/// The likeliest tire in the box where it stands on a bound, and the one beyond.
pub struct ActiveBounds {
    /// Bounds that it stands on.
    on: Vec<(Parameter, f64)>,
    best: Theta,
    beyond: Theta,
    /// −2 ln of the likelihood in the box over that beyond.
    gain: f64,
}

impl ActiveBounds {
    /// `best` is the likeliest tire in the box of `prior`, given samples.
    pub fn new(data: &CompressedSamples, prior: &Prior, best: &Theta) -> Self {
        Self::with_search(prior, best, |wider| {
            let (beyond, least) = minimise_squares(data, wider, best, None);
            (beyond, data.effective_count() as f64 * (data.residual_squares(best) / least).ln())
        })
    }

    /// `best` is the likeliest tire in the box of `prior`; if it stands on a bound, `search` is asked for the likeliest one in a
    /// wider box, with −2 ln of the likelihood of `best` over that of it.
    pub fn with_search(prior: &Prior, best: &Theta, search: impl FnOnce(&Prior) -> (Theta, f64)) -> Self {
        let on: Vec<(Parameter, f64)> = prior
            .free_parameters()
            .filter_map(|parameter| {
                let [low, high] = prior.bounds.range(parameter);
                let value = best[parameter as usize];
                let near = |end: f64| (value - end).abs() <= CLOSE * (high - low);
                [low, high].into_iter().find(|end| near(*end)).map(|end| (parameter, end))
            })
            .collect();
        let wider = Prior { bounds: widen_bounds(&prior.bounds), ..*prior };
        let (beyond, gain) = if on.is_empty() { (*best, 0.0) } else { search(&wider) };
        Self { on, best: *best, beyond, gain }
    }

    /// The judgement, no better than the bounds allow.
    pub fn cap_judgement(&self, mut judgement: QuantityIdentifiability) -> QuantityIdentifiability {
        let quantity = judgement.quantity;
        let stands = self.on.iter().find(|(parameter, _)| quantity.parameter() == Some(*parameter));
        let moved = (quantity.value(&self.beyond) - quantity.value(&self.best)).abs() / judgement.std;
        if self.on.is_empty() || (stands.is_none() && moved < MAX_PRIOR_SHIFT) {
            return judgement;
        }
        if judgement.verdict == Identifiability::Identified {
            judgement.verdict = Identifiability::Weak;
        }
        let sentence = match stands {
            Some((parameter, end)) => self.describe_bound(*parameter, *end),
            None => format!(
                "A tire beyond the bounds would move it by {} standard deviations: {}",
                format_significant(moved, 2),
                self.on.iter().map(|(p, end)| self.describe_bound(*p, *end)).collect::<Vec<_>>().join(" ")
            ),
        };
        judgement.reason = format!("{} {sentence}", judgement.reason);
        judgement
    }

    fn describe_bound(&self, parameter: Parameter, end: f64) -> String {
        let (name, end) = (parameter.symbol(), format_significant(end, 3));
        if self.gain <= RULED_OUT {
            return format!("The likeliest {name} is on its bound {end}.");
        }
        format!(
            "The data push {name} against its bound {end}: beyond the bounds −2 ln L falls by {} (at {name} = {}); widen `bounds`.",
            format_significant(self.gain, 2),
            format_significant(Quantity::Parameter(parameter).value(&self.beyond), 3)
        )
    }
}

/// A box that no choice of bounds has narrowed: five times as far in B and D, and more of C and E. E ends at 1, beyond which no curve
/// is a tire's.
fn widen_bounds(bounds: &Bounds) -> Bounds {
    let mut wide = *bounds;
    for parameter in [Parameter::B, Parameter::D] {
        let [low, high] = bounds.range(parameter);
        wide.set_range(parameter, [low / 5.0, 5.0 * high]);
    }
    let [low, high] = bounds.range(Parameter::C);
    wide.set_range(Parameter::C, [0.5 * low, high.max(4.0)]);
    let [low, high] = bounds.range(Parameter::E);
    wide.set_range(Parameter::E, [low - 20.0, high.max(1.0)]);
    for parameter in [Parameter::S_h, Parameter::S_v] {
        let [low, high] = bounds.range(parameter);
        let half = high - low;
        wide.set_range(parameter, [low - half, high + half]);
    }
    wide
}
