//! Judges a run from its rows: checks end in verdicts, baselines compare it with recordings, and values are collected for sweeps.
#![forbid(unsafe_code)]

pub mod baseline;
pub mod check;
pub mod collected;

pub use baseline::{BaselinePlan, BaselineSignal, TubeSize};
pub use check::{CheckCondition, CheckPlan, ResultName, ResultSpace};
pub use collected::{CollectPlan, CollectedOrigin};
