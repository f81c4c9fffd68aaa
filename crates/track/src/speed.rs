//! Follows a speed: feed-forward of the wanted acceleration, feedback of the speed, within what the car can do.

use serde::{Deserialize, Serialize};

/// The speed law with its gains; its one state, the integral, stays with the caller.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct SpeedLaw {
    /// Speed error to acceleration [1/s].
    pub gain: f64,
    /// Integral of the speed error to acceleration [1/s²].
    pub integral_gain: f64,
}

impl Default for SpeedLaw {
    fn default() -> Self {
        SpeedLaw { gain: 3.0, integral_gain: 0.5 }
    }
}

/// What a car should do now.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SpeedCommand {
    /// Speed [m/s].
    pub speed: f64,
    /// Acceleration that goes with it [m/s²].
    pub acceleration: f64,
}

impl SpeedLaw {
    /// Acceleration [m/s²] for the next step of `h` [s], between two limits [m/s²]: a = a_ref + k (v_ref − v) + z, z' = k_i (v_ref − v).
    ///
    /// The integral stands still while the command is at a limit that the error would push it further into (conditional integration,
    /// K. Åström and T. Hägglund, Advanced PID Control, 2006, section 3.5), and is itself within the limits.
    #[must_use]
    pub fn commanded_acceleration(
        &self,
        wanted: &SpeedCommand,
        v: f64,
        [least, most]: [f64; 2],
        integral: &mut f64,
        h: f64,
    ) -> f64 {
        let error = wanted.speed - v;
        let free = wanted.acceleration + self.gain * error + *integral;
        if (free < most || error < 0.0) && (free > least || error > 0.0) {
            *integral += self.integral_gain * error * h;
        }
        let (low, high) = (least.min(0.0), most.max(0.0));
        *integral = integral.clamp(low, high);
        free.max(least).min(most)
    }
}

#[cfg(test)]
mod tests {
    use approx::assert_relative_eq;

    use super::*;

    const H: f64 = 0.01;

    #[test]
    fn a_constant_disturbance_leaves_no_error() {
        let (law, mut v, mut integral) = (SpeedLaw::default(), 10.0, 0.0);
        for _ in 0..6000 {
            let wanted = SpeedCommand { speed: 20.0, acceleration: 0.0 };
            v += H * (law.commanded_acceleration(&wanted, v, [-10.0, 5.0], &mut integral, H) - 1.5);
        }
        assert_relative_eq!(v, 20.0, epsilon = 1e-3);
        assert_relative_eq!(integral, 1.5, epsilon = 1e-2);
    }

    #[test]
    fn a_long_saturation_does_not_overshoot() {
        let (law, mut v, mut integral, mut highest) = (SpeedLaw::default(), 0.0, 0.0, 0.0_f64);
        for _ in 0..2000 {
            let wanted = SpeedCommand { speed: 50.0, acceleration: 0.0 };
            v += H * law.commanded_acceleration(&wanted, v, [-10.0, 5.0], &mut integral, H);
            highest = highest.max(v);
        }
        assert!(highest < 50.5 && (v - 50.0).abs() < 0.5, "{highest} {v}");
    }

    #[test]
    fn no_command_passes_its_limits() {
        let law = SpeedLaw::default();
        for (speed, wanted) in [(100.0, 3.0), (-100.0, -8.0)] {
            let mut integral = 0.0;
            let wanted_speed = SpeedCommand { speed, acceleration: 0.0 };
            let found = law.commanded_acceleration(&wanted_speed, 0.0, [-8.0, 3.0], &mut integral, H);
            assert_eq!((found, integral), (wanted, 0.0));
        }
    }
}
