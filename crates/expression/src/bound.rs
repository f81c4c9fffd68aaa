//! Finds the constant bounds that a condition sets to single signals, to be drawn beside them.

use super::{ArithmeticOperator, ComparisonOperator, Expression, ExpressionNode, NumberIndex};

/// Reductions whose result is the value of one sample.
const PICKS: [&str; 4] = ["max", "min", "first", "last"];

/// A bound of one signal.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SignalBound<S> {
    /// The signal.
    pub of: NumberIndex<S>,
    /// Its value at the bound.
    pub value: f64,
}

impl<S> Expression<S> {
    /// The bounds of single signals in a condition: of `abs(a) < 5 and max(b) > 2` these are -5 and 5 of a, and 2 of b.
    #[must_use]
    pub fn signal_bounds(&self) -> Vec<SignalBound<S>> {
        let mut bounds = Vec::new();
        self.collect_condition_bounds(&self.root, &mut bounds);
        bounds
    }

    /// The constant that the only reduction is compared with, if the reduction picks a sample; not a number otherwise.
    pub(crate) fn picked_sample_limit(&self) -> f64 {
        let (ExpressionNode::Compare(_, sides), [only]) = (&self.root, self.reductions.as_slice()) else {
            return f64::NAN;
        };
        let limit = match (&sides[0], &sides[1]) {
            (ExpressionNode::Reduced(_), other) | (other, ExpressionNode::Reduced(_)) => {
                constant_value(other)
            }
            _ => None,
        };
        limit.filter(|_| PICKS.contains(&only.reducer.name)).unwrap_or(f64::NAN)
    }

    fn collect_condition_bounds(&self, node: &ExpressionNode, bounds: &mut Vec<SignalBound<S>>) {
        match node {
            ExpressionNode::Join(_, sides) => {
                sides.iter().for_each(|side| self.collect_condition_bounds(side, bounds))
            }
            ExpressionNode::Not(inner) => self.collect_condition_bounds(inner, bounds),
            ExpressionNode::Compare(relation, sides) if *relation != ComparisonOperator::NotEqual => {
                match (constant_value(&sides[0]), constant_value(&sides[1])) {
                    (None, Some(value)) => self.collect_signal_bounds(&sides[0], value, bounds),
                    (Some(value), None) => self.collect_signal_bounds(&sides[1], value, bounds),
                    _ => {}
                }
            }
            _ => {}
        }
    }

    /// The values of the only signal in `node` that make it `value`.
    fn collect_signal_bounds(&self, node: &ExpressionNode, value: f64, bounds: &mut Vec<SignalBound<S>>) {
        match node {
            ExpressionNode::Signal(index) => {
                let of = NumberIndex::new(*index);
                bounds.extend(value.is_finite().then_some(SignalBound { of, value }));
            }
            ExpressionNode::Negate(inner) => self.collect_signal_bounds(inner, -value, bounds),
            ExpressionNode::Convert(inner, factor, offset) => {
                self.collect_signal_bounds(inner, (value - offset) / factor, bounds);
            }
            ExpressionNode::Call(function, arguments) => match (function.name, arguments.as_slice()) {
                ("abs", [inner]) if value >= 0.0 => {
                    self.collect_signal_bounds(inner, value, bounds);
                    self.collect_signal_bounds(inner, -value, bounds);
                }
                ("deg", [inner]) => self.collect_signal_bounds(inner, value.to_radians(), bounds),
                ("rad", [inner]) => self.collect_signal_bounds(inner, value.to_degrees(), bounds),
                _ => {}
            },
            ExpressionNode::Arithmetic(operator, sides) => {
                let (inner, value) = match (operator, constant_value(&sides[0]), constant_value(&sides[1])) {
                    (ArithmeticOperator::Add, Some(known), None) => (&sides[1], value - known),
                    (ArithmeticOperator::Subtract, Some(known), None) => (&sides[1], known - value),
                    (ArithmeticOperator::Multiply, Some(known), None) => (&sides[1], value / known),
                    (ArithmeticOperator::Add, None, Some(known)) => (&sides[0], value - known),
                    (ArithmeticOperator::Subtract, None, Some(known)) => (&sides[0], value + known),
                    (ArithmeticOperator::Multiply, None, Some(known)) => (&sides[0], value / known),
                    (ArithmeticOperator::Divide, None, Some(known)) => (&sides[0], value * known),
                    _ => return,
                };
                self.collect_signal_bounds(inner, value, bounds);
            }
            // A mean or a sum has no bound of the signal.
            ExpressionNode::Reduced(index) => {
                let reduction = &self.reductions[*index];
                if PICKS.contains(&reduction.reducer.name) {
                    reduction.arguments.iter().for_each(|it| self.collect_signal_bounds(it, value, bounds));
                }
            }
            _ => {}
        }
    }
}

/// The value of a node without signals.
fn constant_value(node: &ExpressionNode) -> Option<f64> {
    match node {
        ExpressionNode::Number(number) => Some(*number),
        ExpressionNode::Negate(inner) => constant_value(inner).map(|value| -value),
        ExpressionNode::Convert(inner, factor, offset) => {
            constant_value(inner).map(|value| value * factor + offset)
        }
        ExpressionNode::Call(function, arguments) => {
            let values: Option<Vec<f64>> = arguments.iter().map(constant_value).collect();
            values.map(|values| (function.evaluate)(&values))
        }
        ExpressionNode::Arithmetic(operator, sides) => {
            Some(operator.apply_operator(constant_value(&sides[0])?, constant_value(&sides[1])?))
        }
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use crate::{Expression, NumberIndex, ResolvedSignal, SignalOperand, SignalUnit};
    use units::Unit;

    /// The bounds of signals `a`, `b` .. by their place in the alphabet; `v` is in km/h.
    fn bounds(condition: &str) -> Vec<(usize, f64)> {
        let parsed = Expression::<()>::parse(condition, &mut |name| {
            let operand = SignalOperand::Number(NumberIndex::new((name.as_bytes()[0] - b'a').into()));
            let kmh = || SignalUnit::Known(Unit::parse("km/h").expect("a unit"), "km/h".to_owned());
            let unit = if name == "v" { kmh() } else { SignalUnit::Plain };
            Some(ResolvedSignal { operand, unit })
        });
        let bounds = parsed.expect("a condition").signal_bounds();
        bounds.into_iter().map(|bound| (bound.of.position(), bound.value)).collect()
    }

    #[test]
    fn constant_bounds_of_single_signals_are_found() {
        assert_eq!(bounds("a < 2"), [(0, 2.0)]);
        assert_eq!(bounds("2 * 3 >= a"), [(0, 6.0)]);
        assert_eq!(bounds("abs(a) < 5 and b > -2"), [(0, 5.0), (0, -5.0), (1, -2.0)]);
        assert_eq!(bounds("max(abs(b)) > 2 and min(a / 2 - 1) < 1"), [(1, 2.0), (1, -2.0), (0, 4.0)]);
        assert_eq!(bounds("1 - a > 3"), [(0, -2.0)]);
        let [(21, limit)] = bounds("v < 10 m/s")[..] else { panic!("one bound of v") };
        assert!((limit - 36.0).abs() < 1e-9, "{limit} km/h");
    }

    #[test]
    fn what_is_no_bound_of_one_signal_is_left_out() {
        for condition in ["a < b", "abs(a - b) < 1", "a * b < 1", "rms(a) < 1", "a != 1", "abs(a) > -1"] {
            assert_eq!(bounds(condition), [], "{condition}");
        }
    }
}
