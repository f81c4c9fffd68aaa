//! Indices of the values of a row, each tied to a kind of row (its space) and a kind of value (number or text).

use std::marker::PhantomData;
use std::ops::Range;

/// Marks indices among the numbers of a row.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default)]
pub struct NumberKind;

/// Marks indices among the texts of a row.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default)]
pub struct TextKind;

/// Marks indices among the integers of a row that are kept exactly beside its numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default)]
pub struct IntegerKind;

/// The index of a column of kind `K` in rows of space `S`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct TypedIndex<K, S> {
    position: usize,
    of: PhantomData<(K, S)>,
}

/// The index of a number in rows of space `S`.
pub type NumberIndex<S> = TypedIndex<NumberKind, S>;
/// The index of a text in rows of space `S`.
pub type TextIndex<S> = TypedIndex<TextKind, S>;
/// The index of an exact integer in rows of space `S`.
pub type IntegerIndex<S> = TypedIndex<IntegerKind, S>;
/// Neighbouring numbers in rows of space `S`.
pub type NumberRange<S> = TypedRange<NumberKind, S>;
/// Neighbouring texts in rows of space `S`.
pub type TextRange<S> = TypedRange<TextKind, S>;
/// Neighbouring exact integers in rows of space `S`.
pub type IntegerRange<S> = TypedRange<IntegerKind, S>;

impl<K, S> TypedIndex<K, S> {
    /// The column with so many others of its kind before it.
    #[must_use]
    pub const fn new(position: usize) -> Self {
        Self { position, of: PhantomData }
    }

    /// How many columns of its kind come before it.
    #[must_use]
    pub const fn position(&self) -> usize {
        self.position
    }
}

/// Neighbouring columns of kind `K` in rows of space `S`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct TypedRange<K, S> {
    start: usize,
    end: usize,
    of: PhantomData<(K, S)>,
}

impl<K, S> Default for TypedRange<K, S> {
    fn default() -> Self {
        Self::new(0..0)
    }
}

impl<K, S> TypedRange<K, S> {
    /// The columns at these positions among those of their kind.
    #[must_use]
    pub const fn new(positions: Range<usize>) -> Self {
        Self { start: positions.start, end: positions.end, of: PhantomData }
    }

    /// The positions of the columns among those of their kind.
    #[must_use]
    pub const fn positions(&self) -> Range<usize> {
        self.start..self.end
    }

    /// The index of the column with so many others of these before it; nothing when there are not so many.
    #[must_use]
    pub fn nth_index(&self, place: usize) -> Option<TypedIndex<K, S>> {
        self.positions().nth(place).map(TypedIndex::new)
    }

    /// The index of each column.
    pub fn indices(&self) -> impl DoubleEndedIterator<Item = TypedIndex<K, S>> + use<K, S> {
        self.positions().map(TypedIndex::new)
    }
}

/// The index of a column of either kind.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ColumnIndex<S> {
    /// Among the numbers.
    Number(NumberIndex<S>),
    /// Among the texts.
    Text(TextIndex<S>),
}

/// The values of a row of space `S`, as expressions over that space read them.
pub trait ReadableRow<S> {
    /// The number at this index; nothing when the row is shorter.
    fn number_at(&self, index: NumberIndex<S>) -> Option<f64>;

    /// The text at this index; nothing when the row is shorter.
    fn text_at(&self, index: TextIndex<S>) -> Option<&str>;
}
