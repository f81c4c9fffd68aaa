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
//!
//! A condition is parsed once, with a place in the row for each signal, and watches samples:
//!
//! ```
//! use expression::{
//!     ConditionMonitor, Expression, NumberIndex, ReadableRow, ResolvedSignal, SignalOperand, SignalUnit, TextIndex,
//! };
//! use units::Unit;
//!
//! /// A row of one number: the speed [m/s].
//! #[derive(Debug)]
//! struct SpeedRow(f64);
//!
//! impl ReadableRow<SpeedRow> for SpeedRow {
//!     fn number_at(&self, index: NumberIndex<SpeedRow>) -> Option<f64> {
//!         (index.position() == 0).then_some(self.0)
//!     }
//!     fn text_at(&self, _: TextIndex<SpeedRow>) -> Option<&str> {
//!         None
//!     }
//! }
//!
//! let unit = SignalUnit::Known(Unit::parse("m/s")?, "m/s".to_owned());
//! let mut resolve = |name: &str| {
//!     let operand = SignalOperand::Number(NumberIndex::new(0));
//!     (name == "car.v").then(|| ResolvedSignal { operand, unit: unit.clone() })
//! };
//! let condition: Expression<SpeedRow> = Expression::parse("car.v < 100 km/h", &mut resolve)?;
//! let mut monitor = ConditionMonitor::new(condition, 0.0);
//! for (time, v) in [(0.0, 20.0), (1.0, 27.0), (2.0, 28.0)] {
//!     monitor.push_sample(time, &SpeedRow(v));
//! }
//! let outcome = monitor.outcome();
//! assert!(!outcome.passed && outcome.first == Some(2.0));
//!
//! let mistake = Expression::parse("car.v < 3 kg and time > 1", &mut resolve).unwrap_err();
//! assert_eq!(&"car.v < 3 kg and time > 1"[mistake.span], "car.v < 3 kg");
//! println!("{}", mistake.message);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! In the registry this crate is `trackside-expression`; the name in code stays.
#![forbid(unsafe_code)]

mod bound;
mod dimension;
mod function;
mod index;
mod inference;
mod interval;
mod monitor;
mod operator;
mod parser;
mod reducer;
mod sides;
#[cfg(test)]
mod tests;
mod token;
mod trace;

use std::marker::PhantomData;
use std::ops::Range;

use dimension::InferredUnit;
use function::ScalarFunction;
use reducer::WindowReducer;
use units::Unit;

pub use bound::SignalBound;
pub use index::{
    ColumnIndex, IntegerIndex, IntegerKind, IntegerRange, NumberIndex, NumberKind, NumberRange, ReadableRow,
    TextIndex, TextKind, TextRange, TypedIndex, TypedRange,
};
pub use interval::Interval;
pub use monitor::{ConditionMonitor, ConditionOutcome};
pub use sides::{comparison_sides, reduced_quantity};
pub use trace::{ComparisonTrace, TraceContent, TracePoint};

/// One parsed condition, with its signals resolved to values of rows of space `S`; it is evaluated over such rows only.
#[derive(Debug, Clone, PartialEq)]
pub struct Expression<S> {
    root: ExpressionNode,
    dimension: Box<InferredUnit>,
    /// The unit of the sides of the comparison at the root.
    compared: Option<Box<str>>,
    reductions: Vec<ReductionCall>,
    space: PhantomData<S>,
}

/// The index of a signal in rows of space `S`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SignalOperand<S> {
    /// A number.
    Number(NumberIndex<S>),
    /// A text.
    Text(TextIndex<S>),
    /// A value of unknown kind: a text where it is compared with a text, else a number.
    Either(NumberIndex<S>, TextIndex<S>),
}

/// A signal as an expression sees it. One that is made of its operand alone is a plain number.
#[derive(Debug, Clone, PartialEq)]
pub struct ResolvedSignal<S> {
    /// Where its values are.
    pub operand: SignalOperand<S>,
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

impl<S, O: Into<SignalOperand<S>>> From<O> for ResolvedSignal<S> {
    fn from(operand: O) -> Self {
        ResolvedSignal { operand: operand.into(), unit: SignalUnit::Plain }
    }
}

impl<S> From<ColumnIndex<S>> for SignalOperand<S> {
    fn from(index: ColumnIndex<S>) -> Self {
        match index {
            ColumnIndex::Number(index) => SignalOperand::Number(index),
            ColumnIndex::Text(index) => SignalOperand::Text(index),
        }
    }
}

/// A mistake in the text of a condition.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{message}")]
#[non_exhaustive]
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
    pub unitless: Option<Box<UnitlessSignal>>,
}

/// A signal whose unit is needed and not known.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub struct UnitlessSignal {
    /// The name of the signal.
    pub signal: String,
    /// The unit on the other side.
    pub other: String,
}

impl ParseError {
    fn new(span: Range<usize>, message: impl Into<String>) -> Self {
        Self { message: message.into(), span, help: None, unknown: None, unitless: None }
    }

    fn with_help(mut self, help: impl Into<String>) -> Self {
        self.help = Some(help.into());
        self
    }
}

