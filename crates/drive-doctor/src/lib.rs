//! Looks for errors in the log of a drive before tires are identified from it: units, signs, clocks, offsets, places of sensors,
//! dead and saturated channels, gaps. Physics decides: which channel contradicts the others, by how much, how surely.
//!
//! Each check sees the log as the checks before it would correct it, so one error does not hide the next. All intervals come
//! from blocks of the log (delete-one-block jackknife), since neighbouring rows are not independent.
#![forbid(unsafe_code)]
#![allow(rustdoc::broken_intra_doc_links, reason = "units stand in brackets, which rustdoc takes for links")]

mod blocks;
mod case;
mod channel;
mod check;
mod correction;
mod finding;
mod motion;
mod reexamination;
mod rolling_radius;
mod statistics;
mod steering_map;
mod understeer_gradient;

pub use case::CarData;
pub use channel::CHANNELS;
pub use check::course::COURSE_CLOCK;
pub use correction::{CorrectionTarget, LogCorrection};
pub use finding::{Certainty, LogExamination, LogFinding, UnansweredCheck};
pub use rolling_radius::RollingRadius;
pub use steering_map::{SteeringMap, SteeringPoint, steering_map};
pub use understeer_gradient::UndersteerGradient;

use preparation::DriveLog;

/// Fewest rows in which the motion of a car is looked for.
const LEAST_ROWS: usize = 100;

/// Examines the log of a drive. Channels have the names and units of [`CHANNELS`] and time stamps of their own [s]; any of them
/// can be missing, and what could not be looked at is said. A log with corrections is examined once more with them.
pub fn examine_log(log: &DriveLog, car: &CarData) -> LogExamination {
    reexamination::weigh_by_corrected_log(log, car, examine_once(log, car), examine_once)
}

fn examine_once(log: &DriveLog, car: &CarData) -> LogExamination {
    let mut case = case::ExaminedLog::new(log, *car);
    for check in check::CHECKS {
        check(&mut case);
    }
    let rows = case.signals.values().map(|signal| signal.time.len()).max().unwrap_or(0);
    if rows < LEAST_ROWS {
        let reason = format!("it has {rows} rows with values, of {LEAST_ROWS} or more that are needed");
        case.found.too_short = true;
        case.add_open_question("whether the log is right", reason, "Record a minute or more.");
    }
    case.into_examination()
}
