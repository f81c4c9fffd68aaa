//! Makes the struct of all coefficients, and the table of their keys, from one list.

use std::fmt;

use serde::{Deserialize, Serialize};

#[macro_use]
mod list;

/// Version of the Magic Formula that coefficients belong to.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum MagicFormulaVersion {
    /// MF 5.2.
    Mf52,
    /// PAC2002 of Adams: the equations of 5.2, with inflation pressure and the moments of 6.1.
    Pac2002,
    /// MF 6.1: inflation pressure, loaded radius, carcass stiffnesses.
    #[default]
    Mf61,
    /// MF 6.2: as 6.1, with a loaded radius that depends on camber.
    Mf62,
}

impl fmt::Display for MagicFormulaVersion {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Mf52 => "MF 5.2",
            Self::Pac2002 => "PAC2002",
            Self::Mf61 => "MF 6.1",
            Self::Mf62 => "MF 6.2",
        })
    }
}

impl MagicFormulaVersion {
    /// Whether forces, camber and relaxation follow the equations of 5.2.
    pub const fn is_before_61(self) -> bool {
        matches!(self, Self::Mf52 | Self::Pac2002)
    }

    /// Whether the inflation pressure has an effect.
    pub const fn has_pressure(self) -> bool {
        !matches!(self, Self::Mf52)
    }
}

const ALL: &[MagicFormulaVersion] = &[
    MagicFormulaVersion::Mf52,
    MagicFormulaVersion::Pac2002,
    MagicFormulaVersion::Mf61,
    MagicFormulaVersion::Mf62,
];
const BEFORE_61: &[MagicFormulaVersion] = &[MagicFormulaVersion::Mf52, MagicFormulaVersion::Pac2002];
const AFTER_52: &[MagicFormulaVersion] =
    &[MagicFormulaVersion::Pac2002, MagicFormulaVersion::Mf61, MagicFormulaVersion::Mf62];
const SINCE_61: &[MagicFormulaVersion] = &[MagicFormulaVersion::Mf61, MagicFormulaVersion::Mf62];
const ONLY_62: &[MagicFormulaVersion] = &[MagicFormulaVersion::Mf62];
const NONE: &[MagicFormulaVersion] = &[];

/// What a coefficient measures: a file in other units has to be converted by it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum CoefficientQuantity {
    /// No unit; angles within coefficients are radians in every file.
    Ratio,
    /// Metres.
    Length,
    /// Newtons.
    Force,
    /// Pascals.
    Pressure,
    /// Newtons per metre.
    Stiffness,
    /// Newton seconds per metre.
    Damping,
    /// Radians.
    Angle,
    /// Metres per second.
    Speed,
    /// 1 / m.
    InverseLength,
    /// 1 / m².
    InverseArea,
}

/// One key of the Magic Formula.
#[derive(Clone, Copy, Debug)]
pub struct CoefficientKey {
    /// Its name in a file and in [`Coefficients`].
    pub name: &'static str,
    /// The section of a `.tir` file where it stands.
    pub section: &'static str,
    /// What it measures.
    pub quantity: CoefficientQuantity,
    /// Its value where nothing else is known: without effect where that is possible [SI].
    pub default: f64,
    /// The versions in which it has an effect on what this crate computes.
    pub versions: &'static [MagicFormulaVersion],
    /// What it is, in one line.
    pub doc: &'static str,
    index: usize,
}

impl CoefficientKey {
    /// The key of this name, in capitals.
    pub fn from_name(name: &str) -> Option<&'static Self> {
        KEYS.iter().find(|key| key.name == name)
    }

    /// Its value [SI].
    pub fn get<T: Copy>(&self, coefficients: &Coefficients<T>) -> T {
        *coefficients.fields()[self.index]
    }

    /// Sets its value [SI].
    pub fn set<T: Copy>(&self, coefficients: &mut Coefficients<T>, value: T) {
        *coefficients.fields_mut()[self.index] = value;
    }
}

