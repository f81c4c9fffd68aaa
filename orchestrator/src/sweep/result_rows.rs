//! Converts outcomes of variants to rows of the result table, and back.

use ::sweep::table::{
    ERROR, FAILED, NO_CHECKS, PASSED, SweepColumn, SweepColumnRole, SweepColumnValues, SweepTable,
};

use super::plan_metadata::PlanMetadata;
use super::variant::{VariantFailure, VariantOutcome};

/// The name of the column of a check.
fn check_column_name(name: &str) -> String {
    format!("check.{name}")
}

/// The name of the column of its margin.
fn margin_column_name(name: &str) -> String {
    format!("margin.{name}")
}

/// The name of the column of a collected value.
fn collected_column_name(name: &str) -> String {
    format!("collect.{name}")
}

/// The outcome of a variant, and its row in the values of its chunk.
pub(super) struct RowOutcome<'a> {
    pub row: usize,
    pub outcome: &'a VariantOutcome,
}

/// The table of some variants of a chunk.
pub(super) fn outcomes_to_table(
    metadata: &PlanMetadata,
    values: &SweepTable,
    done: &[RowOutcome],
) -> SweepTable {
    let rows: Vec<usize> = done.iter().map(|it| it.row).collect();
    let picked = |column: &SweepColumn| SweepColumn {
        values: values_at_rows(&column.values, &rows),
        ..column.clone()
    };
    let outcomes = || done.iter().map(|it| it.outcome);
    let failures = || outcomes().map(|it| it.failure.as_ref());
    let text = |take: fn(&VariantFailure) -> Option<String>| {
        SweepColumnValues::Texts(failures().map(|it| it.and_then(take)).collect())
    };
    let mut columns: Vec<SweepColumn> =
        values.columns_with_role(SweepColumnRole::Variant).map(picked).collect();
    columns.extend(values.columns_with_role(SweepColumnRole::Name).map(picked));
    // It varies, or else all variants have the same.
    let seeds = SweepColumnValues::Integers(outcomes().map(|it| it.seed.cast_signed()).collect());
    columns.extend(values.columns_with_role(SweepColumnRole::Seed).map(picked));
    if columns.iter().all(|it| it.role != SweepColumnRole::Seed) {
        columns.push(SweepColumn::new("seed", SweepColumnRole::Seed, seeds));
    }
    let varied =
        values.columns_with_role(SweepColumnRole::Parameter).filter(|it| !metadata.also.contains(&it.name));
    columns.extend(varied.map(|column| {
        let own = column.unit.clone().or_else(|| metadata.units.get(&column.name).cloned());
        let column = SweepColumn { unit: own, ..picked(column) };
        match metadata.scenario_values.get(&column.name) {
            Some(value) => value.fill_missing(column),
            None => column,
        }
    }));
    let verdicts = outcomes().map(|it| Some(outcome_verdict(it).to_owned())).collect();
    columns.push(SweepColumn::new("verdict", SweepColumnRole::Verdict, SweepColumnValues::Texts(verdicts)));
    columns.push(SweepColumn::new("error", SweepColumnRole::Error, text(|it| Some(it.what.clone()))));
    columns.push(SweepColumn::new("error.node", SweepColumnRole::Error, text(|it| it.node.clone())));
    columns.push(SweepColumn::new("error.call", SweepColumnRole::Error, text(|it| it.call.clone())));
    let times = failures().map(|it| it.and_then(|it| it.time).unwrap_or(f64::NAN)).collect();
    columns.push(
        SweepColumn::new("error.time", SweepColumnRole::Error, SweepColumnValues::Numbers(times))
            .with_unit(Some("s")),
    );
    for (place, name) in metadata.checks.iter().enumerate() {
        let verdicts_of_check = || outcomes().map(|it| it.checks.get(place));
        let passed = verdicts_of_check().map(|it| it.map(|(passed, _)| *passed)).collect();
        columns.push(SweepColumn::new(
            &check_column_name(name),
            SweepColumnRole::Check,
            SweepColumnValues::Booleans(passed),
        ));
        let margins = verdicts_of_check().map(|it| it.and_then(|(_, margin)| *margin).unwrap_or(f64::NAN));
        let margins = SweepColumnValues::Numbers(margins.collect());
        let unit = metadata.margin_units.get(place).and_then(Option::as_deref);
        columns.push(
            SweepColumn::new(&margin_column_name(name), SweepColumnRole::Margin, margins).with_unit(unit),
        );
    }
    for (place, (name, unit)) in metadata.collected.iter().enumerate() {
        let numbers = outcomes().map(|it| it.collected.get(place).copied().unwrap_or(f64::NAN));
        let column = SweepColumn::new(
            &collected_column_name(name),
            SweepColumnRole::Collected,
            SweepColumnValues::Numbers(numbers.collect()),
        );
        columns.push(column.with_unit(unit.as_deref()));
    }
    let steps = outcomes().map(|it| it.steps.cast_signed()).collect();
    columns.push(SweepColumn::new("steps", SweepColumnRole::Effort, SweepColumnValues::Integers(steps)));
    let seconds = outcomes().map(|it| it.seconds).collect();
    columns.push(
        SweepColumn::new("seconds", SweepColumnRole::Effort, SweepColumnValues::Numbers(seconds))
            .with_unit(Some("s")),
    );
    SweepTable { columns }
}

