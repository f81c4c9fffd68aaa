//! The rows of one run, or two recorded runs, go in; a recording with a layout for the Rerun viewer comes out, into a file or over
//! the network. No other crate depends on Rerun.
#![forbid(unsafe_code)]

pub mod comparison;
mod sink;
pub mod viewer;

pub use sink::{RecordingTarget, RerunSink};
