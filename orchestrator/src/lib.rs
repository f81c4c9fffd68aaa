//! A scenario's path goes in; a report of its run comes out: this crate builds what the scenario names, runs it, records it, lets
//! analyses and validations follow, and judges all of it.
#![forbid(unsafe_code)]

pub mod analysis;
mod baseline;
mod branch;
mod checkpoint_file;
mod course;
pub mod fresh;
pub mod inspect;
pub mod messages;
mod options;
mod pace;
pub mod package;
mod recorder;
pub mod report;
mod run;
mod run_folder;
mod sinks;
mod stop;
pub mod suite;
pub mod sweep;
pub mod validation;

pub use branch::latest_stop;
pub use options::{ProgressEvent, Replay, Role, RunOptions};
pub use run::{Remains, Run, run};
