//! Makes slip angles and axle forces of sensors, each with its variance.
#![allow(non_snake_case, reason = "symbols as in vehicle dynamics")]

use serde::{Deserialize, Serialize};
use vehicle::{G, VehicleBody};

use crate::sample::{SensorNoise, SensorSample};
use crate::sideslip::LateralSpeedEstimate;

/// An axle as it was seen: force over load at a slip angle.
#[derive(Debug, Clone, Copy, Default)]
pub struct AxleObservation {
    /// Slip angle [rad].
    pub alpha: f64,
    /// Lateral force over the load at rest.
    pub force: f64,
    /// Variance of the force.
    pub force_variance: f64,
    /// Variances of the slip angle, of what lasts and of what does not [rad²].
    pub alpha_variances: [f64; 2],
}

/// The first-order low-pass that all channels share. Equal delays leave slips and forces together, and the yaw acceleration
/// is the change of the filtered yaw rate.
#[derive(Debug, Clone, Copy, Default, Serialize, Deserialize)]
pub struct LowPassFilter {
    /// Slip angles of front and rear axle [rad], a_y [m/s²], r [rad/s], cosine of the steering angle; none before the first sample.
    values: Option<[f64; 5]>,
}

impl LowPassFilter {
    /// Forgets what came before a gap.
    pub fn reset(&mut self) {
        self.values = None;
    }

    /// Takes a sample that is `h` [s] younger than the one before, with its v_y. The first sample after a [`reset`](Self::reset)
    /// gives nothing.
    pub fn filter_sample(
        &mut self,
        sample: &SensorSample,
        v_y: &LateralSpeedEstimate,
        body: &VehicleBody,
        noise: &SensorNoise,
        [time, h]: [f64; 2],
    ) -> Option<[AxleObservation; 2]> {
        let SensorSample { v_x, r, a_y, delta, .. } = *sample;
        let VehicleBody { m, I_zz, l_f, l_r, .. } = *body;
        let front = delta - (v_y.mean + l_f * r).atan2(v_x);
        let rear = -(v_y.mean - l_r * r).atan2(v_x);
        let now = [front, rear, a_y, r, delta.cos()];
        let Some(before) = self.values else {
            self.values = Some(now);
            return None;
        };
        let share = -(-h / time).exp_m1();
        let values: [f64; 5] = std::array::from_fn(|k| before[k] + share * (now[k] - before[k]));
        self.values = Some(values);
        let [_, _, a_y, _, cosine] = values;
        let r_rate = (values[3] - before[3]) / h;
        // Variances of white noise behind the filter, and of its change.
        let passed = share / (2.0 - share);
        let r_rate_std = noise.r * share / h * (2.0 / (2.0 - share)).sqrt();
        // An estimated v_y is wrong for longer than a measured one.
        let by_v_y = v_y.variance / (v_x * v_x);
        let [lasting, passing] = if v_y.measured { [0.0, by_v_y] } else { [by_v_y, 0.0] };
        let axle = |k: usize, arm: f64, other: f64, sign: f64, cosine: f64| {
            let load = m * G * other / (l_f + l_r);
            let over = 1.0 / ((l_f + l_r) * load * cosine.max(0.1));
            let by_a_y = m * other * over * noise.a_y;
            let by_rate = I_zz * over * r_rate_std;
            let by_r = arm * noise.r / v_x;
            AxleObservation {
                alpha: values[k],
                force: (other * m * a_y + sign * I_zz * r_rate) * over,
                force_variance: noise.force.powi(2) + passed * by_a_y.powi(2) + by_rate.powi(2),
                alpha_variances: [noise.alpha[k].powi(2) + lasting, passed * by_r.powi(2) + passing],
            }
        };
        Some([axle(0, l_f, l_r, 1.0, cosine), axle(1, l_r, l_f, -1.0, 1.0)])
    }
}
