//! Makes numbers and time stamps of the cells of a CSV file.

use units::Unit;

use super::cell::{self, Cell, Mark, cell, clock, mark};
use super::error::CsvError;
use super::file::{CsvFile, Rows};
use crate::table::kept::Kept;
use crate::table::title::spelled;
use crate::table::wanted::{Decimal, Reading, Separator, Wanted};

/// The cells of some columns, with their file.
pub(super) struct Cells<'a> {
    file: &'a CsvFile<'a>,
    rows: &'a Rows,
    /// Where the columns are in the file.
    places: &'a [usize],
    decimal: Decimal,
}

/// The numbers of a column. Gaps are NaN.
pub(super) struct Numbers {
    pub values: Vec<f64>,
    /// Row and text of the first gap.
    gap: Option<(usize, String)>,
}

impl<'a> Cells<'a> {
    /// Takes the decimal mark that is given, or the one that the cells of columns without texts show.
    pub fn new(
        file: &'a CsvFile<'a>,
        rows: &'a Rows,
        places: &'a [usize],
        (given, readings): (Option<Decimal>, &[Reading]),
    ) -> Result<Self, CsvError> {
        let mut cells = Cells { file, rows, places, decimal: Decimal::Point };
        cells.decimal = given.map_or_else(|| cells.detected(readings), Ok)?;
        Ok(cells)
    }

    fn detected(&self, readings: &[Reading]) -> Result<Decimal, CsvError> {
        let commas_separate = self.file.header.separator == Separator::Comma;
        let (mut either, mut point) = (None, false);
        let is_text = |column: &usize| readings.get(*column) == Some(&Reading::Text);
        for column in (0..self.places.len()).filter(|column| !is_text(column)) {
            for (row, text) in self.rows.column(column).enumerate() {
                match mark(text) {
                    Mark::Decimal(Decimal::Comma) if !commas_separate => {
                        return Ok(Decimal::Comma);
                    }
                    Mark::Decimal(_) => point = true,
                    Mark::Either => either = either.or(Some((row, column, text))),
                    Mark::Nothing => {}
                }
            }
        }
        let Some((row, column, text)) = either.filter(|_| !point) else {
            return Ok(Decimal::Point);
        };
        let (path, line, column) = self.place(row, column);
        Err(CsvError::Comma { path, line, column, text: text.trim().to_owned() })
    }

    /// The file, the line of a row, and the title of a column.
    fn place(&self, row: usize, column: usize) -> (std::path::PathBuf, usize, String) {
        let title = self.file.header.titles[self.places[column]].text.clone();
        (self.file.path.to_owned(), self.file.line(self.rows.begins[row]), title)
    }

    fn wrong(
        &self,
        (row, column): (usize, usize),
        text: &str,
        expected: &'static str,
        hint: &'static str,
    ) -> CsvError {
        let text = text.trim().to_owned();
        let (path, line, column) = self.place(row, column);
        CsvError::Cell { path, line, column, expected, text, hint }
    }

    /// The numbers of a column.
    pub fn numbers(&self, column: usize) -> Result<Numbers, CsvError> {
        let mut values = Vec::with_capacity(self.rows.begins.len());
        let mut gap = None;
        for (row, text) in self.rows.column(column).enumerate() {
            let wrong = |expected, hint| self.wrong((row, column), text, expected, hint);
            values.push(match cell(text, self.decimal) {
                Cell::Number(value) => value,
                Cell::Gap => {
                    gap.get_or_insert_with(|| (row, text.to_owned()));
                    f64::NAN
                }
                Cell::Infinite => {
                    return Err(wrong("a finite number", "; remove the row or empty the cell"));
                }
                Cell::Other => return Err(wrong("a number", cell::hint(text, self.decimal))),
            });
        }
        Ok(Numbers { values, gap })
    }

