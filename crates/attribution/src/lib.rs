//! Explains why two runs differ: what differs between their inputs, where their values part, and which difference is the cause, found by
//! repeating the runs with some differences swapped.
#![forbid(unsafe_code)]

mod archive_comparison;
mod check_comparison;
mod check_evaluation;
mod difference;
mod experiment;
mod explanation;
mod file_comparison;
mod key_figure;
mod number_pair;
mod page;
mod pictures;
mod reference_outputs;
mod run_inputs;
mod spread_graph;
mod text;
mod toml_difference;
mod trajectory;

pub use check_comparison::{CheckComparison, CheckPart, FlipCause};
pub use difference::{Difference, DifferenceKind};
pub use experiment::{ExperimentOptions, LocalDeviation};
pub use explanation::{Cause, CauseEffect, Explanation, RunSummary, SpreadArrow, explain_difference};
pub use key_figure::KeyFigure;
pub use page::{DATA, PAGE};
pub use run_inputs::{
    ARCHIVE, RecordedCheck, RecordedRun, RunInputs, is_blessed_recording, save_baseline_inputs,
    save_run_inputs,
};
pub use trajectory::{SignalDeviation, SignalName, Trajectory, TrajectoryComparison};
