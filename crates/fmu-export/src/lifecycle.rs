//! Defines the state machine of an instance: which calls each state allows (FMI 2.0, table 4.2.4), and its times.

use crate::abi::Status;
use crate::error::{FmiResult, reject};

/// The state of a co-simulation instance.
///
/// An FMU that does not step asynchronously never is in the states `stepInProgress` and `stepCanceled`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub enum LifecycleState {
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

use LifecycleState::{Error, Initialization, Instantiated, StepComplete, StepFailed, Terminated};

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

const fn state_mask(states: &[LifecycleState]) -> u8 {
    let (mut mask, mut i) = (0, 0);
    while i < states.len() {
        mask |= states[i] as u8;
        i += 1;
    }
    mask
}

const ALIVE: &[LifecycleState] = &[Instantiated, Initialization, StepComplete, StepFailed, Terminated, Error];
const STEPPED: &[LifecycleState] = &[StepComplete, StepFailed, Terminated, Error];

impl Call {
    /// Whether the call is legal in `state`.
    pub(crate) fn is_allowed_in(self, state: LifecycleState) -> bool {
        let states = match self {
            Call::SetDebugLogging | Call::Reset | Call::FmuState => const { state_mask(ALIVE) },
            Call::SetupExperiment | Call::EnterInitializationMode => const { state_mask(&[Instantiated]) },
            Call::ExitInitializationMode => const { state_mask(&[Initialization]) },
            Call::Terminate => const { state_mask(&[StepComplete, StepFailed]) },
            Call::Get | Call::GetDirectionalDerivative => {
                const { state_mask(STEPPED) | Initialization as u8 }
            }
            Call::Set | Call::SetRealInputDerivatives => {
                const { state_mask(&[Instantiated, Initialization, StepComplete]) }
            }
            Call::GetRealOutputDerivatives => const { state_mask(STEPPED) },
            Call::DoStep => const { state_mask(&[StepComplete]) },
            Call::CancelStep => 0,
            Call::GetStatus => const { state_mask(&[StepComplete, StepFailed, Terminated]) },
        };
        states & state as u8 != 0
    }
}

/// How far the communication point may be from the end of the last step, as a share of the step:
/// masters that add up time are off by rounding, a master that skips a step is off by a whole one.
const TIME_TOLERANCE: f64 = 1e-6;

/// Where an instance stands: the calls that FMI allows, and the time that it has reached.
#[derive(Debug, Clone, serde::Serialize, serde::Deserialize)]
pub struct Lifecycle {
    /// Its state.
    pub state: LifecycleState,
    /// `fmi2SetupExperiment` was called.
    set_up: bool,
    /// The end of the last step, or the start time [s].
    pub now: f64,
    /// Where the simulation stops, if the importer knows [s].
    pub stop: Option<f64>,
    /// Relative tolerance of the integration, if the importer has one [-].
    pub tolerance: Option<f64>,
    /// Whether the instance ended the simulation.
    pub terminated: bool,
}

impl Default for Lifecycle {
    fn default() -> Self {
        Lifecycle {
            state: Instantiated,
            set_up: false,
            now: 0.0,
            stop: None,
            tolerance: None,
            terminated: false,
        }
    }
}

impl Lifecycle {
    /// Rejects a call that the state of the instance does not allow.
    pub(crate) fn check_call(&self, call: Call) -> FmiResult {
        let state = self.state;
        if !call.is_allowed_in(state) {
            return reject(format!("{call:?} is not allowed in the state {state:?}"));
        }
        if call == Call::EnterInitializationMode && !self.set_up {
            return reject("EnterInitializationMode is not allowed before SetupExperiment");
        }
        Ok(())
    }

    /// Notes a failure that ends the life of the instance.
    pub fn record_failure(&mut self, status: Status) {
        self.state = match status {
            Status::Error => Error,
            Status::Fatal => LifecycleState::Fatal,
            _ => self.state,
        };
    }

    /// Notes the experiment.
    pub(crate) fn setup_experiment(
        &mut self,
        start: f64,
        stop: Option<f64>,
        tolerance: Option<f64>,
    ) -> FmiResult {
        if !start.is_finite() || stop.is_some_and(|stop| stop <= start || stop.is_nan()) {
            return reject(format!("start time {start} and stop time {stop:?} do not make an interval"));
        }
        *self = Lifecycle { now: start, stop, tolerance, set_up: true, ..self.clone() };
        Ok(())
    }

    /// Takes the stop time of another one that has an experiment.
    pub(crate) fn copy_stop_time(&mut self, other: &Lifecycle) {
        if other.set_up {
            self.stop = other.stop;
        }
    }

    /// Rejects a step that does not begin where the last one ended, or that passes the stop time.
    ///
    /// # Errors
    /// When it does so, or is not positive.
    pub fn check_step(&self, time: f64, step: f64) -> FmiResult {
        let Lifecycle { now, stop, .. } = *self;
        if !(step > 0.0 && step.is_finite()) {
            return reject(format!("communication step size {step} s is not positive"));
        }
        // Late in a long run with short steps the rounding of the time itself is the larger part.
        let tolerance = TIME_TOLERANCE * step + 4.0 * f64::EPSILON * now.abs();
        if time.is_nan() || (time - now).abs() > tolerance {
            return reject(format!("expected communication point {now} s, found {time} s"));
        }
        match stop {
            Some(stop) if time + step > stop + tolerance => {
                reject(format!("a step of {step} s from {time} s passes the stop time {stop} s"))
            }
            _ => Ok(()),
        }
    }

    /// The status of the last step.
    #[must_use]
    pub fn last_step(&self) -> Status {
        if self.state == StepFailed { Status::Discard } else { Status::Ok }
    }
}