fn outcome_verdict(outcome: &VariantOutcome) -> &'static str {
    match (&outcome.failure, outcome.has_passed()) {
        (Some(_), _) => ERROR,
        (None, _) if outcome.checks.is_empty() => NO_CHECKS,
        (None, true) => PASSED,
        (None, false) => FAILED,
    }
}

fn values_at_rows(values: &SweepColumnValues, rows: &[usize]) -> SweepColumnValues {
    match values {
        SweepColumnValues::Integers(all) => {
            SweepColumnValues::Integers(rows.iter().map(|row| all[*row]).collect())
        }
        SweepColumnValues::Numbers(all) => {
            SweepColumnValues::Numbers(rows.iter().map(|row| all[*row]).collect())
        }
        SweepColumnValues::Booleans(all) => {
            SweepColumnValues::Booleans(rows.iter().map(|row| all[*row]).collect())
        }
        SweepColumnValues::Texts(all) => {
            SweepColumnValues::Texts(rows.iter().map(|row| all[*row].clone()).collect())
        }
    }
}

/// The outcome of a variant, and its number.
#[derive(Debug, Clone)]
pub(super) struct NumberedOutcome {
    pub variant: u64,
    pub outcome: VariantOutcome,
}

/// The outcomes of the variants of a table; nothing when it is another table.
pub(super) fn outcomes_from_table(
    metadata: &PlanMetadata,
    table: &SweepTable,
) -> Option<Vec<NumberedOutcome>> {
    let integers = |name: &str| table.column(name)?.as_integers();
    let numbers = |name: &str| table.column(name)?.as_numbers();
    let texts = |name: &str| table.column(name)?.as_texts();
    let variants = integers("variant")?;
    let mut outcomes = Vec::with_capacity(variants.len());
    let (seeds, steps) = (integers("seed")?, integers("steps")?);
    let (seconds, times) = (numbers("seconds")?, numbers("error.time")?);
    let (what, nodes, calls) = (texts("error")?, texts("error.node")?, texts("error.call")?);
    for (row, variant) in variants.iter().enumerate() {
        let failure = what[row].as_ref().map(|what| VariantFailure {
            what: what.clone(),
            node: nodes[row].clone(),
            call: calls[row].clone(),
            time: Some(times[row]).filter(|time| !time.is_nan()),
        });
        let mut outcome = VariantOutcome {
            seed: seeds[row].cast_unsigned(),
            steps: steps[row].cast_unsigned(),
            seconds: seconds[row],
            failure,
            ..VariantOutcome::default()
        };
        for name in metadata.checks.iter().filter(|_| outcome.failure.is_none()) {
            let passed = table.column(&check_column_name(name))?.as_booleans()?[row]?;
            let margin = Some(numbers(&margin_column_name(name))?[row]).filter(|margin| !margin.is_nan());
            outcome.checks.push((passed, margin));
        }
        for (name, _) in metadata.collected.iter().filter(|_| outcome.failure.is_none()) {
            outcome.collected.push(numbers(&collected_column_name(name))?[row]);
        }
        outcomes.push(NumberedOutcome { variant: variant.cast_unsigned(), outcome });
    }
    Some(outcomes)
}
