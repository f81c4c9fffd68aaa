//! Plays recorded columns of a CSV file or an MCAP recording back at any time.

mod csv;
mod mcap;

use std::io::Read as _;
use std::path::{Path, PathBuf};

use diagnostics::suggest::{closest_question, shortened};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

pub use self::csv::{CsvError, columns};
pub(crate) use self::mcap::Mcap;
pub use self::mcap::RecordingError;

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

/// Why a recording cannot be played back.
#[derive(Debug, thiserror::Error)]
pub enum TableError {
    /// The file cannot be opened.
    #[error("cannot open the recording {}: {source}", path.display())]
    Open {
        /// The file.
        path: PathBuf,
        /// What the system says.
        source: std::io::Error,
    },
    /// The file does not have a column that the scenario asks for.
    #[error(
        "no column `{column}` in {}: it has {}{}", path.display(), shortened(present),
        hint.as_ref().map(|hint| format!("; {hint}")).unwrap_or_default()
    )]
    MissingColumn {
        /// The file.
        path: PathBuf,
        /// The column that was asked for.
        column: String,
        /// The columns that are there.
        present: Vec<String>,
        /// The question whether the closest of them was meant.
        hint: Option<String>,
    },
    /// The scenario does not say which column of a CSV file is the time.
    #[error(
        "{} is read as CSV, which needs `time`, the column of the time stamps [s]: it has {}",
        path.display(), shortened(present)
    )]
    NoTime {
        /// The file.
        path: PathBuf,
        /// The columns that are there.
        present: Vec<String>,
    },
    /// The CSV file cannot be played back.
    #[error(transparent)]
    Csv(#[from] CsvError),
    /// The MCAP recording cannot be played back.
    #[error(transparent)]
    Recording(#[from] RecordingError),
}

impl TableError {
    fn missing(path: &Path, column: &str, present: Vec<String>) -> Self {
        let hint = closest_question(column, present.iter().map(String::as_str));
        let (path, column) = (path.to_owned(), column.to_owned());
        TableError::MissingColumn { path, column, present, hint }
    }

    /// The word of the scenario that does not fit the file: a column, or what is the time.
    #[must_use]
    pub fn word(&self) -> Option<&str> {
        match self {
            TableError::MissingColumn { column, .. } => Some(column),
            TableError::Recording(error) => error.word(),
            _ => None,
        }
    }
}

/// What a reader takes from a file.
#[derive(Debug)]
struct Recorded {
    /// Time stamps [s], in rising order; columns that were recorded together share them.
    clocks: Vec<Vec<f64>>,
    columns: Vec<Series>,
    /// What the file's clock shows when these stamps are 0 [s].
    zero: f64,
    warning: Option<String>,
}

#[derive(Debug)]
struct Series {
    /// Which of the clocks.
    clock: usize,
    values: Vec<f64>,
    /// As the file says.
    unit: Option<String>,
}

/// Columns of a recording over their time stamps.
#[derive(Debug, Clone)]
pub struct Table {
    clocks: Vec<Clock>,
    columns: Vec<Column>,
    /// What the file's clock shows when stamps are 0 [s].
    zero: f64,
    /// The stamp at the scenario's time 0 [s].
    origin: f64,
    interpolation: Interpolation,
    warning: Option<String>,
}

#[derive(Debug, Clone)]
struct Clock {
    /// Time stamps [s].
    stamps: Vec<f64>,
    /// The row at or before the last time that was asked for: times mostly ascend.
    cursor: usize,
}

#[derive(Debug, Clone)]
struct Column {
    name: String,
    clock: usize,
    values: Vec<f64>,
    unit: Option<String>,
}

/// Scenario times are multiples of a decimal step, which rounding puts just beside a time stamp
/// that they should meet; recordings round stamps to nanoseconds [s].
const EDGE: f64 = 1e-9;

impl Table {
    /// Reads the wanted columns, given as pairs of the name in the scenario and the name in the file,
    /// with linear interpolation and the scenario's time 0 at the earliest of their time stamps.
    ///
    /// A file that begins like an MCAP recording is read as one: `time` is `log_time` (also when absent)
    /// or `publish_time`, and a column is `/topic.field`, or `node.variable` in a recording of a run.
    /// Anything else is read as CSV, of which `time` is a column too [s].
    ///
    /// # Errors
    /// When the file cannot be read, lacks a column or has a value that cannot be played back.
    pub fn read(
        path: impl AsRef<Path>,
        time: Option<&str>,
        columns: &[(String, String)],
    ) -> Result<Self, TableError> {
        let path = path.as_ref();
        let open = |source| TableError::Open { path: path.to_owned(), source };
        let mut file = std::fs::File::open(path).map_err(open)?;
        let mut magic = Vec::new();
        (&mut file).take(mcap::MAGIC.len() as u64).read_to_end(&mut magic).map_err(open)?;
        let wanted: Vec<_> = columns.iter().map(|(_, column)| column.as_str()).collect();
        let read = match magic == mcap::MAGIC {
            true => mcap::read(path, time, &wanted)?,
            false => csv::read(path, time, &wanted)?,
        };
        let names = columns.iter().map(|(name, _)| name.clone());
        let column = |(name, series): (_, Series)| {
            let Series { clock, values, unit } = series;
            Column { name, clock, values, unit }
        };
        let clock = |stamps| Clock { stamps, cursor: 0 };
        let mut table = Self {
            clocks: read.clocks.into_iter().map(clock).collect(),
            columns: names.zip(read.columns).map(column).collect(),
            zero: read.zero,
            origin: 0.0,
            interpolation: Interpolation::default(),
            warning: read.warning,
        };
        table.set_origin(None);
        Ok(table)
    }

    /// Plays back so that the file's clock shows this at the scenario's time 0 [s], the earliest time
    /// stamp when absent: scenario time is the file's time minus `shown`.
    pub fn set_origin(&mut self, shown: Option<f64>) {
        let first = || self.clocks.iter().map(|clock| clock.stamps[0]).reduce(f64::min);
        self.origin = shown.map(|shown| shown - self.zero).or_else(first).unwrap_or(0.0);
    }

    /// Plays back with this interpolation.
    pub fn set_interpolation(&mut self, interpolation: Interpolation) {
        self.interpolation = interpolation;
    }

    /// The names in the scenario; their order is that of the column indices.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        self.columns.iter().map(|column| column.name.as_str())
    }

    /// The time stamps of each clock, in times of the scenario [s].
    #[must_use]
    pub fn times(&self) -> Vec<Vec<f64>> {
        let shifted =
            |clock: &Clock| clock.stamps.iter().map(|stamp| stamp - self.origin).collect();
        self.clocks.iter().map(shifted).collect()
    }

    /// Which of [`Table::times`] a column was recorded at.
    ///
    /// # Panics
    /// When `column` is not an index into [`Table::names`].
    #[must_use]
    pub fn clock(&self, column: usize) -> usize {
        self.columns[column].clock
    }

    /// The values of a column at its time stamps.
    ///
    /// # Panics
    /// When `column` is not an index into [`Table::names`].
    #[must_use]
    pub fn column(&self, column: usize) -> &[f64] {
        &self.columns[column].values
    }

    /// The unit of a column, if the file tells.
    ///
    /// # Panics
    /// When `column` is not an index into [`Table::names`].
    #[must_use]
    pub fn unit(&self, column: usize) -> Option<&str> {
        self.columns[column].unit.as_deref()
    }

    /// What is odd about the file, but no error.
    #[must_use]
    pub fn warning(&self) -> Option<&str> {
        self.warning.as_deref()
    }

    /// The column's value at a time of the scenario [s]: the first one before its recording begins
    /// and the last one after it ends. Constant effort while times ascend.
    ///
    /// # Panics
    /// When `column` is not an index into [`Table::names`].
    pub fn value(&mut self, column: usize, time: f64) -> f64 {
        let Column { clock, values, .. } = &self.columns[column];
        let clock = &mut self.clocks[*clock];
        let stamp = time + self.origin;
        let here = clock.seek(stamp + EDGE);
        let past = stamp - clock.stamps[here];
        if here + 1 == values.len() || self.interpolation == Interpolation::Hold || past <= EDGE {
            return values[here];
        }
        let share = (past / (clock.stamps[here + 1] - clock.stamps[here])).clamp(0.0, 1.0);
        values[here] * (1.0 - share) + values[here + 1] * share
    }
}

impl Clock {
    /// The last row at or before the stamp, or the first one.
    fn seek(&mut self, stamp: f64) -> usize {
        let Clock { stamps, cursor } = self;
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
