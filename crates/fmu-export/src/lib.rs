//! Turns a Rust type with a table of variables into an FMI 2.0 co-simulation unit (FMU).
//!
//! A model is a plain struct. It implements [`Model`], lists the members that the outside world may
//! see as rows of [`Variable`], and is exported by [`export!`]. The C functions, `modelDescription.xml`
//! and the archive all come from that one table.
//!
//! # An FMU from nothing
//!
//! A package whose library is dynamic, or an example of a package (then `crate-type` stands in its
//! `[[example]]`):
//!
//! ```toml
//! [package]
//! name = "mass"
//! edition = "2024"
//!
//! [lib]
//! crate-type = ["cdylib"]
//!
//! [dependencies]
//! fmu-export = { path = "../crates/fmu-export" }
//! serde = { version = "1", features = ["derive"] }
//! ```
//!
//! `src/lib.rs`, all of it:
//!
//! ```
//! use fmu_export::{Info, Model, ModelError, Variable, export, input, output, parameter};
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
//!     const INFO: Info = Info::new("mass", "A mass on a line", 0.01).stop(10.0);
//!     const VARIABLES: &'static [Variable<Self>] = &[
//!         parameter("m", "kg", "Mass").min(1e-6).at(|s| &mut s.m),
//!         input("F", "N", "Force").at(|s| &mut s.F),
//!         output("v", "m/s", "Speed").exact().depends_on(&[]).at(|s| &mut s.v),
//!     ];
//!     fn step(&mut self, _time: f64, step: f64) -> Result<(), ModelError> {
//!         self.v += self.F / self.m * step;
//!         Ok(())
//!     }
//! }
//!
//! export!(Mass);
//! # fn main() {
//! #     assert!(fmu_export::description::xml::<Mass>().contains("valueReference=\"2\""));
//! #     assert!(fmu_export::description::problems::<Mass>().is_empty());
//! # }
//! ```
//!
//! `trackside pack mass` builds it and writes `target/fmu/mass.fmu`; for an example of a package it is
//! `trackside pack --example spring_damper`. The packer asks the library for its description, so that
//! the two always fit, and refuses a table that FMI 2.0 does not allow ([`description::problems`]).
//! `examples/spring_damper.rs` is a whole FMU with derivatives.
//!
//! # The table
//!
//! The row number is the value reference. [`input`], [`output`], [`parameter`],
//! [`calculated_parameter`], [`local`], [`constant`] and [`independent`] begin a row; [`Row::tunable`],
//! [`Row::discrete`], [`Row::exact`] and their siblings change when the variable may move and where its
//! initial value comes from. [`Row::at`] ends it for a real variable, [`Row::at_integer`],
//! [`Row::at_boolean`] and [`Row::at_string`] for the others. Names may be structured: `tire_f.B`,
//! `wheel[1].speed`.
//!
//! - **Start values** live in `Default` and nowhere else.
//! - **Units** are texts such as `N.m/rad` ([`unit`]); the description gets their base units, and those
//!   that people read. A unit that is not understood is refused.
//! - **Limits** ([`Row::min`], [`Row::max`]) are enforced on parameters. Inputs come from other models, whose
//!   transients may leave them.
//! - **Dependencies**: an output follows every input without a step in between, unless
//!   [`Row::depends_on`] lists fewer: none for a state. Masters order the FMUs of a system by that, so
//!   say no more than is true; the packer tries each input once and tells of those that were left out.
//!
//! # A step
//!
//! | call | when |
//! |---|---|
//! | [`Model::initialise`] | in initialisation mode, again after each change of a parameter or input |
//! | [`Model::step`] | for each communication step of any size, with the inputs held |
//! | [`Model::outputs`] | after the two above, and when an output is read after an input was written |
//!
//! An environment that knows how an input goes on may say so (`fmi2SetRealInputDerivatives`, up to the
//! fourth). Then the step is divided into parts of at most [`Info::substep`], each with the input of its
//! middle, and `step` is called for each. Outputs have no time derivatives.
//!
//! # Derivatives
//!
//! Output equations that are written as [`Equations`], generic over their number type, give both the outputs
//! and, with dual numbers, `fmi2GetDirectionalDerivative`:
//!
//! ```
//! use fmu_export::*;
//! # #[derive(Clone, Default, serde::Serialize, serde::Deserialize)]
//! # struct Mass { m: f64, F: f64, a: f64 }
//!
//! impl Equations<1, 1> for Mass {
//!     const KNOWN: [&str; 1] = ["F"];
//!     const UNKNOWN: [&str; 1] = ["a"];
//!     fn equations<T: Number>(&self, [F]: [T; 1]) -> [T; 1] { [F / self.m] }
//! }
//!
//! impl Model for Mass {
//!     // ...
//! #   const INFO: Info = Info::new("mass", "A mass on a line", 0.01);
//! #   const VARIABLES: &'static [Variable<Self>] = &[
//! #       input("F", "N", "Force").at(|s| &mut s.F),
//! #       output("a", "m/s2", "Acceleration").at(|s| &mut s.a),
//! #   ];
//! #   fn step(&mut self, _: f64, _: f64) -> Result<(), ModelError> { Ok(()) }
//!     const DERIVATIVES: Option<Derivatives<Self>> = Some(Derivatives::of());
//!     fn outputs(&mut self) { [self.a] = self.equations([self.F]); }
//! }
//! ```
//!
//! # State, errors and messages
//!
//! `Clone` is the FMU state and `serde` its bytes: a restored model continues bit for bit, as long as the
//! struct holds everything that it computes with. There may be any number of instances in a process; a
//! model has no global state.
//!
//! A step that fails returns a [`ModelError`], and the model is as before the step. [`ModelError::Discard`]
//! asks for a shorter step, [`ModelError::Terminated`] ends the simulation as planned, and after
//! [`ModelError::Error`] the instance needs a reset or an older state. A panic becomes `fmi2Fatal` with its
//! message in the log. Calls that FMI 2.0 does not allow are refused with a message and change nothing.
//!
//! [`log()`] writes into a category of [`Info::log_categories`], and [`warn()`] lets the call return
//! `fmi2Warning`; the environment chooses what it wants to read.

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
mod value;
mod variable;

pub use derivative::{Derivatives, Equations, Number};
pub use info::Info;
pub use log::{LOG_CATEGORIES, log, warn};
pub use units as unit;
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
