//! Reads columns from a CSV file in any logger's dialect.

mod cell;
mod column_builder;
mod explanation;
mod file;
mod layout;
mod line;
mod numbers;
mod profile;
mod region;
mod survey;
mod text;
mod time;

use std::collections::HashSet;
use std::path::Path;

use self::file::CsvFile;
use self::numbers::{CellType, CsvColumnCells};
pub(super) use self::survey::survey_csv;
use self::text::CsvText;
use super::read_request::{ColumnRequest, ColumnType, CsvDialect, ReadRequest, Separator};
use super::{ExactValues, FileTitles, ReadColumns, ReadSeries, TableError};

/// Reads the time stamps [s] and the wanted columns by their titles. Of a file of any size, these alone are in memory.
pub(super) fn read_csv_columns(path: &Path, request: &ReadRequest) -> Result<ReadColumns, TableError> {
    parse_csv_columns(path, &open_csv_text(path)?, request)
}

fn open_csv_text(path: &Path) -> Result<CsvText, TableError> {
    CsvText::from_path(path).map_err(|source| TableError::Open { path: path.to_owned(), source })
}

fn parse_csv_columns(path: &Path, text: &CsvText, request: &ReadRequest) -> Result<ReadColumns, TableError> {
    let mut titles = request.requested_titles();
    titles.extend(request.time.as_deref());
    let mut file = CsvFile::open(path, text, &titles, &request.dialect)?;
    file.is_timed = true;
    let found: Vec<_> =
        request.requested_titles().into_iter().map(|title| file.column_index(title)).collect();
    let time = file.find_time_columns(request.time.as_deref());
    let mut places: Vec<usize> = found.iter().flatten().copied().collect();
    let forms = request.columns.iter().map(|column| CellType::from_column_type(column.column_type));
    let with_form = found.iter().zip(forms);
    let mut forms: Vec<CellType> =
        with_form.filter_map(|(place, form)| place.is_ok().then_some(form)).collect();
    let at = places.len();
    if let Ok(time) = &time {
        places.push(time.place);
        forms.push(CellType::Time);
        places.extend(time.nanoseconds);
        forms.extend(time.nanoseconds.map(|_| CellType::Number));
    }
    let given = request.dialect.decimal;
    let mut cells = match CsvColumnCells::read(&file, &places, given, &forms) {
        Ok(cells) => cells,
        Err(error) if time.is_ok() && found.iter().all(Result::is_ok) => return Err(error.into()),
        // Columns that are not there say more about a file without rows.
        Err(_) => {
            let wrong = found.into_iter().filter_map(Result::err);
            return Err(TableError::from_errors(wrong.chain(time.err())));
        }
    };
    cells.resolve_decimal_mark(given)?;
    let mut next = 0..;
    let column = |(place, asked): (Result<usize, TableError>, &ColumnRequest)| {
        let (place, k) = (place?, next.next().unwrap_or_default());
        let (values, exact) = cells.take_column(k)?;
        let gap = cells.first_gap(k);
        let unit = if asked.column_type == ColumnType::Text { None } else { file.column_unit(place)? };
        Ok(ReadSeries { clock: 0, values, exact, unit, gap })
    };
    let columns: Vec<Result<ReadSeries, TableError>> =
        found.into_iter().zip(&request.columns).map(column).collect();
    let stamps = time.and_then(|time| {
        Ok(match time.nanoseconds {
            Some(_) => cells.split_stamps([at, at + 1], request)?,
            None => cells.take_time_stamps(at, request)?,
        })
    });
    let mut warnings: Vec<String> = cells.warning.take().into_iter().collect();
    warnings.extend(file.unread_header_note());
    match stamps {
        Ok(stamps) => Ok(ReadColumns { clocks: vec![stamps], columns, zero: 0.0, warnings }),
        Err(error) => {
            Err(TableError::from_errors(columns.into_iter().filter_map(Result::err).chain([error])))
        }
    }
}

impl CellType {
    fn from_column_type(column_type: ColumnType) -> Self {
        match column_type {
            ColumnType::Number => CellType::Number,
            ColumnType::Integer => CellType::Integer,
            ColumnType::Text => CellType::Text,
        }
    }
}

/// The titles of a file, whether it says itself which one is the time, and as what it is read.
pub(super) fn csv_titles(path: &Path) -> Result<FileTitles, TableError> {
    let text = open_csv_text(path)?;
    let file = CsvFile::open(path, &text, &[], &CsvDialect::default())?;
    let (columns, has_time) = (file.column_titles()?, file.default_time_column().is_some());
    Ok(FileTitles { columns, has_time, format: file.layout.describe_layout() })
}

