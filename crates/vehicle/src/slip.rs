//! Keeps slips finite at rest: the speed that they are divided by has a floor.

use tire::Number;

/// Forward speed [m/s] below which slip angles are those at this speed, so that they stay finite at
/// rest.
pub const SLIP_SPEED_FLOOR: f64 = 1.0;

/// Forward speed [m/s] that slips are divided by. Below the floor it is constant, also to a derivative.
#[inline]
pub(crate) fn slip_speed<T: Number>(v_x: T) -> T {
    if v_x > SLIP_SPEED_FLOOR { v_x } else { SLIP_SPEED_FLOOR.into() }
}
