//! Checks that an FMU state, as it is or turned into bytes and back, continues where it was taken.

use fmu_import::Version;

use super::Rank::BreaksStandard;
use super::call_order::{InitializationMode, Instantiated, StepComplete, Terminated, bring_to};
use super::test_driver::{STEPS, TestDriver};
use super::{BOTH, Check, Rule, RuleError, RuleResult, not_applicable};

pub(super) const RULES: &[Rule] = &[
    Rule {
        name: "state-restore",
        rank: BreaksStandard,
        sentence: "a restored state continues with the same bits",
        versions: BOTH,
        check: Check::RunsOne(restore),
    },
    Rule {
        name: "state-serialise",
        rank: BreaksStandard,
        sentence: "a state continues with the same bits after it was bytes",
        versions: BOTH,
        check: Check::RunsOne(serialise),
    },
    Rule {
        name: "state-anywhere",
        rank: BreaksStandard,
        sentence: "a state can be taken and restored in every state of an instance",
        versions: BOTH,
        check: Check::Runs(anywhere),
    },
    Rule {
        name: "state-after-error",
        rank: BreaksStandard,
        sentence: "a state from before an error makes good again",
        versions: BOTH,
        check: Check::RunsOne(after_error),
    },
];

/// What follows `canGetAnd` in the name of the flag.
fn state_flag(driver: &TestDriver) -> &'static str {
    match driver.version() {
        Version::Two => "SetFMUstate",
        Version::Three => "SetFMUState",
    }
}

fn restore(driver: &TestDriver) -> RuleResult {
    if !driver.about().state {
        return not_applicable(format!("canGetAnd{} is not set", state_flag(driver)));
    }
    let mut instance = driver.ready()?;
    driver.run_all(&mut instance)?;
    let taken = driver.row(&mut instance, driver.time(STEPS.into()))?;
    driver.note_call("GetFMUState");
    let state = instance.save()?;
    let expected = driver.run(&mut instance, STEPS..2 * STEPS, 0)?;
    // Twice: a state that is used up by the first time would pass otherwise.
    for _ in 0..2 {
        driver.note_call("SetFMUState");
        instance.restore(&state)?;
        let restored = driver.row(&mut instance, taken.time)?;
        driver.same(std::slice::from_ref(&taken), &[restored])?;
        driver.same(&expected, &driver.run(&mut instance, STEPS..2 * STEPS, 0)?)?;
    }
    driver.note_call("FreeFMUState");
    instance.forget(state)?;
    Ok(String::new())
}

fn serialise(driver: &TestDriver) -> RuleResult {
    if !driver.about().serialised_state {
        return not_applicable(match driver.version() {
            Version::Two => "canSerializeFMUstate is not set",
            Version::Three => "canSerializeFMUState is not set",
        });
    }
    let mut instance = driver.ready()?;
    driver.run_all(&mut instance)?;
    driver.note_call("GetFMUState");
    let state = instance.save()?;
    driver.note_call("SerializeFMUState");
    let bytes = instance.serialise(&state)?;
    driver.note_call("FreeFMUState");
    instance.forget(state)?;
    // The bytes may bring the state back.
    instance.keep_history(true);
    let expected = driver.run(&mut instance, STEPS..2 * STEPS, 0)?;
    driver.note_call("DeserializeFMUState");
    let state = instance.deserialise(&bytes)?;
    driver.note_call("SetFMUState");
    instance.restore(&state)?;
    instance.forget(state)?;
    driver.same(&expected, &driver.run(&mut instance, STEPS..2 * STEPS, 0)?)?;
    Ok(format!("{} bytes", bytes.len()))
}

/// A state can be taken, taken again, restored and freed wherever FMI 2.0 (table 4.2.4) and FMI 3.0 (section 2.3.1) allow it, and the life of
/// the instance goes on as if nothing had happened.
fn anywhere(driver: &TestDriver) -> RuleResult {
    if !driver.about().state {
        return not_applicable(format!("canGetAnd{} is not set", state_flag(driver)));
    }
    let expected = driver.run(&mut driver.ready()?, 0..STEPS, 0)?;
    for at in [Instantiated, InitializationMode, StepComplete, Terminated] {
        let mut instance = bring_to(driver, at)?;
        let name = at.name(driver.version());
        driver.note(&format!("taking, restoring and freeing a state in {name}"));
        let mut there_and_back = || {
            let mut state = instance.save()?;
            instance.save_into(&mut state)?;
            instance.restore(&state)?;
            instance.forget(state)?;
            instance.free_no_state()
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
        driver.same(&expected, &driver.run(&mut instance, 0..STEPS, 0)?)?;
    }
    Ok(String::new())
}

/// After an error a master may try an older state (FMI 2.0, section 2.1.3; FMI 3.0, section 2.3.1). An FMU may refuse to take
/// it; one that takes it must go on from there.
fn after_error(driver: &TestDriver) -> RuleResult {
    if !driver.about().state {
        return not_applicable(format!("canGetAnd{} is not set", state_flag(driver)));
    }
    let mut instance = driver.ready()?;
    driver.run_all(&mut instance)?;
    let state = instance.save()?;
    let expected = driver.run(&mut instance, STEPS..2 * STEPS, 0)?;
    let call = driver.fmi("ExitInitializationMode");
    driver.note(&format!("{call} at a communication point"));
    if instance.exit_initialization().is_ok() {
        return not_applicable("the illegal call that should fail is accepted");
    }
    driver.note("reading the outputs after an error");
    let _ = driver.row(&mut instance, driver.time((2 * STEPS).into()));
    if instance.is_lost() {
        return driver.fatal();
    }
    driver.note("restoring a state after an error");
    if let Err(error) = instance.restore(&state) {
        return Ok(format!("warning: {} {}, so only a reset helps", error.call, error.what));
    }
    let found = driver.run(&mut instance, STEPS..2 * STEPS, 0).map_err(|error| {
        RuleError::Violated(format!(
            "{} {}, with a state from before an error",
            error.call, error.what
        ))
    })?;
    driver.same(&expected, &found)?;
    instance.forget(state)?;
    Ok(String::new())
}
