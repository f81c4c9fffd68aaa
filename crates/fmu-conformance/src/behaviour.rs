//! Checks how instances behave in a simulation: start values, repeatability, independence, step size.

use fmu_import::description::{Type, Variable};
use fmu_import::{Causality, Initial, Variability};

use super::bench::{Bench, Row, STEPS, Value, read};
use super::{Objection, Verdict, broken, not_applicable};

/// How far a start value may be from its decimal digits in the description: many tools write 15 of them.
const DIGITS: f64 = 1e-12;
/// Values below this share of an output's nominal value count as zero when two runs are compared.
const NOISE: f64 = 1e-6;

pub(super) fn start_values(bench: &Bench) -> Verdict {
    let mut instance = bench.instance()?;
    bench.enter(&mut instance)?;
    let (mut count, mut wrong) = (0, Vec::new());
    for variable in &bench.about().variables {
        let Some(start) = &variable.start else { continue };
        if variable.initial != Some(Initial::Exact) {
            continue;
        }
        bench.note(&format!("reading `{}` in initialization mode", variable.name));
        let found = read(&mut instance, variable)?;
        count += 1;
        if !is(variable, start, &found) {
            wrong.push(format!("`{}`: expected {start}, found {found}", variable.name));
        }
    }
    match wrong.is_empty() {
        true => Ok(format!("{count} values")),
        false => broken(wrong.join("; ")),
    }
}

fn is(variable: &Variable, start: &str, found: &Value) -> bool {
    match found {
        Value::Real(found) => start.trim().parse::<f64>().is_ok_and(|start| {
            start == *found || (start - found).abs() <= DIGITS * start.abs().max(found.abs())
        }),
        Value::Integer(found) => start.trim().parse() == Ok(*found),
        Value::Boolean(found) => matches!(start.trim(), "true" | "1") == *found,
        Value::String(found) => variable.kind == Type::String && start == found,
    }
}

pub(super) fn finite(bench: &Bench) -> Verdict {
    let mut instance = bench.ready()?;
    let mut rows = vec![bench.row(&mut instance, bench.time(0.0))?];
    rows.extend(bench.run(&mut instance, 0..5 * STEPS, 0)?);
    all_finite(bench, &rows)?;
    Ok(format!("{} communication points", rows.len()))
}

fn all_finite(bench: &Bench, rows: &[Row]) -> Result<(), Objection> {
    for row in rows {
        for (output, value) in bench.with(Causality::Output).zip(&row.values) {
            if matches!(value, Value::Real(value) if !value.is_finite()) {
                let (name, time) = (&output.name, row.time);
                return broken(format!("`{name}` is {value} at t = {time} s"));
            }
        }
    }
    Ok(())
}

/// A fresh instance's run.
fn fresh(bench: &Bench, variant: u32) -> Result<Vec<Row>, Objection> {
    let mut instance = bench.ready()?;
    let mut rows = vec![bench.row(&mut instance, bench.time(0.0))?];
    rows.extend(bench.run(&mut instance, 0..STEPS, variant)?);
    Ok(rows)
}

pub(super) fn deterministic(bench: &Bench) -> Verdict {
    let first = fresh(bench, 0)?;
    bench.same(&first, &fresh(bench, 0)?)?;
    Ok(String::new())
}

pub(super) fn reset(bench: &Bench) -> Verdict {
    let mut instance = bench.ready()?;
    let mut runs = Vec::new();
    for again in [true, false] {
        let mut rows = vec![bench.row(&mut instance, bench.time(0.0))?];
        rows.extend(bench.run(&mut instance, 0..STEPS, 0)?);
        runs.push(rows);
        if again {
            bench.note("fmi2Reset");
            instance.reset()?;
            bench.initialise(&mut instance)?;
        }
    }
    bench.same(&runs[0], &runs[1])?;
    Ok(String::new())
}

pub(super) fn instances(bench: &Bench) -> Verdict {
    let alone = [fresh(bench, 0)?, fresh(bench, 1)?];
    let mut instances = [bench.instance()?, bench.instance()?];
    let mut together = [Vec::new(), Vec::new()];
    for (instance, rows) in instances.iter_mut().zip(&mut together) {
        bench.initialise(instance)?;
        rows.push(bench.row(instance, bench.time(0.0))?);
    }
    for tick in 0..STEPS {
        for (variant, (instance, rows)) in (0..).zip(instances.iter_mut().zip(&mut together)) {
            rows.push(bench.advance(instance, tick, variant)?);
        }
    }
    for (alone, together) in alone.iter().zip(&together) {
        bench.same(alone, together)?;
    }
    Ok(String::new())
}

