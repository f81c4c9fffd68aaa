//! Simulates logs of twelve cars without a mistake: steering that moves between rows or is held, relaxation, downforce, any friction.
#![allow(non_snake_case, dead_code, reason = "symbols as in vehicle dynamics; each user needs a part")]

use std::f64::consts::TAU;

use drive_doctor::CarData;
use drive_inference::Drive;
use rand::{RngExt, SeedableRng};
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64Mcg;
use tire::MagicFormula;
use vehicle::{Aerodynamics, G, PlanarState, SingleTrackCar, SingleTrackInput, VehicleBody};

/// Step of the integration [s].
const FINE: f64 = 1e-3;
/// Period of the driver, who steers anew after it [s].
const DRIVER: f64 = 0.01;

/// A car that is driven.
pub struct TestCar {
    pub name: &'static str,
    body: VehicleBody,
    /// Peak friction of both axles [-].
    mu: [f64; 2],
    /// Cornering stiffness over load of both axles [1/rad].
    stiffness: [f64; 2],
    /// Area times the coefficients of downforce of both axles [m²].
    pressed_area: [f64; 2],
    /// Relaxation length of the tires [m].
    relaxation: f64,
    /// Lowest and highest speed [m/s].
    speeds: [f64; 2],
}

/// How a car is driven and recorded.
#[derive(Clone, Copy)]
pub struct Manner {
    /// Share of the tires' friction that the driver asks for.
    pub effort: f64,
    /// Time constant of the steering [s]; 0 where it is held over rows.
    pub steering_lag: f64,
    /// Distance of rows [s].
    pub row: f64,
    /// Noise of the sensors, as a multiple of that of good ones.
    pub noise: f64,
    /// Whether the logger writes channels in the steps of a vehicle bus.
    pub is_rounded: bool,
    /// Whether tires have other curves than those of [`CARS`], drawn by the seed.
    pub has_other_tires: bool,
}

impl Manner {
    /// Moderate driving with steering that moves between rows and good sensors.
    pub const USUAL: Self = Self {
        effort: 0.7,
        steering_lag: 0.1,
        row: 0.01,
        noise: 1.0,
        is_rounded: false,
        has_other_tires: false,
    };
}

const fn body(m: f64, I_zz: f64, l_f: f64, l_r: f64, h: f64) -> VehicleBody {
    VehicleBody { m, I_zz, l_f, l_r, h }
}

const fn car(
    name: &'static str,
    body: VehicleBody,
    mu: [f64; 2],
    stiffness: [f64; 2],
    speeds: [f64; 2],
) -> TestCar {
    TestCar { name, body, mu, stiffness, pressed_area: [0.0; 2], relaxation: 0.0, speeds }
}

/// The cars.
pub const CARS: [TestCar; 12] = [
    car("kart", body(160.0, 22.0, 0.55, 0.5, 0.22), [1.3, 1.25], [22.0, 26.0], [8.0, 18.0]),
    car("junior kart", body(185.0, 30.0, 0.6, 0.47, 0.24), [1.0, 1.0], [16.0, 20.0], [7.0, 15.0]),
    TestCar {
        pressed_area: [1.3, 1.7],
        relaxation: 0.15,
        ..car("formula", body(540.0, 560.0, 1.55, 1.25, 0.28), [1.6, 1.7], [28.0, 32.0], [18.0, 55.0])
    },
    TestCar {
        relaxation: 0.2,
        ..car("slicks", body(900.0, 1150.0, 1.35, 1.2, 0.4), [1.75, 1.9], [30.0, 34.0], [15.0, 45.0])
    },
    TestCar {
        relaxation: 0.25,
        ..car("hatchback", body(1150.0, 1700.0, 1.0, 1.55, 0.52), [0.95, 0.95], [15.0, 18.0], [12.0, 32.0])
    },
    car("ice", body(1150.0, 1650.0, 1.2, 1.35, 0.5), [0.3, 0.32], [9.0, 10.0], [8.0, 20.0]),
    TestCar {
        relaxation: 0.3,
        ..car("snow", body(1500.0, 2500.0, 1.3, 1.4, 0.55), [0.45, 0.45], [10.0, 12.0], [10.0, 25.0])
    },
    TestCar {
        pressed_area: [0.4, 0.8],
        relaxation: 0.3,
        ..car("GT", body(1280.0, 1900.0, 1.35, 1.3, 0.42), [1.45, 1.5], [24.0, 28.0], [18.0, 60.0])
    },
    TestCar {
        relaxation: 0.4,
        ..car("saloon", body(1650.0, 2900.0, 1.4, 1.5, 0.55), [1.0, 1.05], [16.0, 20.0], [12.0, 36.0])
    },
    TestCar {
        relaxation: 0.5,
        ..car("estate", body(1950.0, 3700.0, 1.35, 1.6, 0.6), [0.85, 0.9], [14.0, 18.0], [12.0, 34.0])
    },
    TestCar {
        relaxation: 0.6,
        ..car("van", body(2800.0, 6200.0, 1.6, 1.9, 0.85), [0.8, 0.82], [11.0, 15.0], [10.0, 28.0])
    },
    TestCar {
        relaxation: 0.1,
        ..car("rear heavy", body(1020.0, 1100.0, 1.5, 0.95, 0.42), [1.15, 1.3], [18.0, 27.0], [14.0, 40.0])
    },
];

