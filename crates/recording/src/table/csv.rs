//! Reads columns of numbers from a CSV file, however its logger wrote it.

mod cell;
mod error;
mod file;
mod header;
mod numbers;

use std::collections::HashSet;
use std::path::Path;

use diagnostics::read_bounded;

pub use self::error::CsvError;
use self::file::CsvFile;
use self::numbers::Cells;
use super::wanted::{Dialect, Reading, Separator, Wanted};
use super::{ColumnTitle, Kept, Recorded, Series, TableError};

/// Reads the time stamps [s] and the wanted columns by their titles.
pub(super) fn read(path: &Path, wanted: &Wanted) -> Result<Recorded, TableError> {
    let read = read_bounded(path, LARGEST);
    let bytes = read.map_err(|source| CsvError::Read { path: path.to_owned(), source })?;
    parse(path, &bytes, wanted)
}

fn parse(path: &Path, bytes: &[u8], wanted: &Wanted) -> Result<Recorded, TableError> {
    let mut titles = wanted.titles();
    titles.extend(wanted.time.as_deref());
    let file = CsvFile::open(path, bytes, &titles, &wanted.dialect)?;
    if wanted.time.is_none() {
        return Err(TableError::NoTime {
            path: path.to_owned(),
            format: "CSV",
            present: file.names(),
        });
    }
    let found: Vec<_> = titles.iter().map(|title| file.place(title)).collect();
    let places: Vec<usize> =
        found.iter().filter_map(|place| place.as_ref().ok().copied()).collect();
    let mut rows = match file.rows(&places) {
        Ok(rows) => rows,
        // Columns that are not there say more about a file without rows.
        Err(error) if found.iter().all(Result::is_ok) => return Err(error.into()),
        Err(_) => return Err(TableError::all(found.into_iter().filter_map(Result::err))),
    };
    let warnings = rows.warning.take().into_iter().collect();
    let readings = wanted.columns.iter().map(|column| column.reading);
    let found_readings: Vec<Reading> = (found.iter().zip(readings.clone()))
        .filter_map(|(place, reading)| place.is_ok().then_some(reading))
        .collect();
    let cells = Cells::new(&file, &rows, &places, (wanted.dialect.decimal, &found_readings))?;
    let mut next = 0..;
    let column = |(place, reading): (Result<usize, TableError>, Reading)| {
        let (place, k) = (place?, next.next().unwrap_or_default());
        let (numbers, kept) = match reading {
            Reading::Number => (cells.numbers(k)?, Kept::Nothing),
            Reading::Integer => cells.integers(k)?,
            Reading::Text => cells.texts(k),
        };
        let gap = cells.first_gap(&numbers);
        let unit = if reading == Reading::Text { None } else { file.unit(place)? };
        Ok(Series { clock: 0, values: numbers.values, kept, unit, gap })
    };
    let mut found = found.into_iter();
    let time = found.next_back();
    let columns: Vec<Result<Series, TableError>> = found.zip(readings).map(column).collect();
    let stamps =
        time.map_or(Ok(0), |time| time).and_then(|_| Ok(cells.stamps(places.len() - 1, wanted)?));
    match stamps {
        Ok(stamps) => Ok(Recorded { clocks: vec![stamps], columns, zero: 0.0, warnings }),
        Err(error) => {
            Err(TableError::all(columns.into_iter().filter_map(Result::err).chain([error])))
        }
    }
}

/// The largest file [B]: it is read as a whole.
const LARGEST: u64 = 2 << 30;

/// The contents of a file.
pub(super) fn bytes(path: &Path) -> Result<Vec<u8>, TableError> {
    read_bounded(path, LARGEST).map_err(|source| TableError::Open { path: path.to_owned(), source })
}

/// The titles of a file.
pub(super) fn titles(path: &Path) -> Result<Vec<ColumnTitle>, TableError> {
    let bytes = bytes(path)?;
    let file = CsvFile::open(path, &bytes, &[], &Dialect::default())?;
    Ok(file.titles()?)
}

/// Whether the file has each of these columns.
pub(super) fn look_up(
    path: &Path,
    names: &[&str],
    dialect: &Dialect,
) -> Result<Vec<Result<(), TableError>>, TableError> {
    let bytes = bytes(path)?;
    let file = CsvFile::open(path, &bytes, names, dialect)?;
    Ok(names.iter().map(|name| file.place(name).map(drop)).collect())
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
    let bytes = match kept {
        Some(text) => text.as_bytes().to_owned(),
        None => bytes(path)?,
    };
    let file = CsvFile::open(path, &bytes, wanted, &Dialect::default())?;
    let places = file.places(wanted)?;
    let rows = file.rows(&places)?;
    let cells = Cells::new(&file, &rows, &places, (None, &[]))?;
    Ok((0..places.len()).map(|k| cells.complete(k)).collect::<Result<_, _>>()?)
}

/// A CSV file with the time in its first column, such as `run.csv`.
#[derive(Debug)]
pub(crate) struct Whole {
    /// Time stamps [s].
    pub times: Vec<f64>,
    pub columns: Vec<CsvColumn>,
}

/// A column: its numbers, or its texts where it is one of texts or a cell is no number.
#[derive(Debug)]
pub(crate) struct CsvColumn {
    pub name: String,
    pub unit: Option<String>,
    pub numbers: Option<Vec<f64>>,
    pub texts: Vec<String>,
}

/// Reads all columns, those called `texts` as they are; numbers that are missing are NaN.
pub(crate) fn whole(path: &Path, texts: &[&str]) -> Result<Whole, TableError> {
    let bytes = bytes(path)?;
    let file = CsvFile::open(path, &bytes, &[], &Dialect::default())?;
    // Of two columns of one name nobody could say which one a signal is compared with.
    for title in file.header.titles.iter().skip(1).filter(|title| !title.plain.is_empty()) {
        file.only(&title.plain)?;
    }
    let places: Vec<_> = (0..file.header.titles.len()).collect();
    let rows = file.rows(&places)?;
    let cells = Cells::new(&file, &rows, &places, (None, &[]))?;
    let texts: HashSet<_> = texts.iter().copied().collect();
    let column = |place: usize| {
        let name = file.header.titles[place].plain.clone();
        let is_text = texts.contains(name.as_str());
        let numbers = cells.numbers(place).ok().filter(|_| !is_text);
        let numbers = numbers.map(|numbers| numbers.values);
        let texts = match &numbers {
            Some(_) => Vec::new(),
            None => rows.column(place).map(str::to_owned).collect(),
        };
        Ok(CsvColumn { name, unit: file.unit(place)?, numbers, texts })
    };
    let times = cells.stamps(0, &Wanted::default())?;
    let columns: Result<_, CsvError> = (1..places.len()).map(column).collect();
    Ok(Whole { times, columns: columns? })
}

/// A text of the file, which may be of Western Windows.
fn text(bytes: &[u8]) -> String {
    match std::str::from_utf8(bytes) {
        Ok(text) => text.to_owned(),
        Err(_) => bytes.iter().map(|byte| char::from(*byte)).collect(),
    }
}

fn reader(bytes: &[u8], separator: Separator) -> ::csv::Reader<&[u8]> {
    ::csv::ReaderBuilder::new()
        .delimiter(separator.byte())
        .has_headers(false)
        .flexible(true)
        .from_reader(bytes)
}

#[cfg(test)]
mod tests;
