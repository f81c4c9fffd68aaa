//! Tires: forces and moments at an operating point, by the Magic Formula 5.2, PAC2002, 6.1 and 6.2 or by its simple form.
//!
//! Numbers only: no files. Everything is in SI units and radians, in ISO-W axes (x forward, y to the left, z up), and
//! generic over the [`Number`] type: with dual numbers the same lines yield exact derivatives with respect to inputs and
//! coefficients.
//!
//! A tire at 4 kN, its lateral force over the slip angle and its cornering stiffness, which is a derivative:
//!
//! ```
//! use num_dual::Dual64;
//! use tire::{Coefficients, MfTire, Tire, TireOperatingPoint};
//!
//! let coefficients = Coefficients { LMUY: 0.95, ..Coefficients::sports_tire() };
//! let tire = MfTire::new(coefficients)?;
//! let free = TireOperatingPoint { F_z: 4000.0, v_x: 20.0, ..TireOperatingPoint::default() };
//! for degrees in [1.0_f64, 2.0, 4.0, 8.0, 12.0] {
//!     let forces = tire.forces(&TireOperatingPoint { alpha: degrees.to_radians(), ..free });
//!     assert!(forces.F_y < 0.0 && forces.F_y > -1.2 * free.F_z);
//! }
//!
//! let [_, F_y] = tire.cast::<Dual64>().F_xy(&TireOperatingPoint {
//!     alpha: Dual64::from(0.0).derivative(),
//!     F_z: Dual64::from(free.F_z),
//!     v_x: Dual64::from(free.v_x),
//!     ..TireOperatingPoint::default()
//! });
//! assert!((50e3..150e3).contains(&-F_y.eps)); // [N/rad]
//!
//! let wrong = MfTire::new(Coefficients { FNOMIN: 0.0, ..coefficients }).unwrap_err();
//! assert!(wrong.to_string().contains("FNOMIN"));
//! # Ok::<(), tire::BadCoefficient>(())
//! ```
//!
//! In the registry this crate is `trackside-tire`; the name in code stays.
//!
//! `MagicFormula` is the simple form with four coefficients. Files (`.tir`) are read by another crate.
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
