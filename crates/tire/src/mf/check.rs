//! Refuses coefficients that the formula cannot calculate with.

use std::fmt;

use crate::coefficients::{Coefficients, KEYS};
use elementary::Number;

/// A coefficient that no tire can have.
#[derive(Clone, Debug, PartialEq)]
pub struct BadCoefficient {
    /// Its key.
    pub key: &'static str,
    /// Its value [SI].
    pub value: f64,
    /// What it has to be, such as "above 0".
    pub expected: String,
}

impl fmt::Display for BadCoefficient {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { key, value, expected } = self;
        write!(f, "{key} is {value}, expected a number {expected}")
    }
}

impl std::error::Error for BadCoefficient {}

/// Lengths, forces and speeds that others are divided by.
const POSITIVE: [&str; 8] =
    ["LONGVL", "UNLOADED_RADIUS", "INFLPRES", "NOMPRES", "FNOMIN", "VERTICAL_STIFFNESS", "LFZO", "PRESMIN"];

/// Carcass stiffnesses, which relaxation lengths are divided by since 6.1.
const POSITIVE_SINCE_61: [&str; 2] = ["LONGITUDINAL_STIFFNESS", "LATERAL_STIFFNESS"];

const NOT_NEGATIVE: [&str; 6] = ["VXLOW", "WIDTH", "FZMIN", "LMUX", "LMUY", "LMUV"];

/// Each lower limit of validity and its upper one.
pub const RANGES: [(&str, &str); 5] = [
    ("PRESMIN", "PRESMAX"),
    ("FZMIN", "FZMAX"),
    ("KPUMIN", "KPUMAX"),
    ("ALPMIN", "ALPMAX"),
    ("CAMMIN", "CAMMAX"),
];

impl<T: Number> Coefficients<T> {
    /// Whether the formula can calculate with them.
    ///
    /// # Errors
    /// Names the first coefficient that no tire can have: not finite, or outside of the bound that the formula needs.
    pub fn check(&self) -> Result<(), BadCoefficient> {
        let expect = |key: &'static str, holds: &dyn Fn(f64) -> bool, expected: &dyn Fn() -> String| {
            let value = coefficient_by_name(self, key);
            let bad = || BadCoefficient { key, value, expected: expected() };
            if holds(value) { Ok(()) } else { Err(bad()) }
        };
        for key in KEYS {
            expect(key.name, &f64::is_finite, &|| "that is finite".to_owned())?;
        }
        for key in POSITIVE {
            expect(key, &|value| value > 0.0, &|| "above 0".to_owned())?;
        }
        for key in NOT_NEGATIVE {
            expect(key, &|value| value >= 0.0, &|| "of at least 0".to_owned())?;
        }
        let divisors: &[_] = if self.version.is_before_61() { &["PTY2"] } else { &POSITIVE_SINCE_61 };
        for key in divisors {
            expect(key, &|value| value > 0.0, &|| "above 0".to_owned())?;
        }
        expect("PKY2", &|value| value != 0.0, &|| "other than 0".to_owned())?;
        for (lower, upper) in RANGES {
            let bound = coefficient_by_name(self, lower);
            expect(upper, &|value| value >= bound, &|| format!("of at least {lower}, {bound}"))?;
        }
        Ok(())
    }
}

fn coefficient_by_name<T: Number>(coefficients: &Coefficients<T>, name: &str) -> f64 {
    let key = KEYS.iter().find(|key| key.name == name);
    key.map_or(f64::NAN, |key| key.get(coefficients).re())
}
