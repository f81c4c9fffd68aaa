//! Lists the functions of numbers. A new function is a line in [`FUNCTIONS`].

use std::ops::RangeInclusive;

use crate::dimension::UnitRule;

/// A function of numbers at one sample.
#[derive(Debug)]
pub(crate) struct Function {
    pub name: &'static str,
    /// Fewest and most arguments.
    pub arity: RangeInclusive<usize>,
    pub evaluate: fn(&[f64]) -> f64,
    pub units: UnitRule,
    /// Whether the value is a truth: 1 or 0.
    pub is_condition: bool,
}

/// A function with the same name is the same one.
impl PartialEq for Function {
    fn eq(&self, other: &Self) -> bool {
        self.name == other.name
    }
}

/// More arguments than a condition can have words.
const ANY: usize = usize::MAX;

pub(crate) static FUNCTIONS: &[Function] = &[
    of("abs", 1, 1, UnitRule::Kept, |x| x[0].abs()),
    of("sqrt", 1, 1, UnitRule::Root, |x| x[0].sqrt()),
    of("sin", 1, 1, UnitRule::OfAngle, |x| x[0].sin()),
    of("cos", 1, 1, UnitRule::OfAngle, |x| x[0].cos()),
    of("tan", 1, 1, UnitRule::OfAngle, |x| x[0].tan()),
    of("atan", 1, 1, UnitRule::ToAngle, |x| x[0].atan()),
    of("atan2", 2, 2, UnitRule::AngleOfTwo, |x| fold(x, f64::atan2)),
    of("exp", 1, 1, UnitRule::OfAngle, |x| x[0].exp()),
    of("ln", 1, 1, UnitRule::OfAngle, |x| x[0].ln()),
    of("min", 2, ANY, UnitRule::Kept, |x| fold(x, f64::min)),
    of("max", 2, ANY, UnitRule::Kept, |x| fold(x, f64::max)),
    of("sign", 1, 1, UnitRule::Plain, |x| if x[0] == 0.0 { 0.0 } else { x[0].signum() }),
    of("deg", 1, 1, UnitRule::Degrees, |x| x[0].to_degrees()),
    of("rad", 1, 1, UnitRule::Radians, |x| x[0].to_radians()),
    of("hypot", 2, 2, UnitRule::Sum, |x| fold(x, f64::hypot)),
    Function {
        is_condition: true,
        ..of("isfinite", 1, 1, UnitRule::Plain, |x| f64::from(u8::from(x[0].is_finite())))
    },
];

const fn of(
    name: &'static str,
    fewest: usize,
    most: usize,
    units: UnitRule,
    evaluate: fn(&[f64]) -> f64,
) -> Function {
    Function { name, arity: fewest..=most, evaluate, units, is_condition: false }
}

/// IEEE 754's minimum, maximum and hypot hide a NaN.
fn fold(values: &[f64], pick: fn(f64, f64) -> f64) -> f64 {
    let either = |a: f64, b: &f64| if a.is_nan() || b.is_nan() { f64::NAN } else { pick(a, *b) };
    values[1..].iter().fold(values[0], either)
}

/// The function of this name.
pub(crate) fn find(name: &str) -> Option<&'static Function> {
    FUNCTIONS.iter().find(|function| function.name == name)
}
