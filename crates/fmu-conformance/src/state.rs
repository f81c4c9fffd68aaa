//! Checks that an FMU state, as it is or turned into bytes and back, continues where it was taken.

use fmu_import::FmiVersion;

use super::RuleSeverity::BreaksStandard;
use super::call_order::{InitializationMode, Instantiated, StepComplete, Terminated, instance_in_state};
use super::test_driver::{STEPS, TestDriver};
use super::{BOTH, ConformanceRule, RuleCheck, RuleError, RuleResult, not_applicable};

pub(super) const RULES: &[ConformanceRule] = &[
    ConformanceRule {
        name: "state-restore",
        rank: BreaksStandard,
        sentence: "a restored state continues with the same bits",
        versions: BOTH,
        check: RuleCheck::RunsOne(check_restore),
    },
    ConformanceRule {
        name: "state-serialise",
        rank: BreaksStandard,
        sentence: "a state continues with the same bits after it was bytes",
        versions: BOTH,
        check: RuleCheck::RunsOne(check_serialised_state),
    },
    ConformanceRule {
        name: "state-anywhere",
        rank: BreaksStandard,
        sentence: "a state can be taken and restored in every state of an instance",
        versions: BOTH,
        check: RuleCheck::Runs(check_state_in_each_phase),
    },
    ConformanceRule {
        name: "state-after-error",
        rank: BreaksStandard,
        sentence: "a state from before an error makes good again",
        versions: BOTH,
        check: RuleCheck::RunsOne(after_error),
    },
];

/// What follows `canGetAnd` in the name of the flag.
fn state_flag(driver: &TestDriver) -> &'static str {
    match driver.fmi_version() {
        FmiVersion::One | FmiVersion::Two => "SetFMUstate",
        FmiVersion::Three => "SetFMUState",
    }
}

fn check_restore(driver: &TestDriver) -> RuleResult {
    if !driver.description().state {
        return not_applicable(format!("canGetAnd{} is not set", state_flag(driver)));
    }
    let mut instance = driver.initialised_instance()?;
    driver.run_to_end(&mut instance)?;
    let taken = driver.read_outputs(&mut instance, driver.tick_time(STEPS.into()))?;
    driver.note_call("GetFMUState");
    let state = instance.save_state()?;
    let expected = driver.run_ticks(&mut instance, STEPS..2 * STEPS, 0)?;
    // Twice: a state that is used up by the first time would pass otherwise.
    for _ in 0..2 {
        driver.note_call("SetFMUState");
        instance.restore_state(&state)?;
        let restored = driver.read_outputs(&mut instance, taken.time)?;
        driver.require_equal_runs(std::slice::from_ref(&taken), &[restored])?;
        driver.require_equal_runs(&expected, &driver.run_ticks(&mut instance, STEPS..2 * STEPS, 0)?)?;
    }
    driver.note_call("FreeFMUState");
    instance.free_saved_state(state)?;
    Ok(String::new())
}

fn check_serialised_state(driver: &TestDriver) -> RuleResult {
    if !driver.description().serialised_state {
        return not_applicable(match driver.fmi_version() {
            FmiVersion::One | FmiVersion::Two => "canSerializeFMUstate is not set",
            FmiVersion::Three => "canSerializeFMUState is not set",
        });
    }
    let mut instance = driver.initialised_instance()?;
    driver.run_to_end(&mut instance)?;
    driver.note_call("GetFMUState");
    let state = instance.save_state()?;
    driver.note_call("SerializeFMUState");
    let bytes = instance.serialise_state(&state)?;
    driver.note_call("FreeFMUState");
    instance.free_saved_state(state)?;
    // The bytes may bring the state back.
    instance.set_keeps_earlier_states(true);
    let expected = driver.run_ticks(&mut instance, STEPS..2 * STEPS, 0)?;
    driver.note_call("DeserializeFMUState");
    let state = instance.deserialise_state(&bytes)?;
    driver.note_call("SetFMUState");
    instance.restore_state(&state)?;
    instance.free_saved_state(state)?;
    driver.require_equal_runs(&expected, &driver.run_ticks(&mut instance, STEPS..2 * STEPS, 0)?)?;
    Ok(format!("{} bytes", bytes.len()))
}

/// A state can be taken, taken again, restored and freed wherever FMI 2.0 (table 4.2.4) and FMI 3.0 (section 2.3.1) allow it, and the life of
/// the instance goes on as if nothing had happened.
fn check_state_in_each_phase(driver: &TestDriver) -> RuleResult {
    if !driver.description().state {
        return not_applicable(format!("canGetAnd{} is not set", state_flag(driver)));
    }
    let expected = driver.run_ticks(&mut driver.initialised_instance()?, 0..STEPS, 0)?;
    for at in [Instantiated, InitializationMode, StepComplete, Terminated] {
        let mut instance = instance_in_state(driver, at)?;
        let name = at.fmi_state_name(driver.fmi_version());
        driver.note_progress(&format!("taking, restoring and freeing a state in {name}"));
        let mut there_and_back = || {
            let mut state = instance.save_state()?;
            instance.save_into(&mut state)?;
            instance.restore_state(&state)?;
            instance.free_saved_state(state)?;
            instance.free_null_state()
        };
        there_and_back().map_err(|mut error| {
            error.what += &format!(" in {name}");
            error
        })?;
        match at {
            Instantiated => driver.initialise(&mut instance)?,
            InitializationMode => instance.exit_initialization()?,
            StepComplete => {}
            Terminated => continue,
        }
        driver.require_equal_runs(&expected, &driver.run_ticks(&mut instance, 0..STEPS, 0)?)?;
    }
    Ok(String::new())
}

/// After an error a master may try an older state (FMI 2.0, section 2.1.3; FMI 3.0, section 2.3.1). An FMU may refuse to take
/// it; one that takes it must go on from there.
fn after_error(driver: &TestDriver) -> RuleResult {
    if !driver.description().state {
        return not_applicable(format!("canGetAnd{} is not set", state_flag(driver)));
    }
    let mut instance = driver.initialised_instance()?;
    driver.run_to_end(&mut instance)?;
    let state = instance.save_state()?;
    let expected = driver.run_ticks(&mut instance, STEPS..2 * STEPS, 0)?;
    let call = driver.fmi_name("ExitInitializationMode");
    driver.note_progress(&format!("{call} at a communication point"));
    if instance.exit_initialization().is_ok() {
        return not_applicable("the illegal call that should fail is accepted");
    }
    driver.note_progress("reading the outputs after an error");
    let _ = driver.read_outputs(&mut instance, driver.tick_time((2 * STEPS).into()));
    if instance.has_failed_fatally() {
        return driver.fatal_status_violation();
    }
    driver.note_progress("restoring a state after an error");
    if let Err(error) = instance.restore_state(&state) {
        return Ok(format!("warning: {} {}, so only a reset helps", error.call, error.what));
    }
    let found = driver.run_ticks(&mut instance, STEPS..2 * STEPS, 0).map_err(|error| {
        RuleError::Violated(format!("{} {}, with a state from before an error", error.call, error.what))
    })?;
    driver.require_equal_runs(&expected, &found)?;
    instance.free_saved_state(state)?;
    Ok(String::new())
}
