//! Holds what the sensors say, and how noisy they are.
#![allow(non_snake_case, reason = "symbols as in vehicle dynamics")]

use serde::{Deserialize, Serialize};

/// What the sensors say at one time.
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
pub struct SensorSample {
    /// Forward speed [m/s].
    pub v_x: f64,
    /// Speed to the left [m/s]; NaN where nobody measured it.
    pub v_y: f64,
    /// Yaw rate [rad/s].
    pub r: f64,
    /// Acceleration to the left [m/s²].
    pub a_y: f64,
    /// Road-wheel angle [rad].
    pub delta: f64,
}

/// Largest values that a sensor of a car can show [m/s, rad/s, m/s², rad]: more is a fault of the sensor.
const MOST: [(&str, f64); 4] = [("v_x", 200.0), ("r", 50.0), ("a_y", 200.0), ("delta", 1.5)];

impl SensorSample {
    /// Names the first channel that is no measurement of a car; a number that is not finite says that it is missing.
    pub fn missing_channel(&self) -> Option<(&'static str, f64)> {
        let values = [self.v_x, self.r, self.a_y, self.delta];
        let mut named = MOST.into_iter().zip(values);
        named
            .find(|((_, most), value)| value.is_nan() || value.abs() > *most)
            .map(|((name, _), value)| (name, value))
    }
}

/// Standard deviations of the noises.
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
pub struct SensorNoise {
    /// v_y of a sensor, white as the next two [m/s].
    pub v_y: f64,
    /// Yaw rate [rad/s].
    pub r: f64,
    /// Acceleration [m/s²].
    pub a_y: f64,
    /// Slip angles of both axles, for trim, play and offsets [rad].
    pub alpha: [f64; 2],
    /// Model error of an axle force over its load.
    pub force: f64,
}
