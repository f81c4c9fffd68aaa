//! Evaluates a condition sample by sample and keeps the worst sample.

mod memory;

use std::marker::PhantomData;

use super::{
    Expression, Function, Junction, Node, NumberIndex, Operator, Reduction, Relation, TextIndex,
    TextSide, Values,
};
use crate::reducer;
use crate::trace::{Trace, Traced};

/// The judgement of a condition at one sample, or over the window.
#[derive(Debug, Clone, Copy)]
struct Judgement {
    passed: bool,
    /// Distance to failing; infinite where there is none, NaN when an operand is not a number.
    margin: f64,
    value: f64,
    limit: f64,
}

impl Judgement {
    /// Equal margins differ at the edge: `a <= b` holds there and `a < b` does not.
    fn is_worse_than(&self, other: &Self) -> bool {
        (self.margin, self.passed) < (other.margin, other.passed)
    }

    /// The side that decides: the worse of two that must both hold, the better of two alternatives.
    fn joined(junction: Junction, a: Self, b: Self) -> Self {
        let (worse, better) = match (a.margin.is_nan(), b.margin.is_nan()) {
            (true, _) => (a, a),
            (_, true) => (b, b),
            _ if b.is_worse_than(&a) => (b, a),
            _ => (a, b),
        };
        match junction {
            Junction::And => worse,
            Junction::Or => better,
        }
    }
}

impl Operator {
    pub(crate) fn apply(self, a: f64, b: f64) -> f64 {
        match self {
            Self::Add => a + b,
            Self::Subtract => a - b,
            Self::Multiply => a * b,
            Self::Divide => a / b,
            // IEEE 754 has NaN^0 = 1 and 1^NaN = 1.
            Self::Power if a.is_nan() || b.is_nan() => f64::NAN,
            Self::Power => a.powf(b),
        }
    }
}

impl Relation {
    fn complement(self) -> Self {
        match self {
            Self::Less => Self::GreaterOrEqual,
            Self::LessOrEqual => Self::Greater,
            Self::Greater => Self::LessOrEqual,
            Self::GreaterOrEqual => Self::Less,
            Self::Equal => Self::NotEqual,
            Self::NotEqual => Self::Equal,
        }
    }

    fn judge(self, value: f64, limit: f64, tolerance: f64) -> Judgement {
        // Equal infinities have no difference, but subtracting them would be NaN.
        let room = if value == limit { 0.0 } else { limit - value };
        let margin = match self {
            Self::Less | Self::LessOrEqual => tolerance + room,
            Self::Greater | Self::GreaterOrEqual => tolerance - room,
            Self::Equal => tolerance - room.abs(),
            Self::NotEqual => room.abs() - tolerance,
        };
        let passed = match self {
            Self::LessOrEqual | Self::GreaterOrEqual | Self::Equal => margin >= 0.0,
            Self::Less | Self::Greater | Self::NotEqual => margin > 0.0,
        };
        Judgement { passed, margin, value, limit }
    }
}

/// The values that an expression is evaluated with.
struct Sample<'a, S, V> {
    time: f64,
    row: &'a V,
    reduced: &'a [f64],
    space: PhantomData<S>,
}

/// A row without values.
struct Empty;

impl<S> Values<S> for Empty {
    fn number(&self, _: NumberIndex<S>) -> Option<f64> {
        None
    }

    fn text(&self, _: TextIndex<S>) -> Option<&str> {
        None
    }
}

impl<'a, S, V: Values<S>> Sample<'a, S, V> {
    fn new(time: f64, row: &'a V) -> Self {
        Sample { time, row, reduced: &[], space: PhantomData }
    }

    fn value(&self, node: &Node) -> f64 {
        match node {
            Node::Number(number) => *number,
            Node::Time => self.time,
            // A missing column is not a number, so the check fails and says so.
            Node::Signal(index) | Node::Either(index, _) => {
                self.row.number(NumberIndex::new(*index)).unwrap_or(f64::NAN)
            }
            Node::Reduced(index) => self.reduced.get(*index).copied().unwrap_or(f64::NAN),
            Node::Negate(inner) => -self.value(inner),
            Node::Convert(inner, factor, offset) => self.value(inner) * factor + offset,
            Node::Arithmetic(operator, sides) => {
                operator.apply(self.value(&sides[0]), self.value(&sides[1]))
            }
            Node::Call(function, arguments) => self.call(function, arguments),
            Node::Text(_) => f64::NAN,
            // Truth that is counted or averaged is exact: a tolerance on it could tighten a check.
            Node::Not(_) | Node::Compare(..) | Node::Same(..) | Node::Join(..) => {
                let judgement = self.judge(node, true, 0.0);
                if judgement.margin.is_nan() {
                    f64::NAN
                } else {
                    f64::from(u8::from(judgement.passed))
                }
            }
        }
    }

