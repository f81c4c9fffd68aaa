//! Checks that an FMU accepts the experiment, and its stop time.

use super::Rank::{BreaksRuns, BreaksStandard, NotRobust};
use super::test_driver::{STEPS, TestDriver};
use super::{BOTH, Check, Rule, RuleResult, TWO, violated};

pub(super) const RULES: &[Rule] = &[
    Rule {
        name: "experiment",
        rank: BreaksStandard,
        sentence: "initialization needs an experiment",
        versions: TWO,
        check: Check::RunsOne(experiment),
    },
    Rule {
        name: "whole-experiment",
        rank: BreaksRuns,
        sentence: "steps reach the announced stop time, and the simulation ends there",
        versions: BOTH,
        check: Check::RunsOne(whole),
    },
    Rule {
        name: "stop-time",
        rank: NotRobust,
        sentence: "a step past the stop time is refused",
        versions: BOTH,
        check: Check::RunsOne(stop_time),
    },
];

/// FMI 2.0 asks masters to set up the experiment first, and FMUs for nothing.
fn experiment(driver: &TestDriver) -> RuleResult {
    let mut instance = driver.instance()?;
    driver.note("fmi2EnterInitializationMode without fmi2SetupExperiment");
    match instance.enter_initialization() {
        Ok(()) => Ok("warning: fmi2EnterInitializationMode was accepted without one".to_owned()),
        Err(_) if instance.is_lost() => driver.fatal(),
        Err(_) => Ok(String::new()),
    }
}

/// The last step ends at the very stop time that was announced.
fn whole(driver: &TestDriver) -> RuleResult {
    let mut instance = driver.instance()?;
    driver.set_up(&mut instance, STEPS.into())?;
    instance.enter_initialization()?;
    instance.exit_initialization()?;
    let rows = driver.run(&mut instance, 0..STEPS, 0)?;
    driver.note_call("Terminate");
    instance.terminate()?;
    Ok(format!("{} steps", rows.len()))
}

/// A step past the stop time that was set up must be refused (FMI 2.0, section 2.1.6; FMI 3.0, section 2.3.3).
fn stop_time(driver: &TestDriver) -> RuleResult {
    let mut instance = driver.instance()?;
    // Half a step apart, so that no rounding matters.
    let stop = f64::from(STEPS) + 0.5;
    driver.note("announcing the stop time");
    driver.set_up(&mut instance, stop)?;
    let stop = driver.time(stop);
    instance.enter_initialization()?;
    instance.exit_initialization()?;
    driver.run_all(&mut instance)?;
    let last = driver.time(STEPS.into());
    match driver.do_step(&mut instance, last, driver.step()) {
        Ok(()) => violated(format!(
            "{}: {} of {} s from t = {last} s, with {stop:.6} s as the stop time",
            driver.instead("success"),
            driver.fmi("DoStep"),
            driver.step()
        )),
        Err(_) if instance.is_lost() => driver.fatal(),
        Err(_) => Ok(String::new()),
    }
}
