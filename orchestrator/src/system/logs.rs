//! Reads the recorded files that a scenario names, and says which of its words does not fit the file.

use std::collections::BTreeMap;

use toml::Spanned;

use crate::error::Error;
use crate::scenario::{Column, Scenario};
use crate::table::{Table, TableError};

/// The words of a scenario that say what is wanted of a file.
pub(super) struct Wanted<'a> {
    pub path: &'a Spanned<String>,
    pub time: &'a Spanned<String>,
    pub origin: Option<f64>,
    pub columns: &'a BTreeMap<Spanned<String>, Spanned<Column>>,
}

/// Reads the columns, in the order of their names.
pub(super) fn read(scenario: &Scenario, wanted: &Wanted) -> Result<Table, Error> {
    let path = scenario.resolve(wanted.path.get_ref());
    let pair = |(name, column): (&Spanned<String>, &Spanned<Column>)| {
        (name.get_ref().clone(), column.get_ref().column.get_ref().clone())
    };
    let columns: Vec<_> = wanted.columns.iter().map(pair).collect();
    let read = Table::read(&path, wanted.time.get_ref(), &columns);
    let mut read =
        read.map_err(|error| scenario.error(wrong_word(wanted, &error), error.to_string()))?;
    read.set_origin(wanted.origin);
    Ok(read)
}

/// The word of the scenario that does not fit the file.
fn wrong_word<'a>(wanted: &Wanted<'a>, error: &TableError) -> &'a Spanned<String> {
    let TableError::MissingColumn { column: missing, .. } = error else { return wanted.path };
    let columns = wanted.columns.values().map(|column| &column.get_ref().column);
    let mut words = columns.chain([wanted.time]);
    words.find(|word| word.get_ref() == missing).unwrap_or(wanted.path)
}
