//! Checks how instances behave in a simulation: start values, repeatability, independence, step size.

use fmu_import::description::{FmiType, Variable};
use fmu_import::{CallError, Causality, FmiVersion, Initial, Instance, StorageType, Value, to_hex};

use super::RuleSeverity::{BreaksRuns, BreaksStandard};
use super::test_driver::{OutputRow, STEPS, TestDriver, read_variable};
use super::{ALL, BOTH, ConformanceRule, RuleCheck, RuleError, RuleResult, violated_rule};

pub(super) const RULES: &[ConformanceRule] = &[
    ConformanceRule {
        name: "start-values",
        rank: BreaksStandard,
        sentence: "exact start values are those of the description",
        versions: BOTH,
        check: RuleCheck::RunsOne(start_values),
    },
    ConformanceRule {
        name: "finite",
        rank: BreaksRuns,
        sentence: "outputs are finite",
        versions: ALL,
        check: RuleCheck::RunsOne(check_finite_outputs),
    },
    ConformanceRule {
        name: "deterministic",
        rank: BreaksStandard,
        sentence: "two runs give the same bits",
        versions: ALL,
        check: RuleCheck::Runs(check_deterministic),
    },
    ConformanceRule {
        name: "reset",
        rank: BreaksStandard,
        sentence: "a reset instance runs like a fresh one",
        versions: ALL,
        check: RuleCheck::RunsOne(check_reset),
    },
    ConformanceRule {
        name: "instances",
        rank: BreaksRuns,
        sentence: "instances do not disturb each other",
        versions: ALL,
        check: RuleCheck::Runs(check_independent_instances),
    },
];

/// How far a start value may be from its decimal digits in the description: many tools write 15 of them.
const DIGITS: f64 = 1e-12;
/// The same for `Float32`, which has 24 bits.
const SINGLE: f64 = 1e-6;

fn start_values(driver: &TestDriver) -> RuleResult {
    let (mut count, mut wrong, mut warning) = (0, Vec::new(), String::new());
    // FMI 2.0 forbids reading before initialization mode. FMI 3.0 until 3.0.2 says that start values can be read there (table of
    // section 2.3.2), and leaves the function out of the list of allowed ones below.
    if driver.fmi_version() == FmiVersion::Three {
        let mut instance = driver.new_instance()?;
        match compare_start_values(driver, &mut instance, "before the initialization", &mut wrong) {
            Ok(read) => count += read,
            Err(_) if instance.has_failed_fatally() => return driver.fatal_status_violation(),
            Err(CallError { call, .. }) => {
                warning = format!("; warning: {call} before the initialization was refused");
            }
        }
    }
    let mut instance = driver.new_instance()?;
    driver.enter_initialization(&mut instance)?;
    count += compare_start_values(driver, &mut instance, "in initialization mode", &mut wrong)?;
    match wrong.is_empty() {
        true => Ok(format!("{count} values{warning}")),
        false => violated_rule(wrong.join("; ")),
    }
}

/// Compares exact start values with what the FMU says now, and counts them.
fn compare_start_values(
    driver: &TestDriver,
    instance: &mut Instance,
    when: &str,
    wrong: &mut Vec<String>,
) -> Result<usize, CallError> {
    let mut count = 0;
    let mut whole = Vec::new();
    for variable in driver.description().variables.iter().filter(|it| it.kind != FmiType::Clock) {
        // The value of an input is its source's from the initialization on.
        if variable.initial != Some(Initial::Exact) || variable.causality == Causality::Input {
            continue;
        }
        if variable.element.0 == 0 {
            driver.note_progress(&format!("reading `{}` {when}", variable.name));
            whole = read_variable(instance, variable)?;
        }
        let (Some(start), Some(found)) = (&variable.start, whole.get(variable.element.0)) else {
            continue;
        };
        count += 1;
        if !equals_start_text(variable, start, found) {
            let name = &variable.name;
            wrong.push(format!("`{name}` {when}: expected {start}, found {found}"));
        }
    }
    Ok(count)
}

