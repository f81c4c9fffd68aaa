//! Rows of a run, their columns, and indices that fit one kind of row and one kind of value only.

use std::marker::PhantomData;
use std::ops;

pub use expression::{
    ColumnIndex, Integer, IntegerIndex, IntegerRange, Number, NumberIndex, NumberRange, Text,
    TextIndex, TextRange, TypedIndex, TypedRange, Values,
};

/// Marks rows with every variable of a run.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default)]
pub struct Full;

/// Marks rows with the recorded variables only.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default)]
pub struct Recorded;

/// Which side of its node a variable is on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Direction {
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
    pub fn is_exact(self) -> bool {
        matches!(self, ValueKind::Int64 | ValueKind::UInt64)
    }
}

/// Whether a number of a run holds this integer exactly.
#[must_use]
pub fn fits_number(integer: i128) -> bool {
    integer as f64 as i128 == integer
}

/// A variable of a run.
#[derive(Debug, Clone)]
pub struct Column {
    /// The node's name in the scenario.
    pub node: String,
    /// The variable's name in the node.
    pub variable: String,
    /// The side of the node that it is on.
    pub direction: Direction,
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
    pub fn name(&self) -> String {
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
    space: PhantomData<S>,
}

impl<S> Default for Columns<S> {
    fn default() -> Self {
        Self { numbers: Vec::new(), texts: Vec::new(), integers: Vec::new(), space: PhantomData }
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
        if column.kind == ValueKind::String {
            self.texts.push(column);
            ColumnIndex::Text(TextIndex::new(self.texts.len() - 1))
        } else {
            let place = self.numbers.len();
            if column.kind.is_exact() {
                self.integers.push(place);
            }
            self.numbers.push(column);
            ColumnIndex::Number(NumberIndex::new(place))
        }
    }

    /// Number columns in the order of the row.
    pub fn numbers(
        &self,
    ) -> impl DoubleEndedIterator<Item = (NumberIndex<S>, &Column)> + ExactSizeIterator + Clone
    {
        self.numbers.iter().enumerate().map(|(at, column)| (NumberIndex::new(at), column))
    }

    /// Text columns in the order of the row.
    pub fn texts(
        &self,
    ) -> impl DoubleEndedIterator<Item = (TextIndex<S>, &Column)> + ExactSizeIterator + Clone {
        self.texts.iter().enumerate().map(|(at, column)| (TextIndex::new(at), column))
    }

    /// The numbers that are integers of 64 bits, in the order of the row.
    pub fn integers(
        &self,
    ) -> impl DoubleEndedIterator<Item = (IntegerIndex<S>, NumberIndex<S>)> + ExactSizeIterator + Clone
    {
        let pair =
            |(at, number): (usize, &usize)| (IntegerIndex::new(at), NumberIndex::new(*number));
        self.integers.iter().enumerate().map(pair)
    }

    /// The exact integer of a number, if it is one.
    #[must_use]
    pub fn integer(&self, number: NumberIndex<S>) -> Option<IntegerIndex<S>> {
        self.integers.binary_search(&number.position()).ok().map(IntegerIndex::new)
    }

    /// All columns, numbers first.
    pub fn iter(&self) -> impl Iterator<Item = &Column> + Clone {
        self.numbers.iter().chain(&self.texts)
    }

    /// The first column of this name, `node.variable`.
    #[must_use]
    pub fn find(&self, name: &str) -> Option<ColumnIndex<S>> {
        let named = |column: &Column| {
            let variable = name.strip_prefix(column.node.as_str());
            variable.and_then(|rest| rest.strip_prefix('.')) == Some(column.variable.as_str())
        };
        let number = self.numbers.iter().position(named).map(NumberIndex::new);
        let text = || self.texts.iter().position(named).map(TextIndex::new);
        number.map(ColumnIndex::Number).or_else(|| text().map(ColumnIndex::Text))
    }