/// One run in steps of `h`, one in steps of `h/2` and `3h/2`, with inputs that change every `2h` only.
///
/// FMI 2.0 asks for steps of any size to be done, not for results that do not depend on them: a controller
/// or a filter that samples at communication points rightly gives others. So the largest difference is
/// told, and warned about when the results have nothing to do with each other. What is wrong in any case
/// is not to look at the size of the step.
pub(super) fn step_size(bench: &Bench) -> Verdict {
    if !bench.about().variable_step {
        return not_applicable("canHandleVariableCommunicationStepSize is not set");
    }
    let even = in_steps(bench, [1.0, 1.0])?;
    let uneven = in_steps(bench, [0.5, 1.5])?;
    all_finite(bench, &uneven)?;
    if let Some(name) = ignores_step(bench)? {
        return broken(format!(
            "the size of the step is ignored: steps of {} s give the same values of `{name}` and of all \
             other continuous outputs as steps of half that size, while time goes on half as far",
            bench.step()
        ));
    }
    let (largest, of) = largest_difference(bench, &even, &uneven);
    let told = format!("largest relative difference{of} {largest:.1e}");
    Ok(if largest > 1.0 { format!("warning: {told}") } else { told })
}

fn largest_difference(bench: &Bench, even: &[Row], uneven: &[Row]) -> (f64, String) {
    let (mut largest, mut of) = (0.0, String::new());
    for (place, output) in bench.with(Causality::Output).enumerate() {
        let reals = |row: &Row| match row.values[place] {
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
fn ignores_step(bench: &Bench) -> Result<Option<String>, Objection> {
    let [whole, half] = [1.0, 0.5].map(|share| held(bench, share));
    let (whole, half) = (whole?, half?);
    let mut moving = None;
    for (place, output) in bench.with(Causality::Output).enumerate() {
        let continuous = output.kind == Type::Real && output.variability == Variability::Continuous;
        if !continuous || whole.iter().all(|row| row.values[place] == whole[0].values[place]) {
            continue;
        }
        if whole.iter().zip(&half).any(|(a, b)| a.values[place] != b.values[place]) {
            return Ok(None);
        }
        moving.get_or_insert_with(|| output.name.clone());
    }
    Ok(moving)
}

/// The rows after each of some steps of this length [h] under inputs that never change.
fn held(bench: &Bench, share: f64) -> Result<Vec<Row>, Objection> {
    let mut instance = bench.ready()?;
    bench.set_inputs(&mut instance, 3, 0)?;
    let mut rows = Vec::new();
    for tick in 0..STEPS {
        let tick = f64::from(tick);
        bench.do_step(&mut instance, bench.time(share * tick), share * bench.step())?;
        rows.push(bench.row(&mut instance, bench.time(share * (tick + 1.0)))?);
    }
    Ok(rows)
}

/// The rows at multiples of `2h` of a run in steps of these lengths [h], which add up to 2.
fn in_steps(bench: &Bench, steps: [f64; 2]) -> Result<Vec<Row>, Objection> {
    let mut instance = bench.ready()?;
    let mut rows = Vec::new();
    for tick in (0..STEPS).step_by(2) {
        bench.set_inputs(&mut instance, tick, 0)?;
        let start = f64::from(tick);
        bench.do_step(&mut instance, bench.time(start), steps[0] * bench.step())?;
        bench.do_step(&mut instance, bench.time(start + steps[0]), steps[1] * bench.step())?;
        rows.push(bench.row(&mut instance, bench.time(start + 2.0))?);
    }
    Ok(rows)
}

/// FMI 2.0 asks masters to leave no gap and FMUs for nothing, so that an FMU that does not look is warned
/// about and passes.
pub(super) fn step_start(bench: &Bench) -> Verdict {
    let mut instance = bench.ready()?;
    bench.run(&mut instance, 0..STEPS, 0)?;
    let (end, start) = (f64::from(STEPS), f64::from(STEPS + 10));
    match bench.do_step(&mut instance, bench.time(start), bench.step()) {
        Err(_) => Ok(String::new()),
        Ok(()) => Ok(format!(
            "warning: after t = {} s a step from {} s was accepted",
            bench.time(end),
            bench.time(start)
        )),
    }
}
