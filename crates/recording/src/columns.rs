//! Describes the variables of a run, each a column of its rows.

use std::collections::HashMap;
use std::marker::PhantomData;
use std::ops;

use expression::{ColumnIndex, IntegerIndex, NumberIndex, TextIndex};

use crate::row::Row;

/// Which side of its node a variable is on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum VariableDirection {
    /// The value that the node got for the step that ended at the row's time, sensor effects included.
    Input,
    /// The value that the node showed at the row's time.
    Output,
}

/// The type of a variable. Numbers travel as `f64`, which holds each of them exactly, except for integers of 64 bits: these
/// travel a second time beside the numbers, exactly. Texts travel beside both.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ValueKind {
    /// A floating-point number.
    Real,
    /// An integer of up to 32 bits, or the value of an enumeration item.
    Integer,
    /// A signed integer of 64 bits, or the value of an enumeration item of FMI 3.0.
    Int64,
    /// An unsigned integer of 64 bits.
    UInt64,
    /// 0 or 1.
    Boolean,
    /// A text.
    String,
}

impl ValueKind {
    /// Whether it is an integer that `f64` may round, which therefore travels exactly beside the numbers.
    #[must_use]
    pub fn is_64_bit_integer(self) -> bool {
        matches!(self, ValueKind::Int64 | ValueKind::UInt64)
    }
}

/// A variable of a run.
#[derive(Debug, Clone)]
pub struct Column {
    /// The node's name in the scenario.
    pub node: String,
    /// The variable's name in the node.
    pub variable: String,
    /// The side of the node that it is on.
    pub direction: VariableDirection,
    /// Its type.
    pub kind: ValueKind,
    /// Its unit, as the node states it.
    pub unit: Option<String>,
    /// One line about it, as the node states it.
    pub description: Option<String>,
}

impl Column {
    /// The name that scenarios, CSV headers and reports use: `node.variable`.
    #[must_use]
    pub fn qualified_name(&self) -> String {
        format!("{}.{}", self.node, self.variable)
    }
}

/// The columns of a row of space `S`: first the numbers, then the texts. Some numbers are integers of 64 bits.
#[derive(Debug, Clone)]
pub struct Columns<S> {
    numbers: Vec<Column>,
    texts: Vec<Column>,
    /// The place of each exact integer among the numbers.
    integers: Vec<usize>,
    /// The first number and the first text of each name.
    by_name: [HashMap<String, usize>; 2],
    space: PhantomData<S>,
}

impl<S> Default for Columns<S> {
    fn default() -> Self {
        Self {
            numbers: Vec::new(),
            texts: Vec::new(),
            integers: Vec::new(),
            by_name: Default::default(),
            space: PhantomData,
        }
    }
}

impl<S> FromIterator<Column> for Columns<S> {
    fn from_iter<I: IntoIterator<Item = Column>>(columns: I) -> Self {
        let mut all = Self::default();
        for column in columns {
            all.push(column);
        }
        all
    }
}

impl<S> Columns<S> {
    /// Adds a column among the numbers or the texts, as its kind says.
    pub fn push(&mut self, column: Column) -> ColumnIndex<S> {
        let [numbers, texts] = &mut self.by_name;
        if column.kind == ValueKind::String {
            texts.entry(column.qualified_name()).or_insert(self.texts.len());
            self.texts.push(column);
            ColumnIndex::Text(TextIndex::new(self.texts.len() - 1))
        } else {
            let place = self.numbers.len();
            numbers.entry(column.qualified_name()).or_insert(place);
            if column.kind.is_64_bit_integer() {
                self.integers.push(place);
            }
            self.numbers.push(column);
            ColumnIndex::Number(NumberIndex::new(place))
        }
    }

    /// Number columns in the order of the row.
    pub fn number_columns(
        &self,
    ) -> impl DoubleEndedIterator<Item = (NumberIndex<S>, &Column)> + ExactSizeIterator + Clone {
        self.numbers.iter().enumerate().map(|(at, column)| (NumberIndex::new(at), column))
    }

    /// Text columns in the order of the row.
    pub fn text_columns(
        &self,
    ) -> impl DoubleEndedIterator<Item = (TextIndex<S>, &Column)> + ExactSizeIterator + Clone {
        self.texts.iter().enumerate().map(|(at, column)| (TextIndex::new(at), column))
    }

    /// The numbers that are integers of 64 bits, in the order of the row.
    pub fn integer_columns(
        &self,
    ) -> impl DoubleEndedIterator<Item = (IntegerIndex<S>, NumberIndex<S>)> + ExactSizeIterator + Clone {
        let pair = |(at, number): (usize, &usize)| (IntegerIndex::new(at), NumberIndex::new(*number));
        self.integers.iter().enumerate().map(pair)
    }

    /// The exact integer of a number, if it is one.
    #[must_use]
    pub fn integer_index_of(&self, number: NumberIndex<S>) -> Option<IntegerIndex<S>> {
        self.integers.binary_search(&number.position()).ok().map(IntegerIndex::new)
    }

    /// All columns, numbers first.
    pub fn iter(&self) -> impl Iterator<Item = &Column> + Clone {
        self.numbers.iter().chain(&self.texts)
    }

    /// The first column of this name, `node.variable`.
    #[must_use]
    pub fn find(&self, name: &str) -> Option<ColumnIndex<S>> {
        let [numbers, texts] = &self.by_name;
        let number = numbers.get(name).copied().map(NumberIndex::new);
        let text = || texts.get(name).copied().map(TextIndex::new);
        number.map(ColumnIndex::Number).or_else(|| text().map(ColumnIndex::Text))
    }

    /// A row of zeros and empty texts.
    #[must_use]
    pub fn zero_row(&self) -> Row<S> {
        let texts = vec![String::new(); self.texts.len()];
        let mut row = Row::from_values(vec![0.0; self.numbers.len()], texts);
        row.integers = vec![0; self.integers.len()];
        row
    }
}

impl<S> ops::Index<NumberIndex<S>> for Columns<S> {
    type Output = Column;

    fn index(&self, index: NumberIndex<S>) -> &Column {
        &self.numbers[index.position()]
    }
}

impl<S> ops::Index<TextIndex<S>> for Columns<S> {
    type Output = Column;

    fn index(&self, index: TextIndex<S>) -> &Column {
        &self.texts[index.position()]
    }
}