fn equals_start_text(variable: &Variable, start: &str, found: &Value) -> bool {
    match found {
        Value::Real(found) => start.trim().parse::<f64>().is_ok_and(|start| {
            let digits = if variable.storage == StorageType::Float32 { SINGLE } else { DIGITS };
            start == *found || (start - found).abs() <= digits * start.abs().max(found.abs())
        }),
        Value::Integer(found) => start.trim().parse() == Ok(*found),
        Value::Boolean(found) => matches!(start.trim(), "true" | "1") == *found,
        Value::String(found) => variable.kind == FmiType::String && start == found,
        Value::Binary(found) => start.eq_ignore_ascii_case(&to_hex(found)),
    }
}

fn check_finite_outputs(driver: &TestDriver) -> RuleResult {
    let mut instance = driver.initialised_instance()?;
    let mut rows = vec![driver.read_outputs(&mut instance, driver.tick_time(0.0))?];
    rows.extend(driver.run_ticks(&mut instance, 0..5 * STEPS, 0)?);
    require_finite_values(driver, &rows)?;
    Ok(format!("{} communication points", rows.len()))
}

pub(super) fn require_finite_values(driver: &TestDriver, rows: &[OutputRow]) -> Result<(), RuleError> {
    for row in rows {
        for (output, value) in driver.variables_with_causality(Causality::Output).zip(&row.values) {
            if matches!(value, Value::Real(value) if !value.is_finite()) {
                let (name, time) = (&output.name, row.time);
                return violated_rule(format!("`{name}` is {value} at t = {time} s"));
            }
        }
    }
    Ok(())
}

/// FMI does not ask for it, so that an FMU that shows a processor time is warned about and passes.
fn check_deterministic(driver: &TestDriver) -> RuleResult {
    let differing = driver.find_unrepeatable_outputs()?;
    let outputs: Vec<_> = driver.variables_with_causality(Causality::Output).collect();
    let names: Vec<_> = differing.iter().map(|place| format!("`{}`", outputs[*place].name)).collect();
    match names.is_empty() {
        true => Ok(String::new()),
        false => Ok(format!(
            "warning: {} differ between two fresh instances with the same inputs; the other rules leave them out",
            names.join(", ")
        )),
    }
}

fn check_reset(driver: &TestDriver) -> RuleResult {
    let mut instance = driver.initialised_instance()?;
    let mut runs = Vec::new();
    for again in [true, false] {
        let mut rows = vec![driver.read_outputs(&mut instance, driver.tick_time(0.0))?];
        rows.extend(driver.run_ticks(&mut instance, 0..STEPS, 0)?);
        runs.push(rows);
        if again {
            driver.note_call("Reset");
            instance.reset()?;
            driver.initialise(&mut instance)?;
        }
    }
    driver.require_equal_runs(&runs[0], &runs[1])?;
    Ok(String::new())
}

fn check_independent_instances(driver: &TestDriver) -> RuleResult {
    let alone = [driver.run_fresh_instance(0)?, driver.run_fresh_instance(1)?];
    let mut instances = [driver.new_instance()?, driver.new_instance()?];
    let mut together = [Vec::new(), Vec::new()];
    for (instance, rows) in instances.iter_mut().zip(&mut together) {
        driver.initialise(instance)?;
        rows.push(driver.read_outputs(instance, driver.tick_time(0.0))?);
    }
    // As many steps as each made alone before the FMU ended the simulation.
    for tick in 0..STEPS {
        for (variant, (instance, rows)) in (0..).zip(instances.iter_mut().zip(&mut together)) {
            if rows.len() < alone[variant as usize].len() {
                rows.push(driver.step_with_inputs(instance, tick, variant)?);
            }
        }
    }
    for (alone, together) in alone.iter().zip(&together) {
        driver.require_equal_runs(alone, together)?;
    }
    Ok(String::new())
}
