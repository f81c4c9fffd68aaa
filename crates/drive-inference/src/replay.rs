//! Drives a car in open loop along a recording, and says how far it is from what was measured.

use serde::Serialize;
use vehicle::{PlanarState, SingleTrackCar, SingleTrackInput};

use crate::likelihood::DriveNoise;
use crate::recorded_input::InterpolatedSegment;
use crate::smoothing::rmse;
use preparation::Drive;

/// Longest step of the integrator [s].
const SUBSTEP: f64 = 0.002;

/// A number for each measured quantity.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct SensorValues {
    /// Forward speed.
    pub v_x: f64,
    /// Speed to the left.
    pub v_y: f64,
    /// Yaw rate.
    pub r: f64,
    /// Lateral acceleration.
    pub a_y: f64,
}

impl From<[f64; 4]> for SensorValues {
    fn from([v_x, v_y, r, a_y]: [f64; 4]) -> Self {
        Self { v_x, v_y, r, a_y }
    }
}

/// How a car drove along a recording, with its inputs and nothing else.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct OpenLoopReplay {
    /// Times of the first and the last row [s].
    pub window: [f64; 2],
    /// Root mean square differences from what was measured [m/s, m/s, rad/s, m/s²]. They hold the noise of the sensors.
    pub rmse: SensorValues,
    /// The same in units of the root mean square of what was measured [-].
    pub normalised: SensorValues,
    /// What is left of `normalised` if the car is the true one: the noise of the sensors [-].
    pub floor: SensorValues,
    /// `rmse` in units of the noise of the sensors [-]: 1 if the car is the true one.
    pub in_noise: SensorValues,
    /// v_x, v_y [m/s], r [rad/s] and a_y [m/s²] of the car.
    #[serde(skip)]
    pub columns: [Vec<f64>; 4],
}

/// Drives a car along stretches of a recording, along each from a state at its first row: over the gaps between them nothing is
/// known.
pub fn replay_open_loop(
    car: &SingleTrackCar,
    stretches: &[(&Drive, PlanarState)],
    noise: &DriveNoise,
) -> OpenLoopReplay {
    let mut columns = [const { Vec::new() }; 4];
    let mut all = Drive::default();
    for &(recording, mut state) in stretches {
        for k in 0..recording.len() {
            let input = SingleTrackInput { F_x: recording.F_x[k], delta: recording.delta[k] };
            if k > 0 {
                let h = recording.t[k] - recording.t[k - 1];
                let delta = InterpolatedSegment::of_column(
                    recording,
                    &recording.delta,
                    k,
                    recording.interpolation.delta,
                );
                let F_x =
                    InterpolatedSegment::of_column(recording, &recording.F_x, k, recording.interpolation.F_x);
                let parts = (h / SUBSTEP).ceil().max(1.0);
                for part in 0..parts as usize {
                    let shares = [part as f64, part as f64 + 1.0].map(|parts_done| parts_done / parts);
                    let between = SingleTrackInput { F_x: F_x.mean(shares), delta: delta.mean(shares) };
                    state = car.advance(&state, &between, h / parts, SUBSTEP);
                }
            }
            let a_y = car.evaluate(&state, &input).a_y;
            for (column, value) in columns.iter_mut().zip([state.v_x, state.v_y, state.r, a_y]) {
                column.push(value);
            }
        }
        all.append_recording(recording);
    }
    let measured = [&all.v_x, &all.v_y, &all.r, &all.a_y];
    let still = vec![0.0; all.len()];
    let size = measured.map(|column| rmse(column, &still));
    let off: [f64; 4] = std::array::from_fn(|i| rmse(&columns[i], measured[i]));
    let over = |a: &[f64; 4], b: &[f64; 4]| SensorValues::from(std::array::from_fn(|i| a[i] / b[i]));
    OpenLoopReplay {
        window: [all.t.first(), all.t.last()].map(|t| t.copied().unwrap_or(f64::NAN)),
        rmse: off.into(),
        normalised: over(&off, &size),
        floor: over(&noise.sensor, &size),
        in_noise: over(&off, &noise.sensor),
        columns,
    }
}
