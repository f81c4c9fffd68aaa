//! Loads columns of a CSV file, an MCAP recording, a bag of ROS 2 or a data logger's log, and plays them back over time.

mod csv;
mod error;
mod exact_values;
mod foreign;
mod gaps;
mod join;
mod log;
mod mcap;
mod names;
mod read_request;
mod survey;
mod time_ranges;
mod title;

use std::path::Path;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

pub use self::csv::read_untimed_columns;
pub(crate) use self::csv::{CsvColumn, read_csv_table};
pub use self::error::{CsvError, RecordingError, TableError};
use self::exact_values::ExactValues;
pub use self::foreign::is_fmu;
pub(crate) use self::mcap::McapReader;
pub use self::read_request::{
    ColumnRequest, ColumnScaling, ColumnType, CsvDialect, DecimalMark, GapRule, ReadRequest, Separator,
    UnitRow,
};
pub use self::survey::survey_file;
pub(crate) use self::title::format_title;

/// Values between two recorded ones.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Interpolation {
    /// On the straight line between its neighbours.
    #[default]
    Linear,
    /// The last recorded value.
    Hold,
}

/// The columns that a reader takes from a file.
#[derive(Debug)]
struct ReadColumns {
    /// Time stamps [s], in rising order; columns that were recorded together share them.
    clocks: Vec<Vec<f64>>,
    /// Each with what is wrong with it, so that no mistake hides another.
    columns: Vec<Result<ReadSeries, TableError>>,
    /// The time of the file's clock when these stamps are 0 [s].
    zero: f64,
    warnings: Vec<String>,
}

#[derive(Debug)]
struct ReadSeries {
    /// The index of its clock.
    clock: usize,
    /// NaN where there is none; of what is kept, the places.
    values: Vec<f64>,
    exact: ExactValues,
    /// Its unit, from the file.
    unit: Option<String>,
    /// Where the first row without a value is.
    gap: Option<String>,
}

/// The title of a column.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ColumnTitle {
    /// As it stands in the file.
    pub text: String,
    /// Without its unit.
    pub plain: String,
    /// The shortest name that tells it from the other columns.
    pub name: String,
    /// The unit that the file says.
    pub unit: Option<String>,
}

/// The titles of a file.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct FileTitles {
    /// Those of its columns; of an MCAP recording that is none of ROS, only reading it tells, and there are none.
    pub columns: Vec<ColumnTitle>,
    /// Whether it has times without a column that is named.
    pub has_time: bool,
    /// As which format it is read, and where its titles stand.
    pub format: String,
}

/// The titles of a file.
///
/// # Errors
/// When the file cannot be read, or has no titles.
pub fn read_titles(path: impl AsRef<Path>) -> Result<FileTitles, TableError> {
    let path = path.as_ref();
    Ok(match TableFileFormat::detect(path)? {
        TableFileFormat::Mcap => mcap::ros_titles(path)?,
        TableFileFormat::Log(log) => {
            let found = log::ChannelIndex::new(path, &log);
            let (columns, has_time) = (found.column_titles(), found.all_clocks_have_times());
            FileTitles { columns, has_time, format: log.format.to_owned() }
        }
        TableFileFormat::Csv => csv::csv_titles(path)?,
    })
}

/// Whether a file has each of these columns, by their names in it; where not, what is wrong.
///
/// # Errors
/// When the file cannot be read, or has no titles.
pub fn check_columns_exist(
    path: &Path,
    names: &[&str],
    dialect: &CsvDialect,
) -> Result<Vec<Result<(), TableError>>, TableError> {
    match TableFileFormat::detect(path)? {
        TableFileFormat::Mcap => mcap::check_message_columns(path, names),
        TableFileFormat::Log(log) => {
            let found = log::ChannelIndex::new(path, &log);
            Ok(names.iter().map(|name| found.find_channel(name).map(drop)).collect())
        }
        TableFileFormat::Csv => csv::check_csv_columns(path, names, dialect),
    }
}

/// The format of a file, by its contents.
enum TableFileFormat {
    Mcap,
    Log(Box<log_file::LogFile>),
    Csv,
}

