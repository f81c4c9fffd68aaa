//! Drives manoeuvres in open loop with two sets of tires, and says how far apart they are.

use std::f64::consts::TAU;

use vehicle::{MagicFormula, PlanarState, SingleTrackCar, SingleTrackInput};

/// Time step of the inputs [s].
const STEP: f64 = 0.01;
/// Longest step of the integrator [s].
const SUBSTEP: f64 = 0.002;

/// A steering input at a speed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Manoeuvre {
    /// The angle rises slowly up to where the front axle slides, at 30 m/s.
    RampSteer,
    /// The angle rises within 0.15 s and stays (ISO 7401), at 27.8 m/s.
    StepSteer,
    /// One period of 0.7 Hz, held for 0.5 s at its second peak (ISO 19365), at 22.2 m/s.
    SineWithDwell,
    /// Two opposite sines of 0.5 Hz with a pause, the steering of a double lane change (ISO 3888-1), at 22.2 m/s.
    DoubleLaneChange,
}

impl Manoeuvre {
    /// All of them.
    pub const ALL: [Self; 4] =
        [Self::RampSteer, Self::StepSteer, Self::SineWithDwell, Self::DoubleLaneChange];

    /// Speed at the start [m/s].
    pub fn initial_speed(self) -> f64 {
        match self {
            Self::RampSteer => 30.0,
            Self::StepSteer => 27.8,
            Self::SineWithDwell | Self::DoubleLaneChange => 22.2,
        }
    }

    /// Duration [s].
    pub fn duration(self) -> f64 {
        match self {
            Self::RampSteer => 8.0,
            Self::StepSteer => 4.0,
            Self::SineWithDwell => 4.0,
            Self::DoubleLaneChange => 7.0,
        }
    }

    /// Steering angle at a time [rad].
    pub fn steering_angle(self, t: f64) -> f64 {
        match self {
            Self::RampSteer => 0.01 * t,
            Self::StepSteer => 0.05 * (t / 0.15).clamp(0.0, 1.0),
            Self::SineWithDwell => 0.1 * sine_with_dwell(t - 0.5),
            Self::DoubleLaneChange => 0.07 * (single_sine(0.5 * (t - 0.5)) - single_sine(0.5 * (t - 3.5))),
        }
    }

    /// Lateral acceleration and yaw rate of a car over time.
    pub fn simulate(self, car: &SingleTrackCar) -> [Vec<f64>; 2] {
        let mut state = PlanarState { v_x: self.initial_speed(), ..PlanarState::default() };
        // What keeps the speed against drag, straight ahead.
        let F_x = car.aero.drag(state.v_x);
        let steps = (self.duration() / STEP).round() as usize;
        let mut columns = [Vec::with_capacity(steps), Vec::with_capacity(steps)];
        for k in 0..steps {
            let input = SingleTrackInput { F_x, delta: self.steering_angle(k as f64 * STEP) };
            state = car.advance(&state, &input, STEP, SUBSTEP);
            columns[0].push(car.evaluate(&state, &input).a_y);
            columns[1].push(state.r);
        }
        columns
    }
}

/// A sine of one period.
fn single_sine(phase: f64) -> f64 {
    if (0.0..1.0).contains(&phase) { (TAU * phase).sin() } else { 0.0 }
}

fn sine_with_dwell(t: f64) -> f64 {
    let (frequency, dwell) = (0.7, 0.5);
    let peak = 0.75 / frequency;
    if t < peak {
        single_sine(frequency * t)
    } else if t < peak + dwell {
        -1.0
    } else {
        single_sine(frequency * (t - dwell))
    }
}

/// Root mean square differences of lateral acceleration and yaw rate [-], in units of the root mean square of the true ones.
pub fn compare_tires(
    manoeuvre: Manoeuvre,
    car: &SingleTrackCar,
    identified: [MagicFormula; 2],
    truth: [MagicFormula; 2],
) -> [f64; 2] {
    let drive = |[front, rear]: [MagicFormula; 2]| manoeuvre.simulate(&car.with_tires(front, rear));
    let (found, expected) = (drive(identified), drive(truth));
    std::array::from_fn(|i| {
        let square = |values: &mut dyn Iterator<Item = f64>| values.map(|v| v * v).sum::<f64>();
        let off = square(&mut found[i].iter().zip(&expected[i]).map(|(a, b)| a - b));
        (off / square(&mut expected[i].iter().copied())).sqrt()
    })
}
