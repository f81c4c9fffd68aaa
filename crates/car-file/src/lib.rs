//! Reads the tables of a car: text goes in; curves and maps in SI units come out, or what is wrong with a line and a column. Judges its
//! parameters by plausible ranges.
//!
//! A table has a row for each point, with fields between semicolons, tabs, commas or blanks. The first row names the columns and
//! their units: `travel [mm], toe [deg], camber [deg]`. Comments start with `#` or `//`.
//!
//! ```
//! let text = "travel [mm], toe [deg]\n-50, 0.1\n0, 0.0\n50, -0.2\n";
//! let kinematics = car_file::read_kinematics(text)?;
//! assert_eq!(kinematics.camber, None);
//! let toe = kinematics.toe.expect("a column").interpolate(0.025);
//! assert!((toe + 0.1_f64.to_radians()).abs() < 1e-15);
//!
//! let error = car_file::read_kinematics("travel [mm], tow [deg]\n").unwrap_err().to_string();
//! assert_eq!(error, "1: unknown column `tow`, did you mean `toe`?");
//! # Ok::<(), car_file::Error>(())
//! ```
#![forbid(unsafe_code)]
#![allow(rustdoc::broken_intra_doc_links, reason = "units stand in brackets, which rustdoc takes for links")]

mod car;
mod grid;
mod header;
mod plausibility;
mod table;

pub use car::{
    WheelKinematics, read_aerodynamic_map, read_brake_curves, read_engine_torque, read_kinematics,
};
pub use plausibility::{CarParameter, SteeringMonitor, implausible_parameters};

/// What is wrong with a table. It begins with the line, so that the name of the table goes before it: `aero.map:3: ...`.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{line}: {message}")]
pub struct Error {
    /// Line of the text, from 1.
    pub line: usize,
    /// Expectation and fact.
    pub message: String,
}