/// Whether the file has each of these columns.
pub(super) fn check_csv_columns(
    path: &Path,
    names: &[&str],
    dialect: &CsvDialect,
) -> Result<Vec<Result<(), TableError>>, TableError> {
    let text = open_csv_text(path)?;
    let file = CsvFile::open(path, &text, names, dialect)?;
    Ok(names.iter().map(|name| file.column_index(name).map(drop)).collect())
}

/// Reads the wanted columns of a file whose rows have no time, such as the points of a line; `kept` is its text where a
/// recording has it.
///
/// # Errors
/// When the file cannot be read, lacks a column or has a value that is no finite number.
pub fn read_untimed_columns(
    path: &Path,
    kept: Option<&str>,
    wanted: &[&str],
) -> Result<Vec<Vec<f64>>, TableError> {
    let text = match kept {
        Some(text) => CsvText::Memory(text.as_bytes().to_owned()),
        None => open_csv_text(path)?,
    };
    let file = CsvFile::open(path, &text, wanted, &CsvDialect::default())?;
    let places = file.column_indices(wanted)?;
    let mut cells = CsvColumnCells::read(&file, &places, None, &[])?;
    cells.resolve_decimal_mark(None)?;
    Ok((0..places.len()).map(|k| cells.take_gapless_column(k)).collect::<Result<_, _>>()?)
}

/// A CSV file with the time in one of its columns, such as `run.csv`.
#[derive(Debug)]
pub(crate) struct CsvTable {
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

/// Reads all columns, those called `texts` as they are; numbers that are missing are NaN. The time is the column called `time`, or else
/// the first one.
pub(crate) fn read_csv_table(
    path: &Path,
    time: Option<&str>,
    texts: &[&str],
) -> Result<CsvTable, TableError> {
    let text = open_csv_text(path)?;
    let file = CsvFile::open(path, &text, &[], &CsvDialect::default())?;
    // Of two columns of one name nobody could say which one a signal is compared with.
    file.check_unique_titles()?;
    let places: Vec<_> = (0..file.layout.titles.len()).collect();
    let mut forms = vec![CellType::Number; places.len()];
    let time = time.map_or(Ok(0), |name| file.column_index(name))?;
    forms[time] = CellType::Time;
    let mut cells = CsvColumnCells::read(&file, &places, None, &forms)?;
    cells.resolve_decimal_mark(None)?;
    let texts: HashSet<_> = texts.iter().copied().collect();
    let name = |place: usize| file.layout.titles[place].plain.as_str();
    let is_number = |place: &usize| *place != time && !texts.contains(name(*place));
    let numbers = places.iter().map(|place| {
        let values = is_number(place).then(|| cells.take_column(*place)).and_then(Result::ok);
        values.map(|(values, _)| values)
    });
    let numbers: Vec<Option<Vec<f64>>> = numbers.collect();
    let no_numbers: Vec<usize> =
        places.iter().filter(|place| **place != time && numbers[**place].is_none()).copied().collect();
    let mut found = match no_numbers.is_empty() {
        true => None,
        false => {
            Some(CsvColumnCells::read(&file, &no_numbers, None, &vec![CellType::Text; no_numbers.len()])?)
        }
    };
    let mut columns = Vec::new();
    for (place, numbers) in numbers.into_iter().enumerate().filter(|(place, _)| *place != time) {
        let of_texts = no_numbers.iter().position(|it| *it == place).zip(found.as_mut());
        let texts = match of_texts.map(|(k, found)| found.take_column(k)).transpose()? {
            Some((_, ExactValues::Texts(texts))) => texts,
            _ => Vec::new(),
        };
        let (name, unit) = (name(place).to_owned(), file.column_unit(place)?);
        columns.push(CsvColumn { name, unit, numbers, texts });
    }
    // Simulators write the values before and after an event at one time.
    let times = cells.take_time_stamps(time, &ReadRequest { jumps: true, ..ReadRequest::default() })?;
    Ok(CsvTable { times, columns })
}

fn csv_reader<R: std::io::Read>(text: R, separator: Separator) -> ::csv::Reader<R> {
    ::csv::ReaderBuilder::new()
        .delimiter(separator.as_byte())
        .has_headers(false)
        .flexible(true)
        .buffer_capacity(1 << 16)
        .from_reader(text)
}

#[cfg(test)]
mod logger_tests;
#[cfg(test)]
mod tests;
