//! Rows of a run, and indices that fit one kind of row and one kind of value only.

use std::marker::PhantomData;
use std::ops;

use expression::{IntegerIndex, IntegerRange, NumberIndex, NumberRange, ReadableRow, TextIndex, TextRange};

/// Marks rows with every variable of a run.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default)]
pub struct AllVariables;

/// Marks rows with the recorded variables only.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default)]
pub struct RecordedVariables;

/// Whether a number of a run holds this integer exactly.
#[must_use]
pub fn is_exact_in_f64(integer: i128) -> bool {
    integer as f64 as i128 == integer
}

/// The values of a run at a communication point, one for each of the [`Columns`] of the same space.
///
/// An index of a full row does not fit a recorded one:
///
/// ```compile_fail,E0277
/// use recording::{AllVariables, NumberIndex, RecordedVariables, Row};
/// let row = Row::<RecordedVariables>::from_values(vec![1.0], Vec::new());
/// row[NumberIndex::<AllVariables>::new(0)];
/// ```
///
/// An index of a text does not fit numbers:
///
/// ```compile_fail,E0308
/// use recording::{AllVariables, Row, TextIndex};
/// let row = Row::<AllVariables>::from_values(vec![1.0], Vec::new());
/// let number: f64 = row[TextIndex::new(0)];
/// ```
///
/// A check over full rows takes a full row:
///
/// ```
/// use expression::{ConditionMonitor, Expression, SignalOperand};
/// use recording::{AllVariables, NumberIndex, Row};
/// let speed = NumberIndex::<AllVariables>::new(0);
/// let check = Expression::parse("car.speed < 30", &mut |_| Some(SignalOperand::Number(speed).into()))?;
/// let row = Row::<AllVariables>::from_values(vec![20.0], Vec::new());
/// assert_eq!(ConditionMonitor::new(check, 0.0).push_sample(0.0, &row), Some(true));
/// # Ok::<(), expression::ParseError>(())
/// ```
///
/// It refuses a recorded one:
///
/// ```compile_fail,E0277
/// use expression::{ConditionMonitor, Expression, SignalOperand};
/// use recording::{AllVariables, NumberIndex, RecordedVariables, Row};
/// let speed = NumberIndex::<AllVariables>::new(0);
/// let check = Expression::parse("car.speed < 30", &mut |_| Some(SignalOperand::Number(speed).into()))?;
/// let row = Row::<RecordedVariables>::from_values(vec![20.0], Vec::new());
/// assert_eq!(ConditionMonitor::new(check, 0.0).push_sample(0.0, &row), Some(true));
/// # Ok::<(), expression::ParseError>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Row<S> {
    pub(crate) numbers: Vec<f64>,
    pub(crate) texts: Vec<String>,
    /// What the numbers of integers of 64 bits are exactly.
    pub(crate) integers: Vec<i128>,
    space: PhantomData<S>,
}

impl<S> Default for Row<S> {
    fn default() -> Self {
        Self::from_values(Vec::new(), Vec::new())
    }
}

impl<S> Row<S> {
    /// A row of these values, none of them an integer of 64 bits.
    #[must_use]
    pub fn from_values(numbers: Vec<f64>, texts: Vec<String>) -> Self {
        Self { numbers, texts, integers: Vec::new(), space: PhantomData }
    }

    /// All numbers.
    #[must_use]
    pub fn numbers(&self) -> &[f64] {
        &self.numbers
    }

    /// The same, to be changed.
    #[must_use]
    #[inline]
    pub fn numbers_mut(&mut self) -> &mut [f64] {
        &mut self.numbers
    }

    /// All texts.
    #[must_use]
    pub fn texts(&self) -> &[String] {
        &self.texts
    }

    /// All integers of 64 bits, exactly.
    #[must_use]
    pub fn integers(&self) -> &[i128] {
        &self.integers
    }

    /// Takes over the values of a row of the same size, without allocating for numbers.
    #[inline]
    pub fn copy_from(&mut self, other: &Self) {
        self.numbers.copy_from_slice(&other.numbers);
        self.texts.clone_from_slice(&other.texts);
        self.integers.copy_from_slice(&other.integers);
    }

    /// Takes over the numbers and the integers of a row of the same size, and leaves the texts.
    #[inline]
    pub fn copy_numbers_from(&mut self, other: &Self) {
        self.numbers.copy_from_slice(&other.numbers);
        // A call of `memcpy` for nothing takes as long as a short row.
        if !self.integers.is_empty() {
            self.integers.copy_from_slice(&other.integers);
        }
    }

