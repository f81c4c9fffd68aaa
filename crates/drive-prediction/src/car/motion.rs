//! The equations of motion, and rollouts with derivatives with respect to all parameters.
#![allow(non_snake_case, reason = "forces and parameters are written as in the equations")]

use nalgebra::{SVector, U1};
use num_dual::{Derivative, DualSVec64};
use vehicle::Number;
use vehicle::{VehicleBody, rk4_step};

use crate::car::parameters::{COUNT, CarParameters, CarSpecification, LAG, LEAST_LAG, ParameterVector};
use crate::drive::EvenDrive;
use crate::predictor::LateralState;

/// A number with its derivatives with respect to all parameters.
pub type Dual = DualSVec64<COUNT>;

/// Largest lateral speed [m/s] and yaw rate [rad/s] of a rollout: a car that has spun goes nowhere.
const SPUN: LateralState = [60.0, 40.0];
/// An axle keeps this share of its load at rest, and takes at most this much of it.
const LOAD_SHARE: [f64; 2] = [0.1, 3.0];
/// What the ellipse leaves at least of the lateral force, squared, and how smoothly it gets there.
const LEAST_LEFT: [f64; 2] = [0.05, 0.1];
/// How long before a rollout the lag of the steering is followed [s]: much longer than it.
pub(super) const WARM_UP: f64 = 2.0;
/// Longest sub-step [s]: at low speed the yaw damping of a small car is 300/s.
const LONGEST: f64 = 5e-3;

/// Inputs at one instant.
#[derive(Clone, Copy, Debug)]
pub struct MotionInputs<T> {
    /// Forward speed [m/s].
    pub v_x: f64,
    /// Its rate [m/s²].
    pub rate: f64,
    /// Steering angle of the road wheels [rad].
    pub delta: T,
}

/// Lateral forces of both axles along the body [N].
#[inline]
pub fn lateral_axle_forces<T: Number>(
    car: &CarSpecification,
    p: &CarParameters<T>,
    u: &MotionInputs<T>,
    [v_y, r]: [T; 2],
) -> [T; 2] {
    let VehicleBody { m, l_f, l_r, .. } = car.body;
    let v_x = T::from(u.v_x);
    // Inertial acceleration along the body.
    let a_x = -v_y * r + u.rate;
    let moved = a_x * p.h * (m / car.body.wheelbase());
    let rest = car.body.static_loads();
    let loads = [clamp_load(-moved + rest[0], rest[0]), clamp_load(moved + rest[1], rest[1])];
    let slips = [u.delta - (v_y + r * l_f).atan2(v_x), p.S_r - (v_y - r * l_r).atan2(v_x)];
    let mut mu = [T::zero(); 2];
    for i in 0..2 {
        let shape = (p.K[i] / (p.C[i] * p.D[i]) * slips[i]).atan();
        mu[i] = p.D[i] * (p.C[i] * shape).sin();
    }
    let (sin, cos) = u.delta.sin_cos();
    let demand = a_x * m + loads[0] * mu[0] * sin;
    let front = if demand.re() > 0.0 { car.front_drive } else { car.front_brake };
    let left = |i: usize, share: f64| {
        let used = demand * share / (loads[i] * p.D[i]);
        let rest = -p.e * used * used + (1.0 - LEAST_LEFT[0]);
        let smooth = (rest + (rest * rest + LEAST_LEFT[1].powi(2)).sqrt()) * 0.5 + LEAST_LEFT[0];
        if smooth.re() < 1.0 { smooth.sqrt() } else { T::one() }
    };
    let [f, r] = [left(0, front), left(1, 1.0 - front)];
    [loads[0] * mu[0] * f * cos, loads[1] * mu[1] * r]
}

#[inline]
fn clamp_load<T: Number>(load: T, rest: f64) -> T {
    let [least, most] = LOAD_SHARE.map(|share| share * rest);
    if load.re() < least {
        T::from(least)
    } else if load.re() > most {
        T::from(most)
    } else {
        load
    }
}

/// What the steering does to the road wheels from `first` on: a lag of first order, and its derivative with respect to the time constant.
#[derive(Clone, Debug)]
pub struct LaggedSteering {
    first: usize,
    /// Angle [rad] and its derivative [rad/s].
    rows: Vec<[f64; 2]>,
}

impl LaggedSteering {
    /// The rows from `first` to `last`, which are reached from 2 s before.
    #[must_use]
    pub fn new(drive: &EvenDrive, lag: f64, first: usize, last: usize) -> Self {
        let lag = lag.max(LEAST_LAG);
        let before = (WARM_UP / drive.step).ceil() as usize;
        let begin = first.saturating_sub(before);
        let keep = (-drive.step / lag).exp();
        let slope = keep * drive.step / (lag * lag);
        let first_known = drive.motion.delta[begin..=last].iter().find(|delta| delta.is_finite());
        let (mut y, mut by_lag) = (first_known.copied().unwrap_or(0.0), 0.0);
        let mut rows = Vec::with_capacity(last - first + 1);
        for row in begin..=last {
            // Where nobody knows the angle the wheels stay where they are.
            let u = if drive.motion.delta[row].is_finite() { drive.motion.delta[row] } else { y };
            by_lag = keep * by_lag + slope * (y - u);
            y = keep * y + (1.0 - keep) * u;
            if row >= first {
                rows.push([y, by_lag]);
            }
        }
        Self { first, rows }
    }

