//! Unit texts such as `N.m/rad` go in; dimensions, and the factor and offset between units of the same dimension, come out.
#![forbid(unsafe_code)]

use std::f64::consts::{PI, TAU};
use std::ops::Range;

/// The base units, in the order of [`Unit::exponents`].
pub const BASE: [&str; 8] = ["kg", "m", "s", "A", "K", "mol", "cd", "rad"];

const NONE: [i8; 8] = [0; 8];
const MASS: [i8; 8] = [1, 0, 0, 0, 0, 0, 0, 0];
const LENGTH: [i8; 8] = [0, 1, 0, 0, 0, 0, 0, 0];
const TIME: [i8; 8] = [0, 0, 1, 0, 0, 0, 0, 0];
const CURRENT: [i8; 8] = [0, 0, 0, 1, 0, 0, 0, 0];
const TEMPERATURE: [i8; 8] = [0, 0, 0, 0, 1, 0, 0, 0];
const ANGLE: [i8; 8] = [0, 0, 0, 0, 0, 0, 0, 1];
const SPEED: [i8; 8] = [0, 1, -1, 0, 0, 0, 0, 0];
const RATE: [i8; 8] = [0, 0, -1, 0, 0, 0, 0, 0];
const FORCE: [i8; 8] = [1, 1, -2, 0, 0, 0, 0, 0];
const PRESSURE: [i8; 8] = [1, -1, -2, 0, 0, 0, 0, 0];
const ENERGY: [i8; 8] = [1, 2, -2, 0, 0, 0, 0, 0];
const POWER: [i8; 8] = [1, 2, -3, 0, 0, 0, 0, 0];
const VOLTAGE: [i8; 8] = [1, 2, -3, -1, 0, 0, 0, 0];

/// Name, base-unit exponents and SI value of one, for all units without an offset.
/// Inch, foot, mile, pound and psi follow the international yard and pound agreement of 1959.
const NAMES: &[(&str, [i8; 8], f64)] = &[
    ("%", NONE, 0.01),
    ("kg", MASS, 1.0),
    ("g", MASS, 1e-3),
    ("mg", MASS, 1e-6),
    ("t", MASS, 1e3),
    ("lb", MASS, 0.453_592_37),
    ("m", LENGTH, 1.0),
    ("um", LENGTH, 1e-6),
    ("mm", LENGTH, 1e-3),
    ("cm", LENGTH, 1e-2),
    ("dm", LENGTH, 0.1),
    ("km", LENGTH, 1e3),
    ("in", LENGTH, 0.0254),
    ("ft", LENGTH, 0.3048),
    ("mi", LENGTH, 1609.344),
    ("l", [0, 3, 0, 0, 0, 0, 0, 0], 1e-3),
    ("s", TIME, 1.0),
    ("us", TIME, 1e-6),
    ("ms", TIME, 1e-3),
    ("min", TIME, 60.0),
    ("h", TIME, 3600.0),
    ("A", CURRENT, 1.0),
    ("mA", CURRENT, 1e-3),
    ("K", TEMPERATURE, 1.0),
    ("mol", [0, 0, 0, 0, 0, 1, 0, 0], 1.0),
    ("cd", [0, 0, 0, 0, 0, 0, 1, 0], 1.0),
    ("rad", ANGLE, 1.0),
    ("mrad", ANGLE, 1e-3),
    ("deg", ANGLE, PI / 180.0),
    ("rev", ANGLE, TAU),
    ("rpm", [0, 0, -1, 0, 0, 0, 0, 1], TAU / 60.0),
    ("mph", SPEED, 1609.344 / 3600.0),
    ("Hz", RATE, 1.0),
    ("kHz", RATE, 1e3),
    ("N", FORCE, 1.0),
    ("kN", FORCE, 1e3),
    ("MN", FORCE, 1e6),
    ("Pa", PRESSURE, 1.0),
    ("hPa", PRESSURE, 1e2),
    ("kPa", PRESSURE, 1e3),
    ("MPa", PRESSURE, 1e6),
    ("mbar", PRESSURE, 1e2),
    ("bar", PRESSURE, 1e5),
    ("psi", PRESSURE, 0.453_592_37 * 9.806_65 / (0.0254 * 0.0254)),
    ("J", ENERGY, 1.0),
    ("kJ", ENERGY, 1e3),
    ("MJ", ENERGY, 1e6),
    ("Wh", ENERGY, 3.6e3),
    ("kWh", ENERGY, 3.6e6),
    ("W", POWER, 1.0),
    ("kW", POWER, 1e3),
    ("MW", POWER, 1e6),
    ("V", VOLTAGE, 1.0),
    ("mV", VOLTAGE, 1e-3),
    ("kV", VOLTAGE, 1e3),
    ("C", [0, 0, 1, 1, 0, 0, 0, 0], 1.0),
    ("Ah", [0, 0, 1, 1, 0, 0, 0, 0], 3600.0),
    ("Ohm", [1, 2, -3, -2, 0, 0, 0, 0], 1.0),
    ("F", [-1, -2, 4, 2, 0, 0, 0, 0], 1.0),
    ("H", [1, 2, -2, -2, 0, 0, 0, 0], 1.0),
    ("T", [1, 0, -2, -1, 0, 0, 0, 0], 1.0),
    ("Wb", [1, 2, -2, -1, 0, 0, 0, 0], 1.0),
];

