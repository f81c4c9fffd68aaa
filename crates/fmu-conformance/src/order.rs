//! Checks that calls outside of their states are refused and do no harm.

use std::collections::BTreeMap;

use fmu_import::{CallError, Causality, Instance};

use super::Rank::NotRobust;
use super::test_driver::{FAR, Row, STEPS, TestDriver, read, set_start};
use super::{Check, Objection, Rule, Verdict, broken};

pub(super) const RULES: &[Rule] = &[Rule {
    name: "call-order",
    rank: NotRobust,
    sentence: "illegal calls are refused, and a reset makes good again",
    check: Check::Runs(call_order),
}];

/// A state of table 4.2.4 of FMI 2.0 that every master can bring every FMU to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum State {
    Instantiated,
    InitializationMode,
    StepComplete,
    Terminated,
}

pub(super) use State::{InitializationMode, Instantiated, StepComplete, Terminated};

type Call = fn(&TestDriver, &mut Instance) -> Result<(), CallError>;

#[rustfmt::skip]
/// The calls, and the states in which each of them is illegal by table 4.2.4.
const ILLEGAL: &[(&str, Call, &[State])] = &[
    ("fmi2SetupExperiment", setup, &[InitializationMode, StepComplete, Terminated]),
    ("fmi2EnterInitializationMode", |_, instance| instance.enter_initialization(), &[InitializationMode, StepComplete, Terminated]),
    ("fmi2ExitInitializationMode", |_, instance| instance.exit_initialization(), &[Instantiated, StepComplete, Terminated]),
    ("fmi2Terminate", |_, instance| instance.terminate(), &[Instantiated, InitializationMode, Terminated]),
    ("fmi2DoStep", step, &[Instantiated, InitializationMode, Terminated]),
    ("fmi2CancelStep", |_, instance| instance.cancel_step(), &[Instantiated, InitializationMode, StepComplete, Terminated]),
    ("reading a variable", get, &[Instantiated]),
    ("setting a variable", set, &[Terminated]),
    ("fmi2GetDirectionalDerivative", derivative, &[Instantiated]),
    ("fmi2SetRealInputDerivatives", slope, &[Terminated]),
    ("fmi2GetRealOutputDerivatives", output_slope, &[Instantiated, InitializationMode]),
    ("fmi2GetStatus", |_, instance| instance.status().map(drop), &[Instantiated, InitializationMode]),
    ("fmi2GetRealStatus", |_, instance| instance.last_successful_time().map(drop), &[Instantiated, InitializationMode]),
    ("fmi2GetBooleanStatus", |_, instance| instance.ended().map(drop), &[Instantiated, InitializationMode]),
];

fn setup(driver: &TestDriver, instance: &mut Instance) -> Result<(), CallError> {
    driver.set_up(instance, FAR)
}

/// A step that would be right if the state were.
fn step(driver: &TestDriver, instance: &mut Instance) -> Result<(), CallError> {
    instance.step(driver.time(0.0), driver.step())
}

/// Whether there is a variable for the call that reads one: the first output, or else any.
fn get(driver: &TestDriver, instance: &mut Instance) -> Result<(), CallError> {
    let variable = driver.with(Causality::Output).next().or(driver.about().variables.first());
    variable.map_or_else(none, |variable| read(instance, variable).map(drop))
}

/// Sets an input, or else a parameter, to its start value.
fn set(driver: &TestDriver, instance: &mut Instance) -> Result<(), CallError> {
    let mut settable = driver.with(Causality::Input).chain(driver.with(Causality::Parameter));
    let variable = settable.find(|variable| variable.start.is_some());
    variable.map_or_else(none, |variable| set_start(instance, variable))
}

/// What an FMU does not claim to do may end in any way, so it is not tried.
fn derivative(driver: &TestDriver, instance: &mut Instance) -> Result<(), CallError> {
    let [inputs, outputs] =
        [Causality::Input, Causality::Output].map(|it| driver.continuous(it).next());
    match inputs.zip(outputs).filter(|_| driver.about().directional_derivative) {
        Some((input, output)) => instance.derivative(output.reference, input.reference).map(drop),
        None => none(),
    }
}

