//! Says why tires could not be identified from drives.

use kalman::EmError;
use thiserror::Error;

/// Why tires could not be identified from recordings.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum Error {
    /// There is nothing to identify from.
    #[error("expected at least one recording, found none")]
    NoRecording,
    /// Columns differ in length.
    #[error(
        "recording {recording}: expected {expected} rows as in column t, found {found} in column {column}"
    )]
    Length {
        /// Number of the recording, from 0.
        recording: usize,
        /// Name of the column.
        column: &'static str,
        /// Rows of the time.
        expected: usize,
        /// Rows of the column.
        found: usize,
    },
    /// A value is no number.
    #[error(
        "recording {recording}: expected numbers in column {column}, found {found} in row {row}; leave such rows out, as the \
         end of one recording and the start of another"
    )]
    NotFinite {
        /// Number of the recording, from 0.
        recording: usize,
        /// Name of the column.
        column: &'static str,
        /// Number of the row, from 0.
        row: usize,
        /// The value.
        found: f64,
    },
    /// Time stands still or runs back.
    #[error(
        "recording {recording}: expected rising times, found {found} s in row {row} after {before} s"
    )]
    Time {
        /// Number of the recording, from 0.
        recording: usize,
        /// Number of the row, from 0.
        row: usize,
        /// Time of the row [s].
        found: f64,
        /// Time of the row before [s].
        before: f64,
    },
    /// There are too few rows.
    #[error("recording {recording}: expected {expected} rows or more, found {found}")]
    TooShort {
        /// Number of the recording, from 0.
        recording: usize,
        /// Fewest rows.
        expected: usize,
        /// Rows that there are.
        found: usize,
    },
    /// The nominal car could not be smoothed along a recording.
    #[error(
        "recording {recording}: states could not be smoothed: {source}; check the units of the columns and the noises"
    )]
    Smoothing {
        /// Number of the recording, from 0.
        recording: usize,
        /// What went wrong.
        source: EmError,
    },
    /// Whoever was reported of the progress called it off.
    #[error("cancelled")]
    Cancelled,
    /// No start led to numbers.
    #[error(
        "no start gave a finite cost, of {starts}; check that the car's masses and lengths fit the recording, that inputs are \
         in N and rad, and that the speed stays above 1 m/s"
    )]
    NoStart {
        /// How many there were.
        starts: usize,
    },
}
