//! Mistakes in a recording or in the settings of its preparation: the mistake, its place, its cure.

use thiserror::Error;

/// Why a recording cannot be prepared.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum Error {
    /// A signal that the task needs is not there.
    #[error("signal `{name}` ({what}) is missing; the recording has {found}: {advice}")]
    Missing {
        /// Its name.
        name: String,
        /// What it is, with its unit.
        what: &'static str,
        /// Names that are there.
        found: String,
        /// What to do.
        advice: &'static str,
    },
    /// Time stamps and values do not pair up.
    #[error("signal `{name}` has {times} time stamps and {values} values: give one stamp for each value")]
    Lengths {
        /// Its name.
        name: String,
        /// How many stamps.
        times: usize,
        /// How many values.
        values: usize,
    },
    /// A signal has too few rows to be filtered.
    #[error("signal `{name}` has {rows} rows, at least {least} are needed: record longer")]
    TooShort {
        /// Its name.
        name: String,
        /// How many it has.
        rows: usize,
        /// How many it needs.
        least: usize,
    },
    /// A time or a value is NaN or infinite.
    #[error(
        "signal `{name}`, row {row}, time {time} s: {value} is no finite number; leave the row out, a gap splits the recording"
    )]
    NotFinite {
        /// Its name.
        name: String,
        /// Row, from 0.
        row: usize,
        /// Time stamp of the row [s].
        time: f64,
        /// What stands there.
        value: f64,
    },
    /// Time stands still or runs backwards.
    #[error(
        "signal `{name}`, row {row}: time {time} s follows {before} s; sort the rows and drop those of equal time"
    )]
    Backwards {
        /// Its name.
        name: String,
        /// Row, from 0.
        row: usize,
        /// Stamp of the row before [s].
        before: f64,
        /// Stamp of the row [s].
        time: f64,
    },
    /// A setting makes no sense.
    #[error("`{name}` is {found}, expected {expected}")]
    Setting {
        /// Its name, as in the configuration.
        name: String,
        /// What it is.
        found: f64,
        /// What it must be.
        expected: &'static str,
    },
    /// Nothing is left to identify from.
    #[error(
        "no stretch of at least {shortest} s is left of {rows} rows: {lost}; lower `min_speed` or `shortest`, raise `gap`, or set `drop_held` to false if a signal may rest"
    )]
    NothingLeft {
        /// Shortest stretch that would do [s].
        shortest: f64,
        /// Rows of `v_x` in the recording.
        rows: usize,
        /// Rows lost, by cause.
        lost: String,
    },
    /// Too few points near the origin for its shifts.
    #[error(
        "{axle}: {found} points have a slip within ±{limit}, at least {least} on both sides of zero are needed for the shifts; let the fit find them (`shifts.method = \"joint\"`)"
    )]
    FewNearOrigin {
        /// Axle and direction.
        axle: String,
        /// How many there are.
        found: usize,
        /// How many are needed.
        least: usize,
        /// Largest slip that counts.
        limit: f64,
    },
}

impl Error {
    /// That a setting makes no sense, unless it is `right`.
    pub(super) fn check_setting(
        right: bool,
        name: &str,
        found: f64,
        expected: &'static str,
    ) -> Result<(), Self> {
        let wrong = || Self::Setting { name: name.to_owned(), found, expected };
        if right { Ok(()) } else { Err(wrong()) }
    }
}
