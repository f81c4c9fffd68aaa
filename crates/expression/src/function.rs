//! Lists the functions of numbers. A new function is a line in [`FUNCTIONS`].

use std::ops::RangeInclusive;

use crate::dimension::UnitRule;

/// A function of numbers at one sample.
#[derive(Debug)]
pub(crate) struct ScalarFunction {
    pub name: &'static str,
    /// Fewest and most arguments.
    pub arity: RangeInclusive<usize>,
    pub evaluate: fn(&[f64]) -> f64,
    pub units: UnitRule,
    /// Whether the value is a truth: 1 or 0.
    pub is_condition: bool,
}

/// A function with the same name is the same one.
impl PartialEq for ScalarFunction {
    fn eq(&self, other: &Self) -> bool {
        self.name == other.name
    }
}

/// More arguments than a condition can have words.
const ANY: usize = usize::MAX;

pub(crate) static FUNCTIONS: &[ScalarFunction] = &[
    define_function("abs", 1, 1, UnitRule::Kept, |x| x[0].abs()),
    define_function("sqrt", 1, 1, UnitRule::Root, |x| x[0].sqrt()),
    define_function("sin", 1, 1, UnitRule::OfAngle, |x| x[0].sin()),
    define_function("cos", 1, 1, UnitRule::OfAngle, |x| x[0].cos()),
    define_function("tan", 1, 1, UnitRule::OfAngle, |x| x[0].tan()),
    define_function("atan", 1, 1, UnitRule::ToAngle, |x| x[0].atan()),
    define_function("atan2", 2, 2, UnitRule::AngleOfTwo, |x| fold_propagating_nan(x, f64::atan2)),
    define_function("exp", 1, 1, UnitRule::OfAngle, |x| x[0].exp()),
    define_function("ln", 1, 1, UnitRule::OfAngle, |x| x[0].ln()),
    define_function("min", 2, ANY, UnitRule::Kept, |x| fold_propagating_nan(x, f64::min)),
    define_function("max", 2, ANY, UnitRule::Kept, |x| fold_propagating_nan(x, f64::max)),
    define_function("sign", 1, 1, UnitRule::Plain, |x| if x[0] == 0.0 { 0.0 } else { x[0].signum() }),
    define_function("deg", 1, 1, UnitRule::Degrees, |x| x[0].to_degrees()),
    define_function("rad", 1, 1, UnitRule::Radians, |x| x[0].to_radians()),
    define_function("hypot", 2, 2, UnitRule::Sum, |x| fold_propagating_nan(x, f64::hypot)),
    ScalarFunction {
        is_condition: true,
        ..define_function("isfinite", 1, 1, UnitRule::Plain, |x| f64::from(u8::from(x[0].is_finite())))
    },
];

const fn define_function(
    name: &'static str,
    fewest: usize,
    most: usize,
    units: UnitRule,
    evaluate: fn(&[f64]) -> f64,
) -> ScalarFunction {
    ScalarFunction { name, arity: fewest..=most, evaluate, units, is_condition: false }
}

/// IEEE 754's minimum, maximum and hypot hide a NaN.
fn fold_propagating_nan(values: &[f64], pick: fn(f64, f64) -> f64) -> f64 {
    let either = |a: f64, b: &f64| if a.is_nan() || b.is_nan() { f64::NAN } else { pick(a, *b) };
    values[1..].iter().fold(values[0], either)
}

/// The function of this name.
pub(crate) fn find_function(name: &str) -> Option<&'static ScalarFunction> {
    FUNCTIONS.iter().find(|function| function.name == name)
}
