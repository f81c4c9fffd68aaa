//! Takes the signals of an analysis from its log.

use diagnostics::{Error, Mistakes};
use expression::SignalUnit;
use plugin::OwnedInputSignal;

use super::super::logs::{self, Asked, Log, LogColumn};
use super::{read_unit, wire};
use crate::plan::{Origin, Wired};
use crate::words::{Aliases, AnalysisTable, Column, Scenario};

/// The signal that says which of several logs a row is from, 1, 2 and so on: an analysis that declares it gets it.
const LOG: &str = "log";

/// Reads the log with what the analysis takes of it.
pub fn read(
    scenario: &Scenario,
    (table, aliases): (&AnalysisTable, Option<&Aliases>),
    asked: &[OwnedInputSignal],
    warnings: &mut Vec<String>,
) -> Result<Log, Error> {
    let mut log = logs::read(scenario, (table.file(), aliases), Asked::Needs(asked), warnings)?;
    keep_time_ranges(scenario, table, &mut log)?;
    let number = asked.iter().any(|need| need.name == LOG);
    if number && log.columns.iter().all(|column| column.name != LOG) {
        log.table.number_logs(LOG);
    }
    Ok(log)
}

/// Leaves out the rows that the scenario does not want.
fn keep_time_ranges(
    scenario: &Scenario,
    table: &AnalysisTable,
    log: &mut Log,
) -> Result<(), Error> {
    let Some(first) = table.during.first() else { return Ok(()) };
    for word in &table.during {
        let [from, until] = *word.get_ref();
        let rises = from < until;
        if !rises {
            let message = format!("expected two rising times [s], found {from} and {until}");
            return Err(scenario.error(word, message));
        }
    }
    let stretches: Vec<_> = table.during.iter().map(|word| *word.get_ref()).collect();
    log.table.keep_time_ranges(&stretches).map_err(|(column, [begin, end])| {
        let message = format!(
            "expected rows within `during`, found none of `{column}`, which goes from {begin} s to {end} s"
        );
        scenario.error(first, message)
    })
}

/// The columns of the log, in the units that the analysis wants.
pub fn wired(log: &Log, needs: &[OwnedInputSignal], mistakes: &mut Mistakes) -> Vec<Wired> {
    let mut wired = Vec::new();
    for (place, column) in log.columns.iter().enumerate() {
        let wanted = needs.iter().find(|it| it.name == column.name);
        let made = wanted.map(|wanted| wire_column(wanted, place, column));
        wired.extend(made.and_then(|made| mistakes.take(made)));
    }
    if log.table.names().len() > log.columns.len() {
        let (name, unit, origin) = (LOG.to_owned(), String::new(), Origin::Log(log.columns.len()));
        wired.push(Wired { name, unit, origin, factor: 1.0, offset: 0.0 });
    }
    wired
}

/// A column of a log, in the unit that the plugin wants.
fn wire_column(wanted: &OwnedInputSignal, place: usize, of: &LogColumn) -> Result<Wired, Error> {
    let LogColumn { column: Column { column, unit: word, .. }, source, unit, .. } = of;
    let written =
        (source.as_ref(), word.as_ref().unwrap_or(column).span(), column.get_ref().as_str());
    let cure = |unit: &str| {
        format!("say which unit it has: unit = \"{unit}\" in the column `{}`", wanted.name)
    };
    let unit = match unit {
        None => SignalUnit::Missing,
        Some(name) => {
            let unit = read_unit(&written, name).map_err(|it| it.help(cure("m/s")))?;
            SignalUnit::Known(unit, name.to_owned())
        }
    };
    wire(wanted, (Origin::Log(place), unit), written, &cure)
}
