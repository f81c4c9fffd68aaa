//! The inputs of a car as they were recorded, between two rows, and the errors that they may have.
#![allow(non_snake_case, reason = "symbols as in vehicle dynamics")]

use kalman::augmented::InputSegment;
use numerics::scalar::Scalar;
use preparation::{Drive, InputInterpolation, SystematicError, SystematicErrors};
use vehicle::{SingleTrackCar, SingleTrackInput};

use crate::car::CarInput;
use crate::channel_delays::{PerChannel, channel_delays, channel_drifts};

/// An input as it was recorded.
#[derive(Clone, Copy, Debug)]
pub struct RecordedInput {
    delta: f64,
    /// Rate of the steering angle [rad/s].
    rate: f64,
    sin: f64,
    cos: f64,
    F_xf: f64,
    F_xr: f64,
    /// Rates of the longitudinal forces [N/s].
    pushing: [f64; 2],
}

impl RecordedInput {
    /// An input to a car that brakes with this share in front, with the rates of its steering angle [rad/s] and its longitudinal force [N/s].
    pub fn new(brake_front_share: f64, input: &SingleTrackInput, [rate, pushing]: [f64; 2]) -> Self {
        let (sin, cos) = input.delta.sin_cos();
        // The split follows the sign of the force, not that of its rate.
        let front = if input.F_x < 0.0 { brake_front_share } else { 0.0 };
        let [F_xf, F_xr] = [front * input.F_x, (1.0 - front) * input.F_x];
        let pushing = [front * pushing, (1.0 - front) * pushing];
        Self { delta: input.delta, rate, sin, cos, F_xf, F_xr, pushing }
    }

    /// The input with longitudinal forces that are a factor of the recorded ones, and no other errors.
    #[inline(always)]
    pub fn with_force_factor<T: Scalar>(&self, factor: T) -> CarInput<T> {
        CarInput {
            delta: factor.constant(self.delta),
            sin: factor.constant(self.sin),
            cos: factor.constant(self.cos),
            F_xf: factor * self.F_xf,
            F_xr: factor * self.F_xr,
            friction: factor.constant(1.0),
        }
    }
}

/// The errors of the inputs.
#[derive(Clone, Copy, Debug)]
pub struct InputErrors<T> {
    offset: T,
    /// 1 / (1 + gain) of the steering angle.
    shrink: T,
    /// True longitudinal force over the recorded one.
    force: T,
    /// Delays of both in the middle of the drive [s], and their growth with time [-].
    middle: [T; 2],
    drift: [T; 2],
    /// Their delays beyond those of the prepared sample [s].
    delays: [T; 2],
    /// Friction over that before its change: of the drive, and of the sample.
    change: T,
    friction: T,
}

impl<T: Scalar> InputErrors<T> {
    /// Those of some causes.
    pub fn new(causes: &SystematicErrors<T>) -> Self {
        let [steering, force, ..] = channel_delays(causes);
        let [drift, force_drift, ..] = channel_drifts(causes);
        Self {
            offset: causes[SystematicError::SteeringOffset],
            shrink: (causes[SystematicError::SteeringGain] + 1.0).recip(),
            force: causes[SystematicError::ForceGain] + 1.0,
            middle: [steering, force],
            drift: [drift, force_drift],
            delays: [steering, force],
            change: causes[SystematicError::FrictionChange] + 1.0,
            friction: steering.constant(1.0),
        }
    }

    /// Sets the delays that are left of a sample at a time [s], of which some are taken out [s], and its friction.
    #[inline(always)]
    pub fn set_sample(&mut self, time: f64, taken: &PerChannel<f64>, after_change: bool) {
        for (i, taken) in taken.iter().take(2).enumerate() {
            self.delays[i] = self.middle[i].add_scaled(self.drift[i], time) + -*taken;
        }
        self.friction = if after_change { self.change } else { self.change.constant(1.0) };
    }

