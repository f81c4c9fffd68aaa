//! Looks for a course over ground that is behind the motion, as a receiver of GNSS that filters it makes it.

use numerics::text::significant;
use preparation::ColumnKey;

use super::clocks::late_course;
use crate::case::Case;
use crate::correction::Correction;
use crate::finding::{Certainty, Finding};
use crate::motion::Motion;

/// The question whether a course is late, where it has no answer.
pub const COURSE_CLOCK: &str = "clock of the course";

/// A delay that no sideslip makes [s].
const LEAST: f64 = 0.05;

/// Compares the course with the yaw rate, whose own clock was looked at before.
pub(crate) fn check(case: &mut Case) {
    if !case.has(&["v_x", "r", "course"]) {
        return;
    }
    let motion = Motion::of(case).filter(|_| !case.is_one_sided);
    let delay = motion.and_then(|motion| late_course(case, &motion));
    let Some((late, interval, is_constant)) = delay else {
        let reason = "no turns to both sides show whether it is late".to_owned();
        case.cannot_tell(COURSE_CLOCK, reason, "Drive left and right turns for half a minute.");
        return;
    };
    let [low, high] = interval;
    if low < LEAST && high > -LEAST {
        return;
    }
    let word = if late > 0.0 { "late" } else { "early" };
    let [shown, least, most] = match late > 0.0 {
        true => [late, low, high],
        false => [-late, -high, -low],
    }
    .map(|time| significant(time, 2));
    let mut sentence = format!("`course` is {shown} s [{least}, {most}] {word} for the yaw rate.");
    if !is_constant {
        sentence += " The halves of the log disagree: it is no constant.";
    }
    case.report(Finding {
        check: "course_delay".to_owned(),
        channels: vec!["course"],
        sure: Certainty::Likely,
        value: Some(late),
        interval: Some(interval),
        unit: "s",
        sentence,
        consequence: "It would tell a sideslip that is not there at the ends of turns.".to_owned(),
        correction: match is_constant {
            true => Correction::column(&[ColumnKey::Delay(late).into()]),
            false => Correction::advice("Leave the column out."),
        },
        refuses: false,
    });
    case.correct("course", 1.0, late);
}
