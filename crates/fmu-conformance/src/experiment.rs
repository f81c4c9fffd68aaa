//! Checks that an FMU accepts the experiment, and its stop time.

use super::Rank::{BreaksStandard, NotRobust};
use super::test_driver::{STEPS, TestDriver};
use super::{Check, Rule, Verdict, broken};

pub(super) const RULES: &[Rule] = &[
    Rule {
        name: "experiment",
        rank: BreaksStandard,
        sentence: "initialization needs an experiment",
        check: Check::RunsOne(experiment),
    },
    Rule {
        name: "stop-time",
        rank: NotRobust,
        sentence: "a step past the stop time is refused",
        check: Check::RunsOne(stop_time),
    },
];

/// FMI 2.0 asks masters to set up the experiment first, and FMUs for nothing.
fn experiment(driver: &TestDriver) -> Verdict {
    let mut instance = driver.instance()?;
    driver.note("fmi2EnterInitializationMode without fmi2SetupExperiment");
    match instance.enter_initialization() {
        Ok(()) => Ok("warning: fmi2EnterInitializationMode was accepted without one".to_owned()),
        Err(_) if instance.is_lost() => broken("expected fmi2Error, found fmi2Fatal"),
        Err(_) => Ok(String::new()),
    }
}

/// A step past the stop time that was set up must be refused (FMI 2.0, section 2.1.6).
fn stop_time(driver: &TestDriver) -> Verdict {
    let mut instance = driver.instance()?;
    // Half a step apart, so that no rounding matters.
    let stop = f64::from(STEPS) + 0.5;
    driver.note("fmi2SetupExperiment");
    driver.set_up(&mut instance, stop)?;
    let stop = driver.time(stop);
    instance.enter_initialization()?;
    instance.exit_initialization()?;
    driver.run_all(&mut instance)?;
    let last = driver.time(STEPS.into());
    match driver.do_step(&mut instance, last, driver.step()) {
        Ok(()) => broken(format!(
            "expected fmi2Error, found success: fmi2DoStep of {} s from t = {last} s, with {stop:.6} s as the stop time",
            driver.step()
        )),
        Err(_) if instance.is_lost() => broken("expected fmi2Error, found fmi2Fatal"),
        Err(_) => Ok(String::new()),
    }
}
