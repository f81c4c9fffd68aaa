//! Evaluates a condition sample by sample and keeps the worst sample.

mod memory;

use std::marker::PhantomData;

use super::{
    ArithmeticOperator, ComparisonOperator, Expression, ExpressionNode, LogicalOperator, NumberIndex,
    ReadableRow, ReductionCall, ScalarFunction, TextIndex, TextOperand,
};
use crate::reducer;
use crate::trace::{ComparisonTrace, TraceContent};

/// The judgement of a condition at one sample, or over the window.
#[derive(Debug, Clone, Copy)]
struct ConditionVerdict {
    passed: bool,
    /// Distance to failing; infinite where there is none, NaN when an operand is not a number.
    margin: f64,
    value: f64,
    limit: f64,
}

impl ConditionVerdict {
    /// Equal margins differ at the edge: `a <= b` holds there and `a < b` does not.
    fn is_worse_than(&self, other: &Self) -> bool {
        (self.margin, self.passed) < (other.margin, other.passed)
    }

    /// The side that decides: the worse of two that must both hold, the better of two alternatives.
    fn combine_judgements(junction: LogicalOperator, a: Self, b: Self) -> Self {
        let (worse, better) = match (a.margin.is_nan(), b.margin.is_nan()) {
            (true, _) => (a, a),
            (_, true) => (b, b),
            _ if b.is_worse_than(&a) => (b, a),
            _ => (a, b),
        };
        match junction {
            LogicalOperator::And => worse,
            LogicalOperator::Or => better,
        }
    }
}

impl ArithmeticOperator {
    pub(crate) fn apply_operator(self, a: f64, b: f64) -> f64 {
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

impl ComparisonOperator {
    pub(crate) fn negated(self) -> Self {
        match self {
            Self::Less => Self::GreaterOrEqual,
            Self::LessOrEqual => Self::Greater,
            Self::Greater => Self::LessOrEqual,
            Self::GreaterOrEqual => Self::Less,
            Self::Equal => Self::NotEqual,
            Self::NotEqual => Self::Equal,
        }
    }

    fn judge_comparison(self, value: f64, limit: f64, tolerance: f64) -> ConditionVerdict {
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
        ConditionVerdict { passed, margin, value, limit }
    }
}

/// The values that an expression is evaluated with.
struct EvaluationSample<'a, S, V> {
    time: f64,
    row: &'a V,
    reduced: &'a [f64],
    space: PhantomData<S>,
}

/// A row without values.
struct EmptyRow;

impl<S> ReadableRow<S> for EmptyRow {
    fn number_at(&self, _: NumberIndex<S>) -> Option<f64> {
        None
    }

    fn text_at(&self, _: TextIndex<S>) -> Option<&str> {
        None
    }
}

impl<'a, S, V: ReadableRow<S>> EvaluationSample<'a, S, V> {
    fn new(time: f64, row: &'a V) -> Self {
        EvaluationSample { time, row, reduced: &[], space: PhantomData }
    }

    fn evaluate_node(&self, node: &ExpressionNode) -> f64 {
        match node {
            ExpressionNode::Number(number) => *number,
            ExpressionNode::Time => self.time,
            // A missing column is not a number, so the check fails and says so.
            ExpressionNode::Signal(index) | ExpressionNode::Either(index, _) => {
                self.row.number_at(NumberIndex::new(*index)).unwrap_or(f64::NAN)
            }
            ExpressionNode::Reduced(index) => self.reduced.get(*index).copied().unwrap_or(f64::NAN),
            ExpressionNode::Negate(inner) => -self.evaluate_node(inner),
            ExpressionNode::Convert(inner, factor, offset) => self.evaluate_node(inner) * factor + offset,
            ExpressionNode::Arithmetic(operator, sides) => {
                operator.apply_operator(self.evaluate_node(&sides[0]), self.evaluate_node(&sides[1]))
            }
            ExpressionNode::Call(function, arguments) => self.evaluate_call(function, arguments),
            ExpressionNode::Text(_) => f64::NAN,
            // Truth that is counted or averaged is exact: a tolerance on it could tighten a check.
            ExpressionNode::Not(_)
            | ExpressionNode::Compare(..)
            | ExpressionNode::Same(..)
            | ExpressionNode::Join(..) => {
                let judgement = self.judge_node(node, true, 0.0);
                if judgement.margin.is_nan() { f64::NAN } else { f64::from(u8::from(judgement.passed)) }
            }
        }
    }

