//! The messages between a host and the process of an FMU: requests and their responses. Numbers travel beside them.

use std::ops::Range;
use std::time::Duration;

use fmu_import::{FmuLocation, FmuMessage};
use serde::{Deserialize, Serialize};

use crate::clock::CommunicationClock;
use crate::node::refusal::FmuRefusal;
use crate::node::{ExperimentSetup, InputPolynomial};
use crate::system::{StartValue, VariableGroups};

/// What the node is made of.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct IsolatedNodeSetup {
    pub name: String,
    pub fmu: FmuLocation,
    pub log: bool,
    pub inputs: VariableGroups,
    pub outputs: VariableGroups,
    pub experiment: ExperimentSetup,
    pub starts: Vec<StartValue>,
    /// Without one, it is in no sandbox.
    pub sandbox: Option<isolation::Sandbox>,
}

/// Inputs or outputs, besides the numbers.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub(super) struct NonNumericValues {
    pub integers: Vec<i128>,
    pub texts: Vec<String>,
    /// Of inputs that change within a step.
    pub extrapolation: Option<StepPolynomials>,
}

/// The polynomials of inputs in a step between two times [s].
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct StepPolynomials {
    pub polynomials: Vec<InputPolynomial>,
    pub span: Range<f64>,
}

/// What the node is to do: first it drops states, then it takes inputs, then comes the command.
#[derive(Debug, Serialize, Deserialize)]
pub(super) struct GuestRequest {
    /// States by number.
    pub dropped: Vec<u64>,
    pub inputs: Option<NonNumericValues>,
    pub command: GuestCommand,
}

#[derive(Debug, Serialize, Deserialize)]
pub(super) enum GuestCommand {
    Open(Box<IsolatedNodeSetup>),
    EnterInitialization,
    ExitInitialization,
    /// To the communication point after this one.
    DoStep(CommunicationClock, u64),
    GetOutputs,
    Terminate,
    Save,
    Restore(u64),
    /// Other values between two steps at a time [s].
    Tune(Vec<StartValue>, f64),
    /// Wait for a time [s], or crash.
    Wait(f64),
    Crash,
    Serialise(u64),
    Deserialise(Vec<u8>),
    /// How the outputs change with these changes of the inputs.
    DirectionalDerivatives(Vec<f64>),
    /// The process ends.
    Exit,
}

/// What the node did.
#[derive(Debug, Serialize, Deserialize)]
pub(super) struct GuestResponse {
    pub outcome: Result<GuestCommandOutcome, FmuRefusal>,
    pub messages: Vec<FmuMessage>,
    /// How long it took.
    pub duration: Duration,
}

#[derive(Debug, Serialize, Deserialize)]
pub(super) enum GuestCommandOutcome {
    /// Nothing more to say.
    Done,
    /// What the node can do, and what its sandbox lacks.
    Opened { can_save: bool, takes_input_derivatives: bool, lacks: Vec<String> },
    /// What it did not keep of what it was told.
    Initialized(Vec<String>),
    /// Its outputs.
    Outputs(NonNumericValues),
    /// A state by its number.
    State(u64),
    /// A state.
    Bytes(Vec<u8>),
    /// Changes of the outputs, if the FMU says them.
    Derivatives(Option<Vec<f64>>),
}
