//! Runs scenarios from file to report: builds their packages, simulates and records their systems, runs analyses and validations, and
//! evaluates checks; also parameter sweeps and test suites of scenarios.
#![forbid(unsafe_code)]

pub mod analysis;
pub mod baseline;
pub mod baseline_change;
mod checkpoint_file;
mod checkpoint_plan;
pub mod examples;
pub mod inspect;
pub mod messages;
mod nearest_path;
pub mod nofollow;
mod options;
pub mod package;
mod real_time;
mod recorder;
pub mod relative_path;
pub mod report;
mod run;
mod run_folder;
mod sinks;
mod stop;
pub mod suite;
pub mod sweep;
pub mod tube_lines;
pub mod validation;
mod warm_start;

pub use options::{ProgressEvent, ReplayOutput, RunOptions, WarmStartRole};
pub use run::{CompletedRun, RunContext, run_scenario};
pub use warm_start::latest_stop;
