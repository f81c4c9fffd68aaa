//! A car with known tires on a known manoeuvre, and its sensors.

use vehicle::{
    Aerodynamics, MagicFormula, PlanarState, SingleTrackCar, SingleTrackEvaluation, SingleTrackInput,
};

use crate::{Car, DriveLog, OutlierRejection, PreparationPipeline, SlipResampling};

/// A car that the pipeline must not confuse with its defaults: downforce, and unlike axles.
pub fn car() -> SingleTrackCar {
    let aero = Aerodynamics { C_lf: 0.5, C_lr: 0.9, ..Aerodynamics::default() };
    let tire_f = MagicFormula { B: 15.0, C: 1.5, D: 1.4, E: 0.3, S_h: 0.002, S_v: 0.01 };
    let tire_r = MagicFormula { B: 18.0, C: 1.6, D: 1.55, E: 0.5, S_h: -0.001, S_v: 0.0 };
    SingleTrackCar { aero, tire_f, tire_r, ..SingleTrackCar::default() }
}

/// That car without what makes left differ from right.
pub fn symmetric() -> SingleTrackCar {
    let mut vehicle = car();
    (vehicle.tire_f.S_h, vehicle.tire_f.S_v, vehicle.tire_r.S_h) = (0.0, 0.0, 0.0);
    vehicle
}

/// A car's settings, without anything that looks at the points or takes some away.
pub fn pipeline(vehicle: &SingleTrackCar) -> PreparationPipeline {
    let car = Car { body: vehicle.body, aero: vehicle.aero, ..Car::default() };
    let outliers = OutlierRejection { reject: false, ..OutlierRejection::default() };
    PreparationPipeline {
        car,
        outliers,
        slip_resampling: SlipResampling::Off,
        drop_held: false,
        ..PreparationPipeline::default()
    }
}

/// One instant of a simulated drive.
pub struct Instant {
    pub time: f64,
    pub state: PlanarState,
    pub input: SingleTrackInput,
    pub motion: SingleTrackEvaluation,
}

/// Steering and force of a double lane change on the limit, which then is braked and driven out of, and left and right
/// go on at ever higher frequency: with slip beyond the peak at the front and large yaw accelerations.
fn command(t: f64) -> SingleTrackInput {
    let lane = |start: f64| {
        let u = (t - start) / 1.6;
        if (0.0..1.0).contains(&u) {
            (std::f64::consts::TAU * u).sin() * (1.0 - (2.0 * u - 1.0).powi(6))
        } else {
            0.0
        }
    };
    let weave = if t > 8.0 { (2.0 + 0.25 * (t - 8.0)) * (t - 8.0) } else { 0.0 };
    let delta = 0.16 * (lane(2.0) - lane(4.2)) + 0.05 * weave.sin() * (1.0 + 0.5 * (0.7 * t).sin());
    let F_x = 900.0 + 2400.0 * (0.9 * t).sin();
    SingleTrackInput { F_x, delta }
}

/// The drive from 30 m/s on, for so long, every 2.5 ms; mirrored if `side` is −1.
pub fn simulate(vehicle: &SingleTrackCar, seconds: f64, side: f64) -> Vec<Instant> {
    let h = 0.0025;
    let mut state = PlanarState { v_x: 30.0, ..PlanarState::default() };
    (0..(seconds / h) as usize)
        .map(|i| {
            let time = i as f64 * h;
            let SingleTrackInput { F_x, delta } = command(time);
            let input = SingleTrackInput { F_x, delta: side * delta };
            let now = Instant { time, state, input, motion: vehicle.evaluate(&state, &input) };
            // The command moves on within a step, too: constant over it, accelerations would be those of a staircase.
            let middle = command(time + 0.5 * h);
            let held = SingleTrackInput { F_x: middle.F_x, delta: side * middle.delta };
            state = vehicle.advance(&state, &held, h, h);
            now
        })
        .collect()
}

/// What the sensors show: every signal at its own rate, `every` so many instants: velocities 200 Hz, accelerations and
/// yaw rate 400 Hz, steering 100 Hz, shifted in phase.
pub fn record(drive: &[Instant]) -> DriveLog<'static> {
    let mut recording = DriveLog::default();
    let mut signal = |name: &str, first: usize, every: usize, of: &dyn Fn(&Instant) -> f64| {
        let rows = || drive.iter().skip(first).step_by(every);
        recording.insert(name, rows().map(|i| i.time).collect(), rows().map(of).collect());
    };
    signal("v_x", 0, 2, &|i| i.state.v_x);
    signal("v_y", 0, 2, &|i| i.state.v_y);
    signal("a_x", 0, 1, &|i| i.motion.a_x);
    signal("a_y", 0, 1, &|i| i.motion.a_y);
    signal("r", 0, 1, &|i| i.state.r);
    signal("delta", 1, 4, &|i| i.input.delta);
    recording
}
