//! Keeps angles within half a turn.

use std::f64::consts::{PI, TAU};

/// The same angle within -pi .. pi.
#[must_use]
pub fn wrap_angle(angle: f64) -> f64 {
    (angle + PI).rem_euclid(TAU) - PI
}