impl TableFileFormat {
    fn detect(path: &Path) -> Result<Self, TableError> {
        let open = |source| TableError::Open { path: path.to_owned(), source };
        if mcap::is_message_recording(path).map_err(open)? {
            return Ok(TableFileFormat::Mcap);
        }
        Ok(log::open_log(path)?.map_or(TableFileFormat::Csv, |log| TableFileFormat::Log(Box::new(log))))
    }
}

/// Columns of a recording over their time stamps.
#[derive(Debug, Clone)]
pub struct TimeSeriesTable {
    clocks: Vec<TableClock>,
    columns: Vec<TableColumn>,
    /// The time of the file's clock when stamps are 0 [s].
    zero: f64,
    /// The stamp at the scenario's time 0 [s].
    origin: f64,
    interpolation: Interpolation,
    warnings: Vec<String>,
    /// Of logs one after another, a stamp in the pause before each but the first one [s].
    logs: Vec<f64>,
}

#[derive(Debug, Clone)]
struct TableClock {
    /// Time stamps [s].
    stamps: Vec<f64>,
    /// What these are earlier than those of the file [s].
    delay: f64,
    /// The row at or before the last requested time: times mostly ascend.
    cursor: usize,
}

#[derive(Debug, Clone)]
struct TableColumn {
    name: String,
    clock: usize,
    /// Of what is kept, the places.
    values: Vec<f64>,
    exact: ExactValues,
    unit: Option<String>,
}

/// The index of a clock that is `delay` [s] earlier than another one; a new one where there is none.
fn delayed_clock(clocks: &mut Vec<TableClock>, of: usize, delay: f64) -> usize {
    if delay == 0.0 {
        return of;
    }
    let stamps: Vec<f64> = clocks[of].stamps.iter().map(|stamp| stamp - delay).collect();
    let same = |clock: &TableClock| clock.delay == delay && clock.stamps == stamps;
    clocks.iter().position(same).unwrap_or_else(|| {
        clocks.push(TableClock { stamps, delay, cursor: 0 });
        clocks.len() - 1
    })
}

/// Tolerance for equal times [s]: scenario times are rounded multiples of a decimal step, and recordings round
/// stamps to nanoseconds.
const EDGE: f64 = 1e-9;

impl TimeSeriesTable {
    /// Reads the wanted columns, with linear interpolation and the scenario's time 0 at the earliest of their time stamps.
    ///
    /// A file that begins like an MCAP recording or the database of a ROS 2 bag is read as one, as is the folder of a bag: the time is `log_time`,
    /// `publish_time` or `header.stamp`, and a column is `/topic.field`, or `node.variable` in a recording of a run. When the time is absent, it is
    /// `header.stamp` where messages of ROS have one that fits, and `log_time` elsewhere.
    /// The log of a data logger has the time of its own, or in the column that is named, and a column is `channel`, or
    /// `group.channel`. Anything else is read as CSV, of which the time is a column too.
    ///
    /// # Errors
    /// When the file cannot be read, lacks a column or has a value that cannot be played back.
    pub fn read(path: impl AsRef<Path>, request: &ReadRequest) -> Result<Self, TableError> {
        let path = path.as_ref();
        let mut recorded = match TableFileFormat::detect(path)? {
            TableFileFormat::Mcap => mcap::read_message_columns(path, request)?,
            TableFileFormat::Log(log) => log::read_log_columns(path, *log, request)?,
            TableFileFormat::Csv => csv::read_csv_columns(path, request)?,
        };
        gaps::fill_gaps(path, &mut recorded, &request.columns)?;
        Self::new(recorded, request)
    }

    fn new(recorded: ReadColumns, request: &ReadRequest) -> Result<Self, TableError> {
        let (right, wrong): (Vec<_>, Vec<_>) = recorded.columns.into_iter().partition(Result::is_ok);
        if !wrong.is_empty() {
            return Err(TableError::from_errors(wrong.into_iter().filter_map(Result::err)));
        }
        let clock = |stamps| TableClock { stamps, delay: 0.0, cursor: 0 };
        let mut clocks: Vec<TableClock> = recorded.clocks.into_iter().map(clock).collect();
        let column = |(request, series): (&ColumnRequest, ReadSeries)| {
            let ReadSeries { clock, mut values, exact, unit, .. } = series;
            if let ExactValues::Nothing = exact {
                values.iter_mut().for_each(|value| *value = request.scaling.apply(*value));
            }
            let clock = delayed_clock(&mut clocks, clock, request.delay);
            TableColumn { name: request.name.clone(), clock, values, exact, unit }
        };
        let columns = request.columns.iter().zip(right.into_iter().flatten()).map(column).collect();
        let mut table = Self {
            clocks,
            columns,
            zero: recorded.zero,
            origin: 0.0,
            interpolation: Interpolation::default(),
            warnings: recorded.warnings,
            logs: Vec::new(),
        };
        table.set_origin(None);
        Ok(table)
    }

