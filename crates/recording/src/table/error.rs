//! Defines the errors of loading a table.

mod csv;
mod mcap;

use std::path::{Path, PathBuf};

use diagnostics::suggest::{did_you_mean, join_shortened};

pub use self::csv::CsvError;
pub use self::mcap::RecordingError;

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
        "no column `{column}` in {}: it has {}{}", path.display(), join_shortened(present),
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
    /// The scenario does not say which column is the time, and the file does not tell.
    #[error(
        "{} is read as {format}, which needs `time` in the scenario, the name of its column of time stamps [s]; as columns it has {}",
        path.display(), join_shortened(present)
    )]
    NoTime {
        /// The file.
        path: PathBuf,
        /// Its format.
        format: &'static str,
        /// The columns of the file.
        present: Vec<String>,
    },
    /// A word of the scenario is about CSV, and the file is none.
    #[error("{} is {format}: `{key}` is about CSV files, leave it out", path.display())]
    NotCsv {
        /// The file.
        path: PathBuf,
        /// Its format.
        format: &'static str,
        /// The key.
        key: &'static str,
    },
    /// Rows have no value.
    #[error(
        "`{column}` has no value in {count} row{} of {}, the first one in {place}: say `gaps = \"hold\"` for the last value, \
         or `gaps = \"interpolate\"` for the line between its neighbours, or fill them in the file", if *count == 1 { "" } else { "s" }, path.display()
    )]
    GapRule {
        /// The file.
        path: PathBuf,
        /// The column of the scenario.
        column: String,
        /// How many rows have none.
        count: usize,
        /// The first one.
        place: String,
    },
    /// No row has a value.
    #[error("`{column}` has no value in any row of {}", path.display())]
    NoValue {
        /// The file.
        path: PathBuf,
        /// The column of the scenario.
        column: String,
    },
    /// Columns of a clock do not overlap in time.
    #[error(
        "{columns} of {} have no row in common where each has a value: play them back as two tables", path.display()
    )]
    Apart {
        /// The file.
        path: PathBuf,
        /// The columns of the scenario.
        columns: String,
    },
    /// Several channels of a log have the name of a wanted column.
    #[error("`{column}` can be any of {} in {}: name one of them so", join_shortened(each), path.display())]
    Ambiguous {
        /// The file.
        path: PathBuf,
        /// The column of the scenario.
        column: String,
        /// The channels.
        each: Vec<String>,
    },
    /// A channel of a log has values that are not what is wanted.
    #[error("`{column}` of {}: {what}", path.display())]
    Values {
        /// The file.
        path: PathBuf,
        /// The column of the scenario.
        column: String,
        /// What was expected, and what was found.
        what: String,
    },
    /// The log of a data logger cannot be read.
    #[error("{}: {what}", path.display())]
    Log {
        /// The file.
        path: PathBuf,
        /// What was expected, and what was found.
        what: String,
    },
    /// The CSV file cannot be played back.
    #[error(transparent)]
    Csv(#[from] CsvError),
    /// The MCAP recording cannot be played back.
    #[error(transparent)]
    Recording(#[from] RecordingError),
    /// Several columns are wrong.
    #[error("{}", each.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n"))]
    Several {
        /// What is wrong with each.
        each: Vec<TableError>,
    },
}

impl TableError {
    pub(super) fn missing_column(path: &Path, column: &str, present: Vec<String>) -> Self {
        let hint = did_you_mean(column, present.iter().map(String::as_str));
        let (path, column) = (path.to_owned(), column.to_owned());
        TableError::MissingColumn { path, column, present, hint }
    }

    /// One error of some; `Several` of none is never made.
    pub(super) fn from_errors(errors: impl IntoIterator<Item = Self>) -> Self {
        let mut each: Vec<Self> = errors.into_iter().collect();
        if each.len() == 1 { each.remove(0) } else { TableError::Several { each } }
    }

    /// The errors that it consists of.
    #[must_use]
    pub fn into_errors(self) -> Vec<Self> {
        match self {
            TableError::Several { each } => each,
            one => vec![one],
        }
    }

    /// The word of the scenario that does not fit the file: a column, or what is the time.
    #[must_use]
    pub fn offending_word(&self) -> Option<&str> {
        match self {
            TableError::MissingColumn { column, .. }
            | TableError::Ambiguous { column, .. }
            | TableError::Values { column, .. }
            | TableError::GapRule { column, .. }
            | TableError::NoValue { column, .. } => Some(column),
            TableError::Csv(error) => error.offending_word(),
            TableError::Recording(error) => error.offending_word(),
            _ => None,
        }
    }
}
