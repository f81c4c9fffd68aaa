//! Drives the car in a closed loop: an observer with a wrong nominal car, a controller that inverts it, noisy sensors.
#![allow(non_snake_case, dead_code, reason = "symbols as in vehicle dynamics; each user needs a part")]

use std::f64::consts::{PI, TAU};

use drive_inference::{Drive, Tires};
use kalman::{Gaussian, discretise, measurement_update, predict};
use nalgebra::{SMatrix, SVector};
use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64Mcg;
use vehicle::{MagicFormula, NominalCar, PlanarState, SingleTrackCar, SingleTrackInput};

/// Period of the loop [s].
pub const STEP: f64 = 0.01;

/// Wanted speed [m/s] and yaw rate [rad/s] over time.
pub type Reference = Vec<[f64; 2]>;

/// Noises of v_x, v_y, r and a_y.
pub const CLEAN: [f64; 4] = [0.1, 0.00316, 0.00316, 0.00316];
pub const USUAL: [f64; 4] = [0.05, 0.01, 0.01, 0.1];
pub const HARSH: [f64; 4] = [0.05, 0.05, 0.005, 0.1];

fn samples(seconds: f64) -> impl Iterator<Item = f64> {
    (0..(seconds / STEP).round() as usize).map(|k| k as f64 * STEP)
}

/// A multisine of the given peak with phases after Schroeder, faded in and out.
fn multisine(t: f64, duration: f64, peak: f64, turn: f64) -> f64 {
    let parts = [(0.25, 1.0), (0.45, 0.8), (0.7, 0.6), (1.0, 0.5), (1.4, 0.35)];
    let wave = |t: f64| -> f64 {
        let part =
            |(n, (f, w)): (usize, &(f64, f64))| w * (TAU * f * t + turn - PI * (n * n) as f64 / 5.0).sin();
        parts.iter().enumerate().map(part).sum()
    };
    let highest = samples(duration).map(|t| wave(t).abs()).fold(0.0, f64::max);
    let fade = (t.min(duration - t) / 0.5).clamp(0.0, 1.0);
    peak * fade * wave(t) / highest
}

/// At each speed: 4 s to reach it, multisines of 0.9 g and 1.7 g for `long` seconds each, and up to 40 m/s flicks of 1.9 g for 8 s
/// in which the speed reference is switched, so that load transfer takes first the rear, then the front axle past its peak.
pub fn limit(speeds: &[f64], long: f64) -> Reference {
    limit_share(speeds, long, 1.0)
}

/// The same with a share of these accelerations.
pub fn limit_share(speeds: &[f64], long: f64, share: f64) -> Reference {
    let g = share * vehicle::G;
    let mut reference = Vec::new();
    let mut before = speeds[0];
    for &v in speeds {
        reference.extend(samples(4.0).map(|t| [before + (v - before) * (t / 3.5).min(1.0), 0.0]));
        for (share, turn) in [(0.9, 0.3), (1.7, 1.7)] {
            reference.extend(samples(long).map(|t| [v, multisine(t, long, share * g / v, turn + v)]));
        }
        if v <= 40.0 {
            reference.extend(samples(8.0).map(|t| {
                let flick = (3.0 * (TAU * t / 4.0).sin()).tanh() * ((8.0 - t) / 0.5).min(1.0);
                [v + 3.0 * (PI * t + 0.8 * PI).sin().signum(), 1.9 * g / v * flick]
            }));
        }
        before = v;
    }
    reference
}

/// A heading chirp at changing speed that stays far below the limits of the tires.
pub fn chirp(seconds: f64) -> Reference {
    let speed = |t: f64| 45.0 + 35.0 * (TAU * t / 100.0 - 0.5 * PI).sin();
    let heading = |t: f64| 3.5 / speed(t) * (TAU * (0.001 * t + 0.1 * 0.799 / 150.0 * t * t)).sin();
    samples(seconds).map(|t| [speed(t), (heading(t + STEP) - heading(t)) / STEP]).collect()
}

/// The car on these tires.
pub fn on_tires(car: &SingleTrackCar, tires: &Tires) -> SingleTrackCar {
    car.with_tires(tires.front.to_magic_formula(), tires.rear.to_magic_formula())
}

struct Observer {
    car: NominalCar,
    belief: Gaussian<6>,
    Q_c: SMatrix<f64, 6, 6>,
    R: SMatrix<f64, 4, 4>,
}

