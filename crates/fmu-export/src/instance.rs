//! Runs one instance of a model under the rules of FMI 2.0, without pointers.

use std::ffi::CString;

mod direction;
mod slope;

use serde::{Deserialize, Serialize};

use crate::abi::Status;
use crate::lifecycle::{Call, State};
use crate::model::{Model, ModelError};
use crate::value::Value;
use crate::variable::{Access, Causality, Initial, Kind, Row, Variability, Variable};
use slope::Slope;

/// How far the communication point may be from the end of the last step, as a share of the step:
/// masters that add up time are off by rounding, a master that skips a step is off by a whole one.
const TIME_TOLERANCE: f64 = 1e-6;
/// Steps that differ by less than this share are the same step: masters that compute it as the
/// difference of two times are off by rounding, and a car at its limit would turn that into another lap.
const STEP_TOLERANCE: f64 = 1e-9;

/// Failure of a call: the status that it returns, and the message for the log.
#[derive(Debug)]
pub(crate) struct FmiError {
    pub status: Status,
    pub message: String,
}

pub(crate) type FmiResult<T = ()> = Result<T, FmiError>;

/// Fails a call without harm to the instance.
pub(crate) fn reject<T>(message: impl Into<String>) -> FmiResult<T> {
    Err(FmiError { status: Status::Error, message: message.into() })
}

/// Everything that an FMU state restores.
#[derive(Clone, Serialize, Deserialize)]
#[serde(bound = "")]
pub(crate) struct Snapshot<M: Model> {
    model: M,
    state: State,
    /// `fmi2SetupExperiment` was called.
    set_up: bool,
    /// Inputs or parameters were written after the outputs were computed.
    stale: bool,
    /// The end of the last step, or the start time [s].
    now: f64,
    /// The size of the last step, or the model's preferred one [s].
    step: f64,
    stop: Option<f64>,
    terminated: bool,
    slopes: Vec<Slope>,
}

impl<M: Model> Snapshot<M> {
    /// The variable that shows the time.
    const TIME: Option<&'static Variable<M>> = {
        let (rows, mut i) = (M::VARIABLES, 0);
        while i < rows.len() && !matches!(rows[i].row.causality, Causality::Independent) {
            i += 1;
        }
        if i < rows.len() { Some(&rows[i]) } else { None }
    };

    /// Rejects a state that no instance can have been in: bytes may come from anywhere.
    pub fn check(&self) -> FmiResult {
        self.slopes.iter().try_for_each(Slope::check::<M>)
    }

    fn compute_outputs(&mut self) {
        if let Some(Variable { access: Access::Real(at), .. }) = Self::TIME {
            *at(&mut self.model) = self.now;
        }
        self.model.outputs();
        self.stale = false;
    }
}

/// An instance: the model with its state of the FMI state machine, and the texts that importers read.
pub(crate) struct Instance<M: Model> {
    current: Snapshot<M>,
    /// The texts that the last `fmi2GetString` handed out; the importer holds their addresses.
    pub strings: Vec<CString>,
}

impl<M: Model> Instance<M> {
    pub fn new() -> Self {
        let current = Snapshot {
            model: M::default(),
            state: State::Instantiated,
            set_up: false,
            stale: true,
            now: 0.0,
            step: M::INFO.step,
            stop: None,
            terminated: false,
            slopes: Vec::new(),
        };
        Instance { current, strings: Vec::new() }
    }

    /// Rejects a call that the state of the instance does not allow.
    pub fn check(&self, call: Call) -> FmiResult {
        let Snapshot { state, set_up, .. } = self.current;
        if !call.allowed(state) {
            return reject(format!("{call:?} is not allowed in the state {state:?}"));
        }
        if call == Call::EnterInitializationMode && !set_up {
            return reject("EnterInitializationMode is not allowed before SetupExperiment");
        }
        Ok(())
    }

    pub fn fail(&mut self, status: Status) {
        self.current.state = match status {
            Status::Error => State::Error,
            Status::Fatal => State::Fatal,
            _ => self.current.state,
        };
    }

    pub fn reset(&mut self) {
        self.current = Self::new().current;
    }

    pub fn setup_experiment(&mut self, start: f64, stop: Option<f64>) -> FmiResult {
        if !start.is_finite() || stop.is_some_and(|stop| stop <= start || stop.is_nan()) {
            return reject(format!(
                "start time {start} and stop time {stop:?} do not make an interval"
            ));
        }
        let current = &mut self.current;
        (current.now, current.stop, current.set_up) = (start, stop, true);
        Ok(())
    }

    pub fn enter_initialization(&mut self) {
        self.current.state = State::Initialization;
        self.current.stale = true;
    }

    pub fn exit_initialization(&mut self) -> FmiResult {
        self.refresh()?;
        self.current.state = State::StepComplete;
        Ok(())
    }

    pub fn terminate(&mut self) {
        self.current.state = State::Terminated;
    }

