//! Simulates a car like the 250 LM with the noise of its log, and makes errors of sensors in it on purpose.
#![allow(non_snake_case, dead_code, reason = "symbols as in vehicle dynamics; each user needs a part")]

use drive_inference::{Drive, Tires};
use preparation::{Interpolation, SystematicError};
use rand::{RngExt, SeedableRng};
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64Mcg;
use tire_inference::parameters::TireParameters;
use vehicle::{PlanarState, SingleTrackCar, SingleTrackInput, VehicleBody};

use crate::drive::{STEP, on_tires};
use crate::real_log::RealLog;

/// The car (docs/identification.md).
pub fn car() -> SingleTrackCar {
    let body = VehicleBody { m: 982.0, I_zz: 1605.0, l_f: 1.33, l_r: 1.07, h: 0.45 };
    SingleTrackCar { body, ..SingleTrackCar::default() }
}

/// Tires near those of a least-squares fit to the log, with more grip behind, so that no noise of a driver spins the car.
pub const TIRES: Tires = Tires {
    front: TireParameters { B: 13.4, C: 1.13, D: 1.11, E: 0.0 },
    rear: TireParameters { B: 10.2, C: 1.7, D: 1.2, E: 0.0 },
};

/// Wanted speed [m/s] and yaw rate [rad/s], and the steering that a driver begins with [rad].
struct Course {
    v_x: Vec<f64>,
    r: Vec<f64>,
    delta: Vec<f64>,
}

/// The mean over a tenth of a second to both sides.
fn calm(column: &[f64]) -> Vec<f64> {
    let reach = 10;
    let at = |k: usize| {
        let part = &column[k.saturating_sub(reach)..(k + reach + 1).min(column.len())];
        part.iter().sum::<f64>() / part.len() as f64
    };
    (0..column.len()).map(at).collect()
}

/// Rows that are driven: half of the log of 330 s.
const ROWS: usize = 16_500;

/// That of the log; turns to both sides at changing speed without it.
fn course() -> Course {
    if let Some(log) = RealLog::read("revs_250lm.csv") {
        let column = |title| calm(&log.column(title, 1.0)[..ROWS]);
        let [v_x, r, delta] = ["vx_mps", "yaw_rate_radps", "delta_rad"].map(column);
        return Course { v_x, r, delta };
    }
    let time = || (0..ROWS).map(|k| k as f64 * STEP);
    let v_x: Vec<f64> = time().map(|t| 34.0 + 14.0 * (0.2 * t).sin()).collect();
    let a_y = |t: f64| {
        let slow = (0.31 * t).sin() + 0.7 * (0.83 * t + 1.0).sin() + 0.5 * (2.1 * t + 2.0).sin();
        5.0 * slow + 1.2 * (5.0 * t).sin()
    };
    let r: Vec<f64> = time().zip(&v_x).map(|(t, v_x)| a_y(t) / v_x).collect();
    let delta = r.iter().zip(&v_x).map(|(r, v_x)| 2.4 * r / v_x).collect();
    Course { v_x, r, delta }
}

/// What true sensors record while a driver follows the course.
pub fn clean(tires: &Tires) -> Drive {
    let Course { v_x, r, delta } = course();
    let car = on_tires(&car(), tires);
    let mut state = PlanarState { v_x: v_x[0], r: r[0], ..PlanarState::default() };
    let mut drive = Drive::default();
    let mut input = SingleTrackInput::default();
    for k in 0..v_x.len() {
        // As a drive has it: what sensors show at the end of a step, and the inputs that were held during it.
        let a_y = car.evaluate(&state, &input).a_y;
        let row = [k as f64 * STEP, state.v_x, state.v_y, state.r, a_y, input.F_x, input.delta];
        let Drive { t, v_x: of_v_x, v_y, r: of_r, a_y, F_x, delta: of_delta, .. } = &mut drive;
        for (column, value) in [t, of_v_x, v_y, of_r, a_y, F_x, of_delta].into_iter().zip(row) {
            column.push(value);
        }
        let next = (k + 1).min(v_x.len() - 1);
        let wanted = (v_x[next] - v_x[k]) / STEP + 2.0 * (v_x[k] - state.v_x);
        // A driver takes back what the car turns too much.
        let steered = delta[k] + 2.0 * car.body.wheelbase() / state.v_x * (r[k] - state.r);
        input = SingleTrackInput { F_x: car.body.m * (wanted - state.v_y * state.r), delta: steered };
        state = car.advance(&state, &input, STEP, 0.005);
    }
    drive
}

/// Noise of a channel: white, and parts with a standard deviation and a time [s] that they last.
struct Noise {
    white: f64,
    lasting: &'static [[f64; 2]],
    /// Share of rows that repeat the one before.
    repeats: f64,
}

