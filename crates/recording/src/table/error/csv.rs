//! Defines the errors of CSV files.

use std::path::PathBuf;

/// An error in a CSV file; lines count from 1.
#[derive(Debug, thiserror::Error)]
pub enum CsvError {
    /// The file cannot be read to its end.
    #[error("cannot read the recording {}: {source}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// What the system says.
        source: std::io::Error,
    },
    /// A line, or a row whose texts have several lines, is longer than any table's.
    #[error(
        "line {line} of {}: expected rows of at most {longest} bytes, found a longer one; if the file is a table, look there for a quotation mark \
         that is not closed, or for lost ends of lines", path.display()
    )]
    LongRow {
        /// The file.
        path: PathBuf,
        /// The line.
        line: usize,
        /// The bound [B].
        longest: usize,
    },
    /// The bytes of the file are no text that is known here.
    #[error("{} is {found}: expected a CSV file in UTF-8, or an MCAP recording; {cure}", path.display())]
    NoText {
        /// The file.
        path: PathBuf,
        /// Its format.
        found: &'static str,
        /// A remedy.
        cure: &'static str,
    },
    /// There is no header or no row below it.
    #[error("expected a header and at least one row in {}, found {found}", path.display())]
    Empty {
        /// The file.
        path: PathBuf,
        /// What is there.
        found: &'static str,
    },
    /// The first line has numbers only.
    #[error(
        "line {line} of {} has numbers only: expected a line with the titles of the columns above it, such as `{example}`",
        path.display()
    )]
    NoTitles {
        /// The file.
        path: PathBuf,
        /// The line.
        line: usize,
        /// A line of titles.
        example: String,
    },
    /// Several columns have the title of a wanted one.
    #[error(
        "`{column}` can be any of the columns {places} of {}: name one of them so", path.display()
    )]
    Ambiguous {
        /// The file.
        path: PathBuf,
        /// The column of the scenario.
        column: String,
        /// Names of the columns that tell them apart.
        places: String,
    },
    /// A row has more or fewer cells than the header.
    #[error("line {line} of {} has {found} cells, expected {expected} as in the header{hint}", path.display())]
    Ragged {
        /// The file.
        path: PathBuf,
        /// The line.
        line: usize,
        /// The cells of the header.
        expected: usize,
        /// The cells of the line.
        found: usize,
        /// What may be behind it.
        hint: &'static str,
    },
    /// A cell is not a number.
    #[error("line {line} of {}: expected {expected} in column `{column}`, found {text:?}{hint}", path.display())]
    Cell {
        /// The file.
        path: PathBuf,
        /// The line.
        line: usize,
        /// The column.
        column: String,
        /// What should be there.
        expected: &'static str,
        /// The cell.
        text: String,
        /// What may be behind it.
        hint: &'static str,
    },
    /// A comma can be a decimal mark or a separator of thousands.
    #[error(
        "line {line} of {}: is {text:?} in column `{column}` a number with a decimal comma, or are these thousands? \
         Say `decimal = \",\"` for the first; for the second, export without separators of thousands", path.display()
    )]
    Comma {
        /// The file.
        path: PathBuf,
        /// The line.
        line: usize,
        /// The column.
        column: String,
        /// The cell.
        text: String,
    },
    /// A time stamp does not come after the one before it.
    #[error(
        "line {line} of {}: expected a time after {before} of the row before, found {found}; \
         sort the rows and remove repeated times{hint}", path.display()
    )]
    TimeNotIncreasing {
        /// The file.
        path: PathBuf,
        /// The line.
        line: usize,
        /// The time stamp of the row before [s].
        before: f64,
        /// The time stamp of the line [s].
        found: f64,
        /// What may be behind it.
        hint: &'static str,
    },
    /// A title and the line of units contradict each other.
    #[error(
        "`{column}` of {} is in [{title}] by its title and in [{below}] by line {line}: correct one of them", path.display()
    )]
    TwoUnits {
        /// The file.
        path: PathBuf,
        /// The title of the column.
        column: String,
        /// The unit in the title.
        title: String,
        /// The unit in the line.
        below: String,
        /// The line.
        line: usize,
    },
    /// A time without a unit that cannot be in seconds.
    #[error(
        "the time `{column}` of {} begins with {first}, which in s is thousands of years after 1970: say `time_unit = \"{unit}\"`, if it is in {unit} since 1970",
        path.display()
    )]
    TimeMagnitude {
        /// The file.
        path: PathBuf,
        /// The column of the time.
        column: String,
        /// The first time.
        first: f64,
        /// The unit in which it is a time of our days.
        unit: &'static str,
    },
    /// The unit of the time is none, or contradicts that of the scenario.
    #[error("the time `{column}` of {} is in [{unit}], {why}", path.display())]
    TimeUnit {
        /// The file.
        path: PathBuf,
        /// The column of the time.
        column: String,
        /// The unit in the file.
        unit: String,
        /// What is wrong with it.
        why: &'static str,
    },
}

impl CsvError {
    /// The word of the scenario that does not fit the file.
    #[must_use]
    pub fn offending_word(&self) -> Option<&str> {
        match self {
            CsvError::Ambiguous { column, .. }
            | CsvError::TimeUnit { column, .. }
            | CsvError::TimeMagnitude { column, .. } => Some(column),
            _ => None,
        }
    }
}
