//! Checks that calls that the state machine forbids are refused and do no harm.

use std::collections::BTreeMap;

use fmu_import::{CallError, Causality, FmiVersion, Instance};

use super::RuleSeverity::NotRobust;
use super::derivative::{element_directional_derivative, output_time_derivatives};
use super::test_driver::{FAR, OutputRow, STEPS, TestDriver, read_variable, set_start};
use super::{BOTH, ConformanceRule, RuleCheck, RuleError, RuleResult, violated_rule};

pub(super) const RULES: &[ConformanceRule] = &[ConformanceRule {
    name: "call-order",
    rank: NotRobust,
    sentence: "illegal calls are refused, and a reset makes good again",
    versions: BOTH,
    check: RuleCheck::Runs(call_order),
}];

/// A state that every master can bring every FMU to (FMI 2.0, section 4.2.4; FMI 3.0, section 4.2.1), by its name in FMI 2.0.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum InstanceState {
    Instantiated,
    InitializationMode,
    StepComplete,
    Terminated,
}

pub(super) use InstanceState::{InitializationMode, Instantiated, StepComplete, Terminated};

pub(super) const STATES: [InstanceState; 4] = [Instantiated, InitializationMode, StepComplete, Terminated];

impl InstanceState {
    /// Its name in a version of FMI.
    pub(super) fn fmi_state_name(self, version: FmiVersion) -> String {
        match (self, version) {
            (StepComplete, FmiVersion::Three) => "StepMode".to_owned(),
            _ => format!("{self:?}"),
        }
    }
}

type TestCall = fn(&TestDriver, &mut Instance) -> Result<(), CallError>;

/// A call by its name in FMI 3.0, and the states in which FMI 2.0 and FMI 3.0 forbid it; none where a version has no such call or
/// allows it everywhere.
type CallRow = (&'static str, TestCall, &'static [InstanceState], &'static [InstanceState]);

#[rustfmt::skip]
/// By table 4.2.4 of FMI 2.0, and sections 2.3 and 4.2.1 of FMI 3.0. Event mode is not used.
const ILLEGAL: &[CallRow] = &[
    ("SetupExperiment", call_setup_experiment, &[InitializationMode, StepComplete, Terminated], &[]),
    ("EnterConfigurationMode", |_, instance| instance.enter_configuration(), &[], &[InitializationMode, Terminated]),
    ("ExitConfigurationMode", |_, instance| instance.exit_configuration(), &[], &STATES),
    ("EnterInitializationMode", |_, instance| instance.enter_initialization(), &[InitializationMode, StepComplete, Terminated], &[InitializationMode, StepComplete, Terminated]),
    ("ExitInitializationMode", |_, instance| instance.exit_initialization(), &[Instantiated, StepComplete, Terminated], &[Instantiated, StepComplete, Terminated]),
    ("EnterEventMode", |_, instance| instance.enter_event_mode(), &[], &STATES),
    ("UpdateDiscreteStates", |_, instance| instance.update_discrete_states(0.0).map(drop), &[], &STATES),
    ("EnterStepMode", |_, instance| instance.enter_step_mode(), &[], &[Instantiated, StepComplete, Terminated]),
    ("Terminate", |_, instance| instance.terminate(), &[Instantiated, InitializationMode, Terminated], &[Instantiated, InitializationMode, Terminated]),
    ("DoStep", call_do_step, &[Instantiated, InitializationMode, Terminated], &[Instantiated, InitializationMode, Terminated]),
    ("CancelStep", |_, instance| instance.cancel_step(), &STATES, &[]),
    ("reading a variable", call_get_variable, &[Instantiated], &[]),
    ("setting a variable", call_set_variable, &[Terminated], &[Terminated]),
    ("GetDirectionalDerivative", call_directional_derivative, &[Instantiated], &[Instantiated]),
    ("SetRealInputDerivatives", call_set_input_derivative, &[Terminated], &[]),
    ("GetRealOutputDerivatives", call_output_derivative, &[Instantiated, InitializationMode], &[]),
    ("GetOutputDerivatives", call_output_derivative, &[], &[Instantiated, InitializationMode]),
    ("GetStatus", |_, instance| instance.last_step_status().map(drop), &[Instantiated, InitializationMode], &[]),
    ("GetRealStatus", |_, instance| instance.last_successful_time().map(drop), &[Instantiated, InitializationMode], &[]),
    ("GetBooleanStatus", |_, instance| instance.has_ended_simulation().map(drop), &[Instantiated, InitializationMode], &[]),
];

/// The calls that the FMU's version forbids in the state.
fn illegal_calls(driver: &TestDriver, state: InstanceState) -> impl Iterator<Item = (String, TestCall)> {
    let two = driver.fmi_version() == FmiVersion::Two;
    let rows = ILLEGAL.iter().filter(move |row| if two { row.2 } else { row.3 }.contains(&state));
    rows.map(|(name, call, ..)| match name.contains(' ') {
        true => ((*name).to_owned(), *call),
        false => (driver.fmi_name(name), *call),
    })
}

fn call_setup_experiment(driver: &TestDriver, instance: &mut Instance) -> Result<(), CallError> {
    driver.set_up(instance, FAR)
}

/// A step that would be right if the state were.
fn call_do_step(driver: &TestDriver, instance: &mut Instance) -> Result<(), CallError> {
    instance.step(driver.tick_time(0.0), driver.step_size())
}

/// Whether there is a variable for the call that reads one: the first output, or else any.
fn call_get_variable(driver: &TestDriver, instance: &mut Instance) -> Result<(), CallError> {
    let variable =
        driver.variables_with_causality(Causality::Output).next().or(driver.description().variables.first());
    variable.map_or_else(no_call_possible, |variable| read_variable(instance, variable).map(drop))
}

/// Sets an input, or else a parameter, to its start value.
fn call_set_variable(driver: &TestDriver, instance: &mut Instance) -> Result<(), CallError> {
    let mut settable = driver
        .variables_with_causality(Causality::Input)
        .chain(driver.variables_with_causality(Causality::Parameter));
    let variable = settable.find(|variable| variable.start.is_some());
    variable.map_or_else(no_call_possible, |variable| set_start(driver, instance, variable))
}

/// What an FMU does not claim to do may end in any way, so it is not tried.
fn call_directional_derivative(driver: &TestDriver, instance: &mut Instance) -> Result<(), CallError> {
    let [inputs, outputs] =
        [Causality::Input, Causality::Output].map(|it| driver.continuous_variables(it).next());
    match inputs.zip(outputs).filter(|_| driver.description().directional_derivative) {
        Some((input, output)) => element_directional_derivative(instance, output, input).map(drop),
        None => no_call_possible(),
    }
}

fn call_set_input_derivative(driver: &TestDriver, instance: &mut Instance) -> Result<(), CallError> {
    let input = driver.continuous_variables(Causality::Input).next();
    let input = input.filter(|_| driver.description().interpolated_inputs);
    input.map_or_else(no_call_possible, |input| instance.set_input_derivative(input.reference, 1, 0.0))
}

fn call_output_derivative(driver: &TestDriver, instance: &mut Instance) -> Result<(), CallError> {
    let output = driver.continuous_variables(Causality::Output).next();
    let output = output.filter(|_| driver.description().output_derivatives > 0);
    output.map_or_else(no_call_possible, |output| output_time_derivatives(instance, output, 1).map(drop))
}

/// Nothing can be called, so nothing illegal can be accepted.
fn no_call_possible() -> Result<(), CallError> {
    Err(CallError::new("none", ""))
}

pub(super) fn call_order(driver: &TestDriver) -> RuleResult {
    let mut count = 0;
    // By what went wrong, the calls with which it did: an FMU that looks at nothing fails with most.
    let mut wrong: BTreeMap<String, Vec<String>> = BTreeMap::new();
    'all: for state in STATES {
        let expected = after_reset(driver, instance_in_state(driver, state)?)?;
        for (name, call) in illegal_calls(driver, state) {
            count += 1;
            if let Some((what, detail)) = try_illegal_call(driver, state, &name, call, &expected)? {
                let state = state.fmi_state_name(driver.fmi_version());
                wrong.entry(what).or_default().push(format!("{name} in {state}{detail}"));
            }
            // After fmi2Fatal nothing can be tried any more.
            if driver.library.has_failed_fatally() {
                break 'all;
            }
        }
    }
    let lines: Vec<_> = wrong.iter().map(|(what, calls)| format!("{what}: {}", calls.join(", "))).collect();
    match wrong.is_empty() {
        true => Ok(format!("{count} calls")),
        false => violated_rule(lines.join("; ")),
    }
}