/// Those of v_x, v_y, r, a_y and delta in the log of the 250 LM: what is left above 5 Hz, and of a_y what a_y − v_x r − v_y' keeps
/// besides its offset and scale, which is the bank of the road.
const NOISES: [Noise; 5] = [
    Noise { white: 0.0095, lasting: &[[0.008, 0.03]], repeats: 0.0 },
    Noise { white: 0.012, lasting: &[[0.012, 0.03], [0.03, 1.5]], repeats: 0.0 },
    Noise { white: 0.0042, lasting: &[[0.003, 0.03]], repeats: 0.12 },
    Noise { white: 0.95, lasting: &[[0.4, 0.02], [0.2, 3.0]], repeats: 0.12 },
    Noise { white: 0.0003, lasting: &[], repeats: 0.0 },
];

impl Noise {
    fn add(&self, column: &mut [f64], rng: &mut Pcg64Mcg) {
        let mut normal = |std: f64| -> f64 {
            let e: f64 = StandardNormal.sample(rng);
            std * e
        };
        column.iter_mut().for_each(|value| *value += normal(self.white));
        for [std, time] in self.lasting {
            let stays = (-STEP / time).exp();
            let mut part = normal(*std);
            for value in column.iter_mut() {
                *value += part;
                part = stays * part + normal(std * (1.0 - stays * stays).sqrt());
            }
        }
        for k in 1..column.len() {
            if rng.random::<f64>() < self.repeats {
                column[k] = column[k - 1];
            }
        }
    }
}

/// Errors that were made: a lever arm of v_y [m], the delay of a channel [s], an offset of the steering [rad].
#[derive(Clone, Copy, Debug)]
pub struct Injected {
    pub lever: f64,
    pub late: SystematicError,
    pub delay: f64,
    pub offset: f64,
}

/// Channels that are late in turn.
pub const LATE: [SystematicError; 4] = [
    SystematicError::SideslipDelay,
    SystematicError::YawRateDelay,
    SystematicError::AccelerationDelay,
    SystematicError::SteeringDelay,
];

/// How far off an error may be found: 0.05 m, 4 ms, 0.05 deg.
pub fn tolerance(cause: SystematicError) -> f64 {
    match cause {
        SystematicError::SideslipLever => 0.05,
        SystematicError::SteeringOffset => 0.05_f64.to_radians(),
        _ => 0.004,
    }
}

impl Injected {
    /// What was made.
    pub fn causes(&self) -> [SystematicError; 3] {
        [SystematicError::SideslipLever, self.late, SystematicError::SteeringOffset]
    }

    /// By how much.
    pub fn values(&self) -> [f64; 3] {
        [self.lever, self.delay, self.offset]
    }

    /// Errors of a size and sign by chance, about 0.5 m, 40 ms and 0.5 deg.
    pub fn new(seed: u64) -> Self {
        let mut rng = Pcg64Mcg::seed_from_u64(seed ^ 0x1e4e);
        let mut signed = |size: f64| {
            let sign = if rng.random::<bool>() { 1.0 } else { -1.0 };
            sign * size * rng.random_range(0.5..1.5)
        };
        let late = LATE[seed as usize % LATE.len()];
        Self { lever: signed(0.5), late, delay: signed(0.04), offset: signed(0.5_f64.to_radians()) }
    }

    /// A log with these errors and the noise of the 250 LM.
    pub fn log(&self, clean: &Drive, seed: u64) -> Drive {
        let mut drive = clean.clone();
        for (v_y, r) in drive.v_y.iter_mut().zip(&clean.r) {
            *v_y += self.lever * r;
        }
        let column = match self.late {
            SystematicError::SideslipDelay => &mut drive.v_y,
            SystematicError::YawRateDelay => &mut drive.r,
            SystematicError::AccelerationDelay => &mut drive.a_y,
            _ => &mut drive.delta,
        };
        let (first, last) = (clean.t[0], clean.t[clean.t.len() - 1]);
        let before: Vec<f64> = clean.t.iter().map(|t| (t - self.delay).clamp(first, last)).collect();
        *column = Interpolation::Linear.resample(&clean.t, column, &before);
        drive.delta.iter_mut().for_each(|delta| *delta += self.offset);
        let mut rng = Pcg64Mcg::seed_from_u64(seed);
        let Drive { v_x, v_y, r, a_y, delta, .. } = &mut drive;
        for (noise, column) in NOISES.iter().zip([v_x, v_y, r, a_y, delta]) {
            noise.add(column, &mut rng);
        }
        drive
    }
}