    /// Computes the outputs again after inputs or parameters were written.
    pub fn refresh(&mut self) -> FmiResult {
        let Snapshot { model, state, stale, .. } = &mut self.current;
        if *stale && matches!(state, State::Initialization | State::StepComplete) {
            if *state == State::Initialization {
                model.initialise().map_err(|error| FmiError {
                    status: Status::Error,
                    message: format!("initialisation failed: {error}"),
                })?;
            }
            self.current.compute_outputs();
        }
        Ok(())
    }

    pub fn do_step(&mut self, time: f64, step: f64) -> FmiResult {
        self.check_step(time, step)?;
        let current = &mut self.current;
        if (step - current.step).abs() > STEP_TOLERANCE * step {
            current.step = step;
        }
        let step = current.step;
        let before = current.model.clone();
        let (state, status, message) = match current.advance(time, step) {
            Ok(()) => {
                // They refer to the beginning of this step (FMI 2.0, section 4.2.2).
                current.slopes.clear();
                current.now = time + step;
                current.compute_outputs();
                return Ok(());
            }
            Err(ModelError::Error(message)) => (State::Error, Status::Error, message),
            Err(ModelError::Discard(message)) => (State::StepFailed, Status::Discard, message),
            Err(ModelError::Terminated(message)) => {
                current.terminated = true;
                (State::StepFailed, Status::Discard, message)
            }
        };
        current.model = before;
        current.state = state;
        Err(FmiError { status, message: format!("step of {step} s from {time} s: {message}") })
    }

    fn check_step(&self, time: f64, step: f64) -> FmiResult {
        let Snapshot { now, stop, .. } = self.current;
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

    pub fn last_successful_time(&self) -> f64 {
        self.current.now
    }

    pub fn terminated(&self) -> bool {
        self.current.terminated
    }

    pub fn last_step(&self) -> Status {
        if self.current.state == State::StepFailed { Status::Discard } else { Status::Ok }
    }

    pub fn snapshot(&self) -> Snapshot<M> {
        self.current.clone()
    }

    pub fn restore(&mut self, snapshot: &Snapshot<M>) {
        self.current = snapshot.clone();
    }

    /// Reads the variable with the given reference; [`Instance::refresh`] comes first.
    pub fn get<T: Value>(&mut self, reference: u32) -> FmiResult<T> {
        let variable = variable::<M>(reference)?;
        match T::read(&variable.access, &mut self.current.model) {
            Some(value) => Ok(value),
            None => other_type(variable, T::KIND),
        }
    }

    /// Writes variables: all of them, or none when one cannot be written.
    pub fn set<T: Value>(&mut self, references: &[u32], values: &[T]) -> FmiResult {
        for (reference, value) in references.iter().zip(values) {
            self.check_set(variable::<M>(*reference)?, value)?;
        }
        for (reference, value) in references.iter().zip(values) {
            value.write(&variable::<M>(*reference)?.access, &mut self.current.model);
            self.current.stale = true;
            self.current.slopes.retain(|slope| slope.reference != *reference);
        }
        Ok(())
    }

    fn check_set<T: Value>(&self, variable: &Variable<M>, value: &T) -> FmiResult {
        let (Variable { row, access }, state) = (variable, self.current.state);
        if access.kind() != T::KIND {
            return other_type(variable, T::KIND);
        }
        if !writable(row, state) {
            return reject(format!(
                "{} is {:?} {:?} and cannot be set in the state {state:?}",
                row.name, row.variability, row.causality
            ));
        }
        // Inputs come from other models, whose transients may leave the limits.
        if row.causality == Causality::Parameter
            && let Some(number) = value.number()
        {
            let (min, max) =
                (row.min.unwrap_or(f64::NEG_INFINITY), row.max.unwrap_or(f64::INFINITY));
            if !(min..=max).contains(&number) {
                return reject(format!("{} = {number} is outside of {min} .. {max}", row.name));
            }
        }
        Ok(())
    }
}

fn variable<M: Model>(reference: u32) -> FmiResult<&'static Variable<M>> {
    M::VARIABLES.get(reference as usize).ok_or_else(|| FmiError {
        status: Status::Error,
        message: format!("no variable has the value reference {reference}"),
    })
}

/// The accessor of a real variable.
fn real<M: Model>(reference: u32) -> Option<fn(&mut M) -> &mut f64> {
    match M::VARIABLES.get(reference as usize)?.access {
        Access::Real(at) => Some(at),
        _ => None,
    }
}

fn other_type<M, T>(Variable { row, access }: &Variable<M>, expected: Kind) -> FmiResult<T> {
    reject(format!("{} is of type {:?}, not {expected:?}", row.name, access.kind()))
}

/// Whether a variable may be written in a state: the notes below table 4.2.4 of FMI 2.0.
fn writable(row: &Row, state: State) -> bool {
    let input = row.causality == Causality::Input;
    let constant = row.variability == Variability::Constant;
    match state {
        State::Instantiated => row.has_start() && !constant,
        State::Initialization => input || row.initial == Some(Initial::Exact) && !constant,
        State::StepComplete => input || is_tunable(row),
        _ => false,
    }
}

fn is_tunable(row: &Row) -> bool {
    row.causality == Causality::Parameter && row.variability == Variability::Tunable
}
