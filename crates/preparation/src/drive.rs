//! One drive at common time stamps: the measured motion of the car and the inputs that acted.
#![allow(non_snake_case, reason = "symbols as in vehicle dynamics")]

use serde::Serialize;
use thiserror::Error;

use crate::robust::difference_noise;

/// Why the columns of a drive cannot be used.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum DriveError {
    /// Columns differ in length.
    #[error("expected {expected} rows as in column t, found {found} in column {column}")]
    Length {
        /// Name of the column.
        column: &'static str,
        /// Rows of the time.
        expected: usize,
        /// Rows of the column.
        found: usize,
    },
    /// A value is no number.
    #[error(
        "expected numbers in column {column}, found {found} in row {row}; leave such rows out, as the end of one recording and \
         the start of another"
    )]
    NotFinite {
        /// Name of the column.
        column: &'static str,
        /// Number of the row, from 0.
        row: usize,
        /// The value.
        found: f64,
    },
    /// Time stands still or runs back.
    #[error("expected rising times, found {found} s in row {row} after {before} s")]
    Time {
        /// Number of the row, from 0.
        row: usize,
        /// Time of the row [s].
        found: f64,
        /// Time of the row before [s].
        before: f64,
    },
    /// There are too few rows.
    #[error("expected {expected} rows or more, found {found}")]
    TooShort {
        /// Fewest rows.
        expected: usize,
        /// Rows that there are.
        found: usize,
    },
}

/// An input between two rows.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum InputInterpolation {
    /// It had the value of the later row all the time, as a controller holds it.
    ZeroOrderHold,
    /// A straight line.
    #[default]
    FirstOrderHold,
    /// The cubic with the central differences of both rows as its slopes.
    Hermite,
    /// An actuator of first order with this time constant [s] under a command that is held.
    FirstOrderLag(f64),
}

/// How each input moves between rows.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct InputInterpolations {
    /// The steering angle.
    pub delta: InputInterpolation,
    /// The longitudinal force.
    pub F_x: InputInterpolation,
}

/// Columns of one drive, all of the same length.
///
/// A row holds what was measured at its time, and the inputs at that time: how they came there from the row before is told by
/// `interpolation`.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Drive {
    /// Time [s], rising.
    pub t: Vec<f64>,
    /// Measured forward speed [m/s].
    pub v_x: Vec<f64>,
    /// Measured speed to the left [m/s]; NaN where nobody measured it, of which only predictions make sense.
    pub v_y: Vec<f64>,
    /// Measured yaw rate [rad/s].
    pub r: Vec<f64>,
    /// Measured inertial acceleration to the left [m/s²].
    pub a_y: Vec<f64>,
    /// Longitudinal force, braking when negative [N]; empty where it is not known.
    pub F_x: Vec<f64>,
    /// Road-wheel angle of the front axle [rad].
    pub delta: Vec<f64>,
    /// The inputs between rows.
    pub interpolation: InputInterpolations,
}

/// Fewest rows from which tires can be identified.
pub const SHORTEST: usize = 50;

impl Drive {
    /// Number of rows.
    pub fn len(&self) -> usize {
        self.t.len()
    }

    /// Whether there is no row.
    pub fn is_empty(&self) -> bool {
        self.t.is_empty()
    }

    /// Names and columns.
    pub fn named_columns(&self) -> [(&'static str, &[f64]); 7] {
        [
            ("t", &self.t),
            ("v_x", &self.v_x),
            ("v_y", &self.v_y),
            ("r", &self.r),
            ("a_y", &self.a_y),
            ("F_x", &self.F_x),
            ("delta", &self.delta),
        ]
    }

    /// How inputs move between the rows of recordings of one logger.
    pub fn common_interpolation(recordings: &[Self]) -> InputInterpolations {
        recordings.first().map(|drive| drive.interpolation).unwrap_or_default()
    }

    /// The measurements of a row: v_x, v_y, r, a_y.
    pub fn measurements_at(&self, k: usize) -> [f64; 4] {
        [self.v_x[k], self.v_y[k], self.r[k], self.a_y[k]]
    }

    /// Rows `range` as a drive of their own.
    pub fn slice(&self, range: std::ops::Range<usize>) -> Self {
        self.map_columns(|column| column.get(range.clone()).map_or(Vec::new(), <[f64]>::to_vec))
    }

    /// Each column made into another one, such as every fifth row; inputs move between the new rows as between the old ones.
    pub fn map_columns(&self, f: impl Fn(&[f64]) -> Vec<f64>) -> Self {
        Self {
            t: f(&self.t),
            v_x: f(&self.v_x),
            v_y: f(&self.v_y),
            r: f(&self.r),
            a_y: f(&self.a_y),
            F_x: f(&self.F_x),
            delta: f(&self.delta),
            interpolation: self.interpolation,
        }
    }

    /// Appends a later recording.
    pub fn append_recording(&mut self, later: &Self) {
        self.t.extend(&later.t);
        self.v_x.extend(&later.v_x);
        self.v_y.extend(&later.v_y);
        self.r.extend(&later.r);
        self.a_y.extend(&later.a_y);
        self.F_x.extend(&later.F_x);
        self.delta.extend(&later.delta);
    }

    /// Median time from one row to the next [s].
    pub fn median_step(&self) -> f64 {
        let mut steps: Vec<f64> = self.t.windows(2).map(|pair| pair[1] - pair[0]).collect();
        steps.sort_by(f64::total_cmp);
        steps.get(steps.len() / 2).copied().unwrap_or(f64::INFINITY)
    }

    /// The shortest usual step of some recordings [s].
    pub fn shortest_step(recordings: &[Self]) -> f64 {
        recordings.iter().map(Self::median_step).fold(f64::INFINITY, f64::min)
    }

    /// Whether a time is within a window, ends included, for each row.
    pub fn time_window_mask(&self, [from, until]: [f64; 2]) -> Vec<bool> {
        self.t.iter().map(|t| (from..=until).contains(t)).collect()
    }

    /// Some of the rows.
    pub fn select_rows(&self, rows: &[usize]) -> Self {
        self.map_columns(|column| rows.iter().filter_map(|&row| column.get(row).copied()).collect())
    }

    /// Checks that the columns fit each other, hold numbers, and are long enough.
    ///
    /// # Errors
    ///
    /// The first that is wrong, by column and row.
    pub fn check_columns(&self) -> Result<(), DriveError> {
        self.check_numbers()?;
        if self.len() < SHORTEST {
            return Err(DriveError::TooShort { expected: SHORTEST, found: self.len() });
        }
        match (1..self.len()).find(|row| self.t[*row] <= self.t[row - 1]) {
            Some(row) => Err(DriveError::Time { row, found: self.t[row], before: self.t[row - 1] }),
            None => Ok(()),
        }
    }

    /// Checks that the columns are of one length and hold numbers.
    ///
    /// # Errors
    ///
    /// [`DriveError::Length`] and [`DriveError::NotFinite`].
    pub fn check_numbers(&self) -> Result<(), DriveError> {
        let expected = self.len();
        for (column, values) in self.named_columns() {
            if values.len() != expected {
                return Err(DriveError::Length { column, expected, found: values.len() });
            }
            if let Some(row) = values.iter().position(|value| !value.is_finite()) {
                return Err(DriveError::NotFinite { column, row, found: values[row] });
            }
        }
        Ok(())
    }

    /// Standard deviations of the noise of v_x, v_y, r and a_y as third differences show it: a first guess.
    pub fn difference_noise(&self) -> [f64; 4] {
        [&self.v_x, &self.v_y, &self.r, &self.a_y].map(|column| difference_noise(column))
    }
}