    /// The true input. Sine and cosine are those of the record turned by the error, whose series end at its fifth power.
    #[inline(always)]
    pub fn correct_input(&self, recorded: &RecordedInput) -> CarInput<T> {
        let [push_f, push_r] = recorded.pushing;
        let [delay, force_delay] = self.delays;
        let read = (delay * recorded.rate - self.offset) + recorded.delta;
        let delta = read * self.shrink;
        let error = delta + -recorded.delta;
        let square = error * error;
        let sin = error * ((square * (square * (1.0 / 120.0) + -1.0 / 6.0)) + 1.0);
        let cos = square * (square * (1.0 / 24.0) + -0.5) + 1.0;
        CarInput {
            delta,
            sin: (cos * recorded.sin).add_scaled(sin, recorded.cos),
            cos: (cos * recorded.cos).add_scaled(sin, -recorded.sin),
            F_xf: self.force * (force_delay * push_f + recorded.F_xf),
            F_xr: self.force * (force_delay * push_r + recorded.F_xr),
            friction: self.friction,
        }
    }
}

/// A quantity over the time between two rows.
#[derive(Clone, Copy, Debug)]
pub struct InterpolatedSegment {
    /// At both rows.
    values: [f64; 2],
    /// By central differences [1/s].
    rates: [f64; 2],
    /// Time between the rows [s].
    h: f64,
    interpolation: InputInterpolation,
}

impl InterpolatedSegment {
    /// A column of a recording, from the row before `row` to it.
    pub fn of_column(
        recording: &Drive,
        column: &[f64],
        row: usize,
        interpolation: InputInterpolation,
    ) -> Self {
        let rows = [row.saturating_sub(1), row];
        Self {
            values: rows.map(|row| column[row]),
            rates: rows.map(|row| central_difference(&recording.t, column, row)),
            h: recording.t[row] - recording.t[rows[0]],
            interpolation,
        }
    }

    /// The mean over a part of the time, given by its shares.
    pub fn mean(&self, [from, to]: [f64; 2]) -> f64 {
        let integral = |share: f64| {
            let [start, end] = self.values;
            let (rise, square) = (end - start, share * share);
            match self.interpolation {
                InputInterpolation::ZeroOrderHold => end * share,
                InputInterpolation::FirstOrderHold => start * share + rise * square / 2.0,
                InputInterpolation::Hermite => {
                    let [s, e] = self.rates.map(|rate| self.h * rate);
                    let (b, c) = (3.0 * rise - 2.0 * s - e, s + e - 2.0 * rise);
                    start * share + square * (s / 2.0 + share * (b / 3.0 + share * c / 4.0))
                }
                InputInterpolation::FirstOrderLag(time) => {
                    let q = self.h / time;
                    start * share + rise * (share + (-share * q).exp_m1() / q) / -(-q).exp_m1()
                }
            }
        };
        (integral(to) - integral(from)) / (to - from)
    }

    /// How far the quantity moves between the rows.
    pub fn travel(&self) -> f64 {
        match self.interpolation {
            InputInterpolation::ZeroOrderHold => 0.0,
            _ => (self.values[1] - self.values[0]).abs(),
        }
    }

    /// The value after a share of the time.
    fn value(&self, share: f64) -> f64 {
        let [start, end] = self.values;
        let rise = end - start;
        match self.interpolation {
            _ if share == 1.0 => end,
            InputInterpolation::ZeroOrderHold => end,
            InputInterpolation::FirstOrderHold => start + rise * share,
            InputInterpolation::Hermite => {
                let [s, e] = self.rates.map(|rate| self.h * rate);
                let (b, c) = (3.0 * rise - 2.0 * s - e, s + e - 2.0 * rise);
                start + share * (s + share * (b + share * c))
            }
            InputInterpolation::FirstOrderLag(time) => {
                let q = self.h / time;
                start + rise * (-share * q).exp_m1() / (-q).exp_m1()
            }
        }
    }

    /// As [`InputSegment::equivalent_ends`].
    fn equivalent_ends(&self, part: [f64; 2]) -> [f64; 2] {
        let end = self.value(part[1]);
        [2.0 * self.mean(part) - end, end]
    }

    fn rate(&self, share: f64) -> f64 {
        match self.interpolation {
            InputInterpolation::ZeroOrderHold => self.rates[1],
            _ => self.rates[0] + share * (self.rates[1] - self.rates[0]),
        }
    }
}

