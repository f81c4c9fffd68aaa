//! The log of a drive as it was recorded: channels by name, each over its own time stamps, borrowed from whoever read them.

use std::borrow::Cow;
use std::collections::BTreeMap;

use crate::error::Error;
use crate::span::TimeInterval;

/// Names of the signals, what they are, and what to do without them. The first six are needed.
///
/// Velocities and accelerations are those of the centre of gravity, along ISO 8855 axes (x forward, y left, z up);
/// accelerations are inertial, as an accelerometer has them.
pub const SIGNALS: [(&str, &str, &str); 12] = [
    ("v_x", "forward velocity [m/s]", "record it or estimate it, and name it `v_x`"),
    ("v_y", "velocity to the left [m/s]", "record it or estimate it, and name it `v_y`"),
    ("a_x", "longitudinal acceleration [m/s²]", "record it, or compute v_x' − v_y r"),
    ("a_y", "lateral acceleration [m/s²]", "record it, or compute v_y' + v_x r"),
    ("r", "yaw rate [rad/s]", "record it, and name it `r`"),
    (
        "delta",
        "steering angle of the front wheels [rad]",
        "divide that of the steering wheel by the steering ratio",
    ),
    ("a_z", "vertical specific force [m/s²]", "leave it out on a level road"),
    ("omega_fl", "speed of the front left wheel [rad/s]", "record all four wheel speeds"),
    ("omega_fr", "speed of the front right wheel [rad/s]", "record all four wheel speeds"),
    ("omega_rl", "speed of the rear left wheel [rad/s]", "record all four wheel speeds"),
    ("omega_rr", "speed of the rear right wheel [rad/s]", "record all four wheel speeds"),
    ("gear", "gear [-]", "leave it out if nothing is to be cut around gear shifts"),
];

/// How many of [`SIGNALS`] nothing works without.
const NEEDED: usize = 6;

/// Rows that a signal must have.
const LEAST_ROWS: usize = 5;

/// Values over time. Time stamps [s] rise strictly; they need not be even.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Signal<'a> {
    /// Time stamps [s].
    pub time: Cow<'a, [f64]>,
    /// Values, one for each stamp.
    pub value: Cow<'a, [f64]>,
}

impl<'a> Signal<'a> {
    /// Values at their time stamps [s].
    pub fn new(time: impl Into<Cow<'a, [f64]>>, value: impl Into<Cow<'a, [f64]>>) -> Self {
        Self { time: time.into(), value: value.into() }
    }

    /// The same signal without copies.
    pub fn borrowed(&self) -> Signal<'_> {
        Signal::new(&*self.time, &*self.value)
    }

    /// The samples of some rows, in their order.
    pub fn select_rows(&self, rows: impl Iterator<Item = usize> + Clone) -> Signal<'static> {
        let of = |column: &[f64]| rows.clone().map(|row| column[row]).collect::<Vec<f64>>();
        Signal::new(of(&self.time), of(&self.value))
    }

    fn check(&self, name: &str) -> Result<(), Error> {
        let name = name.to_string();
        let (times, values) = (self.time.len(), self.value.len());
        if times != values {
            return Err(Error::Lengths { name, times, values });
        }
        for (row, (&time, &value)) in self.time.iter().zip(&*self.value).enumerate() {
            if !time.is_finite() || !value.is_finite() {
                let value = if time.is_finite() { value } else { time };
                return Err(Error::NotFinite { name, row, time, value });
            }
        }
        if let Some(row) = (1..times).find(|&i| self.time[i] <= self.time[i - 1]) {
            let (before, time) = (self.time[row - 1], self.time[row]);
            return Err(Error::Backwards { name, row, before, time });
        }
        if times < LEAST_ROWS {
            return Err(Error::TooShort { name, rows: times, least: LEAST_ROWS });
        }
        Ok(())
    }
}

/// Signals of a drive, by name. [`SIGNALS`] are those of the preparation; each task takes the ones that it knows.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct DriveLog<'a> {
    signals: BTreeMap<String, Signal<'a>>,
}

impl<'a> DriveLog<'a> {
    /// Adds a signal with its own time stamps [s]; one of the same name is replaced.
    pub fn insert(&mut self, name: &str, time: Vec<f64>, value: Vec<f64>) {
        self.signals.insert(name.to_string(), Signal::new(time, value));
    }

    /// The same for a signal that somebody else holds.
    pub fn insert_borrowed(&mut self, name: &str, time: &'a [f64], value: &'a [f64]) {
        self.signals.insert(name.to_string(), Signal::new(time, value));
    }

