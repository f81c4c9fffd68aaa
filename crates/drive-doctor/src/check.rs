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

use crate::case::ExaminedLog;

/// A family of checks.
type LogCheck = fn(&mut ExaminedLog);

pub(crate) const CHECKS: &[LogCheck] = &[
    time::check_time_stamps,
    swapped::correct_swapped_channels,
    stuck::check_stuck_channels,
    values::check_channel_values,
    units::check_units_and_signs,
    swapped::correct_swapped_wheels,
    force::check_longitudinal_force,
    clocks::check_yaw_rate_delay,
    course::check_course_delay,
    gains::check_yaw_rate_and_wheel_gains,
    understeer::check_understeer_gradient,
    bank::check_road_bank,
    calibration::check_sensor_errors,
];