/// Tires on the way of their slips: σ dα'/dt + v α' = v α.
struct RelaxedCar {
    car: SingleTrackCar,
    length: f64,
    slips: [f64; 2],
}

impl RelaxedCar {
    fn advance(&mut self, state: &PlanarState, input: &SingleTrackInput) -> PlanarState {
        if self.length > 0.0 {
            let slips = self.car.body.slip_angles(state.v_x, state.v_y, state.r, input.delta);
            let share = 1.0 - (-state.v_x * FINE / self.length).exp();
            for (slip, now) in self.slips.iter_mut().zip(slips) {
                *slip += share * (now - *slip);
            }
            // A shift of the curve makes the slip of the motion that of the tire.
            self.car.tire_f.S_h = self.slips[0] - slips[0];
            self.car.tire_r.S_h = self.slips[1] - slips[1];
        }
        self.car.advance(state, input, FINE, FINE)
    }
}

/// A sum of waves in time, of peak 1.
struct Waves(Vec<[f64; 3]>);

impl Waves {
    /// Waves of random frequencies between these [Hz].
    fn random(count: usize, [low, high]: [f64; 2], rng: &mut Pcg64Mcg) -> Self {
        let ratio: f64 = high / low;
        let wave = |k: usize| {
            let place = (k as f64 + rng.random::<f64>()) / count as f64;
            let frequency = low * ratio.powf(place);
            [frequency, rng.random::<f64>() * TAU, 1.0 / (1.0 + frequency)]
        };
        Self((0..count).map(wave).collect())
    }

    fn value(&self, t: f64) -> f64 {
        let total: f64 = self.0.iter().map(|[_, _, weight]| weight).sum();
        let waves =
            self.0.iter().map(|[frequency, phase, weight]| weight * (TAU * frequency * t + phase).sin());
        1.6 * waves.sum::<f64>() / total
    }
}

/// Writes channels in the steps of a vehicle bus: 0.01 m/s, 0.1 deg/s, 0.02 m/s2 and 0.04 deg.
fn round(log: &mut Drive) {
    let channels = [
        (&mut log.v_x, 0.01),
        (&mut log.v_y, 0.01),
        (&mut log.r, 0.1_f64.to_radians()),
        (&mut log.a_y, 0.02),
        (&mut log.delta, 0.04_f64.to_radians()),
    ];
    for (column, step) in channels {
        column.iter_mut().for_each(|value| *value = (*value / step).round() * step);
    }
}

