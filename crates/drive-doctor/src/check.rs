//! Lists the checks. Each is a file; they run in this order, as each corrects the log for the next ones.

mod bank;
mod calibration;
mod clocks;
pub(crate) mod course;
mod force;
mod gains;
mod stuck;
mod swapped;
mod time;
pub(crate) mod understeer;
mod units;
mod values;

use crate::case::Case;

/// A family of checks.
type Check = fn(&mut Case);

pub(crate) const CHECKS: &[Check] = &[
    time::check,
    swapped::channels,
    stuck::check,
    values::check,
    units::check,
    swapped::wheels,
    force::check,
    clocks::check,
    course::check,
    gains::check,
    understeer::check,
    bank::check,
    calibration::check,
];