    /// A row of zeros and empty texts.
    #[must_use]
    pub fn row(&self) -> Row<S> {
        let texts = vec![String::new(); self.texts.len()];
        let row = Row::from_values(vec![0.0; self.numbers.len()], texts);
        Row { integers: vec![0; self.integers.len()], ..row }
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

/// The values of a run at a communication point, one for each of the [`Columns`] of the same space.
///
/// An index of a full row does not fit a recorded one:
///
/// ```compile_fail,E0277
/// use recording::{Full, NumberIndex, Recorded, Row};
/// let row = Row::<Recorded>::from_values(vec![1.0], Vec::new());
/// row[NumberIndex::<Full>::new(0)];
/// ```
///
/// An index of a text does not fit numbers:
///
/// ```compile_fail,E0308
/// use recording::{Full, Row, TextIndex};
/// let row = Row::<Full>::from_values(vec![1.0], Vec::new());
/// let number: f64 = row[TextIndex::new(0)];
/// ```
///
/// A check over full rows takes a full row:
///
/// ```
/// use expression::{Expression, Monitor, Operand};
/// use recording::{Full, NumberIndex, Row};
/// let speed = NumberIndex::<Full>::new(0);
/// let check = Expression::parse("car.speed < 30", &mut |_| Some(Operand::Number(speed).into()))?;
/// let row = Row::<Full>::from_values(vec![20.0], Vec::new());
/// assert_eq!(Monitor::new(check, 0.0).sample(0.0, &row), Some(true));
/// # Ok::<(), expression::ParseError>(())
/// ```
///
/// It refuses a recorded one:
///
/// ```compile_fail,E0277
/// use expression::{Expression, Monitor, Operand};
/// use recording::{Full, NumberIndex, Recorded, Row};
/// let speed = NumberIndex::<Full>::new(0);
/// let check = Expression::parse("car.speed < 30", &mut |_| Some(Operand::Number(speed).into()))?;
/// let row = Row::<Recorded>::from_values(vec![20.0], Vec::new());
/// assert_eq!(Monitor::new(check, 0.0).sample(0.0, &row), Some(true));
/// # Ok::<(), expression::ParseError>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Row<S> {
    numbers: Vec<f64>,
    texts: Vec<String>,
    /// What the numbers of integers of 64 bits are exactly.
    integers: Vec<i128>,
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
    pub fn copy_from(&mut self, other: &Self) {
        self.numbers.copy_from_slice(&other.numbers);
        self.texts.clone_from_slice(&other.texts);
        self.integers.copy_from_slice(&other.integers);
    }

    /// Replaces all values, without allocating for numbers.
    pub fn assign(&mut self, numbers: &[f64], texts: Vec<String>, integers: Vec<i128>) {
        self.numbers.clear();
        self.numbers.extend_from_slice(numbers);
        (self.texts, self.integers) = (texts, integers);
    }

    /// Puts an integer of 64 bits into the row, and beside it its number, which may be rounded.
    pub fn put(&mut self, (integer, number): (IntegerIndex<S>, NumberIndex<S>), value: i128) {
        self.integers[integer.position()] = value;
        self.numbers[number.position()] = value as f64;
    }
}

impl<S> Values<S> for Row<S> {
    #[inline]
    fn number(&self, index: NumberIndex<S>) -> Option<f64> {
        self.numbers.get(index.position()).copied()
    }

    #[inline]
    fn text(&self, index: TextIndex<S>) -> Option<&str> {
        self.texts.get(index.position()).map(String::as_str)
    }
}

impl<S> ops::Index<NumberIndex<S>> for Row<S> {
    type Output = f64;

    fn index(&self, index: NumberIndex<S>) -> &f64 {
        &self.numbers[index.position()]
    }
}

impl<S> ops::IndexMut<NumberIndex<S>> for Row<S> {
    fn index_mut(&mut self, index: NumberIndex<S>) -> &mut f64 {
        &mut self.numbers[index.position()]
    }
}

impl<S> ops::Index<TextIndex<S>> for Row<S> {
    type Output = String;

    fn index(&self, index: TextIndex<S>) -> &String {
        &self.texts[index.position()]
    }
}

impl<S> ops::IndexMut<TextIndex<S>> for Row<S> {
    fn index_mut(&mut self, index: TextIndex<S>) -> &mut String {
        &mut self.texts[index.position()]
    }
}

impl<S> ops::Index<IntegerIndex<S>> for Row<S> {
    type Output = i128;

    fn index(&self, index: IntegerIndex<S>) -> &i128 {
        &self.integers[index.position()]
    }
}

impl<S> ops::Index<IntegerRange<S>> for Row<S> {
    type Output = [i128];

    fn index(&self, range: IntegerRange<S>) -> &[i128] {
        &self.integers[range.positions()]
    }
}

impl<S> ops::IndexMut<IntegerRange<S>> for Row<S> {
    fn index_mut(&mut self, range: IntegerRange<S>) -> &mut [i128] {
        &mut self.integers[range.positions()]
    }
}

impl<S> ops::Index<NumberRange<S>> for Row<S> {
    type Output = [f64];

    fn index(&self, range: NumberRange<S>) -> &[f64] {
        &self.numbers[range.positions()]
    }
}

impl<S> ops::IndexMut<NumberRange<S>> for Row<S> {
    fn index_mut(&mut self, range: NumberRange<S>) -> &mut [f64] {
        &mut self.numbers[range.positions()]
    }
}

impl<S> ops::Index<TextRange<S>> for Row<S> {
    type Output = [String];

