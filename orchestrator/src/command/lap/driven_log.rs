//! Reads the positions of a log or a recorded run, for the lap that was driven beside the fastest one.

use std::path::{Path, PathBuf};

use clap::Args;
use cosim::quantity::convert_quantity;
use diagnostics::Error;
use lap::PositionSample;
use recording::table::{
    ColumnRequest, CsvDialect, GapRule, ReadRequest, TableError, TimeSeriesTable, check_columns_exist,
    read_titles,
};

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
