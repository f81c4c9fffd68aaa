//! Turns a Rust type with a table of variables into an FMI 2.0 co-simulation unit (FMU).
//!
//! A model is a plain struct. It implements [`Model`], lists the members that the outside world may
//! see as rows of [`Variable`], and is exported by [`export!`]. The C functions, `modelDescription.xml`
//! and the archive all come from that one table:
//!
//! ```
//! use fmu_export::{Info, Model, ModelError, Variable, input, output, parameter};
//!
//! /// A mass on a line.
//! #[derive(Clone, serde::Serialize, serde::Deserialize)]
//! struct Mass { m: f64, F: f64, v: f64 }
//!
//! impl Default for Mass {
//!     fn default() -> Self { Mass { m: 2.0, F: 0.0, v: 0.0 } }
//! }
//!
//! impl Model for Mass {
//!     const INFO: Info = Info::new("mass", "A mass on a line", 0.01);
//!     const VARIABLES: &'static [Variable<Self>] = &[
//!         parameter("m", "kg", "Mass").min(1e-6).at(|s| &mut s.m),
//!         input("F", "N", "Force").at(|s| &mut s.F),
//!         output("v", "m/s", "Speed").depends_on(&[]).at(|s| &mut s.v),
//!     ];
//!     fn step(&mut self, _time: f64, step: f64) -> Result<(), ModelError> {
//!         self.v += self.F / self.m * step;
//!         Ok(())
//!     }
//! }
//! # assert!(fmu_export::description::xml::<Mass>().contains("valueReference=\"2\""));
//! ```
//!
//! In a crate of type `cdylib`, the line `fmu_export::export!(Mass);` adds the 34 C functions.

#![allow(unsafe_code, reason = "the C interface of FMI")]

pub mod abi;
mod derivative;
pub mod description;
pub mod export;
mod info;
mod instance;
mod lifecycle;
mod log;
#[cfg(feature = "pack")]
pub mod pack;
mod table;
pub mod unit;
mod value;
mod variable;

pub use derivative::{Derivatives, Equations, Number};
pub use info::Info;
pub use log::{LOG_CATEGORIES, log, warn};
pub use value::Value;
pub use variable::{
    Access, Causality, Depends, Initial, Kind, Row, Variability, Variable, calculated_parameter,
    constant, independent, input, local, output, parameter,
};

/// Why a model could not do what it was asked.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ModelError {
    /// The step was not done and the state is as before; a shorter step might succeed.
    #[error("{0}")]
    Discard(String),
    /// The model ends the simulation here, as planned.
    #[error("{0}")]
    Terminated(String),
    /// The instance is lost until it is reset.
    #[error("{0}")]
    Error(String),
}

/// A model that can be initialised, stepped and looked at.
///
/// `Default` is the only source of start values, `Clone` serves the FMU state, and
/// `Serialize`/`Deserialize` its serialised form; a restored state continues bit for bit.
pub trait Model:
    Default + Clone + serde::Serialize + serde::de::DeserializeOwned + 'static
{
    /// Name, description and preferred step.
    const INFO: Info;
    /// What the outside world may see. The row number is the value reference.
    const VARIABLES: &'static [Variable<Self>];
    /// The derivatives of the output equations, for a model that has [`Equations`].
    const DERIVATIVES: Option<Derivatives<Self>> = None;

    /// Computes the initial state from parameters and start values. It may be called repeatedly and
    /// must depend on nothing that an earlier call computed.
    ///
    /// # Errors
    /// When the parameters do not describe a model that can run.
    fn initialise(&mut self) -> Result<(), ModelError> {
        Ok(())
    }

    /// Advances the state from `time` to `time + step` [s] with the inputs held.
    ///
    /// # Errors
    /// When the step cannot be done; [`ModelError`] says what is left.
    fn step(&mut self, time: f64, step: f64) -> Result<(), ModelError>;

    /// Computes the outputs from state and inputs. It is called after initialisation, after each
    /// step, and when an output is read after an input was written.
    fn outputs(&mut self) {}
}
