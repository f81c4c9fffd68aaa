//! Finds conditions that hold for all values of their signals, by interval arithmetic.

use super::{
    ArithmeticOperator, ComparisonOperator, Expression, ExpressionNode, LogicalOperator, NumberIndex,
    ReductionCall, ScalarFunction, TextOperand,
};

/// All values that an expression may have.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Interval {
    /// The lowest one.
    pub low: f64,
    /// The highest one.
    pub high: f64,
}

impl Interval {
    /// All numbers.
    pub const ALL: Self = Self { low: f64::NEG_INFINITY, high: f64::INFINITY };
    const NOT_NEGATIVE: Self = Self { low: 0.0, high: f64::INFINITY };
    const TRUTH: Self = Self { low: 0.0, high: 1.0 };

    /// That of one number; of none all numbers.
    #[must_use]
    pub fn of_number(number: f64) -> Self {
        if number.is_nan() { Self::ALL } else { Self { low: number, high: number } }
    }

    /// From the lowest to the highest of these ends. What is none, as the difference of infinities, may be anything.
    fn of_ends(ends: &[f64]) -> Self {
        if ends.iter().any(|end| end.is_nan()) {
            return Self::ALL;
        }
        let fold = |start: f64, pick: fn(f64, f64) -> f64| ends.iter().copied().fold(start, pick);
        Self { low: fold(f64::INFINITY, f64::min), high: fold(f64::NEG_INFINITY, f64::max) }
    }

    fn is_finite(self) -> bool {
        self.low.is_finite() && self.high.is_finite()
    }

    fn magnitude(self) -> f64 {
        self.low.abs().max(self.high.abs())
    }

    fn absolute(self) -> Self {
        let low = if self.low <= 0.0 && self.high >= 0.0 { 0.0 } else { self.low.abs().min(self.high.abs()) };
        Self { low, high: self.magnitude() }
    }

    fn negated(self) -> Self {
        Self { low: -self.high, high: -self.low }
    }

    fn scaled(self, factor: f64, offset: f64) -> Self {
        Self::of_ends(&[product(self.low, factor) + offset, product(self.high, factor) + offset])
    }
}

/// Zero times anything finite is zero, however large it is.
fn product(a: f64, b: f64) -> f64 {
    if a == 0.0 || b == 0.0 { 0.0 } else { a * b }
}

impl<S> Expression<S> {
    /// Whether the condition holds at each time from `during.low` to `during.high` [s] whatever values the signals have within
    /// `signal_interval`, with comparisons loosened by `tolerance`. Values that are not a number are left out. False where that
    /// cannot be shown.
    #[must_use]
    pub fn holds_for_all_values(
        &self,
        during: Interval,
        tolerance: f64,
        signal_interval: &dyn Fn(NumberIndex<S>) -> Interval,
    ) -> bool {
        let of_signal = |index: usize| signal_interval(NumberIndex::new(index));
        let box_of_values = ValueBox { during, of_signal: &of_signal, reductions: &self.reductions };
        box_of_values.truth(&self.root, true, tolerance) == Some(true)
    }
}

/// The values that signals and time may have.
struct ValueBox<'a> {
    during: Interval,
    of_signal: &'a dyn Fn(usize) -> Interval,
    reductions: &'a [ReductionCall],
}

