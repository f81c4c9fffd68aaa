//! Builds a column from its cells before it is known whether commas or points are decimal marks.

use std::borrow::Cow;

use super::cell::{self, CsvCell, DecimalEvidence, decimal_evidence, parse_cell, parse_clock_seconds};
use crate::table::read_request::DecimalMark;

/// The form in which a column is read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CellType {
    Number,
    Integer,
    Text,
    /// Numbers, or clocks where the first cell is one.
    Time,
}

/// A cell at its row.
#[derive(Debug, Clone)]
pub struct CellPosition {
    /// The first byte of the row.
    pub begin: u64,
    pub text: String,
}

/// What is wrong with a cell.
#[derive(Debug, Clone)]
pub struct CellError {
    pub at: CellPosition,
    pub expected: &'static str,
    pub hint: &'static str,
}

/// The cells of a column that were read up to now.
#[derive(Debug)]
pub struct ColumnBuilder {
    pub form: CellType,
    given: Option<DecimalMark>,
    /// Gaps are NaN.
    pub values: Vec<f64>,
    pub integers: Vec<i128>,
    pub texts: Vec<String>,
    /// The first gap.
    pub gap: Option<CellPosition>,
    /// Whether a cell shows that a point, or a comma, is the decimal mark.
    pub shows: [bool; 2],
    /// The first cell that may be a number with a decimal comma, or thousands.
    pub either: Option<CellPosition>,
    /// The first cell that is wrong when points, and when commas are decimal marks.
    wrong: [Option<CellError>; 2],
    /// The first number that is no integer, or does not fit the others.
    no_integer: Option<CellError>,
    /// Whether all integers fit Int64, and whether all of them fit UInt64.
    fits: [bool; 2],
    /// Whether times are clocks or dates.
    clocks: bool,
}

const EACH: [DecimalMark; 2] = [DecimalMark::Point, DecimalMark::Comma];

/// The index of a decimal mark in lists of both.
pub fn decimal_mark_index(decimal: DecimalMark) -> usize {
    usize::from(decimal == DecimalMark::Comma)
}

impl ColumnBuilder {
    pub fn new(form: CellType, given: Option<DecimalMark>) -> Self {
        ColumnBuilder {
            form,
            given,
            values: Vec::new(),
            integers: Vec::new(),
            texts: Vec::new(),
            gap: None,
            shows: [false; 2],
            either: None,
            wrong: [None, None],
            no_integer: None,
            fits: [true; 2],
            clocks: false,
        }
    }

    /// Takes a cell.
    pub fn push_cell(&mut self, begin: u64, text: Cow<str>) {
        let at = || CellPosition { begin, text: text.trim().to_owned() };
        if self.form == CellType::Text {
            self.values.push(self.values.len() as f64);
            return self.texts.push(text.into_owned());
        }
        self.note_decimal_mark(&text, begin);
        if self.form == CellType::Time && self.values.is_empty() {
            self.clocks = parse_clock_seconds(&text).is_some();
        }
        if self.clocks {
            let stamp = parse_clock_seconds(&text);
            let expected = "a clock or a date as in the rows before";
            if stamp.is_none() {
                let wrong = || CellError { at: at(), expected, hint: "" };
                self.wrong.iter_mut().filter(|it| it.is_none()).for_each(|it| *it = Some(wrong()));
            }
            return self.values.push(stamp.unwrap_or(f64::NAN));
        }
        let value = self.parse_number(&text, &at);
        if value.is_nan() {
            self.gap.get_or_insert_with(|| CellPosition { begin, text: text.clone().into_owned() });
        }
        if self.form == CellType::Integer && !value.is_nan() {
            self.push_integer(text.trim(), value, &at);
            self.values.push(self.integers.len() as f64 - 1.0);
        } else {
            self.values.push(value);
        }
    }

    fn note_decimal_mark(&mut self, text: &str, begin: u64) {
        let plain = !text.contains(',');
        if self.given.is_some() || (plain && self.shows[decimal_mark_index(DecimalMark::Point)]) {
            return;
        }
        match decimal_evidence(text) {
            DecimalEvidence::Nothing => {}
            DecimalEvidence::Decimal(decimal) => self.shows[decimal_mark_index(decimal)] = true,
            DecimalEvidence::Either => {
                let at = || CellPosition { begin, text: text.trim().to_owned() };
                self.either.get_or_insert_with(at);
            }
        }
    }

    /// The number under the decimal mark that makes it one; NaN for a gap, and where it is wrong.
    fn parse_number(&mut self, text: &str, at: &dyn Fn() -> CellPosition) -> f64 {
        let same = !text.contains([',', '.']);
        let decimals = match self.given {
            Some(given) => &[given][..],
            None if same => &EACH[..1],
            None => &EACH,
        };
        let mut value = f64::NAN;
        for &decimal in decimals {
            let wrong = match parse_cell(text, decimal) {
                CsvCell::Number(number) => {
                    value = number;
                    continue;
                }
                CsvCell::Gap => continue,
                CsvCell::Infinite => ("a finite number", "; remove the row or empty the cell"),
                CsvCell::Other => ("a number", ""),
            };
            for place in [decimal_mark_index(decimal), 1 - decimal_mark_index(decimal)]
                .into_iter()
                .take(1 + usize::from(same))
            {
                let of = EACH[place];
                self.wrong[place].get_or_insert_with(|| CellError {
                    at: at(),
                    expected: wrong.0,
                    hint: if wrong.1.is_empty() { cell::non_number_hint(text, of) } else { wrong.1 },
                });
            }
        }
        value
    }

    fn push_integer(&mut self, text: &str, value: f64, at: &dyn Fn() -> CellPosition) {
        let exact = text.parse::<i128>().ok();
        // Such as `5.0` and `1e3`: beyond 2^53 the digits are not all there.
        let whole = || (value.abs() <= 2.0_f64.powi(53)).then_some(value as i128);
        let whole = || whole().filter(|whole| *whole as f64 == value);
        let integer = exact.or_else(whole);
        let mut expected = "an integer";
        if let Some(integer) = integer {
            let [signed, unsigned] = [i64::MIN.into()..=i64::MAX.into(), 0..=u64::MAX.into()];
            self.fits[0] &= signed.contains(&integer);
            self.fits[1] &= unsigned.contains(&integer);
            expected = "an integer of 64 bits, all of the column with a sign or all without one";
        }
        if integer.is_none() || self.fits == [false; 2] {
            self.no_integer.get_or_insert_with(|| CellError { at: at(), expected, hint: "" });
        }
        self.integers.push(integer.unwrap_or_default());
    }

    /// The first cell that is wrong, now that the decimal mark is known.
    pub fn first_error(&self, decimal: DecimalMark) -> Option<&CellError> {
        self.wrong[decimal_mark_index(decimal)].as_ref().or(self.no_integer.as_ref())
    }

    /// Whether its times are clocks or dates.
    pub fn has_clocks(&self) -> bool {
        self.clocks
    }
}
