//! Unit texts such as `N.m/rad` go in; dimensions, and the factor and offset between units of the same dimension, come out.
//!
//! ```
//! use units::Unit;
//!
//! let (limit, speed) = (Unit::parse("km/h")?, Unit::parse("m/s")?);
//! let (scale, offset) = Unit::conversion(&limit, &speed).expect("two speeds");
//! assert_eq!(scale * 36.0 + offset, 10.0);
//!
//! let error = Unit::parse("N.furlong").unwrap_err();
//! assert_eq!(error.byte_range(), 2..9);
//! assert!(units::known_unit_names().any(|name| name == "ft"));
//! # Ok::<(), units::UnitError>(())
//! ```
//!
//! Angles are a dimension of their own, as in FMI: `rad/s` and `1/s` do not convert into each other. Temperatures with a shifted
//! zero (`degC`, `degF`) stand alone only.
//!
//! In the registry this crate is `trackside-units`; the name in code stays.
#![forbid(unsafe_code)]

pub mod display;
mod error;
mod parser;
mod spelling;
mod table;
mod unit_prefix;

pub use error::UnitError;
use parser::UnitParser;
pub use spelling::{normalized_unit_text, unit_for_spelling};
pub use table::STANDARD_GRAVITY;
use table::{NAMES, NONE, SCALES, TEMPERATURE};
pub use unit_prefix::leading_unit_length;

/// The base units, in the order of [`Unit::exponents`].
pub const BASE: [&str; 8] = ["kg", "m", "s", "A", "K", "mol", "cd", "rad"];

/// Index of the angle in [`BASE`].
const RAD: usize = 7;

/// The names of all units that a text may consist of: for suggestions, and for a reference.
pub fn known_unit_names() -> impl Iterator<Item = &'static str> {
    NAMES.iter().map(|(name, ..)| *name).chain(SCALES.iter().map(|(name, ..)| *name))
}

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

impl Unit {
    /// The unit of plain numbers.
    pub const ONE: Self = Self::from_base(NONE, 1.0, 0.0);

    /// A unit from the numbers of FMI's `BaseUnit` element.
    #[must_use]
    pub const fn from_base(exponents: [i8; 8], factor: f64, offset: f64) -> Self {
        Self { exponents, factor, offset }
    }

    /// A unit from numbers that somebody else wrote into such an element.
    ///
    /// # Errors
    /// When the factor is 0, or a number is none or beyond all units: conversions would give such numbers, too.
    pub fn try_from_base(exponents: [i8; 8], factor: f64, offset: f64) -> Result<Self, UnitError> {
        if !is_plausible_magnitude(factor) {
            return Err(UnitError::Factor { found: factor });
        }
        if offset != 0.0 && !is_plausible_magnitude(offset) {
            return Err(UnitError::Offset { found: offset });
        }
        Ok(Self::from_base(exponents, factor, offset))
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
        UnitParser::parse_unit(text).map_err(|error| match unit_for_spelling(word) {
            Some(meant) => {
                let (word, text) = (word.to_owned(), text.to_owned());
                let at = text.find(word.as_str()).unwrap_or_default();
                UnitError::Unknown { word, at, text, meant: Some(meant) }
            }
            None => error,
        })
    }

    /// The unit of differences of values: the same without an offset.
    #[must_use]
    pub fn difference_unit(self) -> Self {
        Self { offset: 0.0, ..self }
    }

    /// A name of a unit of this size without an offset, if there is one: K of the differences of degC.
    #[must_use]
    pub fn offset_free_name(&self) -> Option<&'static str> {
        let same = |a: f64, b: f64| (a - b).abs() <= 1e-12 * a.abs().max(b.abs());
        let of_size = |(_, exponents, factor): &&(&str, [i8; 8], f64)| {
            *exponents == self.exponents && same(*factor, self.factor)
        };
        NAMES.iter().find(of_size).filter(|_| self.offset == 0.0).map(|(name, ..)| *name)
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
        let offset = if same(from.offset, to.offset) { 0.0 } else { (from.offset - to.offset) / to.factor };
        Some((scale, offset))
    }

    /// The dimension in base units, for messages: `m/s`, `kg.m2/(s2.rad)`, or `1` for none.
    #[must_use]
    pub fn dimension_text(&self) -> String {
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

    /// The same unit with angles counted as plain numbers: `rad/s` becomes `1/s`, with the factor of `deg` kept.
    #[must_use]
    pub fn without_angle(mut self) -> Self {
        self.exponents[RAD] = 0;
        self
    }

    /// `self^power`, or nothing when an exponent is not whole or leaves the range of `i8`, or the factor is beyond all units. An
    /// angle counts as a plain number where its own exponent is not whole.
    #[must_use]
    pub fn powf(self, power: f64) -> Option<Self> {
        let raised = |exponents: [i8; 8]| {
            let mut raised = NONE;
            for (to, from) in raised.iter_mut().zip(exponents) {
                let exponent = f64::from(from) * power;
                let fits = exponent.fract() == 0.0 && exponent.abs() <= f64::from(i8::MAX);
                *to = fits.then_some(exponent as i8)?;
            }
            Some(raised)
        };
        let exponents = raised(self.exponents).or_else(|| raised(self.without_angle().exponents))?;
        Self::try_from_base(exponents, self.factor.powf(power), 0.0).ok()
    }

    /// `self * other^exponent`, or nothing when a power leaves the range of `i8`, or the factor is beyond all units.
    #[must_use]
    pub fn times_power(self, other: Self, exponent: i8) -> Option<Self> {
        let mut exponents = self.exponents;
        for (sum, power) in exponents.iter_mut().zip(other.exponents) {
            *sum = sum.checked_add(power.checked_mul(exponent)?)?;
        }
        let factor = self.factor * other.factor.powi(i32::from(exponent));
        Self::try_from_base(exponents, factor, 0.0).ok()
    }
}

/// Whether a factor or an offset is of a size that units have; the ratio of any two of them is finite, and no 0.
fn is_plausible_magnitude(number: f64) -> bool {
    (1e-150..=1e150).contains(&number.abs())
}

#[cfg(test)]
mod tests;