    fn text_operand<'b>(&'b self, text: &'b TextOperand) -> Option<&'b str> {
        match text {
            TextOperand::Literal(text) => Some(text),
            TextOperand::Signal(index) => self.row.text_at(TextIndex::new(*index)),
        }
    }

    fn evaluate_call(&self, function: &ScalarFunction, arguments: &[ExpressionNode]) -> f64 {
        // Few arguments need no allocation.
        let mut few = [0.0; 4];
        match few.get_mut(..arguments.len()) {
            Some(values) => {
                values.iter_mut().zip(arguments).for_each(|(value, node)| *value = self.evaluate_node(node));
                (function.evaluate)(values)
            }
            None => {
                let values: Vec<_> = arguments.iter().map(|node| self.evaluate_node(node)).collect();
                (function.evaluate)(&values)
            }
        }
    }

    /// Judges the node, or its negation: the tolerance loosens every comparison in the sense in
    /// which it has to hold.
    fn judge_node(&self, node: &ExpressionNode, positive: bool, tolerance: f64) -> ConditionVerdict {
        match node {
            ExpressionNode::Not(inner) => self.judge_node(inner, !positive, tolerance),
            ExpressionNode::Compare(relation, sides) => {
                let relation = if positive { *relation } else { relation.negated() };
                relation.judge_comparison(
                    self.evaluate_node(&sides[0]),
                    self.evaluate_node(&sides[1]),
                    tolerance,
                )
            }
            ExpressionNode::Same(same, [a, b]) => {
                let passed = ((self.text_operand(a) == self.text_operand(b)) == *same) == positive;
                let margin = if passed { f64::INFINITY } else { f64::NEG_INFINITY };
                ConditionVerdict { passed, margin, value: f64::NAN, limit: f64::NAN }
            }
            ExpressionNode::Join(junction, sides) => {
                let [a, b] = sides.each_ref().map(|side| self.judge_node(side, positive, tolerance));
                let junction = match (junction, positive) {
                    (LogicalOperator::And, true) | (LogicalOperator::Or, false) => LogicalOperator::And,
                    _ => LogicalOperator::Or,
                };
                ConditionVerdict::combine_judgements(junction, a, b)
            }
            _ => {
                let value = self.evaluate_node(node);
                let passed = (value != 0.0) == positive;
                let margin = match (value.is_nan(), passed) {
                    (true, _) => f64::NAN,
                    (false, true) => f64::INFINITY,
                    (false, false) => f64::NEG_INFINITY,
                };
                ConditionVerdict { passed, margin, value, limit: f64::NAN }
            }
        }
    }
}

impl<S> Expression<S> {
    /// Its value at one sample; not a number when it is one of the window.
    #[must_use]
    pub fn evaluate(&self, time: f64, row: &impl ReadableRow<S>) -> f64 {
        EvaluationSample::new(time, row).evaluate_node(&self.root)
    }
}

/// The running state of one reduction.
#[derive(Debug, Clone)]
struct ReductionState {
    samples: u64,
    /// Time of the first value that is not a number [s].
    not_a_number: Option<f64>,
    /// The quantities at the last sample.
    values: Vec<f64>,
    state: Box<dyn reducer::Accumulator>,
}

impl ReductionState {
    fn new(reduction: &ReductionCall) -> Self {
        let state = (reduction.reducer.start)(reduction.parameter);
        ReductionState { samples: 0, not_a_number: None, values: Vec::new(), state }
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
        if self.not_a_number.is_some() || self.samples == 0 { f64::NAN } else { self.state.result() }
    }
}

/// The outcome of a condition over its window.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct ConditionOutcome {
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
pub struct ConditionMonitor<S> {
    expression: Expression<S>,
    tolerance: f64,
    samples: u64,
    worst: Option<(f64, ConditionVerdict)>,
    first: Option<f64>,
    trace: ComparisonTrace,
    /// The limit of the only reduction in the trace.
    limit: f64,
    accumulators: Vec<ReductionState>,
}

impl<S> ConditionMonitor<S> {
    /// Watches a condition whose comparisons are loosened by `tolerance`, in the unit of their left sides: `a < b` is
    /// `a < b + tolerance`, and `a == b` is `|a - b| <= tolerance`. Comparisons that are operands,
    /// as in `count(a < b)`, are exact.
    #[must_use]
    pub fn new(expression: Expression<S>, tolerance: f64) -> Self {
        let accumulators = expression.reductions.iter().map(ReductionState::new).collect();
        let traced = match (&expression.root, expression.is_reduction()) {
            (_, true) => TraceContent::Reduced,
            (ExpressionNode::Compare(..), false) => TraceContent::Sides,
            _ => TraceContent::Margins,
        };
        Self {
            limit: expression.picked_sample_limit(),
            expression,
            tolerance,
            samples: 0,
            worst: None,
            first: None,
            trace: ComparisonTrace::new(traced),
            accumulators,
        }
    }

