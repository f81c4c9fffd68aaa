//! Calls every function in every state and compares with table 4.2.4 of FMI 2.0.
#![allow(unsafe_code, reason = "the functions under test are those of a C interface")]

use std::ptr;

use crate::support::last_message;
use fmu_export::abi::Status::{self, Discard, Error, Fatal, Ok as Fine};
use fmu_export::export::{self, Call};
use fmu_export::{Info, Instance, Model, ModelError, Variable, input, output, parameter};
use serde::{Deserialize, Serialize};

/// A model whose parameter `mood` makes it fail.
#[derive(Clone, Default, Serialize, Deserialize)]
struct Moody {
    u: f64,
    y: f64,
    mood: i32,
}

impl Model for Moody {
    const INFO: Info = Info::new("moody", "Fails on demand", 0.1);
    const VARIABLES: &'static [Variable<Self>] = &[
        input("u", "1", "Input").at(|s| &mut s.u),
        output("y", "1", "Sum").depends_on(&[]).at(|s| &mut s.y),
        parameter("mood", "", "How a step ends").tunable().at_integer(|s| &mut s.mood),
    ];

    fn step(&mut self, _time: f64, _step: f64) -> Result<(), ModelError> {
        self.y += self.u;
        match self.mood {
            0 => Ok(()),
            1 => Err(ModelError::Discard("no".to_owned())),
            2 => Err(ModelError::Error("100 % no %n".to_owned())),
            _ => panic!("at {} %s", self.mood),
        }
    }
}

type TestInstance = crate::support::TestInstance<Moody>;

#[derive(Debug, Clone, Copy)]
enum State {
    Instantiated,
    Initialization,
    StepComplete,
    StepFailed,
    Terminated,
    Failed,
    Fatal,
}

use State::{Failed, Initialization, Instantiated, StepComplete, StepFailed, Terminated};

const STATES: [State; 7] =
    [Instantiated, Initialization, StepComplete, StepFailed, Terminated, Failed, State::Fatal];

/// A new instance in a state.
fn instance(state: State) -> TestInstance {
    let stepped = |mood: i32, expected: Status| {
        let instance = TestInstance::ready();
        assert_eq!(instance.set(0, 1.0), Fine);
        assert_eq!(instance.step(0.0, 1.0), Fine);
        assert_eq!(instance.set(2, mood), Fine);
        assert_eq!(instance.step(1.0, 1.0), expected);
        instance
    };
    match state {
        Instantiated => {
            let instance = TestInstance::new();
            assert_eq!(instance.setup(0.0, 10.0), Fine);
            instance
        }
        Initialization => TestInstance::initialising(),
        StepComplete => TestInstance::ready(),
        StepFailed => stepped(1, Discard),
        Failed => stepped(2, Error),
        State::Fatal => stepped(3, Fatal),
        Terminated => {
            let instance = stepped(0, Fine);
            assert_eq!(instance.change_state(Call::Terminate), Fine);
            instance
        }
    }
}

/// A name, the states that allow it, and the call.
type Row = (&'static str, &'static [State], fn(&TestInstance) -> Status);

const ALIVE: &[State] = &[Instantiated, Initialization, StepComplete, StepFailed, Terminated, Failed];
const READABLE: &[State] = &[Initialization, StepComplete, StepFailed, Terminated, Failed];

fn status<T>(result: Result<T, Status>) -> Status {
    result.err().unwrap_or(Fine)
}

const TABLE: &[Row] = &[
    ("SetDebugLogging", ALIVE, |s| unsafe {
        export::set_debug_logging::<Instance<Moody>>(s.0, 0, 0, ptr::null())
    }),
    ("Reset", ALIVE, |s| s.change_state(Call::Reset)),
    ("SetupExperiment", &[Instantiated], |s| s.setup(0.0, 10.0)),
    ("EnterInitializationMode", &[Instantiated], |s| s.change_state(Call::EnterInitializationMode)),
    ("ExitInitializationMode", &[Initialization], |s| s.change_state(Call::ExitInitializationMode)),
    ("Terminate", &[StepComplete, StepFailed], |s| s.change_state(Call::Terminate)),
    ("GetReal", READABLE, |s| status(s.get(1))),
    ("GetInteger", READABLE, |s| status(s.get_as(2, 0))),
    ("SetReal", &[Instantiated, Initialization, StepComplete], |s| s.set(0, 1.0)),
    ("SetInteger", &[Instantiated, Initialization, StepComplete], |s| s.set(2, 0)),
    ("GetFMUstate, SetFMUstate, FreeFMUstate", ALIVE, |s| match s.state() {
        Ok(state) => s.restore(state).max(s.free(state)),
        Err(status) => status,
    }),
    ("SetRealInputDerivatives", &[Instantiated, Initialization, StepComplete], |s| s.slope(0, 1, 1.0)),
    ("DoStep", &[StepComplete], |s| s.step(0.0, 1.0)),
    ("CancelStep", &[], |s| s.change_state(Call::CancelStep)),
    ("GetRealStatus, GetBooleanStatus", &[StepComplete, StepFailed, Terminated], |s| status(s.last())),
    // Not supported, and rejected in every state.
    ("GetDirectionalDerivative", &[], |s| status(s.derivative(&[1], &[0], &[1.0]))),
    ("GetRealOutputDerivatives", &[], |s| unsafe {
        let call = Call::GetRealOutputDerivatives;
        export::unsupported::<Instance<Moody>>(s.0, call, "an output derivative")
    }),
];