/// Name, factor and offset of the temperature scales whose zero is not 0 K.
const SCALES: &[(&str, f64, f64)] =
    &[("degC", 1.0, 273.15), ("degF", 5.0 / 9.0, 459.67 * 5.0 / 9.0)];

/// The names of all units.
pub fn names() -> impl Iterator<Item = &'static str> {
    NAMES.iter().map(|(name, ..)| *name).chain(SCALES.iter().map(|(name, ..)| *name))
}

/// Nesting that no unit needs; it bounds the recursion for a hostile text.
const DEEPEST: usize = 16;

/// A unit as FMI's `BaseUnit` describes it: SI value = `factor` * value + `offset`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Unit {
    /// Powers of kg, m, s, A, K, mol, cd and rad; as in FMI an angle is a dimension of its own.
    pub exponents: [i8; 8],
    /// SI value of one of this unit, less the offset.
    pub factor: f64,
    /// SI value of this unit's zero.
    pub offset: f64,
}

/// Why a unit text cannot be read; every position is a byte index into the text.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum UnitError {
    /// A word is in no table.
    #[error(
        "unknown unit `{word}` at byte {at} of `{text}`: expected names such as \
         kg, m, s, N, Pa, W, rad, deg, rpm, joined by `.`, `*` or `/`"
    )]
    Unknown {
        /// The unknown word.
        word: String,
        /// Where it begins.
        at: usize,
        /// The whole unit text.
        text: String,
    },
    /// A unit whose zero is shifted is part of a larger expression.
    #[error(
        "`{word}` at byte {at} of `{text}` has a shifted zero and can only stand alone: \
         write `K` for a difference of temperatures"
    )]
    Shifted {
        /// The unit with the offset.
        word: String,
        /// Where it begins.
        at: usize,
        /// The whole unit text.
        text: String,
    },
    /// The text is not a product of powers.
    #[error("expected {expected} at byte {at} of the unit `{text}`, found {found}")]
    Syntax {
        /// What could stand there.
        expected: &'static str,
        /// What stands there.
        found: String,
        /// Where.
        at: usize,
        /// The whole unit text.
        text: String,
    },
}

impl UnitError {
    /// The bytes of the unit text that the error is about.
    #[must_use]
    pub fn span(&self) -> Range<usize> {
        match self {
            Self::Unknown { word, at, .. } | Self::Shifted { word, at, .. } => {
                *at..*at + word.len()
            }
            Self::Syntax { at, text, .. } => {
                *at..*at + text[*at..].chars().next().map_or(0, char::len_utf8)
            }
        }
    }
}

impl Unit {
    /// The unit of plain numbers.
    pub const ONE: Self = Self::from_base(NONE, 1.0, 0.0);

    /// A unit from the numbers of FMI's `BaseUnit` element.
    #[must_use]
    pub const fn from_base(exponents: [i8; 8], factor: f64, offset: f64) -> Self {
        Self { exponents, factor, offset }
    }

