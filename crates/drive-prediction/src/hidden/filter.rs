//! The extended Kalman filter of the car, augmented by disturbances that are Gauss–Markov processes: prediction from row to row, and
//! whatever was measured there, one channel after the other.
#![allow(non_snake_case, reason = "symbols as in estimation")]

use kalman::augmented::StateEstimate;
use nalgebra::{SMatrix, SVector};

use super::car::{
    BANK, COMMON, FilterCarModel, FilterInput, FilterState, GRADE, LinearisedModel, MOVING, SLIP, STATES,
    TRIM,
};
use super::parameters::SideslipModelParameters;
use super::setup::{EstimatorSetup, GaussMarkov};
use super::signals::{CHANNELS, SensorChannel, SensorSignals};
use crate::lag::first_order_lag;

pub(super) type StateMatrix = SMatrix<f64, STATES, STATES>;

/// Mean and covariance of the state.
pub(super) type FilterEstimate = StateEstimate<f64, STATES>;

/// What happened at a row.
pub(super) struct FilterRow {
    /// Before the measurements.
    pub prior: FilterEstimate,
    /// After them.
    pub posterior: FilterEstimate,
    /// Derivative of the prior's state by the state after the row before.
    pub F: StateMatrix,
    /// Residuals and their variances, in the order of the channels; NaN where nothing was measured.
    pub residual: [f64; CHANNELS],
    pub variance: [f64; CHANNELS],
    /// Which channels were taken in.
    pub measured: [bool; CHANNELS],
    /// Whether the filter starts here.
    pub start: bool,
    /// Whether the car is too slow to tell anything.
    pub slow: bool,
}

/// Largest product of the step of integration and the fastest rate.
const STABLE: f64 = 0.7;
const MOST_PARTS: f64 = 60.0;
/// First standard deviation of the sideslip angle [rad], and of the heading [rad].
const SIDESLIP: f64 = 0.05;
const ANY_HEADING: f64 = 100.0;
/// First standard deviation of a yaw rate that was not measured [rad/s].
const YAW_RATE: f64 = 1.0;

/// A filter for one car.
pub(super) struct ExtendedKalmanFilter<'a> {
    car: FilterCarModel<'a>,
    /// The states that are Gauss–Markov processes.
    disturbances: [(usize, GaussMarkov); 5],
    process: [f64; 3],
    /// Variances of the channels.
    noise: [f64; CHANNELS],
}

impl<'a> ExtendedKalmanFilter<'a> {
    /// With the variance of measured v_y [m²/s²], where the filter may see it.
    pub fn new(
        setup: &'a EstimatorSetup,
        parameters: &'a SideslipModelParameters,
        v_y_variance: f64,
    ) -> Self {
        let it = &setup.disturbances;
        let [r, a_y, v_x] = parameters.sensor_noise().map(|std| std * std);
        let [course, speed] = setup.gnss.map(|std| std * std);
        let mut noise = [0.0; CHANNELS];
        noise[SensorChannel::Speed as usize] = v_x;
        noise[SensorChannel::YawRate as usize] = r;
        noise[SensorChannel::LateralAcceleration as usize] = a_y;
        noise[SensorChannel::LateralSpeed as usize] = v_y_variance;
        noise[SensorChannel::Course as usize] = course;
        noise[SensorChannel::GroundSpeed as usize] = speed;
        Self {
            car: FilterCarModel::new(setup, parameters),
            disturbances: [
                (GRADE, it.grade),
                (BANK, it.bank),
                (SLIP[0], it.slip[0]),
                (SLIP[1], it.slip[1]),
                (COMMON, it.common_slip),
            ],
            process: parameters.process_noise().map(|std| std * std),
            noise,
        }
    }