fn every_function_is_allowed_where_the_standard_allows_it() {
    for (name, allowed, call) in TABLE {
        for state in STATES {
            let legal = allowed.iter().any(|other| *other as u8 == state as u8);
            let expected = if legal { Fine } else { Error };
            let instance = instance(state);
            assert_eq!(call(&instance), expected, "{name} in {state:?}: {}", last_message());
        }
    }
}

fn an_illegal_call_changes_nothing() {
    for state in STATES {
        for (name, allowed, call) in TABLE {
            let legal = allowed.iter().any(|other| *other as u8 == state as u8);
            if legal || matches!(state, State::Fatal) {
                continue;
            }
            let instance = instance(state);
            let bytes = |instance: &TestInstance| {
                let state = instance.state().expect("a state");
                let bytes = instance.bytes(state);
                instance.free(state);
                bytes
            };
            let before = bytes(&instance);
            assert_eq!(call(&instance), Error);
            assert_eq!(bytes(&instance), before, "{name} in {state:?}");
        }
    }
}

fn initialisation_needs_an_experiment() {
    let instance = TestInstance::new();
    assert_eq!(instance.change_state(Call::EnterInitializationMode), Error);
    assert!(last_message().contains("SetupExperiment"));
    assert_eq!(instance.setup(0.0, 1.0), Fine);
    assert_eq!(instance.change_state(Call::EnterInitializationMode), Fine);
    assert_eq!(instance.change_state(Call::Reset), Fine);
    assert_eq!(instance.change_state(Call::EnterInitializationMode), Error, "a reset forgets it");
}

fn after_an_error_values_can_be_looked_at_and_a_state_brought_back() {
    let instance = TestInstance::ready();
    let state = instance.state().expect("a state");
    instance.set(0, 3.0);
    instance.set(2, 2);
    assert_eq!(instance.step(0.0, 1.0), Error);
    assert!(last_message().contains("100 % no %n"), "{}", last_message());
    assert_eq!(instance.get(1), Ok(0.0), "the values of the last step that was done");
    assert_eq!(instance.restore(state), Fine);
    assert_eq!(instance.step(0.0, 1.0), Fine);
    instance.free(state);
}

/// Its importer knows how long the run is, not the one that the state comes from.
fn a_state_of_a_shorter_run_goes_on_until_the_stop_time_of_its_instance() {
    let short = TestInstance::new();
    assert_eq!(short.setup(0.0, 1.0), Fine);
    assert_eq!(short.change_state(Call::EnterInitializationMode), Fine);
    assert_eq!(short.change_state(Call::ExitInitializationMode), Fine);
    assert_eq!((short.set(0, 3.0), short.step(0.0, 1.0)), (Fine, Fine));
    let state = short.state().expect("a state");
    let long = TestInstance::ready();
    let copy = long.state_of(&short.bytes(state)).expect("a state");
    assert_eq!(long.restore(copy), Fine);
    assert_eq!((long.step(1.0, 1.0), long.get(1)), (Fine, Ok(6.0)));
    long.free(copy);
    // What has no experiment of its own takes that of the state.
    let new = TestInstance::new();
    let copy = new.state_of(&short.bytes(state)).expect("a state");
    assert_eq!(new.restore(copy), Fine);
    assert_eq!(new.step(1.0, 1.0), Error);
    assert!(last_message().contains("passes the stop time 1 s"), "{}", last_message());
    new.free(copy);
    short.free(state);
}

fn a_panic_is_reported_and_ends_one_instance_only() {
    let other = TestInstance::ready();
    let instance = instance(State::Fatal);
    assert!(last_message().contains("the model panicked: at 3 %s"), "{}", last_message());
    assert_eq!(instance.get(1), Err(Error));
    assert_eq!(other.step(0.0, 1.0), Fine);
}

fn short_steps_late_in_a_long_run_are_understood() {
    let instance = TestInstance::new();
    let start = 1e9;
    assert_eq!(instance.setup(start, 2e9), Fine);
    instance.change_state(Call::EnterInitializationMode);
    instance.change_state(Call::ExitInitializationMode);
    for k in 0..1000 {
        assert_eq!(instance.step(start + f64::from(k) * 1e-3, 1e-3), Fine, "{}", last_message());
    }
}

crate::tests![
    every_function_is_allowed_where_the_standard_allows_it,
    an_illegal_call_changes_nothing,
    initialisation_needs_an_experiment,
    after_an_error_values_can_be_looked_at_and_a_state_brought_back,
    a_state_of_a_shorter_run_goes_on_until_the_stop_time_of_its_instance,
    a_panic_is_reported_and_ends_one_instance_only,
    short_steps_late_in_a_long_run_are_understood,
];
