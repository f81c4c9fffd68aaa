//! Converts cells of a CSV file to numbers and time stamps.

use units::Unit;

pub(super) use super::column_builder::CellType;
use super::column_builder::{CellError, CellPosition, ColumnBuilder, decimal_mark_index};
use text_encoding::utf8_or_latin1;

use super::file::CsvFile;
use crate::table::CsvError;
use crate::table::exact_values::ExactValues;
use crate::table::read_request::{DecimalMark, ReadRequest, Separator};
use crate::table::title::time_unit_in_name;

/// The cells of some columns, with their file.
pub(super) struct CsvColumnCells<'a> {
    file: &'a CsvFile<'a>,
    /// Where the columns are in the file.
    places: &'a [usize],
    columns: Vec<ColumnBuilder>,
    decimal: DecimalMark,
    /// What is odd about the rows.
    pub warning: Option<String>,
}

impl<'a> CsvColumnCells<'a> {
    /// Reads the cells, and nothing but these into memory. The decimal mark is the given one, or open until it is [decided](Self::resolve_decimal_mark).
    pub fn read(
        file: &'a CsvFile<'a>,
        places: &'a [usize],
        given: Option<DecimalMark>,
        forms: &[CellType],
    ) -> Result<Self, CsvError> {
        let form = |k: usize| forms.get(k).copied().unwrap_or(CellType::Number);
        let mut columns: Vec<_> = (0..places.len()).map(|k| ColumnBuilder::new(form(k), given)).collect();
        let warning = file.visit_rows(&mut |begin, record| {
            for (column, place) in columns.iter_mut().zip(places) {
                column.push_cell(begin, utf8_or_latin1(&record[*place]));
            }
            true
        })?;
        let decimal = given.unwrap_or(DecimalMark::Point);
        Ok(CsvColumnCells { file, places, columns, decimal, warning })
    }

    /// Takes the decimal mark that is given, or the one that the cells of columns without texts show.
    pub fn resolve_decimal_mark(&mut self, given: Option<DecimalMark>) -> Result<(), CsvError> {
        self.decimal = given.map_or_else(|| self.detect_decimal_mark(), Ok)?;
        Ok(())
    }

    fn detect_decimal_mark(&self) -> Result<DecimalMark, CsvError> {
        let commas_separate = self.file.layout.separator == Separator::Comma;
        let columns = || self.columns.iter().enumerate().filter(|(_, it)| it.form != CellType::Text);
        let shows = |decimal| columns().any(|(_, column)| column.shows[decimal_mark_index(decimal)]);
        if shows(DecimalMark::Comma) && !commas_separate {
            return Ok(DecimalMark::Comma);
        }
        let either = columns().find_map(|(k, column)| Some((k, column.either.as_ref()?)));
        // A comma between quotation marks says as much as a point.
        let Some((column, at)) = either.filter(|_| !shows(DecimalMark::Point) && !shows(DecimalMark::Comma))
        else {
            return Ok(DecimalMark::Point);
        };
        let (path, line, column) = self.cell_location(at.begin, column);
        Err(CsvError::Comma { path, line, column, text: at.text.clone() })
    }

    /// The file, the line of a row, and the title of a column.
    fn cell_location(&self, begin: u64, column: usize) -> (std::path::PathBuf, usize, String) {
        let title = self.file.layout.titles[self.places[column]].text.clone();
        (self.file.path.to_owned(), self.file.line_number_at(begin), title)
    }

    fn csv_cell_error(&self, column: usize, CellError { at, expected, hint }: &CellError) -> CsvError {
        let (path, line, column) = self.cell_location(at.begin, column);
        CsvError::Cell { path, line, column, expected, text: at.text.trim().to_owned(), hint }
    }

    /// The values of a column, and what it keeps beside them; gaps are NaN.
    pub fn take_column(&mut self, column: usize) -> Result<(Vec<f64>, ExactValues), CsvError> {
        if let Some(wrong) = self.columns[column].first_error(self.decimal) {
            return Err(self.csv_cell_error(column, wrong));
        }
        let it = &mut self.columns[column];
        let exact = match it.form {
            CellType::Text => ExactValues::Texts(std::mem::take(&mut it.texts)),
            CellType::Integer => ExactValues::Integers(std::mem::take(&mut it.integers)),
            CellType::Number | CellType::Time => ExactValues::Nothing,
        };
        Ok((std::mem::take(&mut it.values), exact))
    }

    /// The line of the first gap.
    pub fn first_gap(&self, column: usize) -> Option<String> {
        let CellPosition { begin, .. } = self.columns[column].gap.as_ref()?;
        Some(format!("line {}", self.file.line_number_at(*begin)))
    }

