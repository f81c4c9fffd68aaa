//! The log of a test: commands and measurements over time, with interpolation, level crossings and means.

use std::ops::Range;

use crate::frame::rotate_into_frame;

/// Commands and measurements from the beginning of a test on, mirrored for a test to the right. All lists have one length.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct ManoeuvreLog {
    /// Time since the beginning of the test [s].
    pub t: Vec<f64>,
    /// The stage of the test.
    pub phase: Vec<f64>,
    /// Road-wheel angle that is held from this moment on [rad].
    pub steer: Vec<f64>,
    /// Driving force that is held from this moment on [N].
    pub drive: Vec<f64>,
    /// Forward speed [m/s].
    pub v_x: Vec<f64>,
    /// Speed to the left [m/s].
    pub v_y: Vec<f64>,
    /// Yaw rate [rad/s].
    pub r: Vec<f64>,
    /// Acceleration to the left [m/s2].
    pub a_y: Vec<f64>,
    /// Position along the path at the beginning [m].
    pub x: Vec<f64>,
    /// Position to the left of it [m].
    pub y: Vec<f64>,
    /// Heading against it [rad], without jumps of a whole turn.
    pub psi: Vec<f64>,
}

impl ManoeuvreLog {
    /// Takes positions and headings, in the frame of the first of them.
    pub(crate) fn set_positions(&mut self, east: &[f64], north: &[f64], heading: &[f64]) {
        let (x0, y0, psi0) = (east[0], north[0], heading[0]);
        let mut turns = 0.0;
        for (place, psi) in heading.iter().enumerate() {
            let [x, y] = rotate_into_frame([east[place] - x0, north[place] - y0], psi0);
            let jump = psi - heading[place.saturating_sub(1)];
            turns -= (jump / std::f64::consts::TAU).round();
            self.x.push(x);
            self.y.push(y);
            self.psi.push(psi - psi0 + turns * std::f64::consts::TAU);
        }
    }

    /// The places of a stage.
    ///
    /// # Errors
    /// In words, when there was none.
    pub fn stage_index_range(&self, number: i8) -> Result<Range<usize>, String> {
        let of = |phase: &f64| *phase == f64::from(number);
        let begin = self.phase.iter().position(of);
        let end = self.phase.iter().rposition(of);
        let range = begin.zip(end).map(|(begin, end)| begin..end + 1);
        range.ok_or_else(|| format!("there was no stage {number}"))
    }

    /// The value at a time [s], on the line between two communication points; none outside of the test.
    #[must_use]
    pub fn interpolate_at(&self, values: &[f64], time: f64) -> Option<f64> {
        let edge = crate::action::EDGE;
        let after = self.t.iter().position(|t| *t >= time - edge)?;
        if after == 0 || (self.t[after] - time).abs() <= edge {
            return (time >= -edge).then(|| values[after]);
        }
        let (t0, t1) = (self.t[after - 1], self.t[after]);
        let share = (time - t0) / (t1 - t0);
        Some(values[after - 1] + share * (values[after] - values[after - 1]))
    }

    /// The first time [s] from `from` on at which the values reach a level, upwards or downwards as `rising` says.
    #[must_use]
    pub fn level_crossing_time(&self, values: &[f64], level: f64, rising: bool, from: usize) -> Option<f64> {
        let beyond = |value: f64| if rising { value >= level } else { value <= level };
        let place = (from..values.len()).find(|place| beyond(values[*place]))?;
        if place == from || values[place] == values[place - 1] {
            return Some(self.t[place]);
        }
        let (before, after) = (values[place - 1], values[place]);
        let share = (level - before) / (after - before);
        Some(self.t[place - 1] + share * (self.t[place] - self.t[place - 1]))
    }

    /// The sideslip angle at each moment [rad].
    #[must_use]
    pub fn sideslip_angles(&self) -> Vec<f64> {
        self.v_x.iter().zip(&self.v_y).map(|(v_x, v_y)| v_y.atan2(*v_x)).collect()
    }

    /// The covered distance at each moment [m], by the trapezoidal rule.
    #[must_use]
    pub fn travelled_distances(&self) -> Vec<f64> {
        let mut sum = 0.0;
        let speed = |k: usize| self.v_x[k].hypot(self.v_y[k]);
        let add = |k: usize| {
            if k > 0 {
                sum += 0.5 * (speed(k) + speed(k - 1)) * (self.t[k] - self.t[k - 1]);
            }
            sum
        };
        (0..self.t.len()).map(add).collect()
    }
}

/// The mean of values; not a number without any.
#[must_use]
pub(crate) fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

/// The largest size of values.
#[must_use]
pub(crate) fn max_abs(values: &[f64]) -> f64 {
    values.iter().fold(0.0, |largest, value| value.abs().max(largest))
}

/// The place of the largest value.
#[must_use]
pub(crate) fn peak_index(values: &[f64]) -> Option<usize> {
    (0..values.len()).max_by(|a, b| values[*a].total_cmp(&values[*b]).then(b.cmp(a)))
}