    /// Reads powers of named units, joined by `.`, `*` or `/` from left to right:
    /// `km/h`, `kg.m2`, `m/s^2`, `s-1`, `N/(m/s)`; `1` is the unit of plain numbers.
    ///
    /// # Errors
    /// When a name is unknown, a shifted unit does not stand alone or the text is malformed.
    pub fn parse(text: &str) -> Result<Self, UnitError> {
        let word = text.trim();
        if let Some((_, factor, offset)) = SCALES.iter().find(|(name, ..)| *name == word) {
            return Ok(Self::from_base(TEMPERATURE, *factor, *offset));
        }
        let mut parser = Parser { text, at: 0, depth: 0 };
        let unit = parser.product()?;
        match parser.peek() {
            None => Ok(unit),
            Some(_) => Err(parser.expected("`.`, `*`, `/` or the end")),
        }
    }

    /// Whether values of one unit can be expressed in the other.
    #[must_use]
    pub fn same_dimension(&self, other: &Self) -> bool {
        self.exponents == other.exponents
    }

    /// `(scale, offset)` such that `to value = scale * from value + offset`, for units of the
    /// same dimension; exactly `(1.0, 0.0)` between equal units.
    #[must_use]
    pub fn conversion(from: &Self, to: &Self) -> Option<(f64, f64)> {
        // Unit definitions in model descriptions are rounded to about 15 digits; a value must
        // still pass unchanged between such a unit and the same one from the table.
        let same = |a: f64, b: f64| (a - b).abs() <= 1e-12 * a.abs().max(b.abs());
        if !from.same_dimension(to) {
            return None;
        }
        let scale = if same(from.factor, to.factor) { 1.0 } else { from.factor / to.factor };
        let offset =
            if same(from.offset, to.offset) { 0.0 } else { (from.offset - to.offset) / to.factor };
        Some((scale, offset))
    }

    /// The dimension in base units, for messages: `m/s`, `kg.m2/(s2.rad)`, or `1` for none.
    #[must_use]
    pub fn dimension(&self) -> String {
        let powers = |sign: i8| -> Vec<String> {
            let power = |(name, exponent): (&str, i8)| match exponent.unsigned_abs() {
                1 => name.to_owned(),
                size => format!("{name}{size}"),
            };
            let pairs = BASE.into_iter().zip(self.exponents);
            pairs.filter(|(_, exponent)| exponent.signum() == sign).map(power).collect()
        };
        let (above, below) = (powers(1), powers(-1));
        let above = if above.is_empty() { "1".to_owned() } else { above.join(".") };
        match below.as_slice() {
            [] => above,
            [one] => format!("{above}/{one}"),
            _ => format!("{above}/({})", below.join(".")),
        }
    }

    /// `self * other^exponent`, or nothing when a power leaves the range of `i8`.
    fn times(self, other: Self, exponent: i8) -> Option<Self> {
        let mut exponents = self.exponents;
        for (sum, power) in exponents.iter_mut().zip(other.exponents) {
            *sum = sum.checked_add(power.checked_mul(exponent)?)?;
        }
        let factor = self.factor * other.factor.powi(i32::from(exponent));
        Some(Self::from_base(exponents, factor, 0.0))
    }
}

struct Parser<'a> {
    text: &'a str,
    at: usize,
    depth: usize,
}