    fn text<'b>(&'b self, text: &'b TextSide) -> Option<&'b str> {
        match text {
            TextSide::Literal(text) => Some(text),
            TextSide::Signal(index) => self.row.text(TextIndex::new(*index)),
        }
    }

    fn call(&self, function: &Function, arguments: &[Node]) -> f64 {
        // Few arguments need no allocation.
        let mut few = [0.0; 4];
        match few.get_mut(..arguments.len()) {
            Some(values) => {
                values
                    .iter_mut()
                    .zip(arguments)
                    .for_each(|(value, node)| *value = self.value(node));
                (function.evaluate)(values)
            }
            None => {
                let values: Vec<_> = arguments.iter().map(|node| self.value(node)).collect();
                (function.evaluate)(&values)
            }
        }
    }

    /// Judges the node, or its negation: the tolerance loosens every comparison in the sense in
    /// which it has to hold.
    fn judge(&self, node: &Node, positive: bool, tolerance: f64) -> Judgement {
        match node {
            Node::Not(inner) => self.judge(inner, !positive, tolerance),
            Node::Compare(relation, sides) => {
                let relation = if positive { *relation } else { relation.complement() };
                relation.judge(self.value(&sides[0]), self.value(&sides[1]), tolerance)
            }
            Node::Same(same, [a, b]) => {
                let passed = ((self.text(a) == self.text(b)) == *same) == positive;
                let margin = if passed { f64::INFINITY } else { f64::NEG_INFINITY };
                Judgement { passed, margin, value: f64::NAN, limit: f64::NAN }
            }
            Node::Join(junction, sides) => {
                let [a, b] = sides.each_ref().map(|side| self.judge(side, positive, tolerance));
                let junction = match (junction, positive) {
                    (Junction::And, true) | (Junction::Or, false) => Junction::And,
                    _ => Junction::Or,
                };
                Judgement::joined(junction, a, b)
            }
            _ => {
                let value = self.value(node);
                let passed = (value != 0.0) == positive;
                let margin = match (value.is_nan(), passed) {
                    (true, _) => f64::NAN,
                    (false, true) => f64::INFINITY,
                    (false, false) => f64::NEG_INFINITY,
                };
                Judgement { passed, margin, value, limit: f64::NAN }
            }
        }
    }
}

impl<S> Expression<S> {
    /// Its value at one sample; not a number when it is one of the window.
    #[must_use]
    pub fn value(&self, time: f64, row: &impl Values<S>) -> f64 {
        Sample::new(time, row).value(&self.root)
    }
}

/// The running state of one reduction.
#[derive(Debug, Clone)]
struct Accumulator {
    samples: u64,
    /// Time of the first value that is not a number [s].
    not_a_number: Option<f64>,
    /// The quantities at the last sample.
    values: Vec<f64>,
    state: Box<dyn reducer::Accumulator>,
}

impl Accumulator {
    fn new(reduction: &Reduction) -> Self {
        let state = (reduction.reducer.start)(reduction.parameter);
        Accumulator { samples: 0, not_a_number: None, values: Vec::new(), state }
    }

    fn push(&mut self, time: f64, values: impl Iterator<Item = f64>) {
        self.values.clear();
        self.values.extend(values);
        if self.values.iter().any(|value| value.is_nan()) {
            self.not_a_number.get_or_insert(time);
        }
        self.samples += 1;
        self.state.push(time, &self.values);
    }

    fn result(&self) -> f64 {
        if self.not_a_number.is_some() || self.samples == 0 {
            f64::NAN
        } else {
            self.state.result()
        }
    }
}

/// The outcome of a condition over its window.
#[derive(Debug, Clone, PartialEq)]
pub struct Outcome {
    /// Whether the condition held, at every sample or for the window as a whole.
    pub passed: bool,
    /// The samples in the window; without any a check fails.
    pub samples: u64,
    /// The smallest distance to failing with the tolerance included, negative when violated;
    /// nothing when there is none, as for a truth value or a NaN.
    pub margin: Option<f64>,
    /// Time [s] of the worst sample, or where the only reduction, if it picks a sample, found it.
    pub at: Option<f64>,
    /// Time [s] of the first sample at which the condition did not hold; none for one about the window.
    pub first: Option<f64>,
    /// The left side of the deciding comparison there.
    pub value: Option<f64>,
    /// The right side of the deciding comparison there.
    pub limit: Option<f64>,
    /// Whether an operand was not a number, which fails the check; `at` is the first such sample.
    pub nan: bool,
}