/// The unit of a quantity in brackets, as docstrings have it.
macro_rules! unit {
    (Ratio) => {
        "[-]"
    };
    (Length) => {
        "[m]"
    };
    (Force) => {
        "[N]"
    };
    (Pressure) => {
        "[Pa]"
    };
    (Stiffness) => {
        "[N/m]"
    };
    (Damping) => {
        "[N s/m]"
    };
    (Angle) => {
        "[rad]"
    };
    (Speed) => {
        "[m/s]"
    };
    (InverseLength) => {
        "[1/m]"
    };
    (InverseArea) => {
        "[1/m²]"
    };
}

macro_rules! coefficients {
    ($($section:ident { $($name:ident: $quantity:ident = $default:literal, $versions:ident, $doc:literal;)+ })+) => {
        /// All coefficients of a tire by their standard keys, in SI units and ISO-W axes.
        ///
        /// The default has no shifts, no effect of combined slip, camber or pressure, and all scale factors 1.
        #[derive(Clone, Copy, Debug, PartialEq)]
        #[allow(non_snake_case, reason = "the keys of .tir files")]
        pub struct Coefficients<T = f64> {
            /// The version of the formula.
            pub version: MagicFormulaVersion,
            $($(#[doc = concat!($doc, " ", unit!($quantity))] pub $name: T,)+)+
        }

        #[allow(non_camel_case_types, clippy::upper_case_acronyms, reason = "the keys of .tir files")]
        enum Index {
            $($($name,)+)+
        }

        const COUNT: usize = [$($(Index::$name as usize,)+)+].len();

        /// All keys, in the order of a `.tir` file.
        pub const KEYS: &[CoefficientKey] = &[$($(CoefficientKey {
            name: stringify!($name),
            section: stringify!($section),
            quantity: CoefficientQuantity::$quantity,
            default: $default,
            versions: $versions,
            doc: $doc,
            index: Index::$name as usize,
        },)+)+];

        impl Default for Coefficients {
            fn default() -> Self {
                Self { version: MagicFormulaVersion::default(), $($($name: $default,)+)+ }
            }
        }

        impl<T: Copy> Coefficients<T> {
            fn fields(&self) -> [&T; COUNT] {
                [$($(&self.$name,)+)+]
            }

            fn fields_mut(&mut self) -> [&mut T; COUNT] {
                [$($(&mut self.$name,)+)+]
            }

            /// The same coefficients as numbers of another type.
            pub fn map<U>(&self, mut number: impl FnMut(T) -> U) -> Coefficients<U> {
                Coefficients { version: self.version, $($($name: number(self.$name),)+)+ }
            }
        }
    };
}

with_all_keys!(coefficients);

impl Coefficients {
    /// The same coefficients as constants of another number type.
    pub fn cast<T: crate::Number>(&self) -> Coefficients<T> {
        self.map(Into::into)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_key_reads_and_writes_its_own_field() {
        let mut coefficients = Coefficients::default();
        for (number, key) in KEYS.iter().enumerate() {
            assert_eq!(key.get(&coefficients), key.default, "{}", key.name);
            key.set(&mut coefficients, number as f64);
        }
        for (number, key) in KEYS.iter().enumerate() {
            assert_eq!(key.get(&coefficients), number as f64, "{}", key.name);
        }
        let radius = CoefficientKey::from_name("UNLOADED_RADIUS").expect("a key");
        assert_eq!(radius.get(&coefficients), coefficients.UNLOADED_RADIUS);
        assert_eq!((radius.section, radius.quantity), ("DIMENSION", CoefficientQuantity::Length));
    }

    #[test]
    fn names_are_unique() {
        for (number, key) in KEYS.iter().enumerate() {
            assert!(KEYS[..number].iter().all(|other| other.name != key.name), "{}", key.name);
        }
    }
}
