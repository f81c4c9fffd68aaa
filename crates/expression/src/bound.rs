//! Finds the constant bounds that a condition sets to single signals, to be drawn beside them.

use super::{Expression, Node, NumberIndex, Operator, Relation};

/// Reductions whose result is the value of one sample.
const PICKS: [&str; 4] = ["max", "min", "first", "last"];

/// A bound of one signal.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bound<S> {
    /// The signal.
    pub of: NumberIndex<S>,
    /// Its value at the bound.
    pub value: f64,
}

impl<S> Expression<S> {
    /// The bounds of single signals in a condition: of `abs(a) < 5 and max(b) > 2` these are -5 and 5 of a, and 2 of b.
    #[must_use]
    pub fn bounds(&self) -> Vec<Bound<S>> {
        let mut bounds = Vec::new();
        self.condition(&self.root, &mut bounds);
        bounds
    }

    /// The constant that the only reduction is compared with, if the reduction picks a sample; not a number otherwise.
    pub(crate) fn limit_of_samples(&self) -> f64 {
        let (Node::Compare(_, sides), [only]) = (&self.root, self.reductions.as_slice()) else {
            return f64::NAN;
        };
        let limit = match (&sides[0], &sides[1]) {
            (Node::Reduced(_), other) | (other, Node::Reduced(_)) => constant(other),
            _ => None,
        };
        limit.filter(|_| PICKS.contains(&only.reducer.name)).unwrap_or(f64::NAN)
    }

    fn condition(&self, node: &Node, bounds: &mut Vec<Bound<S>>) {
        match node {
            Node::Join(_, sides) => sides.iter().for_each(|side| self.condition(side, bounds)),
            Node::Not(inner) => self.condition(inner, bounds),
            Node::Compare(relation, sides) if *relation != Relation::NotEqual => {
                match (constant(&sides[0]), constant(&sides[1])) {
                    (None, Some(value)) => self.side(&sides[0], value, bounds),
                    (Some(value), None) => self.side(&sides[1], value, bounds),
                    _ => {}
                }
            }
            _ => {}
        }
    }

    /// The values of the only signal in `node` that make it `value`.
    fn side(&self, node: &Node, value: f64, bounds: &mut Vec<Bound<S>>) {
        match node {
            Node::Signal(index) => {
                let of = NumberIndex::new(*index);
                bounds.extend(value.is_finite().then_some(Bound { of, value }));
            }
            Node::Negate(inner) => self.side(inner, -value, bounds),
            Node::Convert(inner, factor, offset) => {
                self.side(inner, (value - offset) / factor, bounds);
            }
            Node::Call(function, arguments) => match (function.name, arguments.as_slice()) {
                ("abs", [inner]) if value >= 0.0 => {
                    self.side(inner, value, bounds);
                    self.side(inner, -value, bounds);
                }
                ("deg", [inner]) => self.side(inner, value.to_radians(), bounds),
                ("rad", [inner]) => self.side(inner, value.to_degrees(), bounds),
                _ => {}
            },
            Node::Arithmetic(operator, sides) => {
                let (inner, value) = match (operator, constant(&sides[0]), constant(&sides[1])) {
                    (Operator::Add, Some(known), None) => (&sides[1], value - known),
                    (Operator::Subtract, Some(known), None) => (&sides[1], known - value),
                    (Operator::Multiply, Some(known), None) => (&sides[1], value / known),
                    (Operator::Add, None, Some(known)) => (&sides[0], value - known),
                    (Operator::Subtract, None, Some(known)) => (&sides[0], value + known),
                    (Operator::Multiply, None, Some(known)) => (&sides[0], value / known),
                    (Operator::Divide, None, Some(known)) => (&sides[0], value * known),
                    _ => return,
                };
                self.side(inner, value, bounds);
            }
            // A mean or a sum has no bound of the signal.
            Node::Reduced(index) => {
                let reduction = &self.reductions[*index];
                if PICKS.contains(&reduction.reducer.name) {
                    reduction.arguments.iter().for_each(|it| self.side(it, value, bounds));
                }
            }
            _ => {}
        }
    }
}

/// The value of a node without signals.
fn constant(node: &Node) -> Option<f64> {
    match node {
        Node::Number(number) => Some(*number),
        Node::Negate(inner) => constant(inner).map(|value| -value),
        Node::Convert(inner, factor, offset) => {
            constant(inner).map(|value| value * factor + offset)
        }
        Node::Call(function, arguments) => {
            let values: Option<Vec<f64>> = arguments.iter().map(constant).collect();
            values.map(|values| (function.evaluate)(&values))
        }
        Node::Arithmetic(operator, sides) => {
            Some(operator.apply(constant(&sides[0])?, constant(&sides[1])?))
        }
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use crate::{Expression, NumberIndex, Operand, Signal, SignalUnit};
    use units::Unit;

    /// The bounds of signals `a`, `b` .. by their place in the alphabet; `v` is in km/h.
    fn bounds(condition: &str) -> Vec<(usize, f64)> {
        let parsed = Expression::<()>::parse(condition, &mut |name| {
            let operand = Operand::Number(NumberIndex::new((name.as_bytes()[0] - b'a').into()));
            let kmh = || SignalUnit::Known(Unit::parse("km/h").expect("a unit"), "km/h".to_owned());
            let unit = if name == "v" { kmh() } else { SignalUnit::Plain };
            Some(Signal { operand, unit })
        });
        let bounds = parsed.expect("a condition").bounds();
        bounds.into_iter().map(|bound| (bound.of.position(), bound.value)).collect()
    }

    #[test]
    fn constant_bounds_of_single_signals_are_found() {
        assert_eq!(bounds("a < 2"), [(0, 2.0)]);
        assert_eq!(bounds("2 * 3 >= a"), [(0, 6.0)]);
        assert_eq!(bounds("abs(a) < 5 and b > -2"), [(0, 5.0), (0, -5.0), (1, -2.0)]);
        assert_eq!(
            bounds("max(abs(b)) > 2 and min(a / 2 - 1) < 1"),
            [(1, 2.0), (1, -2.0), (0, 4.0)]
        );
        assert_eq!(bounds("1 - a > 3"), [(0, -2.0)]);
        let [(21, limit)] = bounds("v < 10 m/s")[..] else { panic!("one bound of v") };
        assert!((limit - 36.0).abs() < 1e-9, "{limit} km/h");
    }

    #[test]
    fn what_is_no_bound_of_one_signal_is_left_out() {
        for condition in
            ["a < b", "abs(a - b) < 1", "a * b < 1", "rms(a) < 1", "a != 1", "abs(a) > -1"]
        {
            assert_eq!(bounds(condition), [], "{condition}");
        }
    }
}
