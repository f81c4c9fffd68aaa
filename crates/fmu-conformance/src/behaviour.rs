//! Checks how instances behave in a simulation: start values, repeatability, independence, step size.

use fmu_import::description::{Type, Variable};
use fmu_import::{CallError, Causality, Initial, Instance, Storage, Value, Version, to_hex};

use super::Rank::{BreaksRuns, BreaksStandard};
use super::test_driver::{Row, STEPS, TestDriver, read};
use super::{BOTH, Check, Rule, RuleError, RuleResult, violated};

pub(super) const RULES: &[Rule] = &[
    Rule {
        name: "start-values",
        rank: BreaksStandard,
        sentence: "exact start values are those of the description",
        versions: BOTH,
        check: Check::RunsOne(start_values),
    },
    Rule {
        name: "finite",
        rank: BreaksRuns,
        sentence: "outputs are finite",
        versions: BOTH,
        check: Check::RunsOne(finite),
    },
    Rule {
        name: "deterministic",
        rank: BreaksStandard,
        sentence: "two runs give the same bits",
        versions: BOTH,
        check: Check::Runs(deterministic),
    },
    Rule {
        name: "reset",
        rank: BreaksStandard,
        sentence: "a reset instance runs like a fresh one",
        versions: BOTH,
        check: Check::RunsOne(reset),
    },
    Rule {
        name: "instances",
        rank: BreaksRuns,
        sentence: "instances do not disturb each other",
        versions: BOTH,
        check: Check::Runs(instances),
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
    if driver.version() == Version::Three {
        let mut instance = driver.instance()?;
        match starts(driver, &mut instance, "before the initialization", &mut wrong) {
            Ok(read) => count += read,
            Err(_) if instance.is_lost() => return driver.fatal(),
            Err(CallError { call, .. }) => {
                warning = format!("; warning: {call} before the initialization was refused");
            }
        }
    }
    let mut instance = driver.instance()?;
    driver.enter(&mut instance)?;
    count += starts(driver, &mut instance, "in initialization mode", &mut wrong)?;
    match wrong.is_empty() {
        true => Ok(format!("{count} values{warning}")),
        false => violated(wrong.join("; ")),
    }
}

/// Compares exact start values with what the FMU says now, and counts them.
fn starts(
    driver: &TestDriver,
    instance: &mut Instance,
    when: &str,
    wrong: &mut Vec<String>,
) -> Result<usize, CallError> {
    let mut count = 0;
    let mut whole = Vec::new();
    for variable in driver.about().variables.iter().filter(|it| it.kind != Type::Clock) {
        // The value of an input is its source's from the initialization on.
        if variable.initial != Some(Initial::Exact) || variable.causality == Causality::Input {
            continue;
        }
        if variable.element.0 == 0 {
            driver.note(&format!("reading `{}` {when}", variable.name));
            whole = read(instance, variable)?;
        }
        let (Some(start), Some(found)) = (&variable.start, whole.get(variable.element.0)) else {
            continue;
        };
        count += 1;
        if !is(variable, start, found) {
            let name = &variable.name;
            wrong.push(format!("`{name}` {when}: expected {start}, found {found}"));
        }
    }
    Ok(count)
}

fn is(variable: &Variable, start: &str, found: &Value) -> bool {
    match found {
        Value::Real(found) => start.trim().parse::<f64>().is_ok_and(|start| {
            let digits = if variable.storage == Storage::Float32 { SINGLE } else { DIGITS };
            start == *found || (start - found).abs() <= digits * start.abs().max(found.abs())
        }),
        Value::Integer(found) => start.trim().parse() == Ok(*found),
        Value::Boolean(found) => matches!(start.trim(), "true" | "1") == *found,
        Value::String(found) => variable.kind == Type::String && start == found,
        Value::Binary(found) => start.eq_ignore_ascii_case(&to_hex(found)),
    }
}

fn finite(driver: &TestDriver) -> RuleResult {
    let mut instance = driver.ready()?;
    let mut rows = vec![driver.row(&mut instance, driver.time(0.0))?];
    rows.extend(driver.run(&mut instance, 0..5 * STEPS, 0)?);
    all_finite(driver, &rows)?;
    Ok(format!("{} communication points", rows.len()))
}

pub(super) fn all_finite(driver: &TestDriver, rows: &[Row]) -> Result<(), RuleError> {
    for row in rows {
        for (output, value) in driver.with(Causality::Output).zip(&row.values) {
            if matches!(value, Value::Real(value) if !value.is_finite()) {
                let (name, time) = (&output.name, row.time);
                return violated(format!("`{name}` is {value} at t = {time} s"));
            }
        }
    }
    Ok(())
}

/// A fresh instance's run.
fn fresh(driver: &TestDriver, variant: u32) -> Result<Vec<Row>, RuleError> {
    let mut instance = driver.ready()?;
    let mut rows = vec![driver.row(&mut instance, driver.time(0.0))?];
    rows.extend(driver.run(&mut instance, 0..STEPS, variant)?);
    Ok(rows)
}

fn deterministic(driver: &TestDriver) -> RuleResult {
    let first = fresh(driver, 0)?;
    driver.same(&first, &fresh(driver, 0)?)?;
    Ok(String::new())
}

fn reset(driver: &TestDriver) -> RuleResult {
    let mut instance = driver.ready()?;
    let mut runs = Vec::new();
    for again in [true, false] {
        let mut rows = vec![driver.row(&mut instance, driver.time(0.0))?];
        rows.extend(driver.run(&mut instance, 0..STEPS, 0)?);
        runs.push(rows);
        if again {
            driver.note_call("Reset");
            instance.reset()?;
            driver.initialise(&mut instance)?;
        }
    }
    driver.same(&runs[0], &runs[1])?;
    Ok(String::new())
}

fn instances(driver: &TestDriver) -> RuleResult {
    let alone = [fresh(driver, 0)?, fresh(driver, 1)?];
    let mut instances = [driver.instance()?, driver.instance()?];
    let mut together = [Vec::new(), Vec::new()];
    for (instance, rows) in instances.iter_mut().zip(&mut together) {
        driver.initialise(instance)?;
        rows.push(driver.row(instance, driver.time(0.0))?);
    }
    // As many steps as each made alone before the FMU ended the simulation.
    for tick in 0..STEPS {
        for (variant, (instance, rows)) in (0..).zip(instances.iter_mut().zip(&mut together)) {
            if rows.len() < alone[variant as usize].len() {
                rows.push(driver.advance(instance, tick, variant)?);
            }
        }
    }
    for (alone, together) in alone.iter().zip(&together) {
        driver.same(alone, together)?;
    }
    Ok(String::new())
}
