//! Plays texts and integers back as they are: the last one holds until the next row.

use super::wanted::Reading;
use super::{EDGE, Table};

/// What a column keeps beside its numbers, which are then the places here: rows without a value are filled and cut as those of
/// numbers are.
#[derive(Debug, Clone, Default)]
pub(super) enum Kept {
    #[default]
    Nothing,
    Integers(Vec<i128>),
    Texts(Vec<String>),
}

impl Table {
    /// The form in which a column is played back.
    ///
    /// # Panics
    /// When `column` is not an index into [`Table::names`].
    #[must_use]
    pub fn reading(&self, column: usize) -> Reading {
        match self.columns[column].kept {
            Kept::Nothing => Reading::Number,
            Kept::Integers(_) => Reading::Integer,
            Kept::Texts(_) => Reading::Text,
        }
    }

    /// Whether a column of integers has one beyond those of 64 bits with a sign.
    ///
    /// # Panics
    /// When `column` is not an index into [`Table::names`].
    #[must_use]
    pub fn is_unsigned(&self, column: usize) -> bool {
        match &self.columns[column].kept {
            Kept::Integers(integers) => integers.iter().any(|it| *it > i64::MAX.into()),
            _ => false,
        }
    }

    /// The indices of the columns that are played back in this form.
    #[must_use]
    pub fn read_as(&self, reading: Reading) -> Vec<usize> {
        (0..self.columns.len()).filter(|column| self.reading(*column) == reading).collect()
    }

    /// The text of a column at a time of the scenario [s]; nothing in a column of another form.
    ///
    /// # Panics
    /// When `column` is not an index into [`Table::names`].
    pub fn text(&mut self, column: usize, time: f64) -> Option<&str> {
        let place = self.place(column, time);
        match &self.columns[column].kept {
            Kept::Texts(texts) => texts.get(place).map(String::as_str),
            _ => None,
        }
    }

    /// The integer of a column at a time of the scenario [s]; nothing in a column of another form.
    ///
    /// # Panics
    /// When `column` is not an index into [`Table::names`].
    pub fn integer(&mut self, column: usize, time: f64) -> Option<i128> {
        let place = self.place(column, time);
        match &self.columns[column].kept {
            Kept::Integers(integers) => integers.get(place).copied(),
            _ => None,
        }
    }

    /// Where the value of the last row is among those that the column keeps.
    fn place(&mut self, column: usize, time: f64) -> usize {
        let stamp = time + self.origin;
        let column = &self.columns[column];
        column.values[self.clocks[column.clock].seek(stamp + EDGE)] as usize
    }
}
