//! Makes one FMU of a Python script: a process of Python has the model, and this instance asks it.
//!
//! [`describe_script`] describes what a script says of itself, for the packer. The library in the archive is the package `python-fmu`;
//! all that it does is [`ScriptInstance`].
#![forbid(unsafe_code)]

mod interface;
mod script;
mod script_instance;
mod value_codec;

pub use interface::{ScriptFmuInterface, ScriptVariable, ScriptVariableRole};
pub use script::{PackedScript, describe_script};
pub use script_instance::ScriptInstance;

/// The interface in the folder of resources.
pub const INTERFACE: &str = python::MODEL_INTERFACE_PATH;
