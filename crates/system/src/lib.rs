//! Makes one FMU of a scenario: the master runs inside it, and the FMUs of the scenario lie in its `resources`.
//!
//! [`expose`] says which variables of the scenario the FMU has, for its description and for the library in it. That library is
//! the package `system-fmu`; all that it does is [`ScenarioInstance`], an instance that steps the scenario.
#![forbid(unsafe_code)]

pub mod expose;
mod guided;
mod interface;
mod nested;
mod running;

pub use interface::{ExposedVariable, ExposedVariableRole, ScenarioFmuInterface, SessionSettings};
pub use nested::ScenarioInstance;

/// The scenario in the folder of resources.
pub const SCENARIO: &str = "system.toml";

/// The interface in the folder of resources.
pub const INTERFACE: &str = "interface.json";