    /// The values of a column that must have no gap.
    pub fn take_gapless_column(&mut self, column: usize) -> Result<Vec<f64>, CsvError> {
        if let Some(wrong) = self.columns[column].first_error(self.decimal) {
            return Err(self.csv_cell_error(column, wrong));
        }
        if let Some(at) = &self.columns[column].gap {
            let hint = "; remove the row or fill the gap";
            return Err(
                self.csv_cell_error(column, &CellError { at: at.clone(), expected: "a number", hint })
            );
        }
        Ok(std::mem::take(&mut self.columns[column].values))
    }

    /// The time stamps [s], in rising order.
    pub fn take_time_stamps(&mut self, column: usize, request: &ReadRequest) -> Result<Vec<f64>, CsvError> {
        let stamps = match self.columns[column].has_clocks() {
            true => self.take_column(column)?.0,
            false => {
                let factor = self.seconds_per_time_unit(column, request.time_unit)?;
                let mut stamps = self.take_gapless_column(column)?;
                self.check_seconds_plausible(column, request, &stamps)?;
                if factor != 1.0 {
                    stamps.iter_mut().for_each(|stamp| *stamp *= factor);
                }
                stamps
            }
        };
        self.require_rising_stamps(column, stamps, request)
    }

    /// The time stamps [s] of a column of whole seconds and one of nanoseconds.
    pub fn split_stamps(
        &mut self,
        [seconds, nanoseconds]: [usize; 2],
        request: &ReadRequest,
    ) -> Result<Vec<f64>, CsvError> {
        let (mut stamps, parts) =
            (self.take_gapless_column(seconds)?, self.take_gapless_column(nanoseconds)?);
        stamps.iter_mut().zip(parts).for_each(|(stamp, part)| *stamp += part * 1e-9);
        self.require_rising_stamps(seconds, stamps, request)
    }

    /// Time stamps that rise, or the first line where they do not.
    fn require_rising_stamps(
        &self,
        column: usize,
        mut stamps: Vec<f64>,
        request: &ReadRequest,
    ) -> Result<Vec<f64>, CsvError> {
        let rises = |row: usize, pair: &[f64]| match pair[1] == pair[0] {
            // The first row is the value from the left, the second one that from the right.
            true => request.jumps && (row == 0 || stamps[row - 1] < pair[0]),
            false => pair[1] > pair[0],
        };
        let mut pairs = stamps.windows(2).enumerate();
        let Some(row) = pairs.position(|(row, pair)| !rises(row, pair)) else {
            stamps.shrink_to_fit();
            return Ok(stamps);
        };
        let (before, found) = (stamps[row], stamps[row + 1]);
        let midnight = before > 86_000.0 && before < 86_400.0 && found < 400.0;
        let hint = match midnight {
            true => ", or add dates to a clock that passes midnight",
            false => "",
        };
        let (path, line, _) = self.cell_location(self.file.row_offset(row + 1), column);
        Err(CsvError::TimeNotIncreasing { path, line, before, found, hint })
    }

    /// Refuses a time since 1970 in a smaller unit that nobody says.
    fn check_seconds_plausible(
        &self,
        column: usize,
        request: &ReadRequest,
        stamps: &[f64],
    ) -> Result<(), CsvError> {
        /// From this time on [s] it is no year that a log is from: the first one in ms is of 1973, in us and ns likewise.
        const UNITS: [(f64, &str); 3] = [(1e17, "ns"), (1e14, "us"), (1e11, "ms")];
        let place = self.places[column];
        let title = &self.file.layout.titles[place];
        let is_said = request.time_unit.is_some() || self.file.column_unit(place)?.is_some();
        let Some(&first) = stamps.first().filter(|_| !is_said) else { return Ok(()) };
        let unit = UNITS.iter().find(|(least, _)| first >= *least);
        match unit.filter(|_| time_unit_in_name(&title.plain).is_none()) {
            None => Ok(()),
            Some((_, unit)) => {
                let (path, column) = (self.file.path.to_owned(), title.text.clone());
                Err(CsvError::TimeMagnitude { path, column, first, unit })
            }
        }
    }

    /// The seconds in one unit of the time.
    fn seconds_per_time_unit(&self, column: usize, said: Option<Unit>) -> Result<f64, CsvError> {
        let Some(written) = self.file.column_unit(self.places[column])? else {
            let title = &self.file.layout.titles[self.places[column]].plain;
            return Ok(said.or_else(|| time_unit_in_name(title)).map_or(1.0, |unit| unit.factor));
        };
        let is_time = |unit: &Unit| Unit::parse("s").is_ok_and(|second| unit.same_dimension(&second));
        let known = Unit::parse(&written).ok().filter(is_time);
        let why = match (known, said) {
            (Some(known), Some(said)) if known != said => "and `time_unit` is another one: leave it out",
            (Some(known), _) => return Ok(known.factor),
            (None, Some(said)) => return Ok(said.factor),
            (None, None) => {
                "which is no unit of time that is known here: say `time_unit = \"ms\"`, for example"
            }
        };
        let (path, column) =
            (self.file.path.to_owned(), self.file.layout.titles[self.places[column]].text.clone());
        Err(CsvError::TimeUnit { path, column, unit: written, why })
    }
}
