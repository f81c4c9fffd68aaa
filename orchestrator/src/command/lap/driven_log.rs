//! Reads the positions of a log or a recorded run, and finds its fastest lap beside the fastest possible one.

use std::path::{Path, PathBuf};

use clap::Args;
use cosim::quantity::convert_quantity;
use diagnostics::{Error, escape_for_terminal};
use lap::{DrivenLap, DrivenNode, LapNode, LapOptimum, PositionSample};
use lap_report::LoggedLap;
use recording::table::{
    ColumnRequest, CsvDialect, GapRule, ReadRequest, TableError, TimeSeriesTable, check_columns_exist,
    read_titles,
};
use track::TrackLine;

use super::file_name;
use crate::command::print_to_stderr;

/// Arguments of the log.
#[derive(Args)]
pub struct DrivenLogArguments {
    /// A log or the folder of a run with positions on this track: where its fastest lap loses time to the fastest possible one.
    #[arg(long, value_name = "FILE")]
    log: Option<PathBuf>,
    /// Columns of the log with the position [default: plant.X,plant.Y, X,Y or x,y].
    #[arg(long, value_name = "X,Y", requires = "log")]
    log_position: Option<String>,
    /// Column of the log with the time, where its format has none of its own [default: t, time or Time].
    #[arg(long, value_name = "COLUMN", requires = "log")]
    log_time: Option<String>,
}

/// Way beside the road from which on a log is doubted [m]: more than a car that runs wide.
const BESIDE_ROAD: f64 = 3.0;
/// Time without a position that is told [s].
const LONG_GAP: f64 = 0.5;
/// Share of the least lap time below which a log is not of this car.
const SURELY_FASTER: f64 = 0.98;
/// Columns of a position that need no mention.
const POSITIONS: [[&str; 2]; 3] = [["plant.X", "plant.Y"], ["X", "Y"], ["x", "y"]];
/// Columns of a time that need no mention.
const TIMES: [&str; 3] = ["t", "time", "Time"];

/// Positions of a log.
pub struct DrivenLog {
    /// Its file.
    pub path: PathBuf,
    /// The positions, in the order of the log.
    pub samples: Vec<PositionSample>,
}

impl DrivenLogArguments {
    /// The positions of the log, if one is named.
    ///
    /// # Errors
    /// When it cannot be read or has no such columns.
    pub fn read(&self) -> Result<Option<DrivenLog>, Error> {
        let Some(path) = &self.log else { return Ok(None) };
        let path = if path.is_dir() { path.join("run.mcap") } else { path.clone() };
        let [x, y] = self.position_columns(&path)?;
        let time = self.time_column(&path)?;
        let column = |column: String| ColumnRequest {
            name: column.clone(),
            column,
            gaps: GapRule::Drop,
            ..ColumnRequest::default()
        };
        let request = ReadRequest { time, columns: vec![column(x), column(y)], ..ReadRequest::default() };
        let mut table = TimeSeriesTable::read(&path, &request).map_err(table_error)?;
        let factors = [length_factor(&path, &table, 0)?, length_factor(&path, &table, 1)?];
        let times = table.clock_times().swap_remove(table.column_clock(0));
        let sample = |t: f64| PositionSample {
            t,
            position: [0, 1].map(|axis| factors[axis] * table.value_at(axis, t)),
        };
        let samples = times.into_iter().map(sample).collect();
        Ok(Some(DrivenLog { path, samples }))
    }

    fn position_columns(&self, path: &Path) -> Result<[String; 2], Error> {
        if let Some(told) = &self.log_position {
            let parts: Vec<&str> = told.split(',').map(str::trim).collect();
            let [x, y] = parts[..] else {
                let message = format!("--log-position {told}: expected two columns with a comma in between");
                return Err(Error::invalid_input(message));
            };
            return Ok([x.to_owned(), y.to_owned()]);
        }
        for names in POSITIONS {
            let found = check_columns_exist(path, &names, &CsvDialect::default());
            if found.map_err(table_error)?.iter().all(Result::is_ok) {
                return Ok(names.map(str::to_owned));
            }
        }
        let known = POSITIONS.map(|names| names.join(" and "));
        Err(Error::invalid_input(format!("{}: expected columns {}", path.display(), known.join(", or ")))
            .with_help("tell the columns of the position: --log-position X,Y"))
    }

    fn time_column(&self, path: &Path) -> Result<Option<String>, Error> {
        let titles = read_titles(path).map_err(table_error)?;
        let is_there = |name: &&&str| titles.columns.iter().any(|title| title.name == **name);
        let found = || TIMES.iter().find(is_there).map(|name| (*name).to_owned());
        // Of a recording of ours, only reading it tells its columns; it has times of its own.
        let needs_one = !titles.has_time && !titles.columns.is_empty();
        match self.log_time.clone().or_else(|| needs_one.then(found).flatten()) {
            None if needs_one => {
                let message = format!("{}: expected a time in a column {}", path.display(), TIMES.join(", "));
                Err(Error::invalid_input(message).with_help("tell the column of the time: --log-time COLUMN"))
            }
            time => Ok(time),
        }
    }
}

impl DrivenLog {
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

/// What makes metres of a column.
fn length_factor(path: &Path, table: &TimeSeriesTable, column: usize) -> Result<f64, Error> {
    let Some(unit) = table.column_unit(column) else { return Ok(1.0) };
    convert_quantity(1.0, unit, Some("m"), None, false).map_err(|error| {
        let name = table.column_names().nth(column).unwrap_or_default().to_owned();
        Error::invalid_input(format!("{}: column {name}: {error}", path.display()))
    })
}

fn table_error(error: TableError) -> Error {
    Error::invalid_input(error.to_string())
}
