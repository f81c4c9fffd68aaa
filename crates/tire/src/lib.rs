//! Tires: forces and moments at an operating point, by the Magic Formula 5.2, PAC2002, 6.1 and 6.2 or by its simple form.
//!
//! Numbers only: no files. Everything is in SI units and radians, in ISO-W axes (x forward, y to the left, z up), and
//! generic over the [`Number`] type: with dual numbers the same lines yield exact derivatives with respect to inputs and
//! coefficients.
#![forbid(unsafe_code)]
#![allow(
    rustdoc::broken_intra_doc_links,
    reason = "units stand in brackets, which rustdoc takes for links"
)]

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

pub use axes::Axes;
pub use coefficients::{Coefficients, KEYS, Key, Quantity, Version};
pub use elementary::Number;
pub use magic_formula::MagicFormula;
pub use mf::{
    BadCoefficient, Characteristics, Details, FormulaConvention, MfSet, MfTire, Peak, RANGES,
};
pub use real::Real;
pub use set::TireSet;
pub use slip::{Forces, Relaxation, Slip, Validity};
pub use tire::Tire;
