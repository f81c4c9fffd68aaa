//! Takes the values of a channel, stretch by stretch, in the form that is wanted.

use log_file::Values;

use crate::table::kept::Kept;
use crate::table::wanted::Reading;

/// The values of a column that were read up to now.
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

    /// Takes a stretch.
    pub fn take(&mut self, stretch: &Values) {
        for row in 0..stretch.len() {
            match self.reading {
                Reading::Text => self.text(stretch, row),
                Reading::Number | Reading::Integer => self.number(stretch, row),
            }
        }
    }

    fn text(&mut self, stretch: &Values, row: usize) {
        let text = match stretch {
            // As an empty cell is an empty text.
            Values::Texts(all) => all[row].clone().unwrap_or_default(),
            Values::Integers(all) => all[row].map(|it| it.to_string()).unwrap_or_default(),
            Values::Numbers(all) if all[row].is_nan() => String::new(),
            Values::Numbers(all) => all[row].to_string(),
        };
        self.values.push(self.values.len() as f64);
        if let Kept::Texts(texts) = &mut self.kept {
            texts.push(text);
        }
    }

    fn number(&mut self, stretch: &Values, row: usize) {
        let number = match (stretch.number(row), stretch) {
            (Some(number), _) => number,
            (None, Values::Texts(all)) => match &all[row] {
                None => f64::NAN,
                Some(text) => {
                    let text = text.clone();
                    self.blame("numbers", &format!("the text {text:?}"));
                    f64::NAN
                }
            },
            (None, _) => f64::NAN,
        };
        if number.is_infinite() {
            self.blame("finite numbers", &number.to_string());
        }
        if number.is_nan() {
            let row = self.values.len() + 1;
            self.gap.get_or_insert_with(|| format!("row {row}"));
        }
        if let Kept::Integers(integers) = &mut self.kept
            && !number.is_nan()
        {
            let exact = match stretch {
                Values::Integers(all) => all[row],
                _ => whole(number),
            };
            self.values.push(integers.len() as f64);
            integers.push(exact.unwrap_or_default());
            if exact.is_none() {
                self.blame("integers", &number.to_string());
            }
        } else {
            self.values.push(number);
        }
    }

    fn blame(&mut self, expected: &str, found: &str) {
        let row = self.values.len() + 1;
        self.wrong
            .get_or_insert_with(|| format!("expected {expected}, found {found} in row {row}"));
    }
}

/// Beyond 2^53 the digits are not all there.
fn whole(number: f64) -> Option<i128> {
    let whole = (number.abs() <= 2.0_f64.powi(53)).then_some(number as i128);
    whole.filter(|whole| *whole as f64 == number)
}
