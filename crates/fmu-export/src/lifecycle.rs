//! Lists the FMI functions that each state of an instance allows: table 4.2.4 of FMI 2.0.

/// The state of a co-simulation instance.
///
/// An FMU that does not step asynchronously never is in the states `stepInProgress` and `stepCanceled`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub enum State {
    /// After `fmi2Instantiate` or `fmi2Reset`.
    Instantiated = 1,
    /// Between entering and leaving initialisation.
    Initialization = 2,
    /// At a communication point.
    StepComplete = 4,
    /// After a discarded step.
    StepFailed = 8,
    /// After `fmi2Terminate`.
    Terminated = 16,
    /// After an error, until a reset or the restoration of an older FMU state.
    Error = 32,
    /// After a panic, for ever.
    Fatal = 64,
}

use State::{Error, Initialization, Instantiated, StepComplete, StepFailed, Terminated};

/// A group of C functions that the same states allow.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Call {
    /// `fmi2SetDebugLogging`.
    SetDebugLogging,
    /// `fmi2Reset`.
    Reset,
    /// `fmi2SetupExperiment`.
    SetupExperiment,
    /// `fmi2EnterInitializationMode`.
    EnterInitializationMode,
    /// `fmi2ExitInitializationMode`.
    ExitInitializationMode,
    /// `fmi2Terminate`.
    Terminate,
    /// `fmi2GetReal` and its siblings.
    Get,
    /// `fmi2SetReal` and its siblings; the instance decides for each variable.
    Set,
    /// `fmi2GetFMUstate`, `fmi2SetFMUstate`, `fmi2FreeFMUstate` and the serialisation of them.
    FmuState,
    /// `fmi2GetDirectionalDerivative`.
    GetDirectionalDerivative,
    /// `fmi2SetRealInputDerivatives`.
    SetRealInputDerivatives,
    /// `fmi2GetRealOutputDerivatives`.
    GetRealOutputDerivatives,
    /// `fmi2DoStep`.
    DoStep,
    /// `fmi2CancelStep`.
    CancelStep,
    /// `fmi2GetStatus` and its siblings.
    GetStatus,
}

const fn mask(states: &[State]) -> u8 {
    let (mut mask, mut i) = (0, 0);
    while i < states.len() {
        mask |= states[i] as u8;
        i += 1;
    }
    mask
}

const ALIVE: &[State] =
    &[Instantiated, Initialization, StepComplete, StepFailed, Terminated, Error];
const STEPPED: &[State] = &[StepComplete, StepFailed, Terminated, Error];

impl Call {
    /// Whether the call is legal in `state`.
    pub fn allowed(self, state: State) -> bool {
        let states = match self {
            Call::SetDebugLogging | Call::Reset | Call::FmuState => const { mask(ALIVE) },
            Call::SetupExperiment | Call::EnterInitializationMode => {
                const { mask(&[Instantiated]) }
            }
            Call::ExitInitializationMode => const { mask(&[Initialization]) },
            Call::Terminate => const { mask(&[StepComplete, StepFailed]) },
            Call::Get | Call::GetDirectionalDerivative => {
                const { mask(STEPPED) | Initialization as u8 }
            }
            Call::Set | Call::SetRealInputDerivatives => {
                const { mask(&[Instantiated, Initialization, StepComplete]) }
            }
            Call::GetRealOutputDerivatives => const { mask(STEPPED) },
            Call::DoStep => const { mask(&[StepComplete]) },
            Call::CancelStep => 0,
            Call::GetStatus => const { mask(&[StepComplete, StepFailed, Terminated]) },
        };
        states & state as u8 != 0
    }
}
