//! The car of the baselines: a single track with curves of axles at constant loads, driven by measured speed and steering.

use nalgebra::Vector2;
use vehicle::{VehicleBody, rk4_step};

use crate::curve::AxleCurve;
use crate::drive::EvenDrive;
use crate::predictor::{LateralState, MotionPredictor};

/// Largest lateral speed [m/s] and yaw rate [rad/s] of a rollout: a car that has spun goes nowhere.
const SPUN: LateralState = [60.0, 40.0];

/// A single track at constant loads.
#[derive(Clone, Debug, PartialEq)]
pub struct SingleTrack {
    /// For people.
    pub name: &'static str,
    /// Mass, inertia and lengths.
    pub body: VehicleBody,
    /// Front and rear.
    pub curves: [AxleCurve; 2],
    /// Time constant of the steering [s].
    pub steering_lag: f64,
}

impl SingleTrack {
    /// Slip angles of both axles [rad] (ISO 8855), without the floor of speed of [`VehicleBody::slip_angles`]: logs of small cars count from 0.6 m/s on.
    #[must_use]
    pub fn slip_angles(body: &VehicleBody, v_x: f64, [v_y, r]: LateralState, delta: f64) -> [f64; 2] {
        [delta - (v_y + body.l_f * r).atan2(v_x), -(v_y - body.l_r * r).atan2(v_x)]
    }

    /// Lateral forces of both axles along the body [N].
    fn lateral_axle_forces(&self, v_x: f64, state: LateralState, delta: f64) -> [f64; 2] {
        let slips = Self::slip_angles(&self.body, v_x, state, delta);
        let loads = self.body.static_loads();
        let [front, rear] = std::array::from_fn(|i| loads[i] * self.curves[i].force(slips[i]));
        [front * delta.cos(), rear]
    }

    fn state_rates(&self, v_x: f64, state: LateralState, delta: f64) -> LateralState {
        let [front, rear] = self.lateral_axle_forces(v_x, state, delta);
        let VehicleBody { m, I_zz, l_f, l_r, .. } = self.body;
        [(front + rear) / m - v_x * state[1], (l_f * front - l_r * rear) / I_zz]
    }
}

impl MotionPredictor for SingleTrack {
    fn name(&self) -> &str {
        self.name
    }

    fn steering_lag(&self) -> f64 {
        self.steering_lag
    }

    fn simulate_states(
        &self,
        drive: &EvenDrive,
        steering: &[f64],
        start: usize,
        rows: usize,
    ) -> Vec<LateralState> {
        // At low speed the yaw damping of a small car is 300/s: one step of 0.01 s would not be stable.
        let substeps = ((drive.step / 5e-3).ceil() as usize).max(2);
        let h = drive.step / substeps as f64;
        let mut states = Vec::with_capacity(rows + 1);
        let mut x = Vector2::new(drive.motion.v_y[start], drive.motion.r[start]);
        states.push(x.into());
        for row in start..start + rows {
            for part in 0..substeps {
                // The middle of the sub-step stands for all of it.
                let share = (part as f64 + 0.5) / substeps as f64;
                let at = |channel: &[f64]| channel[row] + share * (channel[row + 1] - channel[row]);
                let (v_x, delta) = (at(&drive.motion.v_x), at(steering));
                x = rk4_step(&x, h, |x| Vector2::from(self.state_rates(v_x, (*x).into(), delta)));
                x = Vector2::from_fn(|i, _| x[i].clamp(-SPUN[i], SPUN[i]));
            }
            states.push(x.into());
        }
        states
    }

    fn a_y(&self, drive: &EvenDrive, steering: &[f64], row: usize) -> Option<f64> {
        let state = [drive.motion.v_y[row], drive.motion.r[row]];
        let [front, rear] = self.lateral_axle_forces(drive.motion.v_x[row], state, steering[row]);
        Some((front + rear) / self.body.m)
    }
}
