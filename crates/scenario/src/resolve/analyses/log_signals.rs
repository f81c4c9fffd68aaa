//! Reads the signals of an analysis from its log, in the units that it wants.

use diagnostics::{Error, ErrorCollector};
use expression::SignalUnit;
use plugin::OwnedInputSignal;

use super::super::logs::{self, AliasRequest, LogColumn, RecordedLog};
use super::super::signal_units::unit_advice;
use super::{SourceSignal, wire_signal};
use crate::document::{AnalysisTable, Column, Scenario, SignalAliases};
use crate::plan::{SignalOrigin, WiredSignal};

/// The signal that says which of several logs a row is from, 1, 2 and so on: an analysis that declares it gets it.
const LOG: &str = "log";

/// Reads the log with what the analysis takes of it.
pub fn read_log(
    scenario: &Scenario,
    table: &AnalysisTable,
    aliases: Option<&SignalAliases>,
    needs: &[OwnedInputSignal],
    warnings: &mut Vec<String>,
) -> Result<RecordedLog, Error> {
    let mut log =
        logs::read_log_numbers(scenario, table.file(), aliases, AliasRequest::Needs(needs), warnings)?;
    keep_time_ranges(scenario, table, &mut log)?;
    let number = needs.iter().any(|need| need.name == LOG);
    if number && log.columns.iter().all(|column| column.name != LOG) {
        log.table.add_log_number_column(LOG);
    }
    Ok(log)
}

/// Leaves out the rows that the scenario does not want.
fn keep_time_ranges(scenario: &Scenario, table: &AnalysisTable, log: &mut RecordedLog) -> Result<(), Error> {
    let Some(first) = table.during.first() else { return Ok(()) };
    for word in &table.during {
        let [from, until] = *word.get_ref();
        let rises = from < until;
        if !rises {
            let message = format!("expected two rising times [s], found {from} and {until}");
            return Err(scenario.error_at(word, message));
        }
    }
    let stretches: Vec<_> = table.during.iter().map(|word| *word.get_ref()).collect();
    log.table.keep_time_ranges(&stretches).map_err(|(column, [begin, end])| {
        let message = format!(
            "expected rows within `during`, found none of `{column}`, which goes from {begin} s to {end} s"
        );
        scenario.error_at(first, message)
    })
}

/// The columns of the log, in the units that the analysis wants.
pub fn wire_columns(
    log: &RecordedLog,
    needs: &[OwnedInputSignal],
    mistakes: &mut ErrorCollector,
) -> Vec<WiredSignal> {
    let mut wired = Vec::new();
    for (index, column) in log.columns.iter().enumerate() {
        let wanted = needs.iter().find(|it| it.name == column.name);
        let made = wanted.map(|wanted| wire_column(wanted, index, column));
        wired.extend(made.and_then(|made| mistakes.ok_or_record(made)));
    }
    if log.table.column_names().len() > log.columns.len() {
        let (name, unit, origin) = (LOG.to_owned(), String::new(), SignalOrigin::Log(log.columns.len()));
        wired.push(WiredSignal { name, unit, origin, factor: 1.0, offset: 0.0 });
    }
    wired
}

/// A column of a log, in the unit that the plugin wants.
fn wire_column(wanted: &OwnedInputSignal, index: usize, of: &LogColumn) -> Result<WiredSignal, Error> {
    let LogColumn { column: Column { column, unit: word, .. }, source: file, unit, .. } = of;
    let span = word.as_ref().unwrap_or(column).span();
    let source = SourceSignal { file, span, name: column.get_ref() };
    let help = |unit: &str| {
        let advice = unit_advice(column.get_ref(), unit, None);
        format!("say which unit it has: {advice} in the column `{}`", wanted.name)
    };
    let unit = match unit {
        None => SignalUnit::Missing,
        Some(name) => {
            let unit = source.parse_unit(name).map_err(|it| it.with_help(help("m/s")))?;
            SignalUnit::Known(unit, name.to_owned())
        }
    };
    wire_signal(wanted, SignalOrigin::Log(index), unit, source, &help)
}
