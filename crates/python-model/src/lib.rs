//! Makes one FMU of a Python script: a process of Python has the model, and this instance asks it.
//!
//! [`Interface::of`] describes what a script says of itself, for the packer. The library in the archive is the package `python-fmu`;
//! all that it does is [`Hosted`].
#![forbid(unsafe_code)]

mod answers;
mod hosted;
mod interface;
mod script;

pub use hosted::Hosted;
pub use interface::{Exposed, Interface, Role};
pub use script::{Described, describe};

/// The interface in the folder of resources.
pub const INTERFACE: &str = "interface.json";