/// Makes the illegal call in the state, and says what is wrong with what came of it.
fn try_illegal_call(
    driver: &TestDriver,
    state: InstanceState,
    name: &str,
    call: TestCall,
    expected: &[OutputRow],
) -> Result<Option<(String, String)>, CallError> {
    let mut instance = instance_in_state(driver, state)?;
    let state = state.fmi_state_name(driver.fmi_version());
    driver.note_progress(&format!("{name} in {state}"));
    if call(driver, &mut instance).is_ok() {
        return Ok(Some((driver.unexpected_status("success"), String::new())));
    }
    if instance.has_failed_fatally() {
        return Ok(Some((driver.unexpected_status(&driver.fmi_name("Fatal")), String::new())));
    }
    driver.note_progress(&format!("a reset and a run after {name} in {state}"));
    let same = after_reset(driver, instance).and_then(|found| driver.require_equal_runs(expected, &found));
    Ok(match same {
        Err(RuleError::Violated(what)) => {
            Some(("a reset does not make good".to_owned(), format!(" ({what})")))
        }
        _ => None,
    })
}

/// A fresh instance in the state.
pub(super) fn instance_in_state(driver: &TestDriver, state: InstanceState) -> Result<Instance, CallError> {
    let mut instance = driver.new_instance()?;
    match state {
        Instantiated => {}
        InitializationMode => driver.enter_initialization(&mut instance)?,
        StepComplete | Terminated => driver.initialise(&mut instance)?,
    }
    if let Terminated = state {
        instance.terminate()?;
    }
    Ok(instance)
}

/// The run of an instance that is reset first: an illegal call may leave it in the state of error, which
/// only a reset ends.
pub(super) fn after_reset(driver: &TestDriver, mut instance: Instance) -> Result<Vec<OutputRow>, RuleError> {
    instance.reset()?;
    driver.initialise(&mut instance)?;
    Ok(driver.run_ticks(&mut instance, 0..STEPS / 4, 0)?)
}
