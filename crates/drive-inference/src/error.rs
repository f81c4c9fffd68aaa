//! Says why tires could not be identified from drives.

use kalman::EmError;
use preparation::{Drive, DriveError};
use thiserror::Error;

/// Why tires could not be identified from recordings.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum Error {
    /// There is nothing to identify from.
    #[error("expected at least one recording, found none")]
    NoRecording,
    /// The columns of a recording cannot be used.
    #[error("recording {recording}: {source}")]
    Drive {
        /// Number of the recording, from 0.
        recording: usize,
        /// What is wrong.
        source: DriveError,
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

/// Checks the columns of all recordings.
///
/// # Errors
///
/// [`Error::NoRecording`] and [`Error::Drive`].
pub fn check_recordings(recordings: &[Drive]) -> Result<(), Error> {
    if recordings.is_empty() {
        return Err(Error::NoRecording);
    }
    for (recording, drive) in recordings.iter().enumerate() {
        drive.check_columns().map_err(|source| Error::Drive { recording, source })?;
    }
    Ok(())
}