/// What the sensors record in 60 s, with what is known of the car.
pub fn clean(test: &TestCar, manner: Manner, seed: u64) -> (Drive, CarData) {
    let mut rng = Pcg64Mcg::seed_from_u64(seed);
    let TestCar { body, mu, stiffness, pressed_area: [front, rear], relaxation, speeds, .. } = *test;
    let mut tire = |axle: usize| {
        let [mut C, mut E, mut K] = [1.35 + 0.15 * axle as f64, -0.4, stiffness[axle]];
        if manner.has_other_tires {
            C += rng.random_range(-0.15..0.25);
            E += rng.random_range(-1.2..1.0);
            K *= rng.random_range(0.7..1.3);
        }
        MagicFormula { B: K / (C * mu[axle]), C, D: mu[axle], E, ..MagicFormula::default() }
    };
    let aero = Aerodynamics { area: 1.0, C_d: 0.5, C_lf: front, C_lr: rear, ..Aerodynamics::default() };
    let [tire_f, tire_r] = [tire(0), tire(1)];
    let car = SingleTrackCar { body, aero, tire_f, tire_r, ..SingleTrackCar::default() };
    let mut car = RelaxedCar { car, length: relaxation, slips: [0.0; 2] };
    let (turns, pace) = (Waves::random(7, [0.08, 1.3], &mut rng), Waves::random(3, [0.015, 0.06], &mut rng));
    let mut state = PlanarState { v_x: 0.5 * (speeds[0] + speeds[1]), ..PlanarState::default() };
    let mut input = SingleTrackInput::default();
    let (mut wheel, mut log) = (0.0, Drive::default());
    let (rows, driver) = ((manner.row / FINE).round() as usize, (DRIVER / FINE).round() as usize);
    // The driver of a log whose steering is held moves it row by row.
    let driver = if manner.steering_lag == 0.0 { rows } else { driver };
    // The driver, a controller, has the noise of the sensors.
    let mut seen = [state.v_x, 0.0];
    let noise = [0.03, 0.01, 0.003, 0.06].map(|std| manner.noise * std * rng.random_range(0.5..1.5));
    for k in 0..60_000_usize {
        let t = k as f64 * FINE;
        if k > 0 {
            state = car.advance(&state, &input);
        }
        if k % rows == 0 {
            let now = car.car.evaluate(&state, &input);
            let mut e = |std: f64| -> f64 { std * Distribution::<f64>::sample(&StandardNormal, &mut rng) };
            log.t.push(t);
            log.v_x.push(state.v_x + e(noise[0]));
            log.v_y.push(state.v_y + e(noise[1]));
            log.r.push(state.r + e(noise[2]));
            seen = [log.v_x[log.v_x.len() - 1], log.r[log.r.len() - 1]];
            log.a_y.push(now.a_y + e(noise[3]));
            log.F_x.push(input.F_x);
            log.delta.push(input.delta);
        }
        let speed =
            0.5 * (speeds[0] + speeds[1]) + 0.5 * (speeds[1] - speeds[0]) * pace.value(t).clamp(-1.0, 1.0);
        if k % driver == 0 {
            let grip = mu[0].min(mu[1]) * (G + aero.downforce(state.v_x).iter().sum::<f64>() / body.m);
            let wanted = manner.effort * grip / state.v_x * turns.value(t) * (t / 2.0).min(1.0);
            let bend = 1.0 / stiffness[0] - 1.0 / stiffness[1];
            let steady = wanted * (body.wheelbase() / state.v_x + bend * state.v_x / G);
            let rolling = (state.v_y + body.l_f * state.r).atan2(state.v_x);
            // No driver steers far beyond the peak.
            let most = 3.5 * mu[0] / stiffness[0];
            wheel = (steady + body.wheelbase() / state.v_x * (wanted - seen[1]))
                .clamp(rolling - most, rolling + most)
                .clamp(-0.5, 0.5);
            input.F_x = (body.m * 0.8 * (speed - seen[0]) + aero.drag(state.v_x))
                .clamp(-0.25 * grip * body.m, 0.25 * grip * body.m);
        }
        input.delta += match manner.steering_lag {
            0.0 => wheel - input.delta,
            lag => (wheel - input.delta) * FINE / lag,
        };
    }
    if manner.is_rounded {
        round(&mut log);
    }
    (log, CarData { axles: Some([body.l_f, body.l_r]), m: Some(body.m), aero: Some(aero), wheelbase: None })
}