/// Watches one condition over rows of space `S` while the samples of its window pass by.
#[derive(Debug, Clone)]
pub struct Monitor<S> {
    expression: Expression<S>,
    tolerance: f64,
    samples: u64,
    worst: Option<(f64, Judgement)>,
    first: Option<f64>,
    trace: Trace,
    /// The limit of the only reduction in the trace.
    limit: f64,
    accumulators: Vec<Accumulator>,
}

impl<S> Monitor<S> {
    /// Watches a condition whose comparisons are loosened by `tolerance`, in the unit of their left sides: `a < b` is
    /// `a < b + tolerance`, and `a == b` is `|a - b| <= tolerance`. Comparisons that are operands,
    /// as in `count(a < b)`, are exact.
    #[must_use]
    pub fn new(expression: Expression<S>, tolerance: f64) -> Self {
        let accumulators = expression.reductions.iter().map(Accumulator::new).collect();
        let traced = match (&expression.root, expression.is_reduction()) {
            (_, true) => Traced::Reduced,
            (Node::Compare(..), false) => Traced::Sides,
            _ => Traced::Margins,
        };
        Self {
            limit: expression.limit_of_samples(),
            expression,
            tolerance,
            samples: 0,
            worst: None,
            first: None,
            trace: Trace::new(traced),
            accumulators,
        }
    }

    /// Takes one sample of the window. Returns whether the condition holds at this sample, unless it is one about the window.
    pub fn sample(&mut self, time: f64, row: &impl Values<S>) -> Option<bool> {
        self.samples += 1;
        let sample = Sample::new(time, row);
        if self.expression.is_reduction() {
            let reductions = self.expression.reductions.iter();
            let alone = self.accumulators.len() == 1;
            for (reduction, accumulator) in reductions.zip(&mut self.accumulators) {
                accumulator.push(time, reduction.arguments.iter().map(|it| sample.value(it)));
                if let ([value], true) = (accumulator.values.as_slice(), alone) {
                    self.trace.push(time, *value, self.limit);
                }
            }
            return None;
        }
        let judgement = sample.judge(&self.expression.root, true, self.tolerance);
        let holds = judgement.passed && !judgement.margin.is_nan();
        if !holds {
            self.first.get_or_insert(time);
        }
        let (value, limit) = match self.trace.of() {
            Traced::Margins => (judgement.margin, 0.0),
            Traced::Sides | Traced::Reduced => (judgement.value, judgement.limit),
        };
        self.trace.push(time, value, limit);
        if matches!(&self.worst, Some((_, worst)) if worst.margin.is_nan()) {
            return Some(holds);
        }
        let worse = |(_, worst): (f64, Judgement)| judgement.is_worse_than(&worst);
        if judgement.margin.is_nan() || self.worst.is_none_or(worse) {
            self.worst = Some((time, judgement));
        }
        Some(holds)
    }

    /// The value of a reduction after the samples so far; not a number without any, and of what is none.
    #[must_use]
    pub fn reduced(&self) -> f64 {
        let reduced: Vec<f64> = self.accumulators.iter().map(Accumulator::result).collect();
        Sample { reduced: &reduced, ..Sample::<S, _>::new(f64::NAN, &Empty) }
            .value(&self.expression.root)
    }

    /// What was compared at the samples so far; nothing for several reductions.
    #[must_use]
    pub fn trace(&self) -> &Trace {
        &self.trace
    }

    /// The outcome after the samples so far.
    #[must_use]
    pub fn verdict(&self) -> Outcome {
        let (at, judgement) = if self.samples == 0 {
            (None, None)
        } else if self.expression.is_reduction() {
            let (at, judgement) = self.reduce();
            (at, Some(judgement))
        } else {
            self.worst.unzip()
        };
        let nan = judgement.is_some_and(|judgement| judgement.margin.is_nan());
        let number = |pick: fn(&Judgement) -> f64| {
            judgement.as_ref().map(pick).filter(|value| !value.is_nan())
        };
        Outcome {
            passed: !nan && judgement.is_some_and(|judgement| judgement.passed),
            samples: self.samples,
            margin: number(|judgement| judgement.margin).filter(|margin| margin.is_finite()),
            at,
            first: self.first,
            value: number(|judgement| judgement.value),
            limit: number(|judgement| judgement.limit),
            nan,
        }
    }

    fn reduce(&self) -> (Option<f64>, Judgement) {
        let reduced: Vec<f64> = self.accumulators.iter().map(Accumulator::result).collect();
        let sample = Sample { reduced: &reduced, ..Sample::<S, _>::new(f64::NAN, &Empty) };
        let judgement = sample.judge(&self.expression.root, true, self.tolerance);
        let broken = self.accumulators.iter().filter_map(|a| a.not_a_number);
        let at = match self.accumulators.as_slice() {
            [only] if only.not_a_number.is_none() => only.state.at(),
            _ => broken.min_by(f64::total_cmp),
        };
        (at, judgement)
    }
}
