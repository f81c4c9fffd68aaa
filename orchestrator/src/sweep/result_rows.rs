//! Converts outcomes of variants to rows of the result table, and back.

use ::sweep::table::{Column, Role, Table, Values};

use super::plan_metadata::PlanMetadata;
use super::variant::{Failure, Outcome};

/// What the verdicts are called.
pub const PASSED: &str = "passed";
/// A check failed.
pub const FAILED: &str = "failed";
/// The run did not come to its end.
pub const ERROR: &str = "error";

/// The name of the column of a check.
fn check(name: &str) -> String {
    format!("check.{name}")
}

/// The name of the column of its margin.
fn margin(name: &str) -> String {
    format!("margin.{name}")
}

/// The name of the column of a collected value.
fn collect(name: &str) -> String {
    format!("collect.{name}")
}

/// The outcome of a variant, and its row in the values of its chunk.
pub(super) struct RowOutcome<'a> {
    pub row: usize,
    pub outcome: &'a Outcome,
}

/// The table of some variants of a chunk.
pub(super) fn table(metadata: &PlanMetadata, values: &Table, done: &[RowOutcome]) -> Table {
    let rows: Vec<usize> = done.iter().map(|it| it.row).collect();
    let picked = |column: &Column| Column { values: pick(&column.values, &rows), ..column.clone() };
    let outcomes = || done.iter().map(|it| it.outcome);
    let failures = || outcomes().map(|it| it.failure.as_ref());
    let text = |take: fn(&Failure) -> Option<String>| {
        Values::Texts(failures().map(|it| it.and_then(take)).collect())
    };
    let mut columns: Vec<Column> = values.of(Role::Variant).map(picked).collect();
    // It varies, or else all variants have the same.
    let seeds = Values::Integers(outcomes().map(|it| it.seed.cast_signed()).collect());
    columns.extend(values.of(Role::Seed).map(picked));
    if columns.len() == 1 {
        columns.push(Column::new("seed", Role::Seed, seeds));
    }
    let varied = values.of(Role::Parameter).filter(|it| !metadata.also.contains(&it.name));
    columns.extend(varied.map(|column| {
        let own = column.unit.clone().or_else(|| metadata.units.get(&column.name).cloned());
        Column { unit: own, ..picked(column) }
    }));
    let verdicts = outcomes().map(|it| Some(verdict(it).to_owned())).collect();
    columns.push(Column::new("verdict", Role::Verdict, Values::Texts(verdicts)));
    columns.push(Column::new("error", Role::Error, text(|it| Some(it.what.clone()))));
    columns.push(Column::new("error.node", Role::Error, text(|it| it.node.clone())));
    columns.push(Column::new("error.call", Role::Error, text(|it| it.call.clone())));
    let times = failures().map(|it| it.and_then(|it| it.time).unwrap_or(f64::NAN)).collect();
    columns
        .push(Column::new("error.time", Role::Error, Values::Numbers(times)).with_unit(Some("s")));
    for (place, name) in metadata.checks.iter().enumerate() {
        let verdicts_of_check = || outcomes().map(|it| it.checks.get(place));
        let passed = verdicts_of_check().map(|it| it.map(|(passed, _)| *passed)).collect();
        columns.push(Column::new(&check(name), Role::Check, Values::Booleans(passed)));
        let margins =
            verdicts_of_check().map(|it| it.and_then(|(_, margin)| *margin).unwrap_or(f64::NAN));
        columns.push(Column::new(&margin(name), Role::Margin, Values::Numbers(margins.collect())));
    }
    for (place, (name, unit)) in metadata.collected.iter().enumerate() {
        let numbers = outcomes().map(|it| it.collected.get(place).copied().unwrap_or(f64::NAN));
        let column =
            Column::new(&collect(name), Role::Collected, Values::Numbers(numbers.collect()));
        columns.push(column.with_unit(unit.as_deref()));
    }
    let steps = outcomes().map(|it| it.steps.cast_signed()).collect();
    columns.push(Column::new("steps", Role::Effort, Values::Integers(steps)));
    let seconds = outcomes().map(|it| it.seconds).collect();
    columns
        .push(Column::new("seconds", Role::Effort, Values::Numbers(seconds)).with_unit(Some("s")));
    Table { columns }
}

fn verdict(outcome: &Outcome) -> &'static str {
    match (&outcome.failure, outcome.passed()) {
        (Some(_), _) => ERROR,
        (None, true) => PASSED,
        (None, false) => FAILED,
    }
}

fn pick(values: &Values, rows: &[usize]) -> Values {
    match values {
        Values::Integers(all) => Values::Integers(rows.iter().map(|row| all[*row]).collect()),
        Values::Numbers(all) => Values::Numbers(rows.iter().map(|row| all[*row]).collect()),
        Values::Booleans(all) => Values::Booleans(rows.iter().map(|row| all[*row]).collect()),
        Values::Texts(all) => Values::Texts(rows.iter().map(|row| all[*row].clone()).collect()),
    }
}

/// The outcome of a variant, and its number.
#[derive(Debug, Clone)]
pub(super) struct VariantOutcome {
    pub variant: u64,
    pub outcome: Outcome,
}

/// The outcomes of the variants of a table; nothing when it is another table.
pub(super) fn outcomes(metadata: &PlanMetadata, table: &Table) -> Option<Vec<VariantOutcome>> {
    let integers = |name: &str| table.column(name)?.integers();
    let numbers = |name: &str| table.column(name)?.numbers();
    let texts = |name: &str| table.column(name)?.texts();
    let variants = integers("variant")?;
    let mut outcomes = Vec::with_capacity(variants.len());
    let (seeds, steps) = (integers("seed")?, integers("steps")?);
    let (seconds, times) = (numbers("seconds")?, numbers("error.time")?);
    let (what, nodes, calls) = (texts("error")?, texts("error.node")?, texts("error.call")?);
    for (row, variant) in variants.iter().enumerate() {
        let failure = what[row].as_ref().map(|what| Failure {
            what: what.clone(),
            node: nodes[row].clone(),
            call: calls[row].clone(),
            time: Some(times[row]).filter(|time| !time.is_nan()),
        });
        let mut outcome = Outcome {
            seed: seeds[row].cast_unsigned(),
            steps: steps[row].cast_unsigned(),
            seconds: seconds[row],
            failure,
            ..Outcome::default()
        };
        for name in metadata.checks.iter().filter(|_| outcome.failure.is_none()) {
            let passed = table.column(&check(name))?.booleans()?[row]?;
            let margin = Some(numbers(&margin(name))?[row]).filter(|margin| !margin.is_nan());
            outcome.checks.push((passed, margin));
        }
        for (name, _) in metadata.collected.iter().filter(|_| outcome.failure.is_none()) {
            outcome.collected.push(numbers(&collect(name))?[row]);
        }
        outcomes.push(VariantOutcome { variant: variant.cast_unsigned(), outcome });
    }
    Some(outcomes)
}
