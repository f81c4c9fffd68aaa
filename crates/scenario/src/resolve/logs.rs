//! Reads the recorded files of a scenario, and points at the word that does not fit the file.

use std::collections::BTreeMap;

use diagnostics::{Error, Mistakes, Spanned};
use recording::table::{Table, TableError};
use units::Unit;

use crate::words::{Column, Scenario};

/// The words of a scenario that say what is wanted of a file.
pub(super) struct Wanted<'a> {
    pub path: &'a Spanned<String>,
    pub time: Option<&'a Spanned<String>>,
    pub origin: Option<f64>,
    pub columns: &'a BTreeMap<Spanned<String>, Spanned<Column>>,
}

/// A file, as it was wanted.
pub(super) struct Log {
    /// The columns, in the order of their names.
    pub table: Table,
    /// Their units.
    pub units: Vec<Option<String>>,
}

/// Reads the columns.
pub(super) fn read(
    scenario: &Scenario,
    wanted: &Wanted,
    warnings: &mut Vec<String>,
) -> Result<Log, Error> {
    let path = scenario.source.resolve(wanted.path);
    let pair = |(name, column): (&Spanned<String>, &Spanned<Column>)| {
        (name.get_ref().clone(), column.get_ref().column.get_ref().clone())
    };
    let columns: Vec<_> = wanted.columns.iter().map(pair).collect();
    let time = wanted.time.map(|time| time.get_ref().as_str());
    let mut table = Table::read(&path, time, &columns)
        .map_err(|error| scenario.error(wrong_word(wanted, &error), error.to_string()))?;
    table.set_origin(wanted.origin);
    warnings.extend(table.warning().map(str::to_owned));
    let units = wanted.columns.values().zip(0..);
    let units = units.map(|(column, place)| unit(scenario, column.get_ref(), table.unit(place)));
    Ok(Log { units: Mistakes::all(units)?, table })
}

/// The word of the scenario that does not fit the file.
fn wrong_word<'a>(wanted: &Wanted<'a>, error: &TableError) -> &'a Spanned<String> {
    let columns = wanted.columns.values().map(|column| &column.get_ref().column);
    let mut words = columns.chain(wanted.time);
    let wrong = words.find(|word| Some(word.get_ref().as_str()) == error.word());
    wrong.unwrap_or(wanted.path)
}

/// The unit of a column: that of the scenario or that of the file, which must not contradict each other.
/// A unit of the file that is not known here gives way.
fn unit(
    scenario: &Scenario,
    column: &Column,
    recorded: Option<&str>,
) -> Result<Option<String>, Error> {
    let Some(word) = &column.unit else { return Ok(recorded.map(str::to_owned)) };
    let (written, name) = (word.get_ref(), column.column.get_ref());
    let known = super::unit::unit(scenario, word)?;
    match recorded.map(|recorded| (recorded, Unit::parse(recorded))) {
        Some((recorded, Ok(unit))) if unit != known => {
            let message =
                format!("`{name}` was recorded in [{recorded}], and is said to be in [{written}]");
            let help = "leave `unit` out: the recording's is taken, and connections convert";
            Err(scenario.error(word, message).help(help))
        }
        _ => Ok(Some(written.clone())),
    }
}