    /// The rows within some stretches of time; of successive rows with one time stamp the first.
    pub fn restricted_to_stretches(&self, stretches: &[TimeInterval]) -> DriveLog<'static> {
        let cut = |signal: &Signal| {
            let time = &signal.time;
            let inside = |row: &usize| {
                let is_new = *row == 0 || time[*row] != time[row - 1];
                is_new && stretches.iter().any(|it| it.contains(time[*row]))
            };
            let rows: Vec<usize> = (0..time.len()).filter(inside).collect();
            signal.select_rows(rows.into_iter())
        };
        let signals = self.signals.iter().map(|(name, signal)| (name.clone(), cut(signal)));
        DriveLog { signals: signals.collect() }
    }

    /// Takes a signal away.
    pub fn remove(&mut self, name: &str) {
        self.signals.remove(name);
    }

    /// The signal of this name.
    pub fn get(&self, name: &str) -> Option<&Signal<'a>> {
        self.signals.get(name)
    }

    /// The signals that the preparation uses and that are here, in the order of [`SIGNALS`].
    ///
    /// # Errors
    /// If one is missing, too short, not a number somewhere, or out of order.
    pub fn checked_signals(&self) -> Result<Vec<(&'static str, &Signal<'a>)>, Error> {
        let mut found = Vec::new();
        for (i, (name, what, advice)) in SIGNALS.into_iter().enumerate() {
            match self.get(name) {
                Some(signal) => {
                    signal.check(name)?;
                    found.push((name, signal));
                }
                None if i < NEEDED => return Err(self.missing_signal_error(name, what, advice)),
                None => {}
            }
        }
        Ok(found)
    }

    /// Whether the signals are here that nothing works without; their values are not looked at.
    ///
    /// # Errors
    /// With the first that is missing.
    pub fn check_completeness(&self) -> Result<(), Error> {
        let needed = SIGNALS.into_iter().take(NEEDED);
        let mut missing = needed.filter(|(name, ..)| self.get(name).is_none());
        missing
            .next()
            .map_or(Ok(()), |(name, what, advice)| Err(self.missing_signal_error(name, what, advice)))
    }

    /// That something needs the optional signal `name`, and it is not here.
    pub(super) fn error_if_missing(&self, name: &str) -> Option<Error> {
        let (name, what, advice) = SIGNALS.into_iter().find(|s| s.0 == name)?;
        self.get(name).is_none().then(|| self.missing_signal_error(name, what, advice))
    }

    fn missing_signal_error(&self, name: &str, what: &'static str, advice: &'static str) -> Error {
        let names: Vec<_> = self.signals.keys().map(|n| format!("`{n}`")).collect();
        let found = if names.is_empty() { "no signals".into() } else { names.join(", ") };
        Error::Missing { name: name.into(), what, found, advice }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn complete() -> DriveLog<'static> {
        let mut recording = DriveLog::default();
        for (name, ..) in &SIGNALS[..NEEDED] {
            recording.insert(name, vec![0.0, 1.0, 2.0, 3.0, 4.0], vec![1.0; 5]);
        }
        recording
    }

    fn message(recording: &DriveLog) -> String {
        recording.checked_signals().expect_err("the recording is not right").to_string()
    }

    #[test]
    fn errors_say_where_and_what_to_do() {
        assert_eq!(complete().checked_signals().map(|s| s.len()), Ok(NEEDED));
        let mut missing = complete();
        missing.signals.remove("a_y");
        assert!(message(&missing).contains("`a_y` (lateral acceleration [m/s²]) is missing"));
        assert!(message(&missing).contains("compute v_y' + v_x r"));

        let mut nan = complete();
        nan.insert("r", vec![0.0, 1.0, 2.5, 3.0, 4.0], vec![0.0, 0.0, f64::NAN, 0.0, 0.0]);
        assert!(message(&nan).contains("`r`, row 2, time 2.5 s: NaN"));

        let mut backwards = complete();
        backwards.insert("gear", vec![0.0, 2.0, 1.0, 3.0, 4.0], vec![0.0; 5]);
        assert!(message(&backwards).contains("row 2: time 1 s follows 2 s"));

        let mut short = complete();
        short.insert("v_x", vec![0.0, 1.0], vec![0.0; 2]);
        assert!(message(&short).contains("has 2 rows, at least 5"));
        short.insert("v_x", vec![0.0, 1.0], vec![0.0; 3]);
        assert!(message(&short).contains("2 time stamps and 3 values"));
    }
}