impl Parser<'_> {
    fn product(&mut self) -> Result<Unit, UnitError> {
        let mut unit = Unit::ONE;
        let mut sign = 1;
        loop {
            let (factor, exponent) = self.power()?;
            unit = unit
                .times(factor, sign * exponent)
                .ok_or_else(|| self.expected("powers within -128..=127 before this place"))?;
            sign = match self.peek() {
                Some('.' | '*') => 1,
                Some('/') => -1,
                _ => return Ok(unit),
            };
            self.at += 1;
        }
    }

    fn power(&mut self) -> Result<(Unit, i8), UnitError> {
        let unit = match self.peek() {
            Some('(') if self.depth < DEEPEST => {
                self.at += 1;
                self.depth += 1;
                let unit = self.product()?;
                if self.peek() != Some(')') {
                    return Err(self.expected("`)`"));
                }
                self.at += 1;
                self.depth -= 1;
                unit
            }
            Some('1') => {
                self.at += 1;
                return Ok((Unit::ONE, 1));
            }
            _ => self.name()?,
        };
        Ok((unit, self.exponent()?))
    }

    fn name(&mut self) -> Result<Unit, UnitError> {
        let at = self.at;
        let is_name = |c: char| c.is_alphabetic() || matches!(c, '%' | '_' | '°');
        let word = self.take(is_name);
        if word.is_empty() {
            return Err(self.expected("a unit name, `1` or `(`"));
        }
        let (word, text) = (word.to_owned(), self.text.to_owned());
        if let Some((_, exponents, factor)) = NAMES.iter().find(|(name, ..)| *name == word) {
            Ok(Unit::from_base(*exponents, *factor, 0.0))
        } else if SCALES.iter().any(|(name, ..)| *name == word) {
            Err(UnitError::Shifted { word, at, text })
        } else {
            Err(UnitError::Unknown { word, at, text })
        }
    }

    /// The exponent directly after a name: `2`, `^2`, `-1` or `^-1`; 1 when there is none.
    fn exponent(&mut self) -> Result<i8, UnitError> {
        let start = self.at;
        let marked = self.text[self.at..].starts_with('^');
        self.at += usize::from(marked);
        let number = self.at;
        self.at += usize::from(self.text[self.at..].starts_with(['-', '+']));
        let digits = self.take(|c| c.is_ascii_digit());
        if digits.is_empty() && self.at == start {
            return Ok(1);
        }
        let parsed = self.text[number..self.at].parse().ok();
        parsed
            // -128 cannot change its sign after a `/`.
            .filter(|exponent| *exponent != i8::MIN)
            .ok_or_else(|| {
                self.at = number;
                self.expected("a whole exponent within -127..=127")
            })
    }

    fn take(&mut self, accepted: impl Fn(char) -> bool) -> &str {
        let rest = &self.text[self.at..];
        let length = rest.find(|c| !accepted(c)).unwrap_or(rest.len());
        self.at += length;
        &rest[..length]
    }

    /// The next character that is not blank; it stays to be read.
    fn peek(&mut self) -> Option<char> {
        self.take(char::is_whitespace);
        self.text[self.at..].chars().next()
    }

    fn expected(&self, expected: &'static str) -> UnitError {
        let found = match self.text[self.at..].chars().next() {
            Some(c) => format!("`{c}`"),
            None => "the end".to_owned(),
        };
        UnitError::Syntax { expected, found, at: self.at, text: self.text.to_owned() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn unit(text: &str) -> Unit {
        Unit::parse(text).unwrap_or_else(|error| panic!("{error}"))
    }

    /// Unit text, its dimension and its SI value.
    const SIZES: &[(&str, &str, f64)] = &[
        ("1", "1", 1.0),
        ("%", "1", 0.01),
        ("m/s", "m/s", 1.0),
        ("km/h", "m/s", 1.0 / 3.6),
        ("mph", "m/s", 0.44704),
        ("m/s2", "m/s2", 1.0),
        ("m/s^2", "m/s2", 1.0),
        ("rad/s", "rad/s", 1.0),
        ("deg/s", "rad/s", PI / 180.0),
        ("rpm", "rad/s", PI / 30.0),
        ("N", "kg.m/s2", 1.0),
        ("kN", "kg.m/s2", 1e3),
        ("N.m", "kg.m2/s2", 1.0),
        ("N*m", "kg.m2/s2", 1.0),
        ("N/rad", "kg.m/(s2.rad)", 1.0),
        ("N/(m/s)", "kg/s", 1.0),
        ("N.s/m", "kg/s", 1.0),
        ("N/m/s", "kg/s3", 1.0),
        ("kg.m2", "kg.m2", 1.0),
        ("g", "kg", 1e-3),
        ("bar", "kg/(m.s2)", 1e5),
        ("psi", "kg/(m.s2)", 6_894.757_293_168),
        ("degC", "K", 1.0),
        ("s-1", "1/s", 1.0),
        ("1/min", "1/s", 1.0 / 60.0),
        ("Hz", "1/s", 1.0),
        ("m2/s3", "m2/s3", 1.0),
        ("rad2/s3", "rad2/s3", 1.0),
        ("N2/s", "kg2.m2/s5", 1.0),
        ("kW", "kg.m2/s3", 1e3),
        ("(km/h)2", "m2/s2", 1.0 / 12.96),
        ("mm^-2", "1/m2", 1e6),
        (" N . m / rad ", "kg.m2/(s2.rad)", 1.0),
        ("V/Ohm", "A", 1.0),
        ("C/V/F", "1", 1.0),
    ];

    #[test]
    fn texts_have_the_dimension_and_the_size_that_they_say() {
        for (text, dimension, factor) in SIZES {
            let parsed = unit(text);
            assert_eq!(parsed.dimension(), *dimension, "{text}");
            assert!((parsed.factor / factor - 1.0).abs() < 1e-12, "{text}");
        }
    }

    #[test]
    fn every_name_reads_back_and_its_dimension_is_a_unit_again() {
        for (name, exponents, factor) in NAMES {
            assert_eq!(unit(name), Unit::from_base(*exponents, *factor, 0.0));
            assert!(unit(&unit(name).dimension()).same_dimension(&unit(name)), "{name}");
        }
    }

    #[test]
    fn conversions_scale_shift_and_invert() {
        for (from, to, value, expected) in [
            ("km/h", "m/s", 36.0, 10.0),
            ("deg", "rad", 180.0, PI),
            ("degC", "K", 20.0, 293.15),
            ("K", "degC", 293.15, 20.0),
            ("degF", "degC", 212.0, 100.0),
            ("rpm", "deg/s", 1.0, 6.0),
            ("N/(m/s)", "kN.s/m", 1500.0, 1.5),
        ] {
            let convert = |from: &str, to: &str, value: f64| {
                let (scale, offset) =
                    Unit::conversion(&unit(from), &unit(to)).expect("same dimension");
                scale * value + offset
            };
            let there = convert(from, to, value);
            assert!((there - expected).abs() < 1e-9, "{from} -> {to}: {there}");
            assert!((convert(to, from, there) - value).abs() < 1e-9, "{to} -> {from}");
        }
    }

    #[test]
    fn equal_units_convert_exactly_even_when_written_with_15_digits() {
        let rounded = Unit::from_base(ANGLE, 0.017_453_292_519_943_3, 0.0);
        for (from, to) in [
            (unit("km/h"), unit("km/h")),
            (unit("degF"), unit("degF")),
            (unit("N.m"), unit("J")),
            (rounded, unit("deg")),
        ] {
            assert_eq!(Unit::conversion(&from, &to), Some((1.0, 0.0)));
        }
    }

    #[test]
    fn different_dimensions_do_not_convert() {
        for (from, to) in [("m", "s"), ("rad/s", "Hz"), ("rad", "1"), ("N", "N.m")] {
            assert_eq!(Unit::conversion(&unit(from), &unit(to)), None, "{from} {to}");
        }
    }

    #[test]
    fn errors_name_the_place() {
        for (text, span, part) in [
            ("N.furlong/s", 2..9, "unknown unit `furlong` at byte 2"),
            ("m/sec", 2..5, "unknown unit `sec`"),
            ("N/degC", 2..6, "write `K`"),
            ("degC2", 0..4, "stand alone"),
            ("", 0..0, "found the end"),
            ("N m", 2..3, "expected `.`, `*`, `/` or the end at byte 2"),
            ("N/(m/s", 6..6, "expected `)`"),
            ("m/", 2..2, "a unit name"),
            ("m^", 2..2, "whole exponent"),
            ("m^x", 2..3, "whole exponent"),
            ("m999", 1..2, "whole exponent"),
            ("m100.m100", 9..9, "powers within"),
            ("2.m", 0..1, "a unit name"),
            ("m²", 1..3, "found `²`"),
            ("((((((((((((((((((((m", 16..17, "a unit name"),
        ] {
            let error = Unit::parse(text).expect_err(text);
            assert_eq!(error.span(), span, "{text}: {error}");
            assert!(error.to_string().contains(part), "{text}: {error}");
        }
    }
}