    /// Sets the time of the file's clock [s] at the scenario's time 0; the earliest time stamp unless it is given.
    pub fn set_origin(&mut self, shown: Option<f64>) {
        let first = || self.clocks.iter().map(|clock| clock.stamps[0] + clock.delay).reduce(f64::min);
        self.origin = shown.map(|shown| shown - self.zero).or_else(first).unwrap_or(0.0);
    }

    /// Sets the interpolation.
    pub fn set_interpolation(&mut self, interpolation: Interpolation) {
        self.interpolation = interpolation;
    }

    /// The names in the scenario, in the order of the column indices.
    pub fn column_names(&self) -> impl ExactSizeIterator<Item = &str> {
        self.columns.iter().map(|column| column.name.as_str())
    }

    /// The time stamps of each clock, in times of the scenario [s].
    #[must_use]
    pub fn clock_times(&self) -> Vec<Vec<f64>> {
        let shifted = |clock: &TableClock| clock.stamps.iter().map(|stamp| stamp - self.origin).collect();
        self.clocks.iter().map(shifted).collect()
    }

    /// The index of a column's clock in [`TimeSeriesTable::clock_times`].
    ///
    /// # Panics
    /// When `column` is not an index into [`TimeSeriesTable::column_names`].
    #[must_use]
    pub fn column_clock(&self, column: usize) -> usize {
        self.columns[column].clock
    }

    /// The values of a column at its time stamps.
    ///
    /// # Panics
    /// When `column` is not an index into [`TimeSeriesTable::column_names`].
    #[must_use]
    pub fn column_values(&self, column: usize) -> &[f64] {
        &self.columns[column].values
    }

    /// The unit of a column, if the file tells.
    ///
    /// # Panics
    /// When `column` is not an index into [`TimeSeriesTable::column_names`].
    #[must_use]
    pub fn column_unit(&self, column: usize) -> Option<&str> {
        self.columns[column].unit.as_deref()
    }

    /// Oddities of the file, such as a recording that was cut off.
    #[must_use]
    pub fn warnings(&self) -> &[String] {
        &self.warnings
    }

    /// The column's value at a time of the scenario [s]: the first one before its recording begins
    /// and the last one after it ends. Constant effort while times ascend.
    ///
    /// # Panics
    /// When `column` is not an index into [`TimeSeriesTable::column_names`].
    pub fn value_at(&mut self, column: usize, time: f64) -> f64 {
        let TableColumn { clock, values, exact, .. } = &self.columns[column];
        let clock = &mut self.clocks[*clock];
        let stamp = time + self.origin;
        let here = clock.seek_row(stamp + EDGE);
        let past = stamp - clock.stamps[here];
        if let ExactValues::Integers(integers) = exact {
            return integers[values[here] as usize] as f64;
        }
        if here + 1 == values.len() || self.interpolation == Interpolation::Hold || past <= EDGE {
            return values[here];
        }
        let share = (past / (clock.stamps[here + 1] - clock.stamps[here])).clamp(0.0, 1.0);
        values[here] * (1.0 - share) + values[here + 1] * share
    }
}

impl TableClock {
    /// The last row at or before the stamp, or the first one.
    fn seek_row(&mut self, stamp: f64) -> usize {
        let TableClock { stamps, cursor, .. } = self;
        if stamp < stamps[*cursor] {
            *cursor = stamps[..*cursor].partition_point(|t| *t <= stamp).saturating_sub(1);
        }
        while stamps.get(*cursor + 1).is_some_and(|t| *t <= stamp) {
            *cursor += 1;
        }
        *cursor
    }
}

#[cfg(test)]
mod tests;
