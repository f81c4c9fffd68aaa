//! Turns smoothed states into what tires have to explain: slip angles, loads, forces and yaw moments, before and after each
//! change of the inputs.

use kalman::SmoothedRecording;
use nalgebra::RowSVector;
use preparation::samples::CurveSamples;
use tire_inference::axles::{Axle, Axles};
use vehicle::{NominalCar, SLIP_SPEED_FLOOR, SingleTrackCar, SingleTrackInput};

use crate::smoothing::nominal_car;
use preparation::Drive;

/// What is known at one instant under one input.
#[derive(Clone, Copy, Debug)]
pub struct InputResponse {
    /// Front slip angle [rad].
    pub alpha_f: f64,
    /// Loads of the front and the rear axle [N].
    pub F_z: [f64; 2],
    /// Cosine of the steering angle.
    pub cos: f64,
    /// Lateral part of the braking force of the steered wheels [N].
    pub braking: f64,
}

/// What is known at one sample.
#[derive(Clone, Copy, Debug)]
pub struct RegressionPoint {
    /// Under the input that acted until this sample.
    pub before: InputResponse,
    /// Under the input that acts from this sample on; that of the last one is the one before.
    pub after: InputResponse,
    /// Rear slip angle [rad].
    pub alpha_r: f64,
    /// Time until the next sample [s].
    pub h: f64,
    /// Measured lateral acceleration [m/s²] and yaw rate [rad/s].
    pub measured: [f64; 2],
    /// Lateral acceleration of the smoothed state [m/s²] and its variance.
    pub a_y: [f64; 2],
    /// Lateral forces of both axles of the smoothed state [N], across the car, and their variances.
    pub forces: [[f64; 2]; 2],
    /// What three odd residual terms multiply: side-slip angle v_y/v_x [rad], curvature r/v_x [1/m], v_x v_y [m²/s²].
    pub odd: [f64; 3],
}

/// The points of a recording.
pub fn regression_points(
    car: &SingleTrackCar,
    recording: &Drive,
    smoothed: &SmoothedRecording<6>,
) -> Vec<RegressionPoint> {
    let nominal = nominal_car(car);
    let last = recording.len() - 1;
    let point = |k: usize| {
        let x = &smoothed.states[k].mean;
        let body = &car.body;
        let v = x[0].max(SLIP_SPEED_FLOOR);
        let turned = ((x[1] + body.l_f * x[2]) / v).atan();
        let side =
            |k: usize| instant_under_input(car, [x[0], x[3]], turned, recording.F_x[k], recording.delta[k]);
        let next = (k + 1).min(last);
        RegressionPoint {
            before: side(k),
            after: side(next),
            alpha_r: -((x[1] - body.l_r * x[2]) / v).atan(),
            h: recording.t[next] - recording.t[k],
            measured: [recording.a_y[k], recording.r[k]],
            a_y: accelerations_under_inputs(&nominal, recording, smoothed, k),
            forces: axle_forces_under_inputs(&nominal, recording, smoothed, k),
            odd: [x[1] / v, x[2] / v, x[0] * x[1]],
        }
    };
    (0..recording.len()).map(point).collect()
}

/// Slip angles and friction coefficients of both axles as the smoothed states have them, to be seen: the coefficients lag where
/// forces change fast.
pub fn friction_samples(points: &[Vec<RegressionPoint>]) -> Axles<CurveSamples> {
    let mut axles = Axles::<CurveSamples>::default();
    for point in points.iter().flatten() {
        let InputResponse { alpha_f, F_z, cos, braking } = point.before;
        let [front, rear] = point.forces.map(|[force, _]| force);
        let [load_f, load_r] = F_z;
        let front = (alpha_f, (front - braking) / cos, load_f);
        let sides = Axles { front, rear: (point.alpha_r, rear, load_r) };
        for axle in Axle::ALL {
            let (slip, force, load) = sides[axle];
            // An axle in the air has no coefficient.
            if load > 0.0 {
                axles[axle].push(slip, force / load, 1.0);
            }
        }
    }
    axles
}

fn instant_under_input(
    car: &SingleTrackCar,
    [v_x, xi_x]: [f64; 2],
    turned: f64,
    F_x: f64,
    delta: f64,
) -> InputResponse {
    // ξ_x holds drag and the steered tires' resistance, so this is m a_x.
    let F_long = F_x + xi_x;
    let [F_xf, _] = car.split_force(SingleTrackInput { F_x, delta }.F_x);
    let (sin, cos) = delta.sin_cos();
    let F_z = car.body.axle_loads(car.aero.downforce(v_x), F_long, 0.0, 0.0);
    InputResponse { alpha_f: delta - turned, F_z, cos, braking: F_xf * sin }
}

fn accelerations_under_inputs(
    car: &NominalCar,
    recording: &Drive,
    smoothed: &SmoothedRecording<6>,
    k: usize,
) -> [f64; 2] {
    let state = &smoothed.states[k];
    let H: RowSVector<f64, 6> = car.measurement_jacobian(&state.mean).row(3).into_owned();
    let a_y = car.measurement(&state.mean, recording.delta[k])[3];
    [a_y, (H * state.cov * H.transpose())[0]]
}

/// From the lateral force S and the yaw moment M: front (l_r S + M)/L, rear (l_f S − M)/L.
fn axle_forces_under_inputs(
    car: &NominalCar,
    recording: &Drive,
    smoothed: &SmoothedRecording<6>,
    k: usize,
) -> [[f64; 2]; 2] {
    let state = &smoothed.states[k];
    let x = &state.mean;
    let S = car.m * car.measurement(x, recording.delta[k])[3];
    let M = car.I_zz * car.state_derivative(x, recording.F_x[k], recording.delta[k])[2];
    let A = car.state_jacobian(x);
    let by_S = car.measurement_jacobian(x).row(3) * car.m;
    let by_M = A.row(2) * car.I_zz;
    let L = car.l_f + car.l_r;
    [(car.l_r, 1.0), (car.l_f, -1.0)].map(|(lever, sign)| {
        let by: RowSVector<f64, 6> = (by_S * lever + by_M * sign) / L;
        [(lever * S + sign * M) / L, (by * state.cov * by.transpose())[0]]
    })
}