fn central_difference(t: &[f64], column: &[f64], row: usize) -> f64 {
    let (before, after) = (row.saturating_sub(1), (row + 1).min(t.len() - 1));
    (column[after] - column[before]) / (t[after] - t[before])
}

/// The recorded inputs between two rows.
#[derive(Clone, Copy, Debug)]
pub struct RecordedSegment {
    delta: InterpolatedSegment,
    F_x: InterpolatedSegment,
    brake_front_share: f64,
    /// For the whole time, which most steps need alone.
    ends: [RecordedInput; 2],
}

impl RecordedSegment {
    /// The inputs of a car.
    pub fn new(car: &SingleTrackCar, delta: InterpolatedSegment, F_x: InterpolatedSegment) -> Self {
        let brake_front_share = car.brake_front_share;
        let ends = equivalent_inputs(brake_front_share, &delta, &F_x, [0.0, 1.0]);
        Self { delta, F_x, brake_front_share, ends }
    }

    #[inline(always)]
    fn equivalent_ends(&self, part: [f64; 2]) -> [RecordedInput; 2] {
        match part {
            [0.0, 1.0] => self.ends,
            _ => equivalent_inputs(self.brake_front_share, &self.delta, &self.F_x, part),
        }
    }
}

fn equivalent_inputs(
    brake_front_share: f64,
    delta: &InterpolatedSegment,
    F_x: &InterpolatedSegment,
    part: [f64; 2],
) -> [RecordedInput; 2] {
    let (angles, forces) = (delta.equivalent_ends(part), F_x.equivalent_ends(part));
    std::array::from_fn(|end| {
        let input = SingleTrackInput { F_x: forces[end], delta: angles[end] };
        RecordedInput::new(brake_front_share, &input, [delta.rate(part[end]), F_x.rate(part[end])])
    })
}

/// The true inputs between two rows.
pub struct TrueInputs<'a, T> {
    /// What was recorded.
    pub recorded: &'a RecordedSegment,
    /// Its errors; without them only the force may be a factor of the recorded one.
    pub errors: Option<&'a InputErrors<T>>,
    /// That factor.
    pub force_factor: T,
}

impl<T: Scalar> InputSegment<CarInput<T>> for TrueInputs<'_, T> {
    #[inline(always)]
    fn equivalent_ends(&self, part: [f64; 2]) -> [CarInput<T>; 2] {
        // No closure: those are not always inlined into the code for wide vectors.
        let [start, end] = self.recorded.equivalent_ends(part);
        match self.errors {
            Some(errors) => [errors.correct_input(&start), errors.correct_input(&end)],
            None => [start.with_force_factor(self.force_factor), end.with_force_factor(self.force_factor)],
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Means by the midpoint rule of short parts, and ends that meet.
    #[test]
    fn means_are_those_of_the_values() {
        let kinds = [
            InputInterpolation::ZeroOrderHold,
            InputInterpolation::FirstOrderHold,
            InputInterpolation::Hermite,
            InputInterpolation::FirstOrderLag(0.02),
        ];
        for interpolation in kinds {
            let segment =
                InterpolatedSegment { values: [0.1, 0.3], rates: [2.0, -1.0], h: 0.05, interpolation };
            let part = [0.25, 0.75];
            let at = |k: i32| segment.value(0.25 + 0.5 * (f64::from(k) + 0.5) / 1000.0);
            let mean = (0..1000).map(at).sum::<f64>() / 1000.0;
            assert!((segment.mean(part) - mean).abs() < 1e-7, "{interpolation:?}");
            let [start, end] = segment.equivalent_ends(part);
            assert!((0.5 * (start + end) - mean).abs() < 1e-7 && end == segment.value(0.75));
        }
    }

    #[test]
    fn a_lag_lies_between_hold_and_line() {
        let mean = |interpolation| {
            InterpolatedSegment { values: [0.0, 1.0], rates: [0.0; 2], h: 0.01, interpolation }
                .mean([0.0, 1.0])
        };
        assert!((mean(InputInterpolation::FirstOrderLag(1e-5)) - 1.0).abs() < 2e-3);
        assert!((mean(InputInterpolation::FirstOrderLag(10.0)) - 0.5).abs() < 2e-3);
    }
}
