//! Judges a peak by whether the data show one: what only rises tells no peak.

use preparation::direction::ForceDirection;

use crate::quantity::{HIGHEST_PEAK_SLIP, Quantity};
use crate::verdict::{Identifiability, QuantityIdentifiability};

/// Caps the peak and its slip where the interval of the latter begins beyond the slips of the data, or has no end.
pub fn cap_absent_peak(
    judgements: &mut [QuantityIdentifiability],
    slip_range: [f64; 2],
    direction: ForceDirection,
) {
    let driven = slip_range[0].abs().max(slip_range[1].abs());
    let Some(slip) = judgements.iter().find(|it| it.quantity == Quantity::PeakSlip) else { return };
    let [low, high] = slip.interval;
    let sentence = if low > driven {
        let [driven, low] = [driven, low].map(|slip| direction.format_slip(slip));
        format!("The data show no peak: to {driven} the force only rises, and the peak is beyond {low}.")
    } else if high >= HIGHEST_PEAK_SLIP {
        format!(
            "The data show no peak: a curve that rises to {} fits as well.",
            direction.format_slip(HIGHEST_PEAK_SLIP)
        )
    } else {
        return;
    };
    let of_peak =
        |it: &&mut QuantityIdentifiability| matches!(it.quantity, Quantity::Peak | Quantity::PeakSlip);
    for it in judgements.iter_mut().filter(of_peak) {
        if it.verdict == Identifiability::Identified {
            it.verdict = Identifiability::Weak;
        }
        it.reason = format!("{sentence} {}", it.reason);
    }
}
