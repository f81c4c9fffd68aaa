//! A scenario file goes in; its words, each with its place in the file, and the checked plan that they ask for come out.
#![forbid(unsafe_code)]

pub mod effects;
mod pattern;
pub mod plan;
mod product;
pub mod resolve;
pub mod signal;
pub mod words;

pub use product::{Built, Product};
pub use words::Scenario;
