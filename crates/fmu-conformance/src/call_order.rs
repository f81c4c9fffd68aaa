//! Checks that calls that the state machine forbids are refused and do no harm.

use std::collections::BTreeMap;

use fmu_import::{CallError, Causality, Instance, Version};

use super::Rank::NotRobust;
use super::derivative::{directional, output_slopes};
use super::test_driver::{FAR, Row, STEPS, TestDriver, read, set_start};
use super::{BOTH, Check, Rule, RuleError, RuleResult, violated};

pub(super) const RULES: &[Rule] = &[Rule {
    name: "call-order",
    rank: NotRobust,
    sentence: "illegal calls are refused, and a reset makes good again",
    versions: BOTH,
    check: Check::Runs(call_order),
}];

/// A state that every master can bring every FMU to (FMI 2.0, section 4.2.4; FMI 3.0, section 4.2.1), by its name in FMI 2.0.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum State {
    Instantiated,
    InitializationMode,
    StepComplete,
    Terminated,
}

pub(super) use State::{InitializationMode, Instantiated, StepComplete, Terminated};

pub(super) const STATES: [State; 4] = [Instantiated, InitializationMode, StepComplete, Terminated];

impl State {
    /// Its name in a version of FMI.
    pub(super) fn name(self, version: Version) -> String {
        match (self, version) {
            (StepComplete, Version::Three) => "StepMode".to_owned(),
            _ => format!("{self:?}"),
        }
    }
}

type Call = fn(&TestDriver, &mut Instance) -> Result<(), CallError>;

/// A call by its name in FMI 3.0, and the states in which FMI 2.0 and FMI 3.0 forbid it; none where a version has no such call or
/// allows it everywhere.
type CallRow = (&'static str, Call, &'static [State], &'static [State]);

#[rustfmt::skip]
/// By table 4.2.4 of FMI 2.0, and sections 2.3 and 4.2.1 of FMI 3.0. Event mode is not used.
const ILLEGAL: &[CallRow] = &[
    ("SetupExperiment", setup, &[InitializationMode, StepComplete, Terminated], &[]),
    ("EnterConfigurationMode", |_, instance| instance.enter_configuration(), &[], &[InitializationMode, Terminated]),
    ("ExitConfigurationMode", |_, instance| instance.exit_configuration(), &[], &STATES),
    ("EnterInitializationMode", |_, instance| instance.enter_initialization(), &[InitializationMode, StepComplete, Terminated], &[InitializationMode, StepComplete, Terminated]),
    ("ExitInitializationMode", |_, instance| instance.exit_initialization(), &[Instantiated, StepComplete, Terminated], &[Instantiated, StepComplete, Terminated]),
    ("EnterEventMode", |_, instance| instance.enter_event_mode(), &[], &STATES),
    ("UpdateDiscreteStates", |_, instance| instance.update_discrete_states(0.0).map(drop), &[], &STATES),
    ("EnterStepMode", |_, instance| instance.enter_step_mode(), &[], &[Instantiated, StepComplete, Terminated]),
    ("Terminate", |_, instance| instance.terminate(), &[Instantiated, InitializationMode, Terminated], &[Instantiated, InitializationMode, Terminated]),
    ("DoStep", step, &[Instantiated, InitializationMode, Terminated], &[Instantiated, InitializationMode, Terminated]),
    ("CancelStep", |_, instance| instance.cancel_step(), &STATES, &[]),
    ("reading a variable", get, &[Instantiated], &[]),
    ("setting a variable", set, &[Terminated], &[Terminated]),
    ("GetDirectionalDerivative", derivative, &[Instantiated], &[Instantiated]),
    ("SetRealInputDerivatives", slope, &[Terminated], &[]),
    ("GetRealOutputDerivatives", output_slope, &[Instantiated, InitializationMode], &[]),
    ("GetOutputDerivatives", output_slope, &[], &[Instantiated, InitializationMode]),
    ("GetStatus", |_, instance| instance.status().map(drop), &[Instantiated, InitializationMode], &[]),
    ("GetRealStatus", |_, instance| instance.last_successful_time().map(drop), &[Instantiated, InitializationMode], &[]),
    ("GetBooleanStatus", |_, instance| instance.terminated_status().map(drop), &[Instantiated, InitializationMode], &[]),
];

/// The calls that the FMU's version forbids in the state.
fn illegal(driver: &TestDriver, state: State) -> impl Iterator<Item = (String, Call)> {
    let two = driver.version() == Version::Two;
    let rows = ILLEGAL.iter().filter(move |row| if two { row.2 } else { row.3 }.contains(&state));
    rows.map(|(name, call, ..)| match name.contains(' ') {
        true => ((*name).to_owned(), *call),
        false => (driver.fmi(name), *call),
    })
}

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
    variable.map_or_else(none, |variable| set_start(driver, instance, variable))
}

/// What an FMU does not claim to do may end in any way, so it is not tried.
fn derivative(driver: &TestDriver, instance: &mut Instance) -> Result<(), CallError> {
    let [inputs, outputs] =
        [Causality::Input, Causality::Output].map(|it| driver.continuous(it).next());
    match inputs.zip(outputs).filter(|_| driver.about().directional_derivative) {
        Some((input, output)) => directional(instance, output, input).map(drop),
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
    output.map_or_else(none, |output| output_slopes(instance, output).map(drop))
}

/// Nothing can be called, so nothing illegal can be accepted.
fn none() -> Result<(), CallError> {
    Err(CallError::new("none", ""))
}

pub(super) fn call_order(driver: &TestDriver) -> RuleResult {
    let mut count = 0;
    // By what went wrong, the calls with which it did: an FMU that looks at nothing fails with most.
    let mut wrong: BTreeMap<String, Vec<String>> = BTreeMap::new();
    'all: for state in STATES {
        let expected = after_reset(driver, bring_to(driver, state)?)?;
        for (name, call) in illegal(driver, state) {
            count += 1;
            if let Some((what, detail)) = attempt(driver, state, &name, call, &expected)? {
                let state = state.name(driver.version());
                wrong.entry(what).or_default().push(format!("{name} in {state}{detail}"));
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
        false => violated(lines.join("; ")),
    }
}

/// Makes the illegal call in the state, and says what is wrong with what came of it.
fn attempt(
    driver: &TestDriver,
    state: State,
    name: &str,
    call: Call,
    expected: &[Row],
) -> Result<Option<(String, String)>, CallError> {
    let mut instance = bring_to(driver, state)?;
    let state = state.name(driver.version());
    driver.note(&format!("{name} in {state}"));
    if call(driver, &mut instance).is_ok() {
        return Ok(Some((driver.instead("success"), String::new())));
    }
    if instance.is_lost() {
        return Ok(Some((driver.instead(&driver.fmi("Fatal")), String::new())));
    }
    driver.note(&format!("a reset and a run after {name} in {state}"));
    let same = after_reset(driver, instance).and_then(|found| driver.same(expected, &found));
    Ok(match same {
        Err(RuleError::Violated(what)) => {
            Some(("a reset does not make good".to_owned(), format!(" ({what})")))
        }
        _ => None,
    })
}

/// A fresh instance in the state.
pub(super) fn bring_to(driver: &TestDriver, state: State) -> Result<Instance, CallError> {
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
) -> Result<Vec<Row>, RuleError> {
    instance.reset()?;
    driver.initialise(&mut instance)?;
    Ok(driver.run(&mut instance, 0..STEPS / 4, 0)?)
}
