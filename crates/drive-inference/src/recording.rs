//! Holds one drive: measured motion and the inputs that acted.

use crate::error::Error;

/// Columns of one drive, all of the same length.
///
/// A row holds what was measured at the end of a step, and the inputs that were held during that step. The inputs of the first
/// row are not used.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Drive {
    /// Time [s], rising.
    pub t: Vec<f64>,
    /// Measured forward speed [m/s].
    pub v_x: Vec<f64>,
    /// Measured speed to the left [m/s].
    pub v_y: Vec<f64>,
    /// Measured yaw rate [rad/s].
    pub r: Vec<f64>,
    /// Measured inertial acceleration to the left [m/s²].
    pub a_y: Vec<f64>,
    /// Longitudinal force, braking when negative [N].
    pub F_x: Vec<f64>,
    /// Road-wheel angle of the front axle [rad].
    pub delta: Vec<f64>,
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
    pub fn columns(&self) -> [(&'static str, &[f64]); 7] {
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

    /// The measurements of a row: v_x, v_y, r, a_y.
    pub fn measured(&self, k: usize) -> [f64; 4] {
        [self.v_x[k], self.v_y[k], self.r[k], self.a_y[k]]
    }

    /// Rows `range` as a recording of their own.
    pub fn slice(&self, range: std::ops::Range<usize>) -> Self {
        self.rows(&range.collect::<Vec<_>>())
    }

    /// Appends a later recording.
    pub fn append(&mut self, later: &Self) {
        self.t.extend(&later.t);
        self.v_x.extend(&later.v_x);
        self.v_y.extend(&later.v_y);
        self.r.extend(&later.r);
        self.a_y.extend(&later.a_y);
        self.F_x.extend(&later.F_x);
        self.delta.extend(&later.delta);
    }

    /// Median time from one row to the next [s].
    pub fn usual_step(&self) -> f64 {
        let mut steps: Vec<f64> = self.t.windows(2).map(|pair| pair[1] - pair[0]).collect();
        steps.sort_by(f64::total_cmp);
        steps.get(steps.len() / 2).copied().unwrap_or(f64::INFINITY)
    }

    /// The shortest usual step of some recordings [s].
    pub fn shortest_step(recordings: &[Self]) -> f64 {
        recordings.iter().map(Self::usual_step).fold(f64::INFINITY, f64::min)
    }

    /// Whether a time is within a window, ends included, for each row.
    pub fn during(&self, [from, until]: [f64; 2]) -> Vec<bool> {
        self.t.iter().map(|t| (from..=until).contains(t)).collect()
    }

    /// Some of the rows.
    pub fn rows(&self, rows: &[usize]) -> Self {
        let pick = |column: &[f64]| rows.iter().map(|&k| column[k]).collect();
        Self {
            t: pick(&self.t),
            v_x: pick(&self.v_x),
            v_y: pick(&self.v_y),
            r: pick(&self.r),
            a_y: pick(&self.a_y),
            F_x: pick(&self.F_x),
            delta: pick(&self.delta),
        }
    }

    /// Checks that the columns fit each other and hold numbers.
    ///
    /// # Errors
    ///
    /// [`Error::Length`], [`Error::NotFinite`], [`Error::Time`] and [`Error::TooShort`], with the number of the recording.
    pub fn check(&self, recording: usize) -> Result<(), Error> {
        self.check_numbers(recording)?;
        let expected = self.len();
        if expected < SHORTEST {
            return Err(Error::TooShort { recording, expected: SHORTEST, found: expected });
        }
        match self.t.windows(2).position(|pair| pair[1] <= pair[0]) {
            Some(k) => {
                Err(Error::Time { recording, row: k + 1, found: self.t[k + 1], before: self.t[k] })
            }
            None => Ok(()),
        }
    }

    /// Checks that the columns are of one length and hold numbers.
    pub(crate) fn check_numbers(&self, recording: usize) -> Result<(), Error> {
        let expected = self.len();
        for (column, values) in self.columns() {
            if values.len() != expected {
                return Err(Error::Length { recording, column, expected, found: values.len() });
            }
            if let Some(row) = values.iter().position(|value| !value.is_finite()) {
                return Err(Error::NotFinite { recording, column, row, found: values[row] });
            }
        }
        Ok(())
    }

    /// Standard deviations of the noise of v_x, v_y, r and a_y as third differences show it: a first guess, too high where the
    /// motion itself is not smooth.
    pub fn rough_noise(&self) -> [f64; 4] {
        [&self.v_x, &self.v_y, &self.r, &self.a_y].map(|column| {
            let mut size: Vec<f64> =
                column.windows(4).map(|w| (w[3] - 3.0 * w[2] + 3.0 * w[1] - w[0]).abs()).collect();
            size.sort_by(f64::total_cmp);
            // The variance of a third difference of white noise is 1 + 9 + 9 + 1 times that of the noise; the median of
            // |N(0, 1)| is 0.6745.
            size[size.len() / 2] / (0.6745 * 20_f64.sqrt())
        })
    }
}
