//! Finds the fastest lap of a log or a recorded run beside the fastest possible one, and tells what is odd about it.

use std::path::{Path, PathBuf};

use clap::Args;
use diagnostics::{Error, escape_for_terminal};
use lap::{DrivenLap, LapOptimum};
use lap_report::LoggedLap;
use track::{LocalPlane, TrackLine};

use super::file_name;
use super::position_log::{PositionColumns, PositionLog};
use crate::command::print_to_stderr;

/// Arguments of the log.
#[derive(Args)]
pub struct DrivenLogArguments {
    /// A log or the folder of a run with positions on this track: where its fastest lap loses time to the fastest possible one.
    #[arg(long, value_name = "FILE")]
    log: Option<PathBuf>,
    /// Columns of the log with the position [default: plant.X,plant.Y, X,Y, x,y or latitude and longitude].
    #[arg(long, value_name = "X,Y", requires = "log")]
    log_position: Option<String>,
    /// Column of the log with the time, where its format has none of its own [default: t, time, Time or timestamp].
    #[arg(long, value_name = "COLUMN", requires = "log")]
    log_time: Option<String>,
}

impl DrivenLogArguments {
    /// The positions of the log on the plane of the track, if one is named.
    ///
    /// # Errors
    /// When it cannot be read, has no such columns, or is in degrees and the track tells no origin.
    pub fn read(&self, track: &Path, plane: Option<LocalPlane>) -> Result<Option<PositionLog>, Error> {
        let Some(path) = &self.log else { return Ok(None) };
        let columns = PositionColumns {
            position: self.log_position.as_deref(),
            time: self.log_time.as_deref(),
            options: ["--log-position", "--log-time"],
        };
        let log = PositionLog::read(path, &columns, plane)?;
        if log.plane.is_some() && plane.is_none() {
            let message = format!(
                "{}: the positions are in degrees, and {} does not tell where its origin is",
                log.path.display(),
                track.display()
            );
            return Err(Error::invalid_input(message).with_help(
                "add a comment to the track, `# origin LATITUDE LONGITUDE`, or make a track of the log: trackside track LOG",
            ));
        }
        Ok(Some(log))
    }
}

impl PositionLog {
    /// Its fastest lap; what is odd about it is told.
    ///
    /// # Errors
    /// When it has none on this track.
    pub fn fastest_lap(&self, line: &TrackLine, optimum: &LapOptimum) -> Result<LoggedLap, Error> {
        let lap = DrivenLap::find_fastest(&self.samples, line, optimum)
            .map_err(|error| Error::invalid_input(format!("{}: {error}", self.path.display())))?;
        for note in lap.doubts(line, optimum) {
            print_to_stderr(&escape_for_terminal(&format!("note: {}: {note}", self.path.display())));
        }
        Ok(LoggedLap { log: file_name(&self.path), lap })
    }
}