    /// The angle [rad] in a row.
    #[must_use]
    pub fn angle(&self, row: usize) -> f64 {
        self.rows[row - self.first][0]
    }

    fn interpolate(&self, row: usize, share: f64) -> [f64; 2] {
        let [a, b] = [self.rows[row - self.first], self.rows[row + 1 - self.first]];
        [0, 1].map(|i| a[i] + share * (b[i] - a[i]))
    }
}

/// A number for which an angle and its derivative with respect to the lag become one.
pub trait SteeringNumber: Number {
    /// The parameters that this number is differentiated by.
    fn from_parameters(x: &ParameterVector) -> [Self; COUNT];
    /// The angle as such a number.
    fn from_angle(angle: [f64; 2]) -> Self;
}

impl SteeringNumber for f64 {
    fn from_parameters(x: &ParameterVector) -> [Self; COUNT] {
        *x
    }

    #[inline]
    fn from_angle(angle: [f64; 2]) -> Self {
        angle[0]
    }
}

impl SteeringNumber for Dual {
    fn from_parameters(x: &ParameterVector) -> [Self; COUNT] {
        std::array::from_fn(|i| {
            Self::new(x[i], Derivative::derivative_generic(nalgebra::Const::<COUNT>, U1, i))
        })
    }

    #[inline]
    fn from_angle([angle, by_lag]: [f64; 2]) -> Self {
        let mut along = SVector::<f64, COUNT>::zeros();
        along[LAG] = by_lag;
        Self::new(angle, Derivative::some(along))
    }
}

/// A drive with what its models need of it again and again.
#[derive(Clone, Debug)]
pub struct DriveWithRates {
    /// The drive.
    pub drive: EvenDrive,
    /// Rate of the forward speed [m/s²].
    pub rate: Vec<f64>,
}

impl DriveWithRates {
    /// Differentiates the speed. Rows with a state or an input that nobody knows do not count.
    #[must_use]
    pub fn new(drive: &EvenDrive) -> Self {
        let mut drive = drive.clone();
        let rate = crate::zero_phase::derivative(&drive.motion.v_x, drive.step);
        for (row, rate) in rate.iter().enumerate() {
            let needed = [
                *rate,
                drive.motion.v_x[row],
                drive.motion.v_y[row],
                drive.motion.r[row],
                drive.motion.delta[row],
            ];
            drive.counts[row] &= needed.iter().all(|value| value.is_finite());
        }
        Self { drive, rate }
    }

    /// The states at `start` and the `rows` after it.
    pub fn simulate_states<T: SteeringNumber>(
        &self,
        car: &CarSpecification,
        x: &ParameterVector,
        start: usize,
        rows: usize,
    ) -> Vec<[T; 2]> {
        let drive = &self.drive;
        let steered = LaggedSteering::new(drive, x[LAG], start, start + rows);
        let p = CarParameters::new(&T::from_parameters(x));
        let substeps = (drive.step / LONGEST).ceil().max(1.0) as usize;
        let h = drive.step / substeps as f64;
        let m = car.body.m;
        let mut state = SVector::<T, 2>::new(drive.motion.v_y[start].into(), drive.motion.r[start].into());
        let mut states = Vec::with_capacity(rows + 1);
        states.push(state.into());
        for row in start..start + rows {
            for part in 0..substeps {
                // The middle of the sub-step stands for all of it.
                let share = (part as f64 + 0.5) / substeps as f64;
                let at = |of: &[f64]| of[row] + share * (of[row + 1] - of[row]);
                let delta = T::from_angle(steered.interpolate(row, share)) + p.offset;
                let u = MotionInputs { v_x: at(&drive.motion.v_x), rate: at(&self.rate), delta };
                let rates = |x: &SVector<T, 2>| {
                    let [front, rear] = lateral_axle_forces(car, &p, &u, (*x).into());
                    let yaw = (front * car.body.l_f - rear * car.body.l_r) / p.I_zz;
                    SVector::<T, 2>::new((front + rear) / m - x[1] * u.v_x, yaw)
                };
                state = rk4_step(&state, h, rates);
                state = SVector::<T, 2>::from_fn(|i, _| clamp_magnitude(state[i], SPUN[i]));
            }
            states.push(state.into());
        }
        states
    }

    /// Lateral acceleration [m/s²] in a row from its measured state.
    #[must_use]
    pub fn a_y(
        &self,
        car: &CarSpecification,
        p: &CarParameters<f64>,
        steered: &LaggedSteering,
        row: usize,
    ) -> f64 {
        let drive = &self.drive;
        let delta = steered.angle(row) + p.offset;
        let u = MotionInputs { v_x: drive.motion.v_x[row], rate: self.rate[row], delta };
        let [front, rear] = lateral_axle_forces(car, p, &u, [drive.motion.v_y[row], drive.motion.r[row]]);
        (front + rear) / car.body.m
    }
}

#[inline]
fn clamp_magnitude<T: Number>(x: T, most: f64) -> T {
    match x.re() {
        // What is not a number has spun too.
        re if re.is_nan() => T::from(most),
        re if re.abs() > most => T::from(most.copysign(re)),
        _ => x,
    }
}
