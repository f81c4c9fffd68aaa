//! Puts a verdict into words, with the figures that it rests on.

use numerics::text::{significant, with_std};

use crate::prior::Prior;
use crate::quantity::Quantity;
use crate::verdict::profile::{RULED_OUT, Side};
use crate::verdict::{Evidence, Judgement, NARROWED, UNMOVED, Verdict};

/// Why a quantity has its verdict, and for one that is not identified what to drive.
pub fn explain(judgement: &Judgement, evidence: &Evidence, prior: &Prior) -> String {
    let name = judgement.quantity.name();
    let value = with_std(judgement.mean, judgement.std);
    let share = significant(100.0 * judgement.width_ratio, 2);
    let profile = &judgement.profile;
    if judgement.verdict == Verdict::Identified {
        let ends = [profile.lower.at, profile.upper.at].map(|end| significant(end, 4));
        let shift = significant(judgement.prior_shift, 1);
        return format!(
            "The data narrow it to {share} % of the width that the bounds allow ({name} = {value}) and rule out \
             values outside of {} to {}; another prior would move it by {shift} standard deviations.",
            ends[0], ends[1]
        );
    }
    let mut parts = Vec::new();
    if judgement.width_ratio < NARROWED {
        parts.push(format!(
            "The data narrow it to {share} % of the width that the bounds allow ({name} = {value})"
        ));
    } else {
        parts.push(format!(
            "The data leave {share} % of the width that the bounds allow ({name} = {value})"
        ));
    }
    parts.extend(open(judgement, prior));
    parts.extend(
        judgement
            .rival
            .map(|value| format!("a tire with {name} = {} fits as well", significant(value, 3))),
    );
    if judgement.prior_shift.is_nan() || judgement.prior_shift >= UNMOVED {
        let shift = significant(judgement.prior_shift, 2);
        parts.push(format!("another prior would move it by {shift} standard deviations"));
    }
    format!("{}. {}", parts.join("; "), advise(judgement, evidence))
}

/// The sides on which the data rule nothing out.
fn open(judgement: &Judgement, prior: &Prior) -> Option<String> {
    let name = judgement.quantity.name();
    let profile = &judgement.profile;
    let [low, high] = judgement.quantity.range(prior).map(|end| significant(end, 3));
    let rise = |side: &Side| significant(side.rise, 2);
    let end = match judgement.quantity {
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
            let highest = significant(profile.lower.rise.max(profile.upper.rise), 2);
            Some(format!(
                "its profile stays below {RULED_OUT} from {end} to {end}, {low} to {high} ({highest})"
            ))
        }
    }
}

fn advise(judgement: &Judgement, evidence: &Evidence) -> String {
    let driven = evidence.slip_range[0].abs().max(evidence.slip_range[1].abs());
    let slip = |slip| evidence.direction.slip(slip);
    match judgement.drive {
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
