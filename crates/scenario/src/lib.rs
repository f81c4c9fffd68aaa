//! A scenario file goes in; its words, each with its place in the file, and the checked plan of the run come out. The reference
//! of all keys is made from the same types that read the file.
#![forbid(unsafe_code)]

mod build_request;
pub mod bundle;
pub mod effect;
pub mod export;
pub mod fault;
mod override_value;
pub mod pattern;
pub mod plan;
pub mod reference;
pub mod resolve;
pub mod schema;
pub mod signal;
mod text_of;
pub mod words;

pub use build_request::{BuildRequest, Built};
pub use words::Scenario;
