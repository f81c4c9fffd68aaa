//! Turns a Rust struct and a table of its variables into a co-simulation unit (FMU) of FMI 2.0 and of FMI 3.0: the C functions of
//! both in one library, `modelDescription.xml` and the archives.
//!
//! The struct implements [`Model`], lists its public variables as rows of [`Variable`], and is exported by
//! [`export!`].
//!
//! # An FMU from nothing
//!
//! The library of the package is dynamic. For an example of a package, `crate-type` stands in its
//! `[[example]]`:
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
//! trackside-fmu-export = "0.1" # in code: fmu_export
//! serde = { version = "1", features = ["derive"] }
//! ```
//!
//! The complete `src/lib.rs`:
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
//! #     assert!(fmu_export::description::fmi2_model_xml::<Mass>().contains("valueReference=\"2\""));
//! #     assert!(fmu_export::description::model_problems::<Mass>().is_empty());
//! # }
//! ```
//!
//! `trackside pack mass` builds it and writes `target/fmu/mass.fmu`; for an example of a package the command
//! is `trackside pack --example spring_damper`. Without Trackside, the feature `pack` has the same as a
//! function, `pack::pack_fmu`. The packer asks the library for its description, so that the two always fit, and
//! rejects a table that FMI 2.0 does not allow ([`description::model_problems`]). `examples/spring_damper.rs` is a
//! complete FMU with derivatives.
//!
//! # The table
//!
//! The row number is the value reference. [`input`], [`output`], [`parameter`],
//! [`calculated_parameter`], [`local`], [`constant`] and [`independent`] begin a row; [`VariableRow::tunable`],
//! [`VariableRow::discrete`], [`VariableRow::exact`] and their siblings set variability and initial value. [`VariableRow::at`] ends
//! it for a real variable, [`VariableRow::at_integer`], [`VariableRow::at_boolean`] and [`VariableRow::at_string`] for the other
//! types. Names may be structured: `tire_f.B`, `wheel[1].speed`.
//!
//! - **Start values** come from `Default` alone.
//! - **Units** are texts such as `N.m/rad` ([`unit`]). The description gets their base units and usual display
//!   units; an unknown unit is rejected.
//! - **Limits** ([`VariableRow::min`], [`VariableRow::max`]) are enforced for parameters only. Inputs come from other models,
//!   whose transients may leave them.
//! - **Arrays**: rows `x[1]`, `x[2]`, ... that follow each other and differ in nothing but names and descriptions are one array `x` in
//!   archives of FMI 3.0, and single variables in those of FMI 2.0.
//! - **Terminals** ([`Info::terminals`]) are groups of inputs and outputs that other tools connect at once. Archives of FMI 3.0
//!   have them.
//! - **Dependencies**: an output depends on every input directly, unless [`VariableRow::depends_on`] lists fewer: none
//!   for a state. Masters order the FMUs of a system by these lists. The packer varies each input once and
//!   reports dependencies that are missing.
//!
//! # A step
//!
//! | call | when |
//! |---|---|
//! | [`Model::initialise`] | in initialisation mode, again after each change of a parameter or input |
//! | [`Model::review_parameters`] | once, when the initialisation ends |
//! | [`Model::step`] | for each communication step of any size, with the inputs held |
//! | [`Model::compute_outputs`] | after the two above, and when an output is read after an input was written |
//!
//! An environment may give time derivatives of inputs (`fmi2SetRealInputDerivatives`, up to order four). The
//! step is then divided into parts of at most [`Info::substep`], and `step` is called for each with the input
//! at its middle. Outputs have no time derivatives.
//!
//! # Derivatives
//!
//! Output equations in the form of [`Equations`], generic over their number type, give the outputs and, with
//! dual numbers, `fmi2GetDirectionalDerivative`:
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
//!     const DERIVATIVES: Option<EquationDerivatives<Self>> = Some(EquationDerivatives::of());
//!     fn compute_outputs(&mut self) { [self.a] = self.equations([self.F]); }
//! }
//! ```
//!
//! # State, threads, failures and messages
//!
//! [`Model`] states the contract. The library keeps the rules of FMI 2.0 for it: calls that a state does not
//! allow, wrong types, unknown value references, null pointers and texts that are not UTF-8 fail with
//! `fmi2Error` and a message, and change nothing.
//!
//! # Features
//!
//! `pack`: the module `pack`, which makes archives of built libraries. A model does without.
//!
//! # Tests and memory
//!
//! `cargo test -p fmu-export` calls every C function in every state, and runs all of that again with valgrind
//! where it is installed. With a nightly toolchain, `cargo +nightly miri test -p fmu-export` checks the rules
//! of references and initialisation too.

#![allow(unsafe_code, reason = "the C interface of FMI")]

pub mod abi;
mod array;
mod co_simulation;
mod derivative;
pub mod description;
mod error;
pub mod export;
mod info;
mod instance;
mod lifecycle;
mod log;
mod memory;
mod model;
#[cfg(feature = "pack")]
pub mod pack;
mod real_values;
pub mod resources;
mod table;
mod terminal;
mod text;
mod value;
mod variable;
mod variable_value;

pub use co_simulation::{CoSimulation, LogCategories};
pub use derivative::{EquationDerivatives, Equations, Number};
pub use error::{FmiError, FmiResult, reject};
pub use info::Info;
pub use instance::{Instance, InstanceSnapshot};
pub use lifecycle::{Lifecycle, LifecycleState};
pub use log::{LOG_CATEGORIES, SUMMARY, log, warn};
pub use model::{Model, ModelError};
pub use real_values::{RealValue, real_values};
pub use terminal::{Member, MemberKind, Terminal};
pub use text::SharedText;
pub use units as unit;
pub use value::FmiValue;
pub use variable::{
    Causality, Initial, OutputDependencies, Variability, Variable, VariableAccess, VariableKind, VariableRow,
    calculated_parameter, constant, independent, input, local, output, parameter,
};
pub use variable_value::VariableValue;