#[derive(Debug, Clone, PartialEq)]
enum ExpressionNode {
    Number(f64),
    Time,
    Signal(usize),
    /// A [`SignalOperand::Either`] that is compared with no text, so it is a number; its indices among numbers and texts.
    Either(usize, usize),
    /// An index into [`Expression::reductions`].
    Reduced(usize),
    Negate(Box<ExpressionNode>),
    /// Value, factor and offset to the unit on the other side.
    Convert(Box<ExpressionNode>, f64, f64),
    Not(Box<ExpressionNode>),
    Arithmetic(ArithmeticOperator, Box<[ExpressionNode; 2]>),
    Compare(ComparisonOperator, Box<[ExpressionNode; 2]>),
    Join(LogicalOperator, Box<[ExpressionNode; 2]>),
    /// A side of [`ExpressionNode::Same`]; the parser leaves none elsewhere.
    Text(TextOperand),
    /// Whether two texts are equal, or, when `false`, whether they are not.
    Same(bool, [TextOperand; 2]),
    Call(&'static ScalarFunction, Vec<ExpressionNode>),
}

#[derive(Debug, Clone, PartialEq)]
enum TextOperand {
    Literal(String),
    Signal(usize),
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum ArithmeticOperator {
    Add,
    Subtract,
    Multiply,
    Divide,
    Power,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum ComparisonOperator {
    Less,
    LessOrEqual,
    Greater,
    GreaterOrEqual,
    Equal,
    NotEqual,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum LogicalOperator {
    And,
    Or,
}

#[derive(Debug, Clone, PartialEq)]
struct ReductionCall {
    reducer: &'static WindowReducer,
    /// Its constant argument, when it has one.
    parameter: f64,
    /// Its quantities, at least one.
    arguments: Vec<ExpressionNode>,
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
            ExpressionNode::Compare(..)
                | ExpressionNode::Same(..)
                | ExpressionNode::Join(..)
                | ExpressionNode::Not(_)
                | ExpressionNode::Call(ScalarFunction { is_condition: true, .. }, _)
        )
    }

    /// Its unit, if it has one, with the name that it was declared by. What products make has no name.
    #[must_use]
    pub fn unit(&self) -> Option<(Unit, Option<String>)> {
        self.dimension.unit_and_name()
    }

    /// The unit that both sides are compared in, if it is one comparison of values with a unit.
    #[must_use]
    pub fn compared_unit(&self) -> Option<&str> {
        self.compared.as_deref()
    }

    /// The numbers of a row that it depends on, some of them repeatedly.
    #[must_use]
    pub fn number_indices(&self) -> Vec<NumberIndex<S>> {
        self.collect_indices(ExpressionNode::collect_number_indices).map(NumberIndex::new).collect()
    }

    /// The texts of a row that it depends on, some of them repeatedly.
    #[must_use]
    pub fn text_indices(&self) -> Vec<TextIndex<S>> {
        self.collect_indices(ExpressionNode::collect_text_indices).map(TextIndex::new).collect()
    }

    fn collect_indices(
        &self,
        collect: fn(&ExpressionNode, &mut Vec<usize>),
    ) -> impl Iterator<Item = usize> + use<S> {
        let mut indices = Vec::new();
        collect(&self.root, &mut indices);
        let arguments = self.reductions.iter().flat_map(|it| &it.arguments);
        arguments.for_each(|it| collect(it, &mut indices));
        indices.into_iter()
    }
}

impl ExpressionNode {
    fn collect_text_indices(&self, indices: &mut Vec<usize>) {
        match self {
            ExpressionNode::Same(_, sides) => indices.extend(sides.iter().filter_map(|side| match side {
                TextOperand::Signal(index) => Some(*index),
                TextOperand::Literal(_) => None,
            })),
            ExpressionNode::Negate(inner)
            | ExpressionNode::Not(inner)
            | ExpressionNode::Convert(inner, ..) => inner.collect_text_indices(indices),
            ExpressionNode::Arithmetic(_, sides)
            | ExpressionNode::Compare(_, sides)
            | ExpressionNode::Join(_, sides) => {
                sides.iter().for_each(|side| side.collect_text_indices(indices));
            }
            ExpressionNode::Call(_, arguments) => {
                arguments.iter().for_each(|it| it.collect_text_indices(indices))
            }
            _ => {}
        }
    }

    fn collect_number_indices(&self, indices: &mut Vec<usize>) {
        match self {
            ExpressionNode::Signal(index) | ExpressionNode::Either(index, _) => indices.push(*index),
            ExpressionNode::Negate(inner)
            | ExpressionNode::Not(inner)
            | ExpressionNode::Convert(inner, ..) => inner.collect_number_indices(indices),
            ExpressionNode::Arithmetic(_, sides)
            | ExpressionNode::Compare(_, sides)
            | ExpressionNode::Join(_, sides) => {
                sides.iter().for_each(|side| side.collect_number_indices(indices));
            }
            ExpressionNode::Call(_, arguments) => {
                arguments.iter().for_each(|it| it.collect_number_indices(indices))
            }
            ExpressionNode::Number(_)
            | ExpressionNode::Time
            | ExpressionNode::Reduced(_)
            | ExpressionNode::Text(_)
            | ExpressionNode::Same(..) => {}
        }
    }
}