impl Observer {
    fn new(car: NominalCar, v_x: f64, noise: &[f64; 4]) -> Self {
        let square = |stds: [f64; 6]| SMatrix::from_diagonal(&SVector::from(stds.map(|s| s * s)));
        Self {
            car,
            belief: Gaussian {
                mean: [v_x, 0.0, 0.0, 0.0, 0.0, 0.0].into(),
                cov: square([noise[0], noise[1], noise[2], 1e3, 1e3, 1e3]),
            },
            Q_c: square([1e-3, 1e-3, 1e-3, 300.0, 1500.0, 1500.0]),
            R: SMatrix::from_diagonal(&SVector::from(noise.map(|s| s * s))),
        }
    }

    fn step(&mut self, input: &SingleTrackInput, y: &SVector<f64, 4>) {
        let x = self.belief.mean;
        let (F, Q) = discretise(&self.car.state_jacobian(&x), &self.Q_c, STEP);
        let after = self.car.advance(&x, input.F_x, input.delta, STEP);
        let prior = predict(&self.belief, after, &F, &Q);
        let residual = y - self.car.measurement(&prior.mean, input.delta);
        let H = self.car.measurement_jacobian(&prior.mean);
        self.belief = measurement_update(&prior, &residual, &H, &self.R).expect("finite measurements").0;
    }

    /// Driving force and steering that make the nominal car with its disturbances follow the reference.
    fn command(&self, [v, r]: [f64; 2], r_next: f64) -> SingleTrackInput {
        let (car, x) = (&self.car, &self.belief.mean);
        let F_x = car.m * (4.0 * (v - x[0]) - x[1] * x[2]) - x[3];
        let moment = car.I_zz * ((r_next - r) / STEP + 12.0 * (r - x[2]));
        let delta = (moment - car.yaw_moment_without_steering(x) - x[5]) / (car.C_f * car.l_f);
        // The front axle may go past its peak, but not so far that more steering helps no longer.
        let rolling = (x[1] + car.l_f * x[2]).atan2(x[0].max(1.0));
        let delta = delta.clamp(rolling - 0.25, rolling + 0.25).clamp(-0.3, 0.3);
        SingleTrackInput { F_x: F_x.clamp(-6000.0, 6000.0), delta }
    }
}

/// A car whose slip angles may follow the motion over a length, σ dα'/dt + v α' = v α (first-order relaxation), with other effects.
struct TrueCar {
    car: SingleTrackCar,
    /// Tires at the static load, before the friction changes.
    tires: [MagicFormula; 2],
    effects: CarEffects,
    slips: [f64; 2],
    /// What acts.
    input: SingleTrackInput,
    /// Time since the start [s].
    t: f64,
}

impl TrueCar {
    /// Steps so short that the slip may be held at its lag [s].
    const SUBSTEP: f64 = 1e-4;

    /// Sub-step of actuators that lag, and of effects that act between motions [s].
    const ACTUATOR_STEP: f64 = 5e-4;

    fn new(car: &SingleTrackCar, effects: CarEffects) -> Self {
        let tires = [car.tire_f, car.tire_r];
        Self { car: *car, tires, effects, slips: [0.0; 2], input: SingleTrackInput::default(), t: 0.0 }
    }

    /// One period of the loop under a command.
    fn follow(&mut self, state: &PlanarState, command: &SingleTrackInput) -> PlanarState {
        let mut state = *state;
        let CarEffects { actuator, .. } = self.effects;
        if actuator == 0.0 {
            self.input = *command;
            if self.effects.only_relax() {
                return self.advance(&state, STEP);
            }
        }
        let share = if actuator == 0.0 { 0.0 } else { 1.0 - (-Self::ACTUATOR_STEP / actuator).exp() };
        for _ in 0..(STEP / Self::ACTUATOR_STEP).round() as usize {
            // Half of the change before and half after: the mean of the input acts.
            let [delta, F_x] = [command.delta - self.input.delta, command.F_x - self.input.F_x];
            self.input.delta += 0.5 * share * delta;
            self.input.F_x += 0.5 * share * F_x;
            self.set_friction(&state);
            state = self.advance(&state, Self::ACTUATOR_STEP);
            state.v_y += self.effects.bank_pull(state.r) * Self::ACTUATOR_STEP;
            self.t += Self::ACTUATOR_STEP;
            self.input.delta += 0.5 * share * delta;
            self.input.F_x += 0.5 * share * F_x;
        }
        state
    }

    /// Friction of both tires at the loads of a state.
    fn set_friction(&mut self, state: &PlanarState) {
        let CarEffects { load_sensitivity, friction_change: (time, factor), .. } = self.effects;
        let now = self.car.evaluate(state, &self.input);
        let rest = self.car.body.static_loads();
        let factor = if self.t >= time { factor } else { 1.0 };
        let friction =
            |D: f64, load: f64, rest: f64| D * factor * (1.0 - load_sensitivity * (load / rest - 1.0));
        self.car.tire_f.D = friction(self.tires[0].D, now.F_zf, rest[0]);
        self.car.tire_r.D = friction(self.tires[1].D, now.F_zr, rest[1]);
    }

