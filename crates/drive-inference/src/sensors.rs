//! What erring sensors measure at a state, with derivatives: errors of scale, offset, delay and place.
#![allow(non_snake_case, reason = "symbols as in estimation")]

use numerics::scalar::Scalar;

use crate::car::Linear;
use preparation::{SystematicError, SystematicErrors};

/// Errors of the sensors of v_x, v_y, r and a_y: a sensor gives `(1 + gain) y(t − delay) + offset`.
#[derive(Clone, Copy, Debug)]
pub struct Sensors<T> {
    scale: [T; 4],
    offset: [T; 4],
    /// Delay beyond that of the prepared samples [s].
    delay: [T; 4],
    /// Mounting angle of the sensor of v_y [rad].
    angle: T,
    /// Distances ahead of the centre of gravity, of the sensors of v_y and a_y [m].
    lever: [T; 2],
}

/// Something measured: its value at a state, and its derivatives by that state.
pub type Measured<T, const S: usize> = (T, [T; S]);

impl<T: Scalar> Sensors<T> {
    /// Those of some causes, with samples that are prepared for delays of v_x, v_y, r and a_y [s].
    pub fn new(causes: &SystematicErrors<T>, prepared: &[f64; 4]) -> Self {
        let none = causes.0[0].constant(0.0);
        let gain = [
            causes[SystematicError::SpeedGain],
            none,
            causes[SystematicError::YawRateGain],
            causes[SystematicError::AccelerationGain],
        ];
        let delay = [
            none,
            causes[SystematicError::SideslipDelay],
            causes[SystematicError::YawRateDelay],
            causes[SystematicError::AccelerationDelay],
        ];
        Self {
            scale: gain.map(|gain| gain + 1.0),
            offset: [
                none,
                none,
                causes[SystematicError::YawRateOffset],
                causes[SystematicError::AccelerationOffset],
            ],
            delay: std::array::from_fn(|i| delay[i] + -prepared[i]),
            angle: causes[SystematicError::SideslipOffset],
            lever: [
                causes[SystematicError::SideslipLever],
                causes[SystematicError::AccelerationLever],
            ],
        }
    }

    /// The state that sensors of v_x, v_y and r show.
    pub fn state(&self, measured: &[f64; 4]) -> [T; 3] {
        let v_x = self.scale[0].recip() * measured[0];
        let r = (-self.offset[2] + measured[2]) * self.scale[2].recip();
        let v_y = self.angle.constant(measured[1]).minus(self.angle, v_x);
        [v_x, v_y.minus(self.lever[0], r), r]
    }

    /// What sensor `i` gives at a motion v_x, v_y, r with its rates. A delay acts as its first-order series.
    #[inline(always)]
    pub fn measure<const M: usize, const S: usize>(
        &self,
        i: usize,
        [v_x, v_y, r]: &[T; 3],
        Linear { rates, a_y, A, C }: &Linear<T, M, S>,
    ) -> Measured<T, S> {
        let zero = self.angle.constant(0.0);
        let one = zero + 1.0;
        let mut by = [zero; S];
        let y = match i {
            0 => {
                by[0] = one;
                *v_x
            }
            1 => {
                (by[0], by[1], by[2]) = (self.angle, one, self.lever[0]);
                v_y.plus(self.angle, *v_x).plus(self.lever[0], *r)
            }
            2 => {
                by[2] = one;
                *r
            }
            _ => {
                for j in 0..S {
                    by[j] = C[j].plus(self.lever[1], A[2][j]);
                }
                a_y.plus(self.lever[1], rates[2])
            }
        };
        let mut rate = zero;
        for k in 0..M {
            rate = rate.plus(by[k], rates[k]);
        }
        let mut late = by;
        for j in 0..S {
            let mut change = zero;
            for k in 0..M {
                change = change.plus(by[k], A[k][j]);
            }
            late[j] = by[j].minus(self.delay[i], change) * self.scale[i];
        }
        (y.minus(self.delay[i], rate) * self.scale[i] + self.offset[i], late)
    }
}
