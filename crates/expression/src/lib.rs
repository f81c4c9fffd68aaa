//! The text of a check or a formula goes in; an expression over the columns of a row comes out, which is evaluated sample by sample.
//!
//! ```text
//! abs(plant.y - reference.y) < 0.3 and plant.fault == 0      holds at every sample
//! rms(a.x - b.x) / max(abs(b.x)) < 0.01                      holds for the window as a whole
//! ```
//!
//! A signal is written `node.variable` with FMI's structured names (`tyre.f_z[1,2]`,
//! `plant.der(v)`), or between backticks when it has other characters; `time` is the time [s] and
//! `pi` a number. Operators, from loose to tight: `or` `||`, `and` `&&`, `not` `!`,
//! `< <= > >= == !=`, `+ -`, `* /`, unary `-`, `^`. Truth is 1 and 0, so `mean(condition)` is a share.
//!
//! A text is compared with another one by `==` and `!=` only: `plant.state == 'armed'`, with quotes of
//! either kind.
//!
//! Signals have units, and so may numbers: `abs(plant.psi) < 5 deg`, `plant.v_x < 100 km/h`. A unit is joined without blanks, so
//! `3 m / plant.v_x` divides. What is added or compared has one dimension, and is converted to the unit on the left; a number
//! without a unit takes that of the other side. `rad` counts as 1 in products.
//!
//! Per sample: `abs sqrt sin cos tan atan exp ln sign deg rad isfinite` of one argument, `atan2
//! hypot` of two, `min max` of two or more. Over the window: `max min mean rms std sum first last
//! count` of one argument, `quantile(x, p)`, `rating(x, reference)` with its parts by ISO/TS 18571, and `corridor` and
//! `corridor_share(x, y, x_ref, y_ref, dx, dy)` by ISO 19364.
#![forbid(unsafe_code)]

mod bound;
mod dimension;
mod function;
mod index;
mod inference;
mod monitor;
mod operator;
mod parser;
mod reducer;
#[cfg(test)]
mod tests;
mod token;
mod trace;

use std::marker::PhantomData;
use std::ops::Range;

use dimension::Dimension;
use function::Function;
use reducer::Reducer;
use units::Unit;

pub use bound::Bound;
pub use index::{
    ColumnIndex, Integer, IntegerIndex, IntegerRange, Number, NumberIndex, NumberRange, Text,
    TextIndex, TextRange, TypedIndex, TypedRange, Values,
};
pub use monitor::{Monitor, Outcome};
pub use trace::{Trace, TracePoint, Traced};

/// One parsed condition, with its signals resolved to values of rows of space `S`; it is evaluated over such rows only.
#[derive(Debug, Clone, PartialEq)]
pub struct Expression<S> {
    root: Node,
    dimension: Box<Dimension>,
    /// The unit of the sides of the comparison at the root.
    compared: Option<Box<str>>,
    reductions: Vec<Reduction>,
    space: PhantomData<S>,
}

/// The index of a signal in rows of space `S`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Operand<S> {
    /// A number.
    Number(NumberIndex<S>),
    /// A text.
    Text(TextIndex<S>),
    /// A value of unknown kind: a text where it is compared with a text, else a number.
    Either(NumberIndex<S>, TextIndex<S>),
}

/// A signal as an expression sees it. One that is made of its operand alone is a plain number.
#[derive(Debug, Clone, PartialEq)]
pub struct Signal<S> {
    /// Where its values are.
    pub operand: Operand<S>,
    /// Its unit.
    pub unit: SignalUnit,
}

/// What is known about the unit of a signal.
#[derive(Debug, Clone, PartialEq)]
pub enum SignalUnit {
    /// It needs none: a count, a truth, a result of an analysis. It takes the unit of what it is compared with.
    Plain,
    /// It should have one, and nobody says which.
    Missing,
    /// The unit with its name.
    Known(Unit, String),
    /// The same of a difference: no point on a scale with a shifted zero, such as degC, compares with it.
    Difference(Unit, String),
}

impl<S, O: Into<Operand<S>>> From<O> for Signal<S> {
    fn from(operand: O) -> Self {
        Signal { operand: operand.into(), unit: SignalUnit::Plain }
    }
}

impl<S> From<ColumnIndex<S>> for Operand<S> {
    fn from(index: ColumnIndex<S>) -> Self {
        match index {
            ColumnIndex::Number(index) => Operand::Number(index),
            ColumnIndex::Text(index) => Operand::Text(index),
        }
    }
}

/// A mistake in the text of a condition.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{message}")]
pub struct ParseError {
    /// The expected and the found word.
    pub message: String,
    /// The bytes of the text that it is about.
    pub span: Range<usize>,
    /// A remedy.
    pub help: Option<String>,
    /// The signal name that could not be resolved, if that is what is wrong, to suggest another.
    pub unknown: Option<String>,
    /// The signal that lacks a unit, if that is what is wrong, to say where it is declared.
    pub unitless: Option<Box<Unitless>>,
}

/// A signal whose unit is needed and not known.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Unitless {
    /// The name of the signal.
    pub signal: String,
    /// The unit on the other side.
    pub other: String,
}