impl ValueBox<'_> {
    /// Whether the node, or its negation, holds for all values or for none; nothing where that cannot be shown.
    fn truth(&self, node: &ExpressionNode, positive: bool, tolerance: f64) -> Option<bool> {
        match node {
            ExpressionNode::Not(inner) => self.truth(inner, !positive, tolerance),
            ExpressionNode::Compare(relation, sides) => {
                let relation = if positive { *relation } else { relation.negated() };
                self.compare(relation, &sides[0], &sides[1], tolerance)
            }
            ExpressionNode::Same(same, [TextOperand::Signal(a), TextOperand::Signal(b)]) if a == b => {
                Some(*same == positive)
            }
            ExpressionNode::Join(junction, sides) => {
                let [a, b] = sides.each_ref().map(|side| self.truth(side, positive, tolerance));
                // One that holds decides an alternative, one that does not decides what must hold with another.
                let decisive = (*junction == LogicalOperator::Or) == positive;
                match (a, b) {
                    (Some(value), _) | (_, Some(value)) if value == decisive => Some(decisive),
                    (Some(_), Some(_)) => Some(!decisive),
                    _ => None,
                }
            }
            _ => None,
        }
    }

    fn compare(
        &self,
        relation: ComparisonOperator,
        left: &ExpressionNode,
        right: &ExpressionNode,
        tolerance: f64,
    ) -> Option<bool> {
        // What is left to the right side, and the tolerance to it.
        let room = self.difference(right, left);
        let within = |low: bool, high: bool| match (low, high) {
            (true, true) => Some(true),
            (false, false) => Some(false),
            _ => None,
        };
        match relation {
            ComparisonOperator::Less => within(room.low + tolerance > 0.0, room.high + tolerance > 0.0),
            ComparisonOperator::LessOrEqual => {
                within(room.low + tolerance >= 0.0, room.high + tolerance >= 0.0)
            }
            ComparisonOperator::Greater => within(tolerance - room.low > 0.0, tolerance - room.high > 0.0),
            ComparisonOperator::GreaterOrEqual => {
                within(tolerance - room.low >= 0.0, tolerance - room.high >= 0.0)
            }
            ComparisonOperator::Equal => {
                let distance = room.absolute();
                within(distance.low <= tolerance, distance.high <= tolerance)
            }
            ComparisonOperator::NotEqual => {
                let distance = room.absolute();
                within(distance.low > tolerance, distance.high > tolerance)
            }
        }
    }

    /// The values of `a - b`; of two equal expressions it is zero.
    fn difference(&self, a: &ExpressionNode, b: &ExpressionNode) -> Interval {
        let same = match (a, b) {
            (ExpressionNode::Reduced(a), ExpressionNode::Reduced(b)) => {
                let [a, b] = [&self.reductions[*a], &self.reductions[*b]];
                // One without a parameter has one that is not a number.
                let same_parameter = a.parameter.total_cmp(&b.parameter).is_eq();
                a.reducer == b.reducer && a.arguments == b.arguments && same_parameter
            }
            _ => a == b,
        };
        if same {
            return Interval::of_number(0.0);
        }
        let (a, b) = (self.values(a), self.values(b));
        Interval { low: subtract_ends(a.low, b.high), high: subtract_ends(a.high, b.low) }
    }

    fn values(&self, node: &ExpressionNode) -> Interval {
        match node {
            ExpressionNode::Number(number) => Interval::of_number(*number),
            ExpressionNode::Time => self.during,
            ExpressionNode::Signal(index) | ExpressionNode::Either(index, _) => (self.of_signal)(*index),
            ExpressionNode::Reduced(index) => {
                self.reductions.get(*index).map_or(Interval::ALL, |it| self.reduced(it))
            }
            ExpressionNode::Negate(inner) => self.values(inner).negated(),
            ExpressionNode::Convert(inner, factor, offset) => self.values(inner).scaled(*factor, *offset),
            ExpressionNode::Arithmetic(operator, sides) => self.arithmetic(*operator, &sides[0], &sides[1]),
            ExpressionNode::Call(function, arguments) => self.call(function, arguments),
            ExpressionNode::Not(_)
            | ExpressionNode::Compare(..)
            | ExpressionNode::Same(..)
            | ExpressionNode::Join(..) => match self.truth(node, true, 0.0) {
                Some(truth) => Interval::of_number(f64::from(u8::from(truth))),
                None => Interval::TRUTH,
            },
            ExpressionNode::Text(_) => Interval::ALL,
        }
    }

    fn arithmetic(
        &self,
        operator: ArithmeticOperator,
        left: &ExpressionNode,
        right: &ExpressionNode,
    ) -> Interval {
        let (a, b) = (self.values(left), self.values(right));
        let products = |b: Interval| {
            let ends = [(a.low, b.low), (a.low, b.high), (a.high, b.low), (a.high, b.high)];
            Interval::of_ends(&ends.map(|(a, b)| product(a, b)))
        };
        match operator {
            ArithmeticOperator::Add => {
                Interval { low: subtract_ends(a.low, -b.low), high: subtract_ends(a.high, -b.high) }
            }
            ArithmeticOperator::Subtract => self.difference(left, right),
            ArithmeticOperator::Multiply if left == right => square(a),
            ArithmeticOperator::Multiply => products(b),
            ArithmeticOperator::Divide if b.low > 0.0 || b.high < 0.0 => {
                products(Interval::of_ends(&[b.low.recip(), b.high.recip()]))
            }
            ArithmeticOperator::Power if b.low == 2.0 && b.high == 2.0 => square(a),
            ArithmeticOperator::Divide | ArithmeticOperator::Power => Interval::ALL,
        }
    }

    fn call(&self, function: &ScalarFunction, arguments: &[ExpressionNode]) -> Interval {
        let values: Vec<_> = arguments.iter().map(|it| self.values(it)).collect();
        let [first, ..] = values[..] else { return Interval::ALL };
        let ends = |pick: fn(f64, f64) -> f64| {
            let low = values.iter().map(|it| it.low).fold(first.low, pick);
            Interval { low, high: values.iter().map(|it| it.high).fold(first.high, pick) }
        };
        let rising = || {
            let at = |end: f64| (function.evaluate)(&[end]);
            Interval::of_ends(&[at(first.low), at(first.high)])
        };
        match function.name {
            "abs" => first.absolute(),
            "hypot" => Interval {
                low: values.iter().map(|it| it.absolute().low).fold(0.0, f64::max),
                high: f64::INFINITY,
            },
            "sqrt" if first.low >= 0.0 => rising(),
            "sqrt" => Interval::NOT_NEGATIVE,
            "exp" | "atan" | "sign" | "deg" | "rad" => rising(),
            "sin" | "cos" => Interval { low: -1.0, high: 1.0 },
            "atan2" => Interval { low: -std::f64::consts::PI, high: std::f64::consts::PI },
            "isfinite" => Interval::TRUTH,
            "min" => ends(f64::min),
            "max" => ends(f64::max),
            _ => Interval::ALL,
        }
    }

    fn reduced(&self, reduction: &ReductionCall) -> Interval {
        let [argument, ..] = &reduction.arguments[..] else { return Interval::ALL };
        let of_sample = || self.values(argument);
        match reduction.reducer.name {
            "max" | "min" | "first" | "last" | "mean" | "quantile" => of_sample(),
            "rms" => of_sample().absolute(),
            "std" if of_sample().is_finite() => {
                Interval { low: 0.0, high: of_sample().high - of_sample().low }
            }
            "std" | "count" => Interval::NOT_NEGATIVE,
            "sum" if of_sample().low >= 0.0 => Interval::NOT_NEGATIVE,
            _ => Interval::ALL,
        }
    }
}

