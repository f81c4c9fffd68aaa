//! Converts cells of a CSV file to numbers and time stamps.

use units::Unit;

pub(super) use super::column_builder::CellType;
use super::column_builder::{CellError, CellPosition, ColumnBuilder, index};
use text_encoding::utf8_or_latin1;

use super::file::CsvFile;
use crate::table::CsvError;
use crate::table::exact_values::ExactValues;
use crate::table::read_request::{Decimal, ReadRequest, Separator};
use crate::table::title::unit_of_time;

/// The cells of some columns, with their file.
pub(super) struct Cells<'a> {
    file: &'a CsvFile<'a>,
    /// Where the columns are in the file.
    places: &'a [usize],
    columns: Vec<ColumnBuilder>,
    decimal: Decimal,
    /// What is odd about the rows.
    pub warning: Option<String>,
}

impl<'a> Cells<'a> {
    /// Reads the cells, and nothing but these into memory. The decimal mark is the given one, or open until it is [decided](Self::decide).
    pub fn read(
        file: &'a CsvFile<'a>,
        places: &'a [usize],
        given: Option<Decimal>,
        forms: &[CellType],
    ) -> Result<Self, CsvError> {
        let form = |k: usize| forms.get(k).copied().unwrap_or(CellType::Number);
        let mut columns: Vec<_> =
            (0..places.len()).map(|k| ColumnBuilder::new(form(k), given)).collect();
        let warning = file.rows(&mut |begin, record| {
            for (column, place) in columns.iter_mut().zip(places) {
                column.take(begin, utf8_or_latin1(&record[*place]));
            }
            true
        })?;
        let decimal = given.unwrap_or(Decimal::Point);
        Ok(Cells { file, places, columns, decimal, warning })
    }

    /// Takes the decimal mark that is given, or the one that the cells of columns without texts show.
    pub fn decide(&mut self, given: Option<Decimal>) -> Result<(), CsvError> {
        self.decimal = given.map_or_else(|| self.detected(), Ok)?;
        Ok(())
    }

    fn detected(&self) -> Result<Decimal, CsvError> {
        let commas_separate = self.file.layout.separator == Separator::Comma;
        let columns =
            || self.columns.iter().enumerate().filter(|(_, it)| it.form != CellType::Text);
        let shows = |decimal| columns().any(|(_, column)| column.shows[index(decimal)]);
        if shows(Decimal::Comma) && !commas_separate {
            return Ok(Decimal::Comma);
        }
        let either = columns().find_map(|(k, column)| Some((k, column.either.as_ref()?)));
        // A comma between quotation marks says as much as a point.
        let Some((column, at)) =
            either.filter(|_| !shows(Decimal::Point) && !shows(Decimal::Comma))
        else {
            return Ok(Decimal::Point);
        };
        let (path, line, column) = self.place(at.begin, column);
        Err(CsvError::Comma { path, line, column, text: at.text.clone() })
    }

    /// The file, the line of a row, and the title of a column.
    fn place(&self, begin: u64, column: usize) -> (std::path::PathBuf, usize, String) {
        let title = self.file.layout.titles[self.places[column]].text.clone();
        (self.file.path.to_owned(), self.file.line(begin), title)
    }

    fn wrong(&self, column: usize, CellError { at, expected, hint }: &CellError) -> CsvError {
        let (path, line, column) = self.place(at.begin, column);
        CsvError::Cell { path, line, column, expected, text: at.text.trim().to_owned(), hint }
    }

    /// The values of a column, and what it keeps beside them; gaps are NaN.
    pub fn take(&mut self, column: usize) -> Result<(Vec<f64>, ExactValues), CsvError> {
        if let Some(wrong) = self.columns[column].wrong(self.decimal) {
            return Err(self.wrong(column, wrong));
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
        Some(format!("line {}", self.file.line(*begin)))
    }

    /// The values of a column that must have no gap.
    pub fn complete(&mut self, column: usize) -> Result<Vec<f64>, CsvError> {
        if let Some(wrong) = self.columns[column].wrong(self.decimal) {
            return Err(self.wrong(column, wrong));
        }
        if let Some(at) = &self.columns[column].gap {
            let hint = "; remove the row or fill the gap";
            return Err(
                self.wrong(column, &CellError { at: at.clone(), expected: "a number", hint })
            );
        }
        Ok(std::mem::take(&mut self.columns[column].values))
    }

    /// The time stamps [s], in rising order.
    pub fn stamps(&mut self, column: usize, request: &ReadRequest) -> Result<Vec<f64>, CsvError> {
        let stamps = match self.columns[column].has_clocks() {
            true => self.take(column)?.0,
            false => {
                let factor = self.time_factor(column, request.time_unit)?;
                let mut stamps = self.complete(column)?;
                self.seconds_are_plausible(column, request, &stamps)?;
                if factor != 1.0 {
                    stamps.iter_mut().for_each(|stamp| *stamp *= factor);
                }
                stamps
            }
        };
        self.rising(column, stamps, request)
    }

    /// The time stamps [s] of a column of whole seconds and one of nanoseconds.
    pub fn split_stamps(
        &mut self,
        [seconds, nanoseconds]: [usize; 2],
        request: &ReadRequest,
    ) -> Result<Vec<f64>, CsvError> {
        let (mut stamps, parts) = (self.complete(seconds)?, self.complete(nanoseconds)?);
        stamps.iter_mut().zip(parts).for_each(|(stamp, part)| *stamp += part * 1e-9);
        self.rising(seconds, stamps, request)
    }

    /// Time stamps that rise, or the first line where they do not.
    fn rising(
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
        let (path, line, _) = self.place(self.file.begin_of(row + 1), column);
        Err(CsvError::TimeNotIncreasing { path, line, before, found, hint })
    }

    /// Refuses a time since 1970 in a smaller unit that nobody says.
    fn seconds_are_plausible(
        &self,
        column: usize,
        request: &ReadRequest,
        stamps: &[f64],
    ) -> Result<(), CsvError> {
        /// From this time on [s] it is no year that a log is from: the first one in ms is of 1973, in us and ns likewise.
        const UNITS: [(f64, &str); 3] = [(1e17, "ns"), (1e14, "us"), (1e11, "ms")];
        let place = self.places[column];
        let title = &self.file.layout.titles[place];
        let is_said = request.time_unit.is_some() || self.file.unit(place)?.is_some();
        let Some(&first) = stamps.first().filter(|_| !is_said) else { return Ok(()) };
        let unit = UNITS.iter().find(|(least, _)| first >= *least);
        match unit.filter(|_| unit_of_time(&title.plain).is_none()) {
            None => Ok(()),
            Some((_, unit)) => {
                let (path, column) = (self.file.path.to_owned(), title.text.clone());
                Err(CsvError::TimeMagnitude { path, column, first, unit })
            }
        }
    }

    /// The seconds in one unit of the time.
    fn time_factor(&self, column: usize, said: Option<Unit>) -> Result<f64, CsvError> {
        let Some(written) = self.file.unit(self.places[column])? else {
            let title = &self.file.layout.titles[self.places[column]].plain;
            return Ok(said.or_else(|| unit_of_time(title)).map_or(1.0, |unit| unit.factor));
        };
        let is_time =
            |unit: &Unit| Unit::parse("s").is_ok_and(|second| unit.same_dimension(&second));
        let known = Unit::parse(&written).ok().filter(is_time);
        let why = match (known, said) {
            (Some(known), Some(said)) if known != said => {
                "and `time_unit` is another one: leave it out"
            }
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