impl ParseError {
    fn new(span: Range<usize>, message: impl Into<String>) -> Self {
        Self { message: message.into(), span, help: None, unknown: None, unitless: None }
    }

    fn help(mut self, help: impl Into<String>) -> Self {
        self.help = Some(help.into());
        self
    }
}

#[derive(Debug, Clone, PartialEq)]
enum Node {
    Number(f64),
    Time,
    Signal(usize),
    /// An [`Operand::Either`] that is compared with no text, so it is a number; its indices among numbers and texts.
    Either(usize, usize),
    /// An index into [`Expression::reductions`].
    Reduced(usize),
    Negate(Box<Node>),
    /// Value, factor and offset to the unit on the other side.
    Convert(Box<Node>, f64, f64),
    Not(Box<Node>),
    Arithmetic(Operator, Box<[Node; 2]>),
    Compare(Relation, Box<[Node; 2]>),
    Join(Junction, Box<[Node; 2]>),
    /// A side of [`Node::Same`]; the parser leaves none elsewhere.
    Text(TextSide),
    /// Whether two texts are equal, or, when `false`, whether they are not.
    Same(bool, [TextSide; 2]),
    Call(&'static Function, Vec<Node>),
}

#[derive(Debug, Clone, PartialEq)]
enum TextSide {
    Literal(String),
    Signal(usize),
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Operator {
    Add,
    Subtract,
    Multiply,
    Divide,
    Power,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Relation {
    Less,
    LessOrEqual,
    Greater,
    GreaterOrEqual,
    Equal,
    NotEqual,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Junction {
    And,
    Or,
}

#[derive(Debug, Clone, PartialEq)]
struct Reduction {
    reducer: &'static Reducer,
    /// Its constant argument, when it has one.
    parameter: f64,
    /// Its quantities, at least one.
    arguments: Vec<Node>,
}

impl<S> Expression<S> {
    /// Whether it is one statement about the window as a whole, not one about every sample.
    #[must_use]
    pub fn is_reduction(&self) -> bool {
        !self.reductions.is_empty()
    }

    /// Whether it is true or false, not a number.
    #[must_use]
    pub fn is_condition(&self) -> bool {
        matches!(
            self.root,
            Node::Compare(..)
                | Node::Same(..)
                | Node::Join(..)
                | Node::Not(_)
                | Node::Call(Function { is_condition: true, .. }, _)
        )
    }

    /// Its unit, if it has one, with the name that it was declared by. What products make has no name.
    #[must_use]
    pub fn unit(&self) -> Option<(Unit, Option<String>)> {
        self.dimension.known()
    }

    /// The unit that both sides are compared in, if it is one comparison of values with a unit.
    #[must_use]
    pub fn compared_unit(&self) -> Option<&str> {
        self.compared.as_deref()
    }

    /// The numbers of a row that it depends on, some of them repeatedly.
    #[must_use]
    pub fn numbers(&self) -> Vec<NumberIndex<S>> {
        self.indices(Node::numbers).map(NumberIndex::new).collect()
    }

    /// The texts of a row that it depends on, some of them repeatedly.
    #[must_use]
    pub fn texts(&self) -> Vec<TextIndex<S>> {
        self.indices(Node::texts).map(TextIndex::new).collect()
    }

    fn indices(&self, collect: fn(&Node, &mut Vec<usize>)) -> impl Iterator<Item = usize> + use<S> {
        let mut indices = Vec::new();
        collect(&self.root, &mut indices);
        let arguments = self.reductions.iter().flat_map(|it| &it.arguments);
        arguments.for_each(|it| collect(it, &mut indices));
        indices.into_iter()
    }
}

impl Node {
    fn texts(&self, indices: &mut Vec<usize>) {
        match self {
            Node::Same(_, sides) => indices.extend(sides.iter().filter_map(|side| match side {
                TextSide::Signal(index) => Some(*index),
                TextSide::Literal(_) => None,
            })),
            Node::Negate(inner) | Node::Not(inner) | Node::Convert(inner, ..) => {
                inner.texts(indices)
            }
            Node::Arithmetic(_, sides) | Node::Compare(_, sides) | Node::Join(_, sides) => {
                sides.iter().for_each(|side| side.texts(indices));
            }
            Node::Call(_, arguments) => arguments.iter().for_each(|it| it.texts(indices)),
            _ => {}
        }
    }

    fn numbers(&self, indices: &mut Vec<usize>) {
        match self {
            Node::Signal(index) | Node::Either(index, _) => indices.push(*index),
            Node::Negate(inner) | Node::Not(inner) | Node::Convert(inner, ..) => {
                inner.numbers(indices)
            }
            Node::Arithmetic(_, sides) | Node::Compare(_, sides) | Node::Join(_, sides) => {
                sides.iter().for_each(|side| side.numbers(indices));
            }
            Node::Call(_, arguments) => arguments.iter().for_each(|it| it.numbers(indices)),
            Node::Number(_) | Node::Time | Node::Reduced(_) | Node::Text(_) | Node::Same(..) => {}
        }
    }
}
