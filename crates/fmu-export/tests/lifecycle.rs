//! Calls every function in every state and compares with table 4.2.4 of FMI 2.0.
#![allow(unsafe_code, reason = "the functions under test are those of a C interface")]

mod support;

use std::ptr;

use fmu_export::abi::Status::{self, Discard, Error, Fatal, Ok as Fine};
use fmu_export::export::{self, Call};
use fmu_export::{Info, Model, ModelError, Variable, input, output, parameter};
use serde::{Deserialize, Serialize};
use support::said;

/// A model that fails as it is told to.
#[derive(Clone, Default, Serialize, Deserialize)]
struct Moody {
    u: f64,
    y: f64,
    mood: i32,
}

impl Model for Moody {
    const INFO: Info = Info::new("moody", "Fails as it is told to", 0.1);
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

type Slave = support::Slave<Moody>;

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
fn slave(state: State) -> Slave {
    let stepped = |mood: i32, expected: Status| {
        let slave = Slave::ready();
        assert_eq!(slave.set(0, 1.0), Fine);
        assert_eq!(slave.step(0.0, 1.0), Fine);
        assert_eq!(slave.set(2, mood), Fine);
        assert_eq!(slave.step(1.0, 1.0), expected);
        slave
    };
    match state {
        Instantiated => {
            let slave = Slave::new();
            assert_eq!(slave.setup(0.0, 10.0), Fine);
            slave
        }
        Initialization => Slave::initialising(),
        StepComplete => Slave::ready(),
        StepFailed => stepped(1, Discard),
        Failed => stepped(2, Error),
        State::Fatal => stepped(3, Fatal),
        Terminated => {
            let slave = stepped(0, Fine);
            assert_eq!(slave.proceed(Call::Terminate), Fine);
            slave
        }
    }
}

/// A name, the states that allow it, and the call.
type Row = (&'static str, &'static [State], fn(&Slave) -> Status);

const ALIVE: &[State] =
    &[Instantiated, Initialization, StepComplete, StepFailed, Terminated, Failed];
const READABLE: &[State] = &[Initialization, StepComplete, StepFailed, Terminated, Failed];

fn status<T>(result: Result<T, Status>) -> Status {
    result.err().unwrap_or(Fine)
}

const TABLE: &[Row] = &[
    ("SetDebugLogging", ALIVE, |s| unsafe {
        export::set_debug_logging::<Moody>(s.0, 0, 0, ptr::null())
    }),
    ("Reset", ALIVE, |s| s.proceed(Call::Reset)),
    ("SetupExperiment", &[Instantiated], |s| s.setup(0.0, 10.0)),
    ("EnterInitializationMode", &[Instantiated], |s| s.proceed(Call::EnterInitializationMode)),
    ("ExitInitializationMode", &[Initialization], |s| s.proceed(Call::ExitInitializationMode)),
    ("Terminate", &[StepComplete, StepFailed], |s| s.proceed(Call::Terminate)),
    ("GetReal", READABLE, |s| status(s.get(1))),
    ("GetInteger", READABLE, |s| status(s.get_as(2, 0))),
    ("SetReal", &[Instantiated, Initialization, StepComplete], |s| s.set(0, 1.0)),
    ("SetInteger", &[Instantiated, Initialization, StepComplete], |s| s.set(2, 0)),
    ("GetFMUstate, SetFMUstate, FreeFMUstate", ALIVE, |s| match s.state() {
        Ok(state) => s.restore(state).max(s.free(state)),
        Err(status) => status,
    }),
    ("SetRealInputDerivatives", &[Instantiated, Initialization, StepComplete], |s| {
        s.slope(0, 1, 1.0)
    }),
    ("DoStep", &[StepComplete], |s| s.step(0.0, 1.0)),
    ("CancelStep", &[], |s| s.proceed(Call::CancelStep)),
    ("GetRealStatus, GetBooleanStatus", &[StepComplete, StepFailed, Terminated], |s| {
        status(s.last())
    }),
    // Not supported, and refused in every state.
    ("GetDirectionalDerivative", &[], |s| status(s.derivative(&[1], &[0], &[1.0]))),
    ("GetRealOutputDerivatives", &[], |s| unsafe {
        let call = Call::GetRealOutputDerivatives;
        export::unsupported::<Moody>(s.0, call, "an output derivative")
    }),
];

#[test]
fn every_function_is_allowed_where_the_standard_allows_it() {
    for (name, allowed, call) in TABLE {
        for state in STATES {
            let legal = allowed.iter().any(|other| *other as u8 == state as u8);
            let expected = if legal { Fine } else { Error };
            let slave = slave(state);
            assert_eq!(call(&slave), expected, "{name} in {state:?}: {}", said());
        }
    }
}

#[test]
fn an_illegal_call_changes_nothing() {
    for state in STATES {
        for (name, allowed, call) in TABLE {
            let legal = allowed.iter().any(|other| *other as u8 == state as u8);
            if legal || matches!(state, State::Fatal) {
                continue;
            }
            let slave = slave(state);
            let bytes = |slave: &Slave| {
                let state = slave.state().expect("a state");
                let bytes = slave.bytes(state);
                slave.free(state);
                bytes
            };
            let before = bytes(&slave);
            assert_eq!(call(&slave), Error);
            assert_eq!(bytes(&slave), before, "{name} in {state:?}");
        }
    }
}

#[test]
fn initialisation_needs_an_experiment() {
    let slave = Slave::new();
    assert_eq!(slave.proceed(Call::EnterInitializationMode), Error);
    assert!(said().contains("SetupExperiment"));
    assert_eq!(slave.setup(0.0, 1.0), Fine);
    assert_eq!(slave.proceed(Call::EnterInitializationMode), Fine);
    assert_eq!(slave.proceed(Call::Reset), Fine);
    assert_eq!(slave.proceed(Call::EnterInitializationMode), Error, "a reset forgets it");
}

#[test]
fn after_an_error_values_can_be_looked_at_and_a_state_brought_back() {
    let slave = Slave::ready();
    let state = slave.state().expect("a state");
    slave.set(0, 3.0);
    slave.set(2, 2);
    assert_eq!(slave.step(0.0, 1.0), Error);
    assert!(said().contains("100 % no %n"), "{}", said());
    assert_eq!(slave.get(1), Ok(0.0), "the values of the last step that was done");
    assert_eq!(slave.restore(state), Fine);
    assert_eq!(slave.step(0.0, 1.0), Fine);
    slave.free(state);
}

#[test]
fn a_panic_is_told_and_ends_one_instance_only() {
    let other = Slave::ready();
    let slave = slave(State::Fatal);
    assert!(said().contains("the model panicked: at 3 %s"), "{}", said());
    assert_eq!(slave.get(1), Err(Error));
    assert_eq!(other.step(0.0, 1.0), Fine);
}

#[test]
fn short_steps_late_in_a_long_run_are_understood() {
    let slave = Slave::new();
    let start = 1e9;
    assert_eq!(slave.setup(start, 2e9), Fine);
    slave.proceed(Call::EnterInitializationMode);
    slave.proceed(Call::ExitInitializationMode);
    for k in 0..1000 {
        assert_eq!(slave.step(start + f64::from(k) * 1e-3, 1e-3), Fine, "{}", said());
    }
}