fn slope(driver: &TestDriver, instance: &mut Instance) -> Result<(), CallError> {
    let input = driver.continuous(Causality::Input).next();
    let input = input.filter(|_| driver.about().interpolated_inputs);
    input.map_or_else(none, |input| instance.set_input_derivative(input.reference, 1, 0.0))
}

fn output_slope(driver: &TestDriver, instance: &mut Instance) -> Result<(), CallError> {
    let output = driver.continuous(Causality::Output).next();
    let output = output.filter(|_| driver.about().output_derivatives > 0);
    output.map_or_else(none, |output| instance.output_derivative(output.reference, 1).map(drop))
}

/// Nothing can be called, so nothing illegal can be accepted.
fn none() -> Result<(), CallError> {
    Err(CallError::new("none", ""))
}

pub(super) fn call_order(driver: &TestDriver) -> Verdict {
    let mut count = 0;
    // By what went wrong, the calls with which it did: an FMU that looks at nothing fails with most.
    let mut wrong: BTreeMap<&str, Vec<String>> = BTreeMap::new();
    'all: for state in [Instantiated, InitializationMode, StepComplete, Terminated] {
        let expected = after_reset(driver, bring(driver, state)?)?;
        for (name, call, _) in ILLEGAL.iter().filter(|(.., states)| states.contains(&state)) {
            count += 1;
            if let Some((what, detail)) = attempt(driver, state, (name, *call), &expected)? {
                wrong.entry(what).or_default().push(format!("{name} in {state:?}{detail}"));
            }
            // After fmi2Fatal nothing can be tried any more.
            if driver.library.is_lost() {
                break 'all;
            }
        }
    }
    let lines: Vec<_> =
        wrong.iter().map(|(what, calls)| format!("{what}: {}", calls.join(", "))).collect();
    match wrong.is_empty() {
        true => Ok(format!("{count} calls")),
        false => broken(lines.join("; ")),
    }
}

/// Makes the illegal call in the state, and says what is wrong with what came of it.
fn attempt(
    driver: &TestDriver,
    state: State,
    (name, call): (&str, Call),
    expected: &[Row],
) -> Result<Option<(&'static str, String)>, CallError> {
    let mut instance = bring(driver, state)?;
    driver.note(&format!("{name} in {state:?}"));
    if call(driver, &mut instance).is_ok() {
        return Ok(Some(("expected fmi2Error, found success", String::new())));
    }
    if instance.is_lost() {
        return Ok(Some(("expected fmi2Error, found fmi2Fatal", String::new())));
    }
    driver.note(&format!("a reset and a run after {name} in {state:?}"));
    let same = after_reset(driver, instance).and_then(|found| driver.same(expected, &found));
    Ok(match same {
        Err(Objection::Broken(what)) => Some(("a reset does not make good", format!(" ({what})"))),
        _ => None,
    })
}

/// A fresh instance in the state.
pub(super) fn bring(driver: &TestDriver, state: State) -> Result<Instance, CallError> {
    let mut instance = driver.instance()?;
    match state {
        Instantiated => {}
        InitializationMode => driver.enter(&mut instance)?,
        StepComplete | Terminated => driver.initialise(&mut instance)?,
    }
    if let Terminated = state {
        instance.terminate()?;
    }
    Ok(instance)
}

/// The run of an instance that is reset first: an illegal call may leave it in the state of error, which
/// only a reset ends.
pub(super) fn after_reset(
    driver: &TestDriver,
    mut instance: Instance,
) -> Result<Vec<Row>, Objection> {
    instance.reset()?;
    driver.initialise(&mut instance)?;
    Ok(driver.run(&mut instance, 0..STEPS / 4, 0)?)
}
