//! Looks for a course over ground that is behind the motion, as a receiver of GNSS that filters it makes it.

use numerics::text::format_significant;
use preparation::ColumnKey;

use super::clocks::course_delay;
use crate::case::ExaminedLog;
use crate::correction::LogCorrection;
use crate::finding::{Certainty, LogFinding};
use crate::motion::ResampledChannels;

/// The question whether a course is late, where it has no answer.
pub const COURSE_CLOCK: &str = "clock of the course";

/// A delay that no sideslip makes [s].
const LEAST: f64 = 0.05;

/// Compares the course with the yaw rate, whose own clock was looked at before.
pub(crate) fn check_course_delay(case: &mut ExaminedLog) {
    if !case.has_channels(&["v_x", "r", "course"]) {
        return;
    }
    let motion = ResampledChannels::from_log(case).filter(|_| !case.is_one_sided);
    let delay = motion.and_then(|motion| course_delay(case, &motion));
    let Some((late, interval, is_constant)) = delay else {
        let reason = "no turns to both sides show whether it is late".to_owned();
        case.add_open_question(COURSE_CLOCK, reason, "Drive left and right turns for half a minute.");
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
    .map(|time| format_significant(time, 2));
    let mut sentence = format!("`course` is {shown} s [{least}, {most}] {word} for the yaw rate.");
    if !is_constant {
        sentence += " The halves of the log disagree: it is no constant.";
    }
    case.add_finding(LogFinding {
        check: "course_delay".to_owned(),
        channels: vec!["course"],
        sure: Certainty::Likely,
        value: Some(late),
        interval: Some(interval),
        unit: "s",
        sentence,
        consequence: "It would tell a sideslip that is not there at the ends of turns.".to_owned(),
        correction: match is_constant {
            true => LogCorrection::from_column_keys(&[ColumnKey::Delay(late).into()]),
            false => LogCorrection::from_advice("Leave the column out."),
        },
        refuses: false,
    });
    case.correct_channel("course", 1.0, late);
}
