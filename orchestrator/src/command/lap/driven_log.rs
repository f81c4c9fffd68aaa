//! Finds the fastest lap of a log or a recorded run beside the fastest possible one, and tells what is odd about it.

use std::path::{Path, PathBuf};

use clap::Args;
use diagnostics::{Error, escape_for_terminal};
use lap::{DrivenLap, DrivenNode, LapNode, LapOptimum};
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

/// Way beside the road from which on a log is doubted [m]: more than a car that runs wide.
const BESIDE_ROAD: f64 = 3.0;
/// Time without a position that is told [s].
const LONG_GAP: f64 = 0.5;
/// Share of the least lap time below which a log is not of this car.
const SURELY_FASTER: f64 = 0.98;
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
        for note in doubts(&lap, line, optimum) {
            print_to_stderr(&escape_for_terminal(&format!("note: {}: {note}", self.path.display())));
        }
        Ok(LoggedLap { log: file_name(&self.path), lap })
    }
}

/// What is odd about a lap of a log.
fn doubts(lap: &DrivenLap, line: &TrackLine, optimum: &LapOptimum) -> Vec<String> {
    let mut doubts = Vec::new();
    let beside_road = |(node, best): (&DrivenNode, &LapNode)| {
        line.widths_at(best.s).map_or(0.0, |[left, right]| (node.n - left).max(-right - node.n))
    };
    let beside_road: Vec<f64> = lap.nodes.iter().zip(&optimum.nodes).map(beside_road).collect();
    let farthest = beside_road.iter().copied().fold(0.0, f64::max);
    if farthest > BESIDE_ROAD {
        let share = beside_road.iter().filter(|it| **it > 0.0).count() as f64 / beside_road.len() as f64;
        doubts.push(format!(
            "{:.0} % of the lap is beside the road, up to {farthest:.1} m: does the log have the origin of the track?",
            100.0 * share
        ));
    }
    if lap.longest_gap > LONG_GAP {
        doubts.push(format!(
            "the positions of the lap have a gap of {:.1} s: speeds there are means over the gap",
            lap.longest_gap
        ));
    }
    if lap.lap_time < SURELY_FASTER * optimum.lap_time {
        doubts.push(
            "the lap is faster than this car can be: is its time in another unit, or was it another car?"
                .to_owned(),
        );
    }
    doubts
}
