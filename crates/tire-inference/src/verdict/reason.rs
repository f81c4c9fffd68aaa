//! Puts a verdict into words, with the figures that it rests on.

use numerics::identifiability::{MAX_PRIOR_SHIFT, MAX_WIDTH_IDENTIFIED};
use numerics::text::{format_significant, with_std};

use crate::prior::Prior;
use crate::profile::{LikelihoodProfile, ProfileSide, RULED_OUT};
use crate::quantity::Quantity;
use crate::verdict::{Identifiability, MeasurementEvidence, QuantityStatistics};

/// Why a quantity has its verdict, and for one that is not identified what to drive.
pub fn explain_verdict(
    known: &QuantityStatistics,
    verdict: Identifiability,
    prior: &Prior,
    advice: &str,
) -> String {
    let name = known.quantity.name();
    let value = with_std(known.mean, known.std);
    let share = if known.width_ratio < 1.0 {
        format!("{} %", format_significant(100.0 * known.width_ratio, 2))
    } else {
        "all".into()
    };
    let does = if known.width_ratio < MAX_WIDTH_IDENTIFIED { "narrow it to" } else { "leave" };
    let width =
        format!("The data {does} {share} of the width that bounds and literature allow ({name} = {value})");
    if verdict == Identifiability::Identified {
        let ends = |p: &LikelihoodProfile| [p.lower.at, p.upper.at].map(|end| format_significant(end, 4));
        let ruled_out =
            known.profile.as_ref().map(ends).map_or(String::new(), |[low, high]| {
                format!(" and rule out values outside of {low} to {high}")
            });
        let moved = known.prior_shift.map_or(String::new(), |shift| {
            let shift = format_significant(shift, 1);
            format!("; another prior would move it by {shift} standard deviations")
        });
        return format!("{width}{ruled_out}{moved}.");
    }
    let mut parts = vec![width];
    parts.extend(known.profile.as_ref().and_then(|profile| describe_open_sides(known, profile, prior)));
    let rival = |value| format!("a tire with {name} = {} fits as well", format_significant(value, 3));
    parts.extend(known.rival.map(rival));
    let moves = |shift: &f64| shift.is_nan() || *shift >= MAX_PRIOR_SHIFT;
    if let Some(shift) = known.prior_shift.filter(moves) {
        let shift = format_significant(shift, 2);
        parts.push(format!("another prior would move it by {shift} standard deviations"));
    }
    if known.noisier.is_some_and(|noisier| !noisier.is_identified()) {
        let sentence = "with twice the noise the data would not tell it, so this width may be luck";
        parts.push(sentence.to_owned());
    }
    format!("{}. {advice}", parts.join("; "))
}

/// The sides on which the data rule nothing out.
fn describe_open_sides(
    known: &QuantityStatistics,
    profile: &LikelihoodProfile,
    prior: &Prior,
) -> Option<String> {
    let name = known.quantity.name();
    let [low, high] = known.quantity.range_in_prior(prior).map(|end| format_significant(end, 3));
    let rise = |side: &ProfileSide| format_significant(side.rise, 2);
    let end = match known.quantity {
        Quantity::Parameter(_) => "bound",
        _ => "limit",
    };
    match (profile.lower.closed, profile.upper.closed) {
        (true, true) => None,
        (false, true) => Some(format!(
            "its profile stays below {RULED_OUT} down to the {end} {name} = {low} ({})",
            rise(&profile.lower)
        )),
        (true, false) => Some(format!(
            "its profile stays below {RULED_OUT} up to the {end} {name} = {high} ({})",
            rise(&profile.upper)
        )),
        (false, false) => {
            let highest = format_significant(profile.lower.rise.max(profile.upper.rise), 2);
            Some(format!(
                "its profile stays below {RULED_OUT} from {end} to {end}, {low} to {high} ({highest})"
            ))
        }
    }
}

/// What to drive, given the slip whose measurement would tell most.
pub fn advise_on_driving(drive: Option<f64>, evidence: &MeasurementEvidence) -> String {
    let driven = evidence.slip_range[0].abs().max(evidence.slip_range[1].abs());
    let slip = |slip| evidence.direction.format_slip(slip);
    match drive {
        Some(at) if at > driven => {
            format!(
                "Data to {} do not show the part of the curve that tells it: drive slips near {}.",
                slip(driven),
                slip(at)
            )
        }
        Some(at) => format!("More data near {} would tell most.", slip(at)),
        None => "No slip near those driven would tell more.".into(),
    }
}
