//! Says what a node in a process of its own is asked, and what it answers. Numbers travel beside it.

use std::path::PathBuf;

use fmu_import::{FmuLocation, Message};
use scenario::plan::{Clock, Ports, Start};
use serde::{Deserialize, Serialize};

use crate::course::Course;
use crate::node::refusal::Refusal;

/// What the node is made of.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct Setup {
    pub name: String,
    pub fmu: FmuLocation,
    pub log: bool,
    pub inputs: Ports,
    pub outputs: Ports,
    /// The first communication point, and the stop time that is told [s].
    pub times: (f64, Option<f64>),
    pub tolerance: Option<f64>,
    pub starts: Vec<Start>,
    /// What may be read and written in its sandbox; without it there is none.
    pub sandbox: Option<(Vec<PathBuf>, Vec<PathBuf>)>,
}

/// Inputs or outputs, besides the numbers.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub(super) struct Others {
    pub integers: Vec<i128>,
    pub texts: Vec<String>,
    /// Of inputs: their courses in a step between two times [s].
    pub courses: Option<Courses>,
}

/// Courses by the places of their inputs, and begin and end of the step [s].
pub(super) type Courses = (Vec<(usize, Course)>, (f64, f64));

/// What the node is to do. What it is to forget comes first, then the inputs.
#[derive(Debug, Serialize, Deserialize)]
pub(super) struct Question {
    /// States by number.
    pub forget: Vec<u64>,
    pub inputs: Option<Others>,
    pub task: Task,
}

#[derive(Debug, Serialize, Deserialize)]
pub(super) enum Task {
    Open(Box<Setup>),
    Enter,
    Ready,
    /// To the communication point after this one.
    Step(Clock, u64),
    Show,
    End,
    Save,
    Restore(u64),
    /// Other values between two steps at a time [s].
    Tune(Vec<Start>, f64),
    /// Wait for a time [s], or crash.
    Wait(f64),
    Crash,
    Serialise(u64),
    Deserialise(Vec<u8>),
    /// How the outputs change with these changes of the inputs.
    Derivatives(Vec<f64>),
    /// The process ends.
    Leave,
}

/// What the node did.
#[derive(Debug, Serialize, Deserialize)]
pub(super) struct Answer {
    pub done: Result<Done, Refusal>,
    pub messages: Vec<Message>,
}

#[derive(Debug, Serialize, Deserialize)]
pub(super) enum Done {
    /// And that is all.
    Well,
    /// What the node can do with states and slopes, and what its sandbox lacks.
    Opened { save: bool, serialise: bool, slopes: bool, lacks: Vec<String> },
    /// What it did not keep of what it was told.
    Entered(Vec<String>),
    /// Its outputs.
    Shown(Others),
    /// A state by its number.
    State(u64),
    /// A state.
    Bytes(Vec<u8>),
    /// Changes of the outputs, if the FMU says them.
    Changes(Option<Vec<f64>>),
}
