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
/// Points of the wider box that are searched from.
const STARTS: usize = 16;

/// The likeliest tire in the box where it stands on a bound, and the one beyond.
pub struct ActiveBounds {
    /// Bounds that the one beyond crosses, or else those that it stands on.
    on: Vec<(Parameter, f64)>,
    prior: Prior,
    best: Theta,
    beyond: Theta,
    /// −2 ln of the likelihood in the box over that beyond.
    gain: f64,
}

impl ActiveBounds {
    /// `best` is the likeliest tire in the box of `prior`, given samples. The wider box is searched from many points: on the other side of
    /// a bound may be another optimum, of another shape.
    pub fn new(data: &CompressedSamples, prior: &Prior, best: &Theta) -> Self {
        let wider = Prior { bounds: widen_bounds(&prior.bounds), ..*prior };
        let starts = std::iter::once(*best).chain(wider.space_filling_points(STARTS));
        let mut found: Vec<(Theta, f64)> =
            starts.map(|start| minimise_squares(data, &wider, &start, None)).collect();
        found.sort_by(|a, b| a.1.total_cmp(&b.1));
        let ratio = |from: f64, to: f64| data.effective_count() as f64 * (from / to).ln();
        let is_rival = |(theta, squares): &&(Theta, f64)| {
            ratio(*squares, found[0].1) < RULED_OUT
                && !bounds_at(prior, theta, -CLOSE).is_empty()
                && bounds_at(&wider, theta, CLOSE).is_empty()
        };
        let rival = found.iter().find(is_rival);
        let (beyond, least) = *rival.unwrap_or(&found[0]);
        let gain = ratio(data.residual_squares(best), least);
        let is_undisturbed = rival.is_none() && gain <= RULED_OUT && bounds_at(prior, best, CLOSE).is_empty();
        let beyond = if is_undisturbed { *best } else { beyond };
        Self::with_tire_beyond(prior, best, beyond, gain)
    }

    /// `best` is the likeliest tire in the box of `prior`; if it stands on a bound, `search` is asked for the likeliest one in a
    /// wider box, with −2 ln of the likelihood of `best` over that of it.
    pub fn with_search(prior: &Prior, best: &Theta, search: impl FnOnce(&Prior) -> (Theta, f64)) -> Self {
        let (beyond, gain) = match bounds_at(prior, best, CLOSE).is_empty() {
            true => (*best, 0.0),
            false => search(&Prior { bounds: widen_bounds(&prior.bounds), ..*prior }),
        };
        Self::with_tire_beyond(prior, best, beyond, gain)
    }

    fn with_tire_beyond(prior: &Prior, best: &Theta, beyond: Theta, gain: f64) -> Self {
        let crossed = bounds_at(prior, &beyond, -CLOSE);
        let on = if crossed.is_empty() { bounds_at(prior, best, CLOSE) } else { crossed };
        Self { on, prior: *prior, best: *best, beyond, gain }
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
        let beyond = format_significant(Quantity::Parameter(parameter).value(&self.beyond), 3);
        if self.gain > RULED_OUT {
            let gain = format_significant(self.gain, 2);
            return format!(
                "The data push {name} against its bound {end}: beyond the bounds −2 ln L falls by {gain} (at {name} = {beyond}); widen `bounds`."
            );
        }
        let crosses = bounds_at(&self.prior, &self.beyond, -CLOSE).iter().any(|it| it.0 == parameter);
        if crosses {
            return format!(
                "A tire with {name} = {beyond}, beyond its bound {end}, fits as well; widen `bounds`."
            );
        }
        format!("The likeliest {name} is on its bound {end}.")
    }
}

/// Bounds that a tire is beyond, or nearer to than a share of the box.
fn bounds_at(prior: &Prior, theta: &Theta, share: f64) -> Vec<(Parameter, f64)> {
    let at = |parameter| {
        let [low, high] = prior.bounds.range(parameter);
        let (value, margin) = (theta[parameter as usize], share * (high - low));
        match (value - low <= margin, high - value <= margin) {
            (true, _) => Some((parameter, low)),
            (_, true) => Some((parameter, high)),
            _ => None,
        }
    };
    prior.free_parameters().filter_map(at).collect()
}

/// A box that no choice of bounds has narrowed: five times as far in B and D, and more of C and E. E ends at 1, beyond which no curve
/// is a tire's; B at 200 and E at −20, beyond which [`CompressedSamples`] do not follow the curve.
fn widen_bounds(bounds: &Bounds) -> Bounds {
    const HIGHEST_B: f64 = 200.0;
    let mut wide = *bounds;
    let [low, high] = bounds.range(Parameter::B);
    wide.set_range(Parameter::B, [low / 5.0, high.max(HIGHEST_B.min(5.0 * high))]);
    let [low, high] = bounds.range(Parameter::D);
    wide.set_range(Parameter::D, [low / 5.0, 5.0 * high]);
    let [low, high] = bounds.range(Parameter::C);
    wide.set_range(Parameter::C, [0.5 * low, high.max(4.0)]);
    let [low, high] = bounds.range(Parameter::E);
    wide.set_range(Parameter::E, [low.min(Bounds::WIDE.lower[Parameter::E as usize]), high.max(1.0)]);
    for parameter in [Parameter::S_h, Parameter::S_v] {
        let [low, high] = bounds.range(parameter);
        let half = high - low;
        wide.set_range(parameter, [low - half, high + half]);
    }
    wide
}
