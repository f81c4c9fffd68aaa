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
//! Per sample: `abs sqrt sin cos tan atan exp ln sign deg rad isfinite` of one argument, `atan2
//! hypot` of two, `min max` of two or more. Over the window: `max min mean rms std sum first last
//! count` of one argument and `quantile(x, p)`.
#![forbid(unsafe_code)]

mod function;
mod monitor;
mod parser;
mod reducer;
#[cfg(test)]
mod tests;
mod token;

use std::ops::Range;

use function::Function;
use reducer::Reducer;

pub use monitor::{Monitor, Outcome};

/// One parsed condition, with its signals resolved to columns.
#[derive(Debug, Clone, PartialEq)]
pub struct Expression {
    root: Node,
    reductions: Vec<Reduction>,
}

/// Where the values of a signal are in a row.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Operand {
    /// At this place among the numbers.
    Number(usize),
    /// At this place among the texts.
    Text(usize),
    /// A result, which is a text where it is compared with a text, else a number; at this place among both.
    Result(usize),
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
}

impl ParseError {
    fn new(span: Range<usize>, message: impl Into<String>) -> Self {
        Self { message: message.into(), span, help: None, unknown: None }
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
    /// A result that is compared with no text, so it is a number.
    Result(usize),
    /// An index into [`Expression::reductions`].
    Reduced(usize),
    Negate(Box<Node>),
    Not(Box<Node>),
    Arithmetic(Operator, Box<[Node; 2]>),
    Compare(Relation, Box<[Node; 2]>),
    Join(Junction, Box<[Node; 2]>),
    /// A side of [`Node::Same`]; the parser leaves none elsewhere.
    Text(Text),
    /// Whether two texts are equal, or, when `false`, whether they are not.
    Same(bool, [Text; 2]),
    Call(&'static Function, Vec<Node>),
}

#[derive(Debug, Clone, PartialEq)]
enum Text {
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
    argument: Node,
}

impl Expression {
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

    /// The places among the numbers of a row that it depends on, some of them repeatedly.
    #[must_use]
    pub fn numbers(&self) -> Vec<usize> {
        let mut places = Vec::new();
        self.root.numbers(&mut places);
        self.reductions.iter().for_each(|it| it.argument.numbers(&mut places));
        places
    }
}

impl Expression {
    /// The places among the texts of a row that it depends on, some of them repeatedly.
    #[must_use]
    pub fn texts(&self) -> Vec<usize> {
        let mut places = Vec::new();
        self.root.texts(&mut places);
        self.reductions.iter().for_each(|it| it.argument.texts(&mut places));
        places
    }
}

impl Node {
    fn texts(&self, places: &mut Vec<usize>) {
        match self {
            Node::Same(_, sides) => places.extend(sides.iter().filter_map(|side| match side {
                Text::Signal(place) => Some(*place),
                Text::Literal(_) => None,
            })),
            Node::Negate(inner) | Node::Not(inner) => inner.texts(places),
            Node::Arithmetic(_, sides) | Node::Compare(_, sides) | Node::Join(_, sides) => {
                sides.iter().for_each(|side| side.texts(places));
            }
            Node::Call(_, arguments) => arguments.iter().for_each(|it| it.texts(places)),
            _ => {}
        }
    }

    fn numbers(&self, places: &mut Vec<usize>) {
        match self {
            Node::Signal(place) | Node::Result(place) => places.push(*place),
            Node::Negate(inner) | Node::Not(inner) => inner.numbers(places),
            Node::Arithmetic(_, sides) | Node::Compare(_, sides) | Node::Join(_, sides) => {
                sides.iter().for_each(|side| side.numbers(places));
            }
            Node::Call(_, arguments) => arguments.iter().for_each(|it| it.numbers(places)),
            Node::Number(_) | Node::Time | Node::Reduced(_) | Node::Text(_) | Node::Same(..) => {}
        }
    }
}
