//! Checks that an FMU looks at the size and the start of a step.

use fmu_import::description::FmiType;
use fmu_import::{Causality, Value, Variability};

use super::RuleSeverity::{BreaksStandard, NotRobust};
use super::behaviour::require_finite_values;
use super::test_driver::{OutputRow, STEPS, TestDriver, until_end};
use super::{BOTH, ConformanceRule, RuleCheck, RuleError, RuleResult, not_applicable, violated_rule};

pub(super) const RULES: &[ConformanceRule] = &[
    ConformanceRule {
        name: "step-size",
        rank: BreaksStandard,
        sentence: "the communication step may change from step to step",
        versions: BOTH,
        check: RuleCheck::Runs(step_size),
    },
    ConformanceRule {
        name: "step-start",
        rank: NotRobust,
        sentence: "a step that leaves a gap in time is refused",
        versions: BOTH,
        check: RuleCheck::RunsOne(step_start),
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
    if !driver.description().variable_step {
        return not_applicable("canHandleVariableCommunicationStepSize is not set");
    }
    let even = in_steps(driver, [1.0, 1.0])?;
    let uneven = in_steps(driver, [0.5, 1.5])?;
    require_finite_values(driver, &uneven)?;
    if let Some(name) = find_step_independent_output(driver)? {
        return violated_rule(format!(
            "the size of the step is ignored: steps of {} s give the same values of `{name}` and of all \
             other continuous outputs as steps of half that size, while time goes on half as far",
            driver.step_size()
        ));
    }
    let (largest, of) = largest_difference(driver, &even, &uneven);
    let measured = format!("largest relative difference{of} {largest:.1e}");
    Ok(if largest > 1.0 { format!("warning: {measured}") } else { measured })
}

fn largest_difference(driver: &TestDriver, even: &[OutputRow], uneven: &[OutputRow]) -> (f64, String) {
    let (mut largest, mut of) = (0.0, String::new());
    for (index, output) in driver.variables_with_causality(Causality::Output).enumerate() {
        let reals = |row: &OutputRow| match row.values[index] {
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
fn find_step_independent_output(driver: &TestDriver) -> Result<Option<String>, RuleError> {
    let [whole, half] = [1.0, 0.5].map(|share| run_with_held_inputs(driver, share));
    let (whole, half) = (whole?, half?);
    let mut moving = None;
    for (index, output) in driver.variables_with_causality(Causality::Output).enumerate() {
        let continuous = output.kind == FmiType::Real && output.variability == Variability::Continuous;
        let still = |rows: &[OutputRow]| rows.iter().all(|row| row.values[index] == rows[0].values[index]);
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
fn run_with_held_inputs(driver: &TestDriver, share: f64) -> Result<Vec<OutputRow>, RuleError> {
    let mut instance = driver.initialised_instance()?;
    driver.set_inputs(&mut instance, 3, 0)?;
    let rows = (0..STEPS).map(|tick| {
        let tick = f64::from(tick);
        driver.do_step(&mut instance, driver.tick_time(share * tick), share * driver.step_size())?;
        driver.read_outputs(&mut instance, driver.tick_time(share * (tick + 1.0)))
    });
    Ok(until_end(rows)?)
}

/// The rows at multiples of `2h` of a run in steps of these lengths [h], which add up to 2.
fn in_steps(driver: &TestDriver, steps: [f64; 2]) -> Result<Vec<OutputRow>, RuleError> {
    let mut instance = driver.initialised_instance()?;
    let rows = (0..STEPS).step_by(2).map(|tick| {
        driver.set_inputs(&mut instance, tick, 0)?;
        let start = f64::from(tick);
        driver.do_step(&mut instance, driver.tick_time(start), steps[0] * driver.step_size())?;
        driver.do_step(&mut instance, driver.tick_time(start + steps[0]), steps[1] * driver.step_size())?;
        driver.read_outputs(&mut instance, driver.tick_time(start + 2.0))
    });
    Ok(until_end(rows)?)
}

/// FMI asks masters to leave no gap and FMUs for nothing, so that an FMU that does not look is warned
/// about and passes.
fn step_start(driver: &TestDriver) -> RuleResult {
    let mut instance = driver.initialised_instance()?;
    driver.run_to_end(&mut instance)?;
    let (end, start) = (f64::from(STEPS), f64::from(STEPS + 10));
    match driver.do_step(&mut instance, driver.tick_time(start), driver.step_size()) {
        Err(_) => Ok(String::new()),
        Ok(()) => Ok(format!(
            "warning: after t = {} s a step from {} s was accepted",
            driver.tick_time(end),
            driver.tick_time(start)
        )),
    }
}
