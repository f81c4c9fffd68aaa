//! Looks for errors in the log of a drive before tires are identified from it: units, signs, clocks, offsets, places of sensors,
//! dead and saturated channels, gaps. Physics decides: which channel contradicts the others, by how much, how surely.
//!
//! Each check sees the log as the checks before it would correct it, so one error does not hide the next. All intervals come
//! from blocks of the log (delete-one-block jackknife), since neighbouring rows are not independent.
#![forbid(unsafe_code)]
#![allow(
    rustdoc::broken_intra_doc_links,
    reason = "units stand in brackets, which rustdoc takes for links"
)]

mod blocks;
mod case;
mod check;
mod finding;
mod motion;

pub use case::{CHANNELS, KnownCar};
pub use finding::{Examination, Finding, NotTold, Sure};
use preparation::DriveLog;

/// Examines the log of a drive. Channels have the names and units of [`CHANNELS`] and time stamps of their own [s]; any of them
/// can be missing, and what could not be looked at is said.
pub fn examine(log: &DriveLog, car: &KnownCar) -> Examination {
    let mut case = case::Case::new(log, *car);
    for check in check::CHECKS {
        check(&mut case);
    }
    case.close()
}
