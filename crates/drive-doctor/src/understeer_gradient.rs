//! Holds an understeer gradient that a log tells.

use serde::Serialize;

/// The understeer gradient K of delta = L r/v_x + K v_x r + offset, with 95 % intervals.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct UndersteerGradient {
    /// K [rad s²/m]: more steering for more lateral acceleration.
    pub gradient: f64,
    /// Its interval.
    pub interval: [f64; 2],
    /// L [m].
    pub wheelbase: f64,
    /// Its interval.
    pub wheelbase_interval: [f64; 2],
    /// What the fit leaves of the steering angle, root mean square [rad].
    pub rms: f64,
    /// The same with the yaw rate as it was recorded [rad].
    pub rms_as_recorded: f64,
    /// By how much the yaw rate was moved before [s].
    pub r_earlier_by: f64,
    /// Gradients of the first and the second half of the log [rad s²/m], if both tell it.
    pub halves: Option<[f64; 2]>,
    /// Whether the halves agree, as far as they tell it.
    pub is_constant: bool,
    /// The whole in words.
    pub sentence: String,
}