    /// Replaces all values, without allocating for numbers; no texts leave those that there are.
    pub fn set_values(&mut self, numbers: &[f64], texts: Option<Vec<String>>, integers: &[i128]) {
        self.numbers.clear();
        self.numbers.extend_from_slice(numbers);
        self.integers.clear();
        self.integers.extend_from_slice(integers);
        self.texts = texts.unwrap_or_else(|| std::mem::take(&mut self.texts));
    }

    /// The numbers of two ranges, of which the first may be written; nothing when they overlap or are not there.
    #[inline]
    pub fn disjoint_number_ranges(
        &mut self,
        written: NumberRange<S>,
        read: NumberRange<S>,
    ) -> Option<(&mut [f64], &[f64])> {
        let (written, read) = (written.positions(), read.positions());
        if written.end <= read.start {
            let (head, tail) = self.numbers.split_at_mut_checked(read.start)?;
            Some((head.get_mut(written)?, tail.get(..read.end.checked_sub(read.start)?)?))
        } else {
            let (head, tail) = self.numbers.split_at_mut_checked(written.start)?;
            Some((tail.get_mut(..written.end.checked_sub(written.start)?)?, head.get(read)?))
        }
    }

    /// Copies a text of the row to another place in it, without allocating where there is room.
    pub fn copy_text(&mut self, from: TextIndex<S>, to: TextIndex<S>) {
        let mut text = std::mem::take(&mut self.texts[to.position()]);
        text.clone_from(&self.texts[from.position()]);
        self.texts[to.position()] = text;
    }

    /// Puts an integer of 64 bits into the row, and beside it its number, which may be rounded.
    pub fn set_integer(&mut self, integer: IntegerIndex<S>, number: NumberIndex<S>, value: i128) {
        self.integers[integer.position()] = value;
        self.numbers[number.position()] = value as f64;
    }
}

impl<S> ReadableRow<S> for Row<S> {
    #[inline]
    fn number_at(&self, index: NumberIndex<S>) -> Option<f64> {
        self.numbers.get(index.position()).copied()
    }

    #[inline]
    fn text_at(&self, index: TextIndex<S>) -> Option<&str> {
        self.texts.get(index.position()).map(String::as_str)
    }
}

impl<S> ops::Index<NumberIndex<S>> for Row<S> {
    type Output = f64;

    #[inline]
    fn index(&self, index: NumberIndex<S>) -> &f64 {
        &self.numbers[index.position()]
    }
}

impl<S> ops::IndexMut<NumberIndex<S>> for Row<S> {
    #[inline]
    fn index_mut(&mut self, index: NumberIndex<S>) -> &mut f64 {
        &mut self.numbers[index.position()]
    }
}

impl<S> ops::Index<TextIndex<S>> for Row<S> {
    type Output = String;

    #[inline]
    fn index(&self, index: TextIndex<S>) -> &String {
        &self.texts[index.position()]
    }
}

impl<S> ops::IndexMut<TextIndex<S>> for Row<S> {
    #[inline]
    fn index_mut(&mut self, index: TextIndex<S>) -> &mut String {
        &mut self.texts[index.position()]
    }
}

impl<S> ops::Index<IntegerIndex<S>> for Row<S> {
    type Output = i128;

    #[inline]
    fn index(&self, index: IntegerIndex<S>) -> &i128 {
        &self.integers[index.position()]
    }
}

impl<S> ops::Index<IntegerRange<S>> for Row<S> {
    type Output = [i128];

    #[inline]
    fn index(&self, range: IntegerRange<S>) -> &[i128] {
        &self.integers[range.positions()]
    }
}

impl<S> ops::IndexMut<IntegerRange<S>> for Row<S> {
    #[inline]
    fn index_mut(&mut self, range: IntegerRange<S>) -> &mut [i128] {
        &mut self.integers[range.positions()]
    }
}

impl<S> ops::Index<NumberRange<S>> for Row<S> {
    type Output = [f64];

    #[inline]
    fn index(&self, range: NumberRange<S>) -> &[f64] {
        &self.numbers[range.positions()]
    }
}

impl<S> ops::IndexMut<NumberRange<S>> for Row<S> {
    #[inline]
    fn index_mut(&mut self, range: NumberRange<S>) -> &mut [f64] {
        &mut self.numbers[range.positions()]
    }
}

impl<S> ops::Index<TextRange<S>> for Row<S> {
    type Output = [String];

    #[inline]
    fn index(&self, range: TextRange<S>) -> &[String] {
        &self.texts[range.positions()]
    }
}

impl<S> ops::IndexMut<TextRange<S>> for Row<S> {
    #[inline]
    fn index_mut(&mut self, range: TextRange<S>) -> &mut [String] {
        &mut self.texts[range.positions()]
    }
}
