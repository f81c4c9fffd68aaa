//! Delays of the channels of a drive, and by how much they grow with time.

use numerics::scalar::Scalar;
use preparation::{SystematicError, SystematicErrors};

/// A number for each channel: steering angle, longitudinal force, v_x, v_y, r, a_y.
pub type PerChannel<T> = [T; 6];

/// Delays of the channels in the middle of a drive [s]; v_x is what the others are late after.
pub fn channel_delays<T: Scalar>(causes: &SystematicErrors<T>) -> PerChannel<T> {
    let none = causes.0[0].constant(0.0);
    [
        causes[SystematicError::SteeringDelay],
        causes[SystematicError::ForceDelay],
        none,
        causes[SystematicError::SideslipDelay],
        causes[SystematicError::YawRateDelay],
        causes[SystematicError::AccelerationDelay],
    ]
}

/// By how much delays of the channels grow with time [-].
pub fn channel_drifts<T: Scalar>(causes: &SystematicErrors<T>) -> PerChannel<T> {
    let [sideslip, inertial, input] = SystematicError::CLOCKS.map(|clock| causes[clock]);
    [input, input, input.constant(0.0), sideslip, inertial, inertial]
}
