//! Takes the values of a channel, one after another, in the form that is wanted.

use log_file::Values;

use crate::table::kept::Kept;
use crate::table::wanted::Reading;

/// A value of a channel.
#[derive(Debug, Clone, PartialEq)]
pub enum Cell {
    /// A number, which is NaN where there is none.
    Number(f64),
    /// An integer with all its digits.
    Integer(i128),
    /// A text.
    Text(String),
}

/// The values of a column that were read up to now.
#[derive(Debug)]
pub struct Growing {
    reading: Reading,
    /// NaN where there is none; of what is kept, the places.
    pub values: Vec<f64>,
    pub kept: Kept,
    /// Where the first row without a value is.
    pub gap: Option<String>,
    /// What was expected and what was found, at the first row that is wrong.
    pub wrong: Option<String>,
}

impl Growing {
    pub fn new(reading: Reading) -> Self {
        let kept = match reading {
            Reading::Number => Kept::Nothing,
            Reading::Integer => Kept::Integers(Vec::new()),
            Reading::Text => Kept::Texts(Vec::new()),
        };
        Growing { reading, values: Vec::new(), kept, gap: None, wrong: None }
    }

    /// Takes a stretch of a log.
    pub fn take(&mut self, stretch: &Values) {
        for row in 0..stretch.len() {
            let nothing = || match self.reading {
                // As an empty cell is an empty text.
                Reading::Text => Cell::Text(String::new()),
                _ => Cell::Number(f64::NAN),
            };
            let cell = match stretch {
                Values::Texts(all) => all[row].clone().map_or_else(nothing, Cell::Text),
                Values::Integers(all) => all[row].map_or_else(nothing, Cell::Integer),
                Values::Numbers(all) => Cell::Number(all[row]),
            };
            let row = self.values.len() + 1;
            self.push(cell, &|| format!("row {row}"));
        }
    }

    /// Takes a value, which stands at a place.
    pub fn push(&mut self, cell: Cell, place: &dyn Fn() -> String) {
        match self.reading {
            Reading::Text => self.text(cell),
            Reading::Number | Reading::Integer => self.number(cell, place),
        }
    }

    fn text(&mut self, cell: Cell) {
        let text = match cell {
            Cell::Text(text) => text,
            Cell::Integer(integer) => integer.to_string(),
            Cell::Number(number) if number.is_nan() => String::new(),
            Cell::Number(number) => number.to_string(),
        };
        self.values.push(self.values.len() as f64);
        if let Kept::Texts(texts) = &mut self.kept {
            texts.push(text);
        }
    }

    fn number(&mut self, cell: Cell, place: &dyn Fn() -> String) {
        let (number, exact) = match cell {
            Cell::Number(number) => (number, whole(number)),
            Cell::Integer(integer) => (integer as f64, Some(integer)),
            Cell::Text(text) => {
                self.blame("numbers", &format!("the text {text:?}"), place);
                (f64::NAN, None)
            }
        };
        if number.is_infinite() {
            self.blame("finite numbers", &number.to_string(), place);
        }
        if number.is_nan() {
            self.gap.get_or_insert_with(place);
        }
        if let Kept::Integers(integers) = &mut self.kept
            && !number.is_nan()
        {
            self.values.push(integers.len() as f64);
            integers.push(exact.unwrap_or_default());
            if exact.is_none() {
                self.blame("integers", &number.to_string(), place);
            }
        } else {
            self.values.push(number);
        }
    }

    fn blame(&mut self, expected: &str, found: &str, place: &dyn Fn() -> String) {
        self.wrong
            .get_or_insert_with(|| format!("expected {expected}, found {found} in {}", place()));
    }
}

/// Beyond 2^53 the digits are not all there.
fn whole(number: f64) -> Option<i128> {
    let whole = (number.abs() <= 2.0_f64.powi(53)).then_some(number as i128);
    whole.filter(|whole| *whole as f64 == number)
}