    fn index(&self, range: TextRange<S>) -> &[String] {
        &self.texts[range.positions()]
    }
}

impl<S> ops::IndexMut<TextRange<S>> for Row<S> {
    fn index_mut(&mut self, range: TextRange<S>) -> &mut [String] {
        &mut self.texts[range.positions()]
    }
}

/// The variables of a run that are recorded: the only way from a full row to a recorded one.
#[derive(Debug, Clone, Default)]
pub struct Selection {
    numbers: Vec<NumberIndex<Full>>,
    texts: Vec<TextIndex<Full>>,
    integers: Vec<IntegerIndex<Full>>,
}

impl Selection {
    /// The columns for which `keep` is true.
    pub fn new(columns: &Columns<Full>, keep: impl Fn(&Column) -> bool) -> Self {
        Self {
            numbers: columns.numbers().filter(|(_, it)| keep(it)).map(|(index, _)| index).collect(),
            texts: columns.texts().filter(|(_, it)| keep(it)).map(|(index, _)| index).collect(),
            integers: columns
                .integers()
                .filter(|(_, number)| keep(&columns[*number]))
                .map(|(index, _)| index)
                .collect(),
        }
    }

    /// The recorded columns.
    #[must_use]
    pub fn columns(&self, full: &Columns<Full>) -> Columns<Recorded> {
        let numbers = self.numbers.iter().map(|&index| full[index].clone());
        let texts = self.texts.iter().map(|&index| full[index].clone());
        numbers.chain(texts).collect()
    }

    /// The recorded column of a full one, if it is recorded.
    #[must_use]
    pub fn recorded(&self, index: NumberIndex<Full>) -> Option<NumberIndex<Recorded>> {
        self.numbers.iter().position(|it| *it == index).map(NumberIndex::new)
    }

    /// Puts the recorded values of a full row into `recorded`, without allocating for numbers.
    pub fn pick(&self, full: &Row<Full>, recorded: &mut Row<Recorded>) {
        recorded.numbers.clear();
        recorded.numbers.extend(self.numbers.iter().map(|&index| full[index]));
        recorded.texts.resize_with(self.texts.len(), String::new);
        for (text, &index) in recorded.texts.iter_mut().zip(&self.texts) {
            text.clone_from(&full[index]);
        }
        recorded.integers.clear();
        recorded.integers.extend(self.integers.iter().map(|&index| full[index]));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn column(variable: &str, kind: ValueKind) -> Column {
        Column {
            node: "car".to_owned(),
            variable: variable.to_owned(),
            direction: Direction::Output,
            kind,
            unit: None,
            description: None,
        }
    }

    #[test]
    fn a_recorded_row_has_the_selected_values_of_the_full_one() {
        let mut columns = Columns::<Full>::default();
        columns.push(column("speed", ValueKind::Real));
        let gear = columns.push(column("gear", ValueKind::Integer));
        let state = columns.push(column("state", ValueKind::String));
        assert_eq!(columns.find("car.gear"), Some(gear));
        assert_eq!(columns.find("car.state"), Some(state));
        assert_eq!(columns.find("car.clutch"), None);
        let selection = Selection::new(&columns, |column| column.variable != "speed");
        let full = Row::from_values(vec![20.0, 3.0], vec!["armed".to_owned()]);
        let mut recorded = Row::default();
        selection.pick(&full, &mut recorded);
        assert_eq!(recorded, Row::from_values(vec![3.0], vec!["armed".to_owned()]));
        let names: Vec<_> = selection.columns(&columns).iter().map(Column::name).collect();
        assert_eq!(names, ["car.gear", "car.state"]);
    }

    #[test]
    fn an_integer_of_64_bits_is_kept_exactly_beside_its_number() {
        let kinds = [ValueKind::UInt64, ValueKind::Real, ValueKind::Int64];
        let mut columns = Columns::<Full>::default();
        for (kind, name) in kinds.into_iter().zip(["id", "speed", "count"]) {
            columns.push(column(name, kind));
        }
        let places: Vec<_> = columns.integers().collect();
        assert_eq!(places.iter().map(|(_, number)| number.position()).collect::<Vec<_>>(), [0, 2]);
        assert_eq!(columns.integer(NumberIndex::new(1)), None);
        assert_eq!(columns.integer(NumberIndex::new(2)), Some(places[1].0));
        let mut full = columns.row();
        let (id, count) = (i128::from(u64::MAX), i128::from(i64::MIN) + 1);
        full.put(places[0], id);
        full.put(places[1], count);
        assert_eq!(full.numbers(), [u64::MAX as f64, 0.0, i64::MIN as f64]);
        assert_eq!(full.integers(), [id, count]);
        let selection = Selection::new(&columns, |column| column.variable != "id");
        let mut recorded = Row::default();
        selection.pick(&full, &mut recorded);
        assert_eq!(recorded.integers(), [count]);
        let columns = selection.columns(&columns);
        assert_eq!(columns.integers().map(|it| it.1.position()).collect::<Vec<_>>(), [1]);
        assert!(fits_number(1 << 53) && fits_number(1 << 60) && !fits_number((1 << 53) + 1));
    }
}
