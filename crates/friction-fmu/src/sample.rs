//! Makes slip angles and axle forces of sensors, each with its variance.
#![allow(non_snake_case, reason = "symbols as in vehicle dynamics")]

use serde::{Deserialize, Serialize};
use vehicle::{Body, G};

/// What the sensors say at one time.
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
pub struct Sample {
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

impl Sample {
    /// Names the first channel that is no measurement of a car; a number that is not finite says that it is missing.
    pub fn missing(&self) -> Option<(&'static str, f64)> {
        let values = [self.v_x, self.r, self.a_y, self.delta];
        let mut named = MOST.into_iter().zip(values);
        // A comparison with NaN is false.
        named.find(|((_, most), value)| !(value.abs() <= *most)).map(|((name, _), value)| (name, value))
    }
}

/// Standard deviations of the noises.
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
pub struct Noise {
    /// Of the sensors, white [m/s, rad/s, m/s², rad].
    pub v_y: f64,
    /// Yaw rate [rad/s].
    pub r: f64,
    /// Acceleration [m/s²].
    pub a_y: f64,
    /// Slip angle of an axle, for the trim of steering and sensors [rad].
    pub alpha: f64,
    /// Model error of an axle force over its load.
    pub force: f64,
}

/// An axle as it was seen: force over load at a slip angle.
#[derive(Debug, Clone, Copy, Default)]
pub struct Seen {
    /// Slip angle [rad].
    pub alpha: f64,
    /// Lateral force over the load at rest.
    pub force: f64,
    /// Variance of the force but for that of the slip angle.
    pub force_variance: f64,
    /// Variance of the slip angle [rad²].
    pub alpha_variance: f64,
}

/// The first-order low-pass that all channels share. Equal delays leave slips and forces together, and the yaw acceleration
/// is the change of the filtered yaw rate.
#[derive(Debug, Clone, Copy, Default, Serialize, Deserialize)]
pub struct Filter {
    /// Slip angles of front and rear axle [rad], a_y [m/s²], r [rad/s], cosine of the steering angle; none before the first sample.
    values: Option<[f64; 5]>,
}

impl Filter {
    /// Forgets what came before a gap.
    pub fn reset(&mut self) {
        self.values = None;
    }

    /// Takes a sample that is `h` [s] younger than the one before, with a v_y [m/s] and its variance. The first sample after a
    /// [`reset`](Self::reset) gives nothing.
    pub fn take(
        &mut self,
        sample: &Sample,
        (v_y, variance): (f64, f64),
        body: &Body,
        noise: &Noise,
        [time, h]: [f64; 2],
    ) -> Option<[Seen; 2]> {
        let Sample { v_x, r, a_y, delta, .. } = *sample;
        let Body { m, I_zz, l_f, l_r, .. } = *body;
        let front = delta - (v_y + l_f * r).atan2(v_x);
        let rear = -(v_y - l_r * r).atan2(v_x);
        let now = [front, rear, a_y, r, delta.cos()];
        let Some(before) = self.values else {
            self.values = Some(now);
            return None;
        };
        let share = -(-h / time).exp_m1();
        let values: [f64; 5] = std::array::from_fn(|k| before[k] + share * (now[k] - before[k]));
        self.values = Some(values);
        let [front, rear, a_y, _, cosine] = values;
        let r_rate = (values[3] - before[3]) / h;
        // Variances of white noise behind the filter, and of its change.
        let passed = share / (2.0 - share);
        let r_rate_std = noise.r * share / h * (2.0 / (2.0 - share)).sqrt();
        let axle = |alpha: f64, arm: f64, other: f64, sign: f64, cosine: f64| {
            let load = m * G * other / (l_f + l_r);
            let over = 1.0 / ((l_f + l_r) * load * cosine.max(0.1));
            let by_a_y = m * other * over * noise.a_y;
            let by_rate = I_zz * over * r_rate_std;
            let by_r = arm * noise.r / v_x;
            Seen {
                alpha,
                force: (other * m * a_y + sign * I_zz * r_rate) * over,
                force_variance: noise.force.powi(2) + passed * by_a_y.powi(2) + by_rate.powi(2),
                alpha_variance: noise.alpha.powi(2) + variance / (v_x * v_x) + passed * by_r.powi(2),
            }
        };
        Some([axle(front, l_f, l_r, 1.0, cosine), axle(rear, l_r, l_f, -1.0, 1.0)])
    }
}