    /// The integers of a column, exactly, and their places.
    pub fn integers(&self, column: usize) -> Result<(Numbers, Kept), CsvError> {
        let (mut numbers, mut integers) = (self.numbers(column)?, Vec::new());
        // Whether all of them fit Int64, and whether all of them fit UInt64.
        let mut signs = [true; 2];
        let texts = self.rows.column(column).zip(&mut numbers.values).enumerate();
        for (row, (text, value)) in texts.filter(|(_, (_, value))| !value.is_nan()) {
            let exact = text.trim().parse::<i128>().ok();
            // Such as `5.0` and `1e3`: beyond 2^53 the digits are not all there.
            let whole = || (value.abs() <= 2.0_f64.powi(53)).then_some(*value as i128);
            let whole = || whole().filter(|whole| *whole as f64 == *value);
            let wrong = || self.wrong((row, column), text, "an integer", "");
            let integer = exact.or_else(whole).ok_or_else(wrong)?;
            let [signed, unsigned] = [i64::MIN.into()..=i64::MAX.into(), 0..=u64::MAX.into()];
            signs[0] &= signed.contains(&integer);
            signs[1] &= unsigned.contains(&integer);
            if signs == [false; 2] {
                let expected =
                    "an integer of 64 bits, all of the column with a sign or all without one";
                return Err(self.wrong((row, column), text, expected, ""));
            }
            *value = integers.len() as f64;
            integers.push(integer);
        }
        Ok((numbers, Kept::Integers(integers)))
    }

    /// The texts of a column as they are, and their places; an empty cell is an empty text.
    pub fn texts(&self, column: usize) -> (Numbers, Kept) {
        let texts: Vec<_> = self.rows.column(column).map(str::to_owned).collect();
        let values = (0..texts.len()).map(|place| place as f64).collect();
        (Numbers { values, gap: None }, Kept::Texts(texts))
    }

    /// The line of the first gap.
    pub fn first_gap(&self, numbers: &Numbers) -> Option<String> {
        let (row, _) = numbers.gap.as_ref()?;
        Some(format!("line {}", self.file.line(self.rows.begins[*row])))
    }

    /// The values of a column that must have no gap.
    pub fn complete(&self, column: usize) -> Result<Vec<f64>, CsvError> {
        let numbers = self.numbers(column)?;
        match &numbers.gap {
            None => Ok(numbers.values),
            Some((row, text)) => {
                let hint = "; remove the row or fill the gap";
                Err(self.wrong((*row, column), text, "a number", hint))
            }
        }
    }

    /// The time stamps [s], in rising order.
    pub fn stamps(&self, column: usize, wanted: &Wanted) -> Result<Vec<f64>, CsvError> {
        let stamps = match self.rows.column(column).next().and_then(clock) {
            Some(_) => self.clocks(column)?,
            None => {
                let factor = self.time_factor(column, wanted.time_unit)?;
                let seconds = |stamp: f64| if factor == 1.0 { stamp } else { stamp * factor };
                self.complete(column)?.into_iter().map(seconds).collect()
            }
        };
        let rises = |row: usize, pair: &[f64]| match pair[1] == pair[0] {
            // The first row is the value from the left, the second one that from the right.
            true => wanted.jumps && (row == 0 || stamps[row - 1] < pair[0]),
            false => pair[1] > pair[0],
        };
        let mut pairs = stamps.windows(2).enumerate();
        let Some(row) = pairs.position(|(row, pair)| !rises(row, pair)) else {
            return Ok(stamps);
        };
        let (before, found) = (stamps[row], stamps[row + 1]);
        let midnight = before > 86_000.0 && before < 86_400.0 && found < 400.0;
        let hint = match midnight {
            true => ", or add dates to a clock that passes midnight",
            false => "",
        };
        let (path, line, _) = self.place(row + 1, column);
        Err(CsvError::TimeNotIncreasing { path, line, before, found, hint })
    }

    /// The time stamps of clocks or dates.
    fn clocks(&self, column: usize) -> Result<Vec<f64>, CsvError> {
        let rows = self.rows.column(column).enumerate();
        let stamp = |(row, text)| {
            let expected = "a clock or a date as in the rows before";
            clock(text).ok_or_else(|| self.wrong((row, column), text, expected, ""))
        };
        rows.map(stamp).collect()
    }

    /// The seconds in one unit of the time.
    fn time_factor(&self, column: usize, said: Option<Unit>) -> Result<f64, CsvError> {
        let Some(written) = self.file.unit(self.places[column])? else {
            return Ok(said.map_or(1.0, |unit| unit.factor));
        };
        let is_time =
            |unit: &Unit| Unit::parse("s").is_ok_and(|second| unit.same_dimension(&second));
        let known = Unit::parse(&spelled(&written)).ok().filter(is_time);
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
        let (path, _, column) = self.place(0, column);
        Err(CsvError::TimeUnit { path, column, unit: written, why })
    }
}
