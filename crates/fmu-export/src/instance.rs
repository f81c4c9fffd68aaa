//! Runs one instance of a model under the rules of FMI 2.0, without any pointer in sight.

use std::ffi::CString;

use serde::{Deserialize, Serialize};

use crate::abi::Status;
use crate::lifecycle::{Call, State};
use crate::variable::{Access, Causality, Row, Variability, Variable};
use crate::{Model, ModelError};

/// How far the communication point may be from the end of the last step, as a share of the step:
/// masters that add up time are off by rounding, a master that skips a step is off by a whole one.
const TIME_TOLERANCE: f64 = 1e-6;
/// Steps that differ by less than this share are the same step: masters that compute it as the
/// difference of two times are off by rounding, and a car at its limit would turn that into another lap.
const STEP_TOLERANCE: f64 = 1e-9;

/// What a call could not do, and how bad that is.
#[derive(Debug)]
pub(crate) struct Refusal {
    pub status: Status,
    pub message: String,
}

pub(crate) type Outcome<T = ()> = Result<T, Refusal>;

/// Refuses the call and leaves the instance in the error state.
fn refuse<T>(message: impl Into<String>) -> Outcome<T> {
    Err(Refusal { status: Status::Error, message: message.into() })
}

/// Everything that an FMU state restores.
#[derive(Clone, Serialize, Deserialize)]
#[serde(bound = "")]
pub(crate) struct Snapshot<M: Model> {
    model: M,
    state: State,
    /// Inputs or parameters were written after the outputs were computed.
    stale: bool,
    /// The end of the last step, or the start time [s].
    now: f64,
    /// The size of the last step, or the model's preferred one [s].
    step: f64,
    stop: Option<f64>,
    terminated: bool,
}

/// An instance: the model, where it is in its life, and what its logger listens to.
pub(crate) struct Instance<M: Model> {
    current: Snapshot<M>,
    /// The texts that the last `fmi2GetString` handed out.
    pub strings: Vec<CString>,
}

impl<M: Model> Instance<M> {
    pub fn new() -> Self {
        let current = Snapshot {
            model: M::default(),
            state: State::Instantiated,
            stale: true,
            now: 0.0,
            step: M::INFO.step,
            stop: None,
            terminated: false,
        };
        Instance { current, strings: Vec::new() }
    }

    pub fn state(&self) -> State {
        self.current.state
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

    pub fn setup_experiment(&mut self, start: f64, stop: Option<f64>) -> Outcome {
        if !start.is_finite() || stop.is_some_and(|stop| stop <= start || stop.is_nan()) {
            return refuse(format!(
                "start time {start} and stop time {stop:?} do not make an interval"
            ));
        }
        self.current.now = start;
        self.current.stop = stop;
        Ok(())
    }

    pub fn enter_initialization(&mut self) {
        self.current.state = State::Initialization;
        self.current.stale = true;
    }

    pub fn exit_initialization(&mut self) -> Outcome {
        self.refresh()?;
        self.current.state = State::StepComplete;
        Ok(())
    }

    pub fn terminate(&mut self) {
        self.current.state = State::Terminated;
    }

    /// Makes the outputs fit the inputs and parameters that were written since they were computed.
    fn refresh(&mut self) -> Outcome {
        let Snapshot { model, state, stale, .. } = &mut self.current;
        if *stale && matches!(state, State::Initialization | State::StepComplete) {
            if *state == State::Initialization {
                model.initialise().map_err(|error| Refusal {
                    status: Status::Error,
                    message: format!("initialisation failed: {error}"),
                })?;
            }
            model.outputs();
            *stale = false;
        }
        Ok(())
    }

    pub fn do_step(&mut self, time: f64, step: f64) -> Outcome {
        let Snapshot { now, stop, .. } = self.current;
        if !(step > 0.0 && step.is_finite()) {
            return refuse(format!("communication step size {step} s is not positive"));
        }
        let tolerance = TIME_TOLERANCE * step;
        if time.is_nan() || (time - now).abs() > tolerance {
            return refuse(format!("expected communication point {now} s, found {time} s"));
        }
        if let Some(stop) = stop
            && time + step > stop + tolerance
        {
            return refuse(format!(
                "a step of {step} s from {time} s passes the stop time {stop} s"
            ));
        }
        let current = &mut self.current;
        if (step - current.step).abs() > STEP_TOLERANCE * step {
            current.step = step;
        }
        let step = current.step;
        let before = current.model.clone();
        let (state, status, message) = match current.model.step(time, step) {
            Ok(()) => {
                current.model.outputs();
                current.stale = false;
                current.now = time + step;
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
        Err(Refusal { status, message: format!("step of {step} s from {time} s: {message}") })
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

    /// Brings outputs up to date before they are read.
    pub fn prepare_get(&mut self) -> Outcome {
        self.refresh()
    }

    /// Reads the variable with the given reference through `read`, which picks the type.
    pub fn get<T>(
        &mut self,
        reference: u32,
        read: impl Fn(&Access<M>, &mut M) -> Option<T>,
    ) -> Outcome<T> {
        let Variable { row, access } = variable::<M>(reference)?;
        match read(access, &mut self.current.model) {
            Some(value) => Ok(value),
            None => refuse(format!("{} is of another type", row.name)),
        }
    }

    /// Writes the variable with the given reference through `write`, which picks the type;
    /// `number` is the value for the check of its limits.
    pub fn set(
        &mut self,
        reference: u32,
        number: Option<f64>,
        write: impl FnOnce(&Access<M>, &mut M) -> bool,
    ) -> Outcome {
        let Variable { row, access } = variable::<M>(reference)?;
        if !writable(row, self.current.state) {
            return refuse(format!(
                "{} is {:?} {:?} and cannot be set in the state {:?}",
                row.name, row.variability, row.causality, self.current.state
            ));
        }
        if row.causality == Causality::Parameter
            && let Some(number) = number
        {
            let (min, max) =
                (row.min.unwrap_or(f64::NEG_INFINITY), row.max.unwrap_or(f64::INFINITY));
            if !(min..=max).contains(&number) {
                return refuse(format!("{} = {number} is outside of {min} .. {max}", row.name));
            }
        }
        if !write(access, &mut self.current.model) {
            return refuse(format!("{} is of another type", row.name));
        }
        self.current.stale = true;
        Ok(())
    }
}

fn variable<M: Model>(reference: u32) -> Outcome<&'static Variable<M>> {
    M::VARIABLES.get(reference as usize).ok_or_else(|| Refusal {
        status: Status::Error,
        message: format!("no variable has the value reference {reference}"),
    })
}

/// Which variables may be written when: the notes below table 4.2.4 of FMI 2.0.
fn writable(row: &Row, state: State) -> bool {
    match state {
        State::Instantiated | State::Initialization => {
            row.has_start() && row.variability != Variability::Constant
        }
        State::StepComplete => {
            row.causality == Causality::Input
                || row.causality == Causality::Parameter && row.variability == Variability::Tunable
        }
        _ => false,
    }
}

impl<M: Model> Instance<M> {
    /// Refuses a call that the state of the instance does not allow.
    pub fn check(&self, call: Call) -> Outcome {
        let state = self.state();
        if call.allowed(state) {
            return Ok(());
        }
        refuse(format!("{call:?} is not allowed in the state {state:?}"))
    }
}