    /// Takes one sample of the window. Returns whether the condition holds at this sample, unless it is one about the window.
    pub fn push_sample(&mut self, time: f64, row: &impl ReadableRow<S>) -> Option<bool> {
        self.samples += 1;
        let sample = EvaluationSample::new(time, row);
        if self.expression.is_reduction() {
            let reductions = self.expression.reductions.iter();
            let alone = self.accumulators.len() == 1;
            for (reduction, accumulator) in reductions.zip(&mut self.accumulators) {
                accumulator.push(time, reduction.arguments.iter().map(|it| sample.evaluate_node(it)));
                if let ([value], true) = (accumulator.values.as_slice(), alone) {
                    self.trace.push_sample(time, *value, self.limit);
                }
            }
            return None;
        }
        let judgement = sample.judge_node(&self.expression.root, true, self.tolerance);
        let holds = judgement.passed && !judgement.margin.is_nan();
        if !holds {
            self.first.get_or_insert(time);
        }
        let (value, limit) = match self.trace.content() {
            TraceContent::Margins => (judgement.margin, 0.0),
            TraceContent::Sides | TraceContent::Reduced => (judgement.value, judgement.limit),
        };
        self.trace.push_sample(time, value, limit);
        if matches!(&self.worst, Some((_, worst)) if worst.margin.is_nan()) {
            return Some(holds);
        }
        let worse = |(_, worst): (f64, ConditionVerdict)| judgement.is_worse_than(&worst);
        if judgement.margin.is_nan() || self.worst.is_none_or(worse) {
            self.worst = Some((time, judgement));
        }
        Some(holds)
    }

    /// The value of a reduction after the samples so far; not a number without any, and of what is none.
    #[must_use]
    pub fn reduction_value(&self) -> f64 {
        let reduced: Vec<f64> = self.accumulators.iter().map(ReductionState::result).collect();
        EvaluationSample { reduced: &reduced, ..EvaluationSample::<S, _>::new(f64::NAN, &EmptyRow) }
            .evaluate_node(&self.expression.root)
    }

    /// What was compared at the samples so far; nothing for several reductions.
    #[must_use]
    pub fn comparison_trace(&self) -> &ComparisonTrace {
        &self.trace
    }

    /// The outcome after the samples so far.
    #[must_use]
    pub fn outcome(&self) -> ConditionOutcome {
        let (at, judgement) = if self.samples == 0 {
            (None, None)
        } else if self.expression.is_reduction() {
            let (at, judgement) = self.judge_reduction();
            (at, Some(judgement))
        } else {
            self.worst.unzip()
        };
        let nan = judgement.is_some_and(|judgement| judgement.margin.is_nan());
        let number =
            |pick: fn(&ConditionVerdict) -> f64| judgement.as_ref().map(pick).filter(|value| !value.is_nan());
        ConditionOutcome {
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

    fn judge_reduction(&self) -> (Option<f64>, ConditionVerdict) {
        let reduced: Vec<f64> = self.accumulators.iter().map(ReductionState::result).collect();
        let sample =
            EvaluationSample { reduced: &reduced, ..EvaluationSample::<S, _>::new(f64::NAN, &EmptyRow) };
        let judgement = sample.judge_node(&self.expression.root, true, self.tolerance);
        let broken = self.accumulators.iter().filter_map(|a| a.not_a_number);
        let at = match self.accumulators.as_slice() {
            [only] if only.not_a_number.is_none() => only.state.sample_time(),
            _ => broken.min_by(f64::total_cmp),
        };
        (at, judgement)
    }
}
