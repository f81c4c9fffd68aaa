//! Builds the series of a channel, value by value, in the requested type.

use log_file::ChannelValues;

use crate::table::exact_values::ExactValues;
use crate::table::read_request::ColumnType;

/// A value of a channel.
#[derive(Debug, Clone, PartialEq)]
pub enum ChannelValue {
    /// A number, which is NaN where there is none.
    Number(f64),
    /// An integer with all its digits.
    Integer(i128),
    /// A text.
    Text(String),
}

/// The values of a column that were read up to now.
#[derive(Debug)]
pub struct SeriesBuilder {
    column_type: ColumnType,
    /// NaN where there is none; of what is kept, the places.
    pub values: Vec<f64>,
    pub exact: ExactValues,
    /// Where the first row without a value is.
    pub gap: Option<String>,
    /// What was expected and what was found, at the first row that is wrong.
    pub wrong: Option<String>,
}

impl SeriesBuilder {
    pub fn new(column_type: ColumnType) -> Self {
        let exact = match column_type {
            ColumnType::Number => ExactValues::Nothing,
            ColumnType::Integer => ExactValues::Integers(Vec::new()),
            ColumnType::Text => ExactValues::Texts(Vec::new()),
        };
        SeriesBuilder { column_type, values: Vec::new(), exact, gap: None, wrong: None }
    }

    /// Takes a stretch of a log.
    pub fn push_chunk(&mut self, stretch: &ChannelValues) {
        for row in 0..stretch.len() {
            let nothing = || match self.column_type {
                // As an empty cell is an empty text.
                ColumnType::Text => ChannelValue::Text(String::new()),
                _ => ChannelValue::Number(f64::NAN),
            };
            let cell = match stretch {
                ChannelValues::Texts(all) => all[row].clone().map_or_else(nothing, ChannelValue::Text),
                ChannelValues::Integers(all) => all[row].map_or_else(nothing, ChannelValue::Integer),
                ChannelValues::Numbers(all) => ChannelValue::Number(all[row]),
            };
            let row = self.values.len() + 1;
            self.push_value(cell, &|| format!("row {row}"));
        }
    }

    /// Takes a value, which stands at a place.
    pub fn push_value(&mut self, cell: ChannelValue, place: &dyn Fn() -> String) {
        match self.column_type {
            ColumnType::Text => self.push_text(cell),
            ColumnType::Number | ColumnType::Integer => self.push_number(cell, place),
        }
    }

    fn push_text(&mut self, cell: ChannelValue) {
        let text = match cell {
            ChannelValue::Text(text) => text,
            ChannelValue::Integer(integer) => integer.to_string(),
            ChannelValue::Number(number) if number.is_nan() => String::new(),
            ChannelValue::Number(number) => number.to_string(),
        };
        self.values.push(self.values.len() as f64);
        if let ExactValues::Texts(texts) = &mut self.exact {
            texts.push(text);
        }
    }

    fn push_number(&mut self, cell: ChannelValue, place: &dyn Fn() -> String) {
        let (number, exact) = match cell {
            ChannelValue::Number(number) => (number, exact_integer(number)),
            ChannelValue::Integer(integer) => (integer as f64, Some(integer)),
            ChannelValue::Text(text) => {
                self.note_first_error("numbers", &format!("the text {text:?}"), place);
                (f64::NAN, None)
            }
        };
        if number.is_infinite() {
            self.note_first_error("finite numbers", &number.to_string(), place);
        }
        if number.is_nan() {
            self.gap.get_or_insert_with(place);
        }
        if let ExactValues::Integers(integers) = &mut self.exact
            && !number.is_nan()
        {
            self.values.push(integers.len() as f64);
            integers.push(exact.unwrap_or_default());
            if exact.is_none() {
                self.note_first_error("integers", &number.to_string(), place);
            }
        } else {
            self.values.push(number);
        }
    }

    fn note_first_error(&mut self, expected: &str, found: &str, place: &dyn Fn() -> String) {
        self.wrong.get_or_insert_with(|| format!("expected {expected}, found {found} in {}", place()));
    }
}

/// Beyond 2^53 the digits are not all there.
fn exact_integer(number: f64) -> Option<i128> {
    let whole = (number.abs() <= 2.0_f64.powi(53)).then_some(number as i128);
    whole.filter(|whole| *whole as f64 == number)
}