/// The end of a difference; infinities that cancel leave what they bound unbounded.
fn subtract_ends(a: f64, b: f64) -> f64 {
    if a.is_infinite() { a } else { a - b }
}

fn square(values: Interval) -> Interval {
    let Interval { low, high } = values.absolute();
    Interval { low: low * low, high: high * high }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{ResolvedSignal, SignalOperand, SignalUnit, TextIndex};

    /// Whether a condition holds from 0 s to 10 s for all signals `a`, `b` .. of which each is in `signals`; `t` is a text.
    fn holds(condition: &str, signals: Interval) -> bool {
        let parsed = Expression::<()>::parse(condition, &mut |name| {
            let operand = match name {
                "t" => SignalOperand::Text(TextIndex::new(0)),
                _ => SignalOperand::Number(NumberIndex::new((name.as_bytes()[0] - b'a').into())),
            };
            Some(ResolvedSignal { operand, unit: SignalUnit::Plain })
        });
        let during = Interval { low: 0.0, high: 10.0 };
        parsed.expect(condition).holds_for_all_values(during, 0.0, &|_| signals)
    }

    #[test]
    fn what_no_value_can_fail_is_found() {
        for condition in [
            "a == a",
            "a <= a",
            "a - a < 1",
            "0 * a < 1",
            "abs(a) >= 0",
            "abs(a - b) > -1",
            "a * a >= 0",
            "a ^ 2 >= 0",
            "sqrt(a) >= 0 and hypot(a, b) >= 0",
            "min(a, 3) <= 3",
            "max(a, 3) >= 3 or a > 5",
            "a > 5 or exp(b) >= 0",
            "not (abs(a) < 0)",
            "sin(a) < 2",
            "sign(a) >= -1",
            "time <= 10",
            "count(a > 1) >= 0",
            "mean(a > 1) <= 1",
            "rms(a) >= 0",
            "max(abs(a)) >= 0",
            "max(a) == max(a)",
            "t == t",
            "1 < 2 or a > 1",
        ] {
            assert!(holds(condition, Interval::ALL), "{condition}");
        }
    }

    #[test]
    fn what_a_value_can_fail_is_not() {
        for condition in [
            "a < 1e9",
            "a == b",
            "a < b",
            "a != a",
            "abs(a) > 0",
            "abs(a) <= 0",
            "a - b < 1",
            "a / b < 1",
            "min(a, 3) < 3",
            "max(a) >= min(b)",
            "time < 10",
            "count(a > 1) > 0",
            "mean(a > 1) < 1",
            "std(a) < 1",
            "sum(a) >= 0",
            "isfinite(a)",
            "a >= 0 and abs(a) >= 0",
            "not (a > 1)",
            "t == 'on'",
            "ln(a) > -1",
            "a ^ 3 > -1",
            "quantile(a, 0.5) < 5",
        ] {
            assert!(!holds(condition, Interval::ALL), "{condition}");
        }
    }

    #[test]
    fn bounds_beyond_the_interval_of_a_signal_cannot_be_failed_in_it() {
        let signals = Interval { low: -20.0, high: 20.0 };
        for (condition, expected) in [
            ("a < 21", true),
            ("abs(a - b) <= 40", true),
            ("max(a) < 21 and rms(b) < 21", true),
            ("std(a) <= 40", true),
            ("a / 4 < 6", true),
            ("abs(a) < 20", false),
            ("a > -19", false),
        ] {
            assert_eq!(holds(condition, signals), expected, "{condition}");
        }
    }
}
