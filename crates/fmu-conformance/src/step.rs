//! Checks that an FMU looks at the size and the start of a step.

use fmu_import::description::Type;
use fmu_import::{Causality, Value, Variability};

use super::Rank::{BreaksStandard, NotRobust};
use super::behaviour::all_finite;
use super::test_driver::{Row, STEPS, TestDriver, until_end};
use super::{BOTH, Check, Rule, RuleError, RuleResult, not_applicable, violated};

pub(super) const RULES: &[Rule] = &[
    Rule {
        name: "step-size",
        rank: BreaksStandard,
        sentence: "the communication step may change from step to step",
        versions: BOTH,
        check: Check::Runs(step_size),
    },
    Rule {
        name: "step-start",
        rank: NotRobust,
        sentence: "a step that leaves a gap in time is refused",
        versions: BOTH,
        check: Check::RunsOne(step_start),
    },
];

/// Values below this share of an output's nominal value count as zero when two runs are compared.
const NOISE: f64 = 1e-6;

/// One run in steps of `h`, one in steps of `h/2` and `3h/2`, with inputs that change every `2h` only.
///
/// FMI asks for steps of any size to be done, not for results that do not depend on them: a controller
/// or a filter that samples at communication points rightly gives others. So the largest difference is
/// reported, and warned about when the results have nothing to do with each other. What is wrong in any case
/// is not to look at the size of the step.
fn step_size(driver: &TestDriver) -> RuleResult {
    if !driver.about().variable_step {
        return not_applicable("canHandleVariableCommunicationStepSize is not set");
    }
    let even = in_steps(driver, [1.0, 1.0])?;
    let uneven = in_steps(driver, [0.5, 1.5])?;
    all_finite(driver, &uneven)?;
    if let Some(name) = ignores_step(driver)? {
        return violated(format!(
            "the size of the step is ignored: steps of {} s give the same values of `{name}` and of all \
             other continuous outputs as steps of half that size, while time goes on half as far",
            driver.step()
        ));
    }
    let (largest, of) = largest_difference(driver, &even, &uneven);
    let measured = format!("largest relative difference{of} {largest:.1e}");
    Ok(if largest > 1.0 { format!("warning: {measured}") } else { measured })
}

fn largest_difference(driver: &TestDriver, even: &[Row], uneven: &[Row]) -> (f64, String) {
    let (mut largest, mut of) = (0.0, String::new());
    for (index, output) in driver.with(Causality::Output).enumerate() {
        let reals = |row: &Row| match row.values[index] {
            Value::Real(value) => value,
            _ => 0.0,
        };
        let floor = NOISE * output.nominal.unwrap_or(1.0);
        let scale = even.iter().map(|row| reals(row).abs()).fold(floor, f64::max);
        for (even, uneven) in even.iter().zip(uneven) {
            let difference = (reals(even) - reals(uneven)).abs() / scale;
            if difference > largest {
                (largest, of) = (difference, format!(" of `{}`", output.name));
            }
        }
    }
    (largest, of)
}

/// A continuous output that moves, when all that move give the same bits after each step of `h` and of
/// `h/2` under the same inputs. What changes at samples only is discrete, and may count them.
fn ignores_step(driver: &TestDriver) -> Result<Option<String>, RuleError> {
    let [whole, half] = [1.0, 0.5].map(|share| held(driver, share));
    let (whole, half) = (whole?, half?);
    let mut moving = None;
    for (index, output) in driver.with(Causality::Output).enumerate() {
        let continuous = output.kind == Type::Real && output.variability == Variability::Continuous;
        let still =
            |rows: &[Row]| rows.iter().all(|row| row.values[index] == rows[0].values[index]);
        if !continuous || still(&whole) {
            continue;
        }
        if whole.iter().zip(&half).any(|(a, b)| a.values[index] != b.values[index]) {
            return Ok(None);
        }
        moving.get_or_insert_with(|| output.name.clone());
    }
    Ok(moving)
}

/// The rows after each of some steps of this length [h] under inputs that never change.
fn held(driver: &TestDriver, share: f64) -> Result<Vec<Row>, RuleError> {
    let mut instance = driver.ready()?;
    driver.set_inputs(&mut instance, 3, 0)?;
    let rows = (0..STEPS).map(|tick| {
        let tick = f64::from(tick);
        driver.do_step(&mut instance, driver.time(share * tick), share * driver.step())?;
        driver.row(&mut instance, driver.time(share * (tick + 1.0)))
    });
    Ok(until_end(rows)?)
}

/// The rows at multiples of `2h` of a run in steps of these lengths [h], which add up to 2.
fn in_steps(driver: &TestDriver, steps: [f64; 2]) -> Result<Vec<Row>, RuleError> {
    let mut instance = driver.ready()?;
    let rows = (0..STEPS).step_by(2).map(|tick| {
        driver.set_inputs(&mut instance, tick, 0)?;
        let start = f64::from(tick);
        driver.do_step(&mut instance, driver.time(start), steps[0] * driver.step())?;
        driver.do_step(&mut instance, driver.time(start + steps[0]), steps[1] * driver.step())?;
        driver.row(&mut instance, driver.time(start + 2.0))
    });
    Ok(until_end(rows)?)
}

/// FMI asks masters to leave no gap and FMUs for nothing, so that an FMU that does not look is warned
/// about and passes.
fn step_start(driver: &TestDriver) -> RuleResult {
    let mut instance = driver.ready()?;
    driver.run_all(&mut instance)?;
    let (end, start) = (f64::from(STEPS), f64::from(STEPS + 10));
    match driver.do_step(&mut instance, driver.time(start), driver.step()) {
        Err(_) => Ok(String::new()),
        Ok(()) => Ok(format!(
            "warning: after t = {} s a step from {} s was accepted",
            driver.time(end),
            driver.time(start)
        )),
    }
}
