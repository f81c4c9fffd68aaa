//! The measurement model of the filter: sensors of v_x, v_y, r and a_y with errors of scale, offset, delay and place.
#![allow(non_snake_case, reason = "symbols as in estimation")]

use kalman::augmented::MeasurementModel;
use numerics::scalar::Scalar;

use crate::car::CarLinearisation;
use crate::channel_delays::{channel_delays, channel_drifts};
use crate::prepared_drive::PreparedSample;
use preparation::{SystematicError, SystematicErrors};

/// Sensors of v_x, v_y, r and a_y: one with errors gives `(1 + gain) y(t − delay) + offset`. Without `BIASED` they have none, which is
/// faster.
#[derive(Clone, Copy, Debug)]
pub struct SensorModel<T, const BIASED: bool> {
    scale: [T; 4],
    offset: [T; 4],
    /// Delay in the middle of the drive [s], and its growth with time [-].
    middle: [T; 4],
    drift: [T; 4],
    /// Delay beyond that of the prepared sample [s].
    delay: [T; 4],
    /// Group delays of low-passes [s], the share of a new value, and what the rest of the value before gives.
    low_pass: [T; 4],
    share: [T; 4],
    rest: [T; 4],
    /// Parts of roll rate and roll acceleration in v_y, and both together in the sample [m/s].
    roll: [T; 2],
    rolling: T,
    /// Mounting angle of the sensor of v_y [rad].
    angle: T,
    /// Distances ahead of the centre of gravity, of the sensors of v_y and a_y [m].
    lever: [T; 2],
}

impl<T: Scalar, const BIASED: bool> SensorModel<T, BIASED> {
    /// Those of some causes.
    pub fn new(causes: &SystematicErrors<T>) -> Self {
        let none = causes.0[0].constant(0.0);
        let gain = [
            causes[SystematicError::SpeedGain],
            none,
            causes[SystematicError::YawRateGain],
            causes[SystematicError::AccelerationGain],
        ];
        let [_, _, middle @ ..] = channel_delays(causes);
        let [_, _, drift @ ..] = channel_drifts(causes);
        Self {
            scale: gain.map(|gain| gain + 1.0),
            offset: [
                none,
                none,
                causes[SystematicError::YawRateOffset],
                causes[SystematicError::AccelerationOffset],
            ],
            middle,
            drift,
            delay: middle,
            low_pass: [
                none,
                causes[SystematicError::SideslipLowPass],
                causes[SystematicError::YawRateLowPass],
                causes[SystematicError::AccelerationLowPass],
            ],
            share: [none.constant(1.0); 4],
            rest: [none; 4],
            roll: [causes[SystematicError::Roll], causes[SystematicError::RollAcceleration]],
            rolling: none,
            angle: causes[SystematicError::SideslipOffset],
            lever: [causes[SystematicError::SideslipLever], causes[SystematicError::AccelerationLever]],
        }
    }

    /// Sets the delays that are left of a sample, the value before, and how the body rolls.
    #[inline(always)]
    pub fn set_sample(&mut self, sample: &PreparedSample) {
        let [_, _, taken @ ..] = sample.taken;
        for (i, taken) in taken.into_iter().enumerate() {
            self.delay[i] = self.middle[i].add_scaled(self.drift[i], sample.time) + -taken;
            self.share[i] = (self.low_pass[i] * (1.0 / sample.h) + 1.0).recip();
            let before = sample.before[i];
            let before = if before.is_finite() { before } else { sample.measured[i] };
            self.rest[i] = if before.is_finite() {
                (self.share[i] * -1.0 + 1.0) * before
            } else {
                self.low_pass[i].constant(0.0)
            };
        }
        self.rolling = self.roll[0] * sample.roll[0] + self.roll[1] * sample.roll[1];
    }

    /// The state that sensors of v_x, v_y and r show.
    pub fn state_from_sensors(&self, measured: &[f64; 4]) -> [T; 3] {
        let v_x = self.scale[0].recip() * measured[0];
        let r = (-self.offset[2] + measured[2]) * self.scale[2].recip();
        let v_y = self.angle.constant(measured[1]).subtract_product(self.angle, v_x);
        [v_x, v_y.subtract_product(self.lever[0], r), r]
    }
}

impl<T: Scalar, const BIASED: bool, const M: usize, const S: usize>
    MeasurementModel<T, CarLinearisation<T, M, S>, S> for SensorModel<T, BIASED>
{
    const DIRECT: usize = if BIASED { 0 } else { 3 };

    /// A delay acts as its first-order series.
    #[inline(always)]
    fn predict_measurement(
        &self,
        i: usize,
        x: &[T; S],
        CarLinearisation { rates, a_y, A, C }: &CarLinearisation<T, M, S>,
    ) -> (T, [T; S]) {
        if !BIASED {
            return (*a_y, *C);
        }
        let (v_x, v_y, r) = (x[0], x[1], x[2]);
        let zero = self.angle.constant(0.0);
        let one = zero + 1.0;
        let mut by = [zero; S];
        let y = match i {
            0 => {
                by[0] = one;
                v_x
            }
            1 => {
                (by[0], by[1], by[2]) = (self.angle, one, self.lever[0]);
                v_y.add_product(self.angle, v_x).add_product(self.lever[0], r) + self.rolling
            }
            2 => {
                by[2] = one;
                r
            }
            _ => {
                for j in 0..S {
                    by[j] = C[j].add_product(self.lever[1], A[2][j]);
                }
                a_y.add_product(self.lever[1], rates[2])
            }
        };
        let mut rate = zero;
        for k in 0..M {
            rate = rate.add_product(by[k], rates[k]);
        }
        let mut late = by;
        for j in 0..S {
            let mut change = zero;
            for k in 0..M {
                change = change.add_product(by[k], A[k][j]);
            }
            late[j] = by[j].subtract_product(self.delay[i], change) * self.scale[i] * self.share[i];
        }
        let now = y.subtract_product(self.delay[i], rate) * self.scale[i] + self.offset[i];
        (self.rest[i].add_product(now, self.share[i]), late)
    }
}
