//! Scenario files: reads them to a document with spans, resolves it to the checked plan of a run, and exports it. The reference
//! of all keys is made from the same types that read the file.
#![forbid(unsafe_code)]

mod build_request;
pub mod bundle;
pub mod document;
pub mod export;
mod override_value;
mod parameter_file;
pub mod pattern;
pub mod plan;
pub mod reference;
pub mod resolve;
pub mod schema;
#[cfg(test)]
mod tests;
mod text_of;

pub use build_request::{BuildArtifacts, BuildRequest};
pub use document::Scenario;
pub use override_value::OverrideValue;
pub use parameter_file::{FileParameter, ParameterFile, number_in_unit};
