//! Tires: forces and moments at an operating point, by the Magic Formula 5.2, PAC2002, 6.1 and 6.2 or by its simple form.
//!
//! Numbers only: no files. Everything is in SI units and radians, in ISO-W axes (x forward, y to the left, z up), and
//! generic over the [`Number`] type: with dual numbers the same lines yield exact derivatives with respect to inputs and
//! coefficients.
#![forbid(unsafe_code)]
#![allow(rustdoc::broken_intra_doc_links, reason = "units stand in brackets, which rustdoc takes for links")]

mod axes;
mod coefficients;
mod example;
mod lanes;
mod magic_formula;
mod mf;
mod plain;
mod real;
mod set;
mod slip;
mod tire;

pub use axes::TireAxes;
pub use coefficients::{CoefficientKey, CoefficientQuantity, Coefficients, KEYS, MagicFormulaVersion};
pub use elementary::Number;
pub use magic_formula::MagicFormula;
pub use mf::{
    BadCoefficient, FormulaConvention, FrictionPeak, MfSet, MfTire, RANGES, TireCharacteristics,
    TireForceDetails,
};
pub use real::Real;
pub use set::TireSet;
pub use slip::{RelaxationLengths, TireForces, TireOperatingPoint, ValidityExcess};
pub use tire::Tire;
