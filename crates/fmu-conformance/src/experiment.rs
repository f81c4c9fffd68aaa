//! Checks that an FMU accepts the experiment, and its stop time.

use super::RuleSeverity::{BreaksRuns, BreaksStandard, NotRobust};
use super::test_driver::{STEPS, TestDriver};
use super::{ALL, BOTH, ConformanceRule, RuleCheck, RuleError, RuleResult, TWO, violated_rule};

pub(super) const RULES: &[ConformanceRule] = &[
    ConformanceRule {
        name: "experiment",
        rank: BreaksStandard,
        sentence: "initialization needs an experiment",
        versions: TWO,
        check: RuleCheck::RunsOne(check_experiment_setup),
    },
    ConformanceRule {
        name: "whole-experiment",
        rank: BreaksRuns,
        sentence: "steps reach the announced stop time, and the simulation ends there",
        versions: ALL,
        check: RuleCheck::RunsOne(check_run_to_stop_time),
    },
    ConformanceRule {
        name: "stop-time",
        rank: NotRobust,
        sentence: "a step past the stop time is refused",
        versions: BOTH,
        check: RuleCheck::RunsOne(stop_time),
    },
];

/// FMI 2.0 asks masters to set up the experiment first, and FMUs for nothing.
fn check_experiment_setup(driver: &TestDriver) -> RuleResult {
    let mut instance = driver.new_instance()?;
    driver.note_progress("fmi2EnterInitializationMode without fmi2SetupExperiment");
    match instance.enter_initialization() {
        Ok(()) => Ok("warning: fmi2EnterInitializationMode was accepted without one".to_owned()),
        Err(_) if instance.has_failed_fatally() => driver.fatal_status_violation(),
        Err(_) => Ok(String::new()),
    }
}

/// The last step ends at the very stop time that was announced. An FMU may discard a step, but then a plain run does not get there.
fn check_run_to_stop_time(driver: &TestDriver) -> RuleResult {
    let mut instance = driver.new_instance()?;
    driver.set_up(&mut instance, STEPS.into())?;
    instance.enter_initialization()?;
    instance.exit_initialization()?;
    let rows = driver
        .run_ticks(&mut instance, 0..STEPS, 0)
        .map_err(|error| RuleError::Violated(error.to_string()))?;
    driver.note_call("Terminate");
    instance.terminate()?;
    Ok(format!("{} steps", rows.len()))
}

/// A step past the stop time that was set up must be refused (FMI 2.0, section 2.1.6; FMI 3.0, section 2.3.3).
fn stop_time(driver: &TestDriver) -> RuleResult {
    let mut instance = driver.new_instance()?;
    // Half a step apart, so that no rounding matters.
    let stop = f64::from(STEPS) + 0.5;
    driver.note_progress("announcing the stop time");
    driver.set_up(&mut instance, stop)?;
    let stop = driver.tick_time(stop);
    instance.enter_initialization()?;
    instance.exit_initialization()?;
    driver.run_to_end(&mut instance)?;
    let last = driver.tick_time(STEPS.into());
    match driver.do_step(&mut instance, last, driver.step_size()) {
        Ok(()) => violated_rule(format!(
            "{}: {} of {} s from t = {last} s, with {stop:.6} s as the stop time",
            driver.unexpected_status("success"),
            driver.fmi_name("DoStep"),
            driver.step_size()
        )),
        Err(_) if instance.has_failed_fatally() => driver.fatal_status_violation(),
        Err(_) => Ok(String::new()),
    }
}