    /// Shows every row of a drive, with the bank that a map gives for each, if any.
    pub fn filter_drive(
        &self,
        signals: &SensorSignals,
        bank: Option<&[f64]>,
        mut show: impl FnMut(&FilterRow),
    ) {
        let setup = self.car.setup;
        let steering = first_order_lag(&signals.delta, setup.steering_lag, signals.step);
        let input = |row: usize| FilterInput {
            delta: steering[row],
            steering_rate: (steering[row] - steering[row.max(1) - 1]) / signals.step,
            a_x: signals.a_x.as_ref().map(|a_x| a_x[row]),
            bank: bank.map_or(0.0, |bank| bank[row]),
        };
        let trim = setup.disturbances.trim;
        let mut trim = [0.0, trim * trim];
        let mut estimate = self.initial_estimate(&[f64::NAN; CHANNELS], trim);
        let (mut slow, mut last) = (true, setup.least_speed);
        for row in 0..signals.row_count() {
            let measured = &signals.measured[row];
            let speed = measured_speed(measured);
            let start = slow && speed.is_some_and(|speed| speed >= setup.least_speed);
            if let Some(speed) = speed {
                (slow, last) = (speed < setup.least_speed, speed);
            }
            let mut F = StateMatrix::identity();
            if start || slow {
                estimate = self.initial_estimate(measured, trim);
            } else {
                let parts = (signals.step * self.car.fastest_settling_rate(last) / STABLE).ceil();
                let inputs = [input(row - 1), input(row)];
                let parts = parts.clamp(1.0, MOST_PARTS) as usize;
                F = self.predict(&mut estimate, &inputs, signals.step, parts);
            }
            let prior = estimate;
            let (mut residual, mut variance) = ([f64::NAN; CHANNELS], [f64::NAN; CHANNELS]);
            if !start && !slow {
                self.update(&mut estimate, &input(row), measured, &mut residual, &mut variance);
                trim = [estimate.x[TRIM], estimate.P[TRIM][TRIM]];
            }
            let taken = measured.map(|value| value.is_finite() && !start && !slow);
            let posterior = estimate;
            show(&FilterRow { prior, posterior, F, residual, variance, measured: taken, start, slow });
        }
    }

    /// The estimate where the car has just become fast enough.
    fn initial_estimate(&self, measured: &[f64; CHANNELS], [trim, variance]: [f64; 2]) -> FilterEstimate {
        let mut first = FilterEstimate { x: [0.0; STATES], P: [[0.0; STATES]; STATES] };
        let FilterEstimate { x, P } = &mut first;
        x[0] = measured_speed(measured).unwrap_or(0.0).max(self.car.setup.least_speed);
        let r = measured[SensorChannel::YawRate as usize];
        x[2] = if r.is_finite() { r } else { 0.0 };
        x[TRIM] = trim;
        P[0][0] = 4.0 * self.noise[SensorChannel::Speed as usize].max(1e-6);
        P[1][1] = (SIDESLIP * x[0]).powi(2);
        let yaw = 4.0 * self.noise[SensorChannel::YawRate as usize];
        P[2][2] = if r.is_finite() { yaw } else { YAW_RATE * YAW_RATE };
        P[3][3] = ANY_HEADING * ANY_HEADING;
        for (state, GaussMarkov { std, .. }) in self.disturbances {
            P[state][state] = std * std;
        }
        P[TRIM][TRIM] = variance;
        first
    }

    /// Moves an estimate over a step [s] in parts; the derivative of the new state by the old one.
    fn predict(
        &self,
        estimate: &mut FilterEstimate,
        [from, to]: &[FilterInput; 2],
        step: f64,
        parts: usize,
    ) -> StateMatrix {
        let h = step / parts as f64;
        let mut all = StateMatrix::identity();
        for part in 0..parts {
            let share = (part as f64 + 0.5) / parts as f64;
            let between = |a: f64, b: f64| a + share * (b - a);
            let input = FilterInput {
                delta: between(from.delta, to.delta),
                a_x: from.a_x.zip(to.a_x).map(|(a, b)| between(a, b)),
                bank: between(from.bank, to.bank),
                ..*to
            };
            let (moved, F) = self.transition(&estimate.x, &input, h);
            let rows: [[f64; STATES]; MOVING] = std::array::from_fn(|i| std::array::from_fn(|j| F[(i, j)]));
            estimate.propagate_covariance(&rows);
            for (i, growth) in self.process.iter().enumerate() {
                estimate.P[i][i] += growth * h;
            }
            for (state, disturbance) in self.disturbances {
                let (correlation, variance) = disturbance.correlation_and_variance(h);
                estimate.propagate_gauss_markov(state, correlation, variance);
            }
            estimate.x = moved;
            all = if part == 0 { F } else { F * all };
        }
        all
    }

