//! A run, or two of them, goes in; what the Rerun viewer shows of it comes out, into a file or over the network.
#![forbid(unsafe_code)]

pub mod comparison;
mod sink;
pub mod viewer;

pub use sink::{RerunSink, Target};
