//! Reads columns of numbers from a CSV file.

use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};

use super::{Recorded, Series, TableError};

/// Why a CSV file cannot be played back; lines count from 1, the header's.
#[derive(Debug, thiserror::Error)]
pub enum CsvError {
    /// The file cannot be read to its end, or is not UTF-8.
    #[error("cannot read the recording {}: {source}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// What the reader says.
        source: ::csv::Error,
    },
    /// There is no header or no row below it.
    #[error("expected a header and at least one row in {}, found {found}", path.display())]
    Empty {
        /// The file.
        path: PathBuf,
        /// What is there.
        found: &'static str,
    },
    /// A row has more or fewer cells than the header.
    #[error("line {line} of {} has {found} cells, expected {expected} as in the header", path.display())]
    Ragged {
        /// The file.
        path: PathBuf,
        /// The line.
        line: u64,
        /// The cells of the header.
        expected: u64,
        /// The cells of the line.
        found: u64,
    },
    /// A cell is not a number.
    #[error("line {line} of {}: expected a number in column `{column}`, found {text:?}", path.display())]
    NotANumber {
        /// The file.
        path: PathBuf,
        /// The line.
        line: u64,
        /// The column.
        column: String,
        /// The cell.
        text: String,
    },
    /// A cell is infinite or NaN.
    #[error(
        "line {line} of {}: expected a finite number in column `{column}`, found {text}; \
         remove the row or fill the gap", path.display()
    )]
    NotFinite {
        /// The file.
        path: PathBuf,
        /// The line.
        line: u64,
        /// The column.
        column: String,
        /// The cell.
        text: String,
    },
    /// A time stamp does not come after the one before it.
    #[error(
        "line {line} of {}: expected a time after {before} of the row before, found {found}; \
         sort the rows and remove repeated times", path.display()
    )]
    TimeNotIncreasing {
        /// The file.
        path: PathBuf,
        /// The line.
        line: u64,
        /// The time stamp of the row before [s].
        before: f64,
        /// The time stamp of the line [s].
        found: f64,
    },
}

/// Reads the time stamps [s] and the wanted columns by their names in the header.
pub(super) fn read(
    path: &Path,
    time: Option<&str>,
    wanted: &[&str],
) -> Result<Recorded, TableError> {
    let mut source = Source::open(path)?;
    let header = source.header()?;
    let Some(time) = time else {
        return Err(TableError::NoTime { path: path.to_owned(), present: header });
    };
    let positions = positions(path, &header, std::iter::once(time).chain(wanted.iter().copied()))?;
    let mut cells = source.cells(&header, &positions, true)?;
    let time = cells.remove(0);
    let series = |values| Series { clock: 0, values, unit: None };
    let columns = cells.into_iter().map(series).collect();
    Ok(Recorded { clocks: vec![time], columns, zero: 0.0, warning: None })
}

/// Reads the wanted columns of a file whose rows have no time, such as the points of a line; `kept` is its text where a
/// recording has it.
///
/// # Errors
/// When the file cannot be read, lacks a column or has a value that is no finite number.
pub fn columns(
    path: &Path,
    kept: Option<&str>,
    wanted: &[&str],
) -> Result<Vec<Vec<f64>>, TableError> {
    let mut source = match kept {
        Some(text) => Source::new(path, Box::new(text.as_bytes())),
        None => Source::open(path)?,
    };
    let header = source.header()?;
    let positions = positions(path, &header, wanted.iter().copied())?;
    Ok(source.cells(&header, &positions, false)?)
}

/// Where the columns are in the header.
fn positions<'a>(
    path: &Path,
    header: &[String],
    wanted: impl Iterator<Item = &'a str>,
) -> Result<Vec<usize>, TableError> {
    let find = |column: &str| {
        let found = header.iter().position(|name| name == column);
        found.ok_or_else(|| TableError::missing(path, column, header.to_owned()))
    };
    wanted.map(find).collect()
}

struct Source<'a> {
    path: &'a Path,
    reader: ::csv::Reader<Box<dyn Read + 'a>>,
}

impl<'a> Source<'a> {
    fn open(path: &'a Path) -> Result<Self, TableError> {
        let file = File::open(path)
            .map_err(|source| TableError::Open { path: path.to_owned(), source })?;
        Ok(Source::new(path, Box::new(file)))
    }

    fn new(path: &'a Path, text: Box<dyn Read + 'a>) -> Self {
        let reader = ::csv::ReaderBuilder::new().buffer_capacity(1 << 16).from_reader(text);
        Source { path, reader }
    }

    /// The trimmed names of the columns; numpy writes the header as a comment that begins with `#`.
    fn header(&mut self) -> Result<Vec<String>, CsvError> {
        let record = self
            .reader
            .headers()
            .map_err(|source| CsvError::Read { path: self.path.to_owned(), source })?;
        let mut names: Vec<String> = record.iter().map(|cell| cell.trim().to_owned()).collect();
        match names.first_mut() {
            Some(first) => *first = first.trim_start_matches('#').trim_start().to_owned(),
            None => return Err(self.empty("nothing")),
        }
        Ok(names)
    }

    fn empty(&self, found: &'static str) -> CsvError {
        CsvError::Empty { path: self.path.to_owned(), found }
    }

    /// The wanted columns; `timed` says that the first one is the time.
    fn cells(
        &mut self,
        header: &[String],
        wanted: &[usize],
        timed: bool,
    ) -> Result<Vec<Vec<f64>>, CsvError> {
        let mut cells = vec![Vec::new(); wanted.len()];
        let mut record = ::csv::StringRecord::new();
        loop {
            match self.reader.read_record(&mut record) {
                Ok(true) => {}
                Ok(false) if cells[0].is_empty() => return Err(self.empty("only a header")),
                Ok(false) => return Ok(cells),
                Err(source) => return Err(self.failure(source)),
            }
            let line = record.position().map_or(0, ::csv::Position::line);
            for (index, values) in wanted.iter().zip(&mut cells) {
                values.push(self.number(&record[*index], line, &header[*index])?);
            }
            if let [.., before, found] = cells[0][..]
                && timed
                && found <= before
            {
                return Err(CsvError::TimeNotIncreasing {
                    path: self.path.to_owned(),
                    line,
                    before,
                    found,
                });
            }
        }
    }

    fn number(&self, cell: &str, line: u64, column: &str) -> Result<f64, CsvError> {
        let (path, column, text) = (self.path, column, cell.trim());
        match text.parse::<f64>() {
            Ok(value) if value.is_finite() => Ok(value),
            Ok(_) => Err(CsvError::NotFinite {
                path: path.to_owned(),
                line,
                column: column.to_owned(),
                text: text.to_owned(),
            }),
            Err(_) => Err(CsvError::NotANumber {
                path: path.to_owned(),
                line,
                column: column.to_owned(),
                text: text.to_owned(),
            }),
        }
    }

    fn failure(&self, source: ::csv::Error) -> CsvError {
        let path = self.path.to_owned();
        match source.kind() {
            ::csv::ErrorKind::UnequalLengths { pos, expected_len, len } => CsvError::Ragged {
                path,
                line: pos.as_ref().map_or(0, ::csv::Position::line),
                expected: *expected_len,
                found: *len,
            },
            _ => CsvError::Read { path, source },
        }
    }
}