    /// The states after `h` [s] by their Taylor series of second order, and the derivative of that by those before.
    fn transition(&self, x: &[f64; STATES], input: &FilterInput, h: f64) -> ([f64; STATES], StateMatrix) {
        let x = FilterState::from(*x);
        let LinearisedModel { rates, A, .. } = self.car.linearise(&x, input);
        let mut whole = StateMatrix::zeros();
        whole.fixed_view_mut::<MOVING, STATES>(0, 0).copy_from(&A);
        let mut speed = FilterState::zeros();
        speed.fixed_rows_mut::<MOVING>(0).copy_from(&rates);
        for (state, GaussMarkov { time, .. }) in self.disturbances {
            whole[(state, state)] = -1.0 / time;
            speed[state] = -x[state] / time;
        }
        let bent = whole * speed;
        let moved = x + speed * h + bent * (0.5 * h * h);
        let mut F = whole * whole * (0.5 * h * h) + whole * h + StateMatrix::identity();
        for (state, disturbance) in self.disturbances {
            F[(state, state)] = disturbance.correlation_and_variance(h).0;
        }
        (moved.into(), F)
    }

    /// Takes in the measurements one after the other.
    fn update(
        &self,
        estimate: &mut FilterEstimate,
        input: &FilterInput,
        measured: &[f64; CHANNELS],
        residuals: &mut [f64; CHANNELS],
        variances: &mut [f64; CHANNELS],
    ) {
        if measured.iter().all(|value| value.is_nan()) {
            return;
        }
        let prior = FilterState::from(estimate.x);
        let at = self.car.linearise(&prior, input);
        for channel in (0..CHANNELS).filter(|channel| measured[*channel].is_finite()) {
            let (expected, H) = self.predicted_measurement(channel, &prior, &at, input);
            let cross_covariance = estimate.P.map(|row| SVector::from(row).dot(&H));
            let variance = H.dot(&SVector::from(cross_covariance)) + self.noise[channel];
            let moved = FilterState::from(estimate.x) - prior;
            let mut residual = measured[channel] - expected - H.dot(&moved);
            if channel == SensorChannel::Course as usize {
                residual -= std::f64::consts::TAU * (residual / std::f64::consts::TAU).round();
            }
            estimate.update(&cross_covariance, residual, variance);
            (residuals[channel], variances[channel]) = (residual, variance);
        }
    }

    /// What a channel shows at a state, and its derivative.
    fn predicted_measurement(
        &self,
        channel: usize,
        x: &FilterState,
        at: &LinearisedModel,
        input: &FilterInput,
    ) -> (f64, FilterState) {
        let mut H = FilterState::zeros();
        let [r_delay, a_y_delay] = self.car.parameters.sensor_delays();
        let (v_x, v_y) = (x[0], x[1]);
        let square = v_x * v_x + v_y * v_y;
        let value = if channel == SensorChannel::LateralAcceleration as usize {
            H = at.C;
            let moving = at.C.fixed_rows::<MOVING>(0).dot(&at.rates);
            let rate = moving + at.C[TRIM] * input.steering_rate;
            at.a_y + self.car.parameters.a_y_offset() - a_y_delay * rate
        } else if channel == SensorChannel::YawRate as usize {
            H = at.A.row(2).transpose() * -r_delay;
            H[2] += 1.0;
            x[2] - r_delay * at.rates[2]
        } else if channel == SensorChannel::Course as usize {
            (H[0], H[1], H[3]) = (-v_y / square, v_x / square, 1.0);
            x[3] + v_y.atan2(v_x)
        } else if channel == SensorChannel::GroundSpeed as usize {
            let speed = square.sqrt();
            (H[0], H[1]) = (v_x / speed, v_y / speed);
            speed
        } else {
            let state = usize::from(channel == SensorChannel::LateralSpeed as usize);
            H[state] = 1.0;
            x[state]
        };
        (value, H)
    }
}

/// The speed that a row shows [m/s].
pub(super) fn measured_speed(measured: &[f64; CHANNELS]) -> Option<f64> {
    let shown = [SensorChannel::Speed, SensorChannel::GroundSpeed].map(|channel| measured[channel as usize]);
    shown.into_iter().find(|speed| speed.is_finite())
}
