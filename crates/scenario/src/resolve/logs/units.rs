//! Reconciles the units of columns: of the scenario with those of the file, and among several files that are joined.

use diagnostics::Error;
use recording::table::TimeSeriesTable;
use units::Unit;

use super::columns::LogColumnRequest;
use super::{LogColumn, RecordedLog, TableFile, set_origin};
use crate::document::Scenario;

/// The unit of a column: that of the scenario or that of the file, which must not contradict each other. A unit of the file
/// that is not known here gives way, and so does one of another dimension if the column has a gain, as that of a sensor in V.
/// Loggers write g for g0, too.
pub fn reconcile_unit(
    LogColumnRequest { column, source, .. }: &LogColumnRequest,
    unit: Option<Unit>,
    recorded: Option<&str>,
) -> Result<Option<String>, Error> {
    let (Some(word), Some(known)) = (&column.unit, unit) else {
        return Ok(recorded.map(str::to_owned));
    };
    let (written, name) = (word.get_ref(), column.column.get_ref());
    match recorded.map(|recorded| (recorded, Unit::parse(recorded))) {
        Some(("g", _)) if written == "g0" => Ok(Some(written.clone())),
        Some((_, Ok(unit))) if column.gain.is_some() && !unit.same_dimension(&known) => {
            Ok(Some(written.clone()))
        }
        Some((recorded, Ok(unit))) if unit != known => {
            let message = format!("`{name}` was recorded in [{recorded}], and is said to be in [{written}]");
            let help = "leave `unit` out: the recording's is taken, and connections convert; if the file is wrong, \
                        correct its values by a `gain`";
            Err(source.error_at(word.span(), message, "").with_help(help))
        }
        _ => Ok(Some(written.clone())),
    }
}

/// What there is to say of the unit that a file has for a column, if it is none.
pub fn unknown_unit_note(column: &str, recorded: Option<&str>, path: &str) -> Option<String> {
    let unit = recorded.filter(|it| Unit::parse(it).is_err())?;
    let cure = "say its `unit`, with a `gain` if there is none like it";
    Some(format!("`{column}` of {path} is in [{unit}], which is no known unit and counts as none: {cure}"))
}

/// Joins logs to one: columns that each of them has, in the units of the first one.
pub fn join_logs(
    scenario: &Scenario,
    file: TableFile,
    logs: Vec<RecordedLog>,
    warnings: &mut Vec<String>,
) -> Result<RecordedLog, Error> {
    let has = |log: &RecordedLog, name: &str| log.columns.iter().any(|it| it.name == name);
    let in_all = |name: &str| logs.iter().all(|log| has(log, name));
    let lost = logs.iter().flat_map(|log| &log.columns).filter(|it| !in_all(&it.name));
    let mut lost: Vec<String> = lost.map(|it| it.name.clone()).collect();
    lost.sort_unstable();
    lost.dedup();
    for name in &lost {
        let without = logs.iter().zip(file.paths).find(|(log, _)| !has(log, name));
        let path = without.map_or("", |(_, path)| path.get_ref());
        warnings.push(format!("`{name}` is left out: {path} has no column for it"));
    }
    let mut columns: Vec<LogColumn> = Vec::new();
    let mut tables = Vec::new();
    for RecordedLog { mut table, columns: mut own } in logs {
        let kept: Vec<usize> = (0..own.len()).filter(|it| !lost.contains(&own[*it].name)).collect();
        table.retain_columns(&kept);
        own.retain(|it| !lost.contains(&it.name));
        if columns.is_empty() {
            columns = own;
        } else {
            for (index, (first, this)) in columns.iter().zip(&own).enumerate() {
                if let Some((factor, offset)) = conversion_to_first_log(first, this)? {
                    table.scale_column(index, factor, offset);
                }
            }
        }
        tables.push(table);
    }
    let mut table = TimeSeriesTable::concatenate(tables).ok_or_else(|| {
        let path = scenario.source.main_path().display();
        Error::invalid_input(format!("{path}: expected at least one log in `path`, found an empty list"))
    })?;
    set_origin(scenario, file, &mut table)?;
    Ok(RecordedLog { table, columns })
}

/// Factor and offset to the unit of the same column in the first log.
fn conversion_to_first_log(first: &LogColumn, this: &LogColumn) -> Result<Option<(f64, f64)>, Error> {
    if first.unit == this.unit {
        return Ok(None);
    }
    let parsed = |it: &LogColumn| it.unit.as_deref().and_then(|unit| Unit::parse(unit).ok());
    let converted = match (parsed(this), parsed(first)) {
        (Some(from), Some(to)) => Unit::conversion(&from, &to),
        _ => None,
    };
    converted.map(Some).ok_or_else(|| {
        let said = |it: &LogColumn| match &it.unit {
            Some(unit) => format!("in [{unit}]"),
            None => "without a unit".to_owned(),
        };
        let message = format!(
            "`{}` is {} in {} and {} in {}",
            this.name,
            said(first),
            first.path,
            said(this),
            this.path
        );
        this.source
            .error_at(this.column.column.span(), message, "")
            .with_help("say its `unit` where a file has none or a wrong one")
    })
}