    fn advance(&mut self, state: &PlanarState, h: f64) -> PlanarState {
        let input = &self.input.clone();
        let length = self.effects.relaxation;
        if length == 0.0 {
            return self.car.advance(state, input, h, 0.002);
        }
        let mut state = *state;
        for _ in 0..(h / Self::SUBSTEP).round() as usize {
            let PlanarState { v_x, v_y, r, .. } = state;
            let now = self.car.body.slip_angles(v_x, v_y, r, input.delta);
            let share = 1.0 - (-v_x * Self::SUBSTEP / length).exp();
            for (slip, now) in self.slips.iter_mut().zip(now) {
                *slip += share * (now - *slip);
            }
            // A shift of the curve that makes the slip of the motion that of the tire.
            self.car.tire_f.S_h = self.slips[0] - now[0];
            self.car.tire_r.S_h = self.slips[1] - now[1];
            state = self.car.advance(&state, input, Self::SUBSTEP, Self::SUBSTEP);
        }
        state
    }
}

/// What sensors record while a car follows a reference.
pub fn drive(car: &SingleTrackCar, reference: &Reference, noise: &[f64; 4], seed: u64) -> Drive {
    drive_with_effects(car, reference, noise, seed, CarEffects::default())
}

/// What a true car has that curves of tires do not tell.
#[derive(Clone, Copy, Debug)]
pub struct CarEffects {
    /// Relaxation length of the tires [m].
    pub relaxation: f64,
    /// Time constant with which steering and force follow the command [s]; 0 where a command acts at once, until the next.
    pub actuator: f64,
    /// Bank of the road to the inside, in left turns [rad].
    pub bank_left: f64,
    /// Relative fall of the friction per relative rise of the load.
    pub load_sensitivity: f64,
    /// Time from which on the friction is a factor of that before [s].
    pub friction_change: (f64, f64),
}

impl Default for CarEffects {
    fn default() -> Self {
        let (relaxation, actuator, bank_left, load_sensitivity) = (0.0, 0.0, 0.0, 0.0);
        Self { relaxation, actuator, bank_left, load_sensitivity, friction_change: (f64::INFINITY, 1.0) }
    }
}

impl CarEffects {
    /// Whether nothing acts between the motions of the car.
    fn only_relax(&self) -> bool {
        self.bank_left == 0.0 && self.load_sensitivity == 0.0 && self.friction_change.0.is_infinite()
    }

    /// Acceleration to the left by the bank of a road whose inside is lower in left turns [m/s²].
    fn bank_pull(&self, r: f64) -> f64 {
        vehicle::G * self.bank_left.sin() * 0.5 * (1.0 + (r / 0.02).tanh())
    }
}

/// The same with effects of tires, actuators and road.
pub fn drive_with_effects(
    car: &SingleTrackCar,
    reference: &Reference,
    noise: &[f64; 4],
    seed: u64,
    effects: CarEffects,
) -> Drive {
    let mut rng = Pcg64Mcg::seed_from_u64(seed);
    let mut state = PlanarState { v_x: reference[0][0], ..PlanarState::default() };
    let [C_f, C_r] = car.body.static_loads().map(|load| 50.0 * load);
    let vehicle::VehicleBody { m, I_zz, l_f, l_r, .. } = car.body;
    let nominal = NominalCar { m, I_zz, l_f, l_r, C_f, C_r };
    let mut observer = Observer::new(nominal, state.v_x, noise);
    let mut input = SingleTrackInput::default();
    let mut recording = Drive::default();
    let mut true_car = TrueCar::new(car, effects);
    for k in 0..reference.len() {
        if k > 0 {
            state = true_car.follow(&state, &input);
        }
        let acting = true_car.input;
        let a_y = true_car.car.evaluate(&state, &acting).a_y;
        let mut e = || -> f64 { StandardNormal.sample(&mut rng) };
        let y = SVector::from([
            state.v_x + noise[0] * e(),
            state.v_y + noise[1] * e(),
            state.r + noise[2] * e(),
            a_y + noise[3] * e(),
        ]);
        recording.t.push(k as f64 * STEP);
        recording.v_x.push(y[0]);
        recording.v_y.push(y[1]);
        recording.r.push(y[2]);
        recording.a_y.push(y[3]);
        recording.F_x.push(acting.F_x);
        recording.delta.push(acting.delta);
        if k > 0 {
            observer.step(&input, &y);
        }
        let next = reference[(k + 1).min(reference.len() - 1)];
        input = observer.command(reference[k], next[1]);
    }
    recording
}
