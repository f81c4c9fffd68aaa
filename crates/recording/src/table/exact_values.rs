//! Plays back columns of texts and exact integers: the last value holds until the next row.

use super::read_request::ColumnType;
use super::{EDGE, TimeSeriesTable};

/// What a column keeps beside its numbers, which are then the places here: rows without a value are filled and cut as those of
/// numbers are.
#[derive(Debug, Clone, Default)]
pub(super) enum ExactValues {
    #[default]
    Nothing,
    Integers(Vec<i128>),
    Texts(Vec<String>),
}

impl TimeSeriesTable {
    /// The form in which a column is played back.
    ///
    /// # Panics
    /// When `column` is not an index into [`TimeSeriesTable::column_names`].
    #[must_use]
    pub fn column_type(&self, column: usize) -> ColumnType {
        match self.columns[column].exact {
            ExactValues::Nothing => ColumnType::Number,
            ExactValues::Integers(_) => ColumnType::Integer,
            ExactValues::Texts(_) => ColumnType::Text,
        }
    }

    /// Whether a column of integers has one beyond those of 64 bits with a sign.
    ///
    /// # Panics
    /// When `column` is not an index into [`TimeSeriesTable::column_names`].
    #[must_use]
    pub fn has_unsigned_integers(&self, column: usize) -> bool {
        match &self.columns[column].exact {
            ExactValues::Integers(integers) => integers.iter().any(|it| *it > i64::MAX.into()),
            _ => false,
        }
    }

    /// The indices of the columns that are played back in this form.
    #[must_use]
    pub fn columns_of_type(&self, column_type: ColumnType) -> Vec<usize> {
        (0..self.columns.len()).filter(|column| self.column_type(*column) == column_type).collect()
    }

    /// The text of a column at a time of the scenario [s]; nothing in a column of another form.
    ///
    /// # Panics
    /// When `column` is not an index into [`TimeSeriesTable::column_names`].
    pub fn text_at(&mut self, column: usize, time: f64) -> Option<&str> {
        let place = self.exact_value_index_at(column, time);
        match &self.columns[column].exact {
            ExactValues::Texts(texts) => texts.get(place).map(String::as_str),
            _ => None,
        }
    }

    /// The integer of a column at a time of the scenario [s]; nothing in a column of another form.
    ///
    /// # Panics
    /// When `column` is not an index into [`TimeSeriesTable::column_names`].
    pub fn integer_at(&mut self, column: usize, time: f64) -> Option<i128> {
        let place = self.exact_value_index_at(column, time);
        match &self.columns[column].exact {
            ExactValues::Integers(integers) => integers.get(place).copied(),
            _ => None,
        }
    }

    /// Where the value of the last row is among those that the column keeps.
    fn exact_value_index_at(&mut self, column: usize, time: f64) -> usize {
        let stamp = time + self.origin;
        let column = &self.columns[column];
        column.values[self.clocks[column.clock].seek_row(stamp + EDGE)] as usize
    }
}
