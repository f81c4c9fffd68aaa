//! Selects the columns of a recorded file: those that the scenario names, and of each alias the first one that the file has.

use std::collections::HashMap;
use std::path::Path;
use std::sync::Arc;

use diagnostics::suggest::join_shortened;
use diagnostics::{Error, ErrorCollector, SourceFiles, Spanned};
use recording::table::TableError;

use super::{AliasRequest, LogReader, look_up_columns};
use crate::document::{Column, SignalAliases};

/// A column that is read, with the words about it.
pub struct LogColumnRequest {
    /// Its name in the scenario.
    pub name: String,
    pub column: Column,
    /// The file that these words stand in.
    pub source: Arc<SourceFiles>,
}

/// The time and the columns of a file. Words stand in the scenario or in the aliases.
pub struct ColumnSelection {
    pub entries: Vec<LogColumnRequest>,
    pub time: Option<(Arc<SourceFiles>, Spanned<String>)>,
    pub time_unit: Option<(Arc<SourceFiles>, Spanned<String>)>,
}

/// The alias that is the time where the scenario names none.
const TIME: &str = "time";

/// What a file has of some names, each with what is wrong where it is not there.
struct ColumnLookup(HashMap<String, Result<(), TableError>>);

impl ColumnLookup {
    /// Whether the file has the column; that there are several of one name is told when it is read.
    fn has_column(&self, name: &str) -> bool {
        !matches!(self.0.get(name), None | Some(Err(TableError::MissingColumn { .. })))
    }

    /// The columns of the file that are close to a name, or all of them.
    fn describe_close_columns(&self, names: &[&str]) -> Option<String> {
        let missing = |name: &&str| match self.0.get(*name) {
            Some(Err(TableError::MissingColumn { hint, present, .. })) => Some((hint, present)),
            _ => None,
        };
        let found: Vec<_> = names.iter().filter_map(missing).collect();
        let hints = found.iter().filter_map(|(hint, _)| hint.as_deref());
        match hints.collect::<Vec<_>>() {
            hints if !hints.is_empty() => Some(hints.join(" ")),
            _ => Some(format!("the file has {}", join_shortened(found.first()?.1))),
        }
    }
}

/// Chooses the columns of a file.
pub fn select_columns(
    reader: &LogReader,
    word: &Spanned<String>,
    path: &Path,
) -> Result<ColumnSelection, Error> {
    let LogReader { scenario, file, aliases, .. } = *reader;
    // One for all columns: there may be a hundred thousand.
    let own = Arc::new(scenario.source.clone());
    let plain = |(name, column): (&Spanned<String>, &Spanned<Column>)| LogColumnRequest {
        name: name.get_ref().clone(),
        column: column.get_ref().clone(),
        source: Arc::clone(&own),
    };
    let of_scenario = |word: &Spanned<String>| (Arc::clone(&own), word.clone());
    let Some(aliases) = aliases else {
        if file.columns.is_empty() {
            let message = "expected `columns`, or a file of `aliases`, for this file";
            return Err(scenario.error_at(word, message));
        }
        return Ok(ColumnSelection {
            entries: file.columns.iter().map(plain).collect(),
            time: file.time.map(of_scenario),
            time_unit: file.time_unit.map(of_scenario),
        });
    };
    let lookup = look_up_names(reader, aliases, word, path)?;
    let named = file.columns.iter().map(|(name, column)| {
        resolve_alias(plain((name, column)), aliases, &lookup).map_err(|tried| {
            let wanted = column.get_ref().column.get_ref();
            missing_column(aliases, wanted, &tried, &lookup, path)
        })
    });
    let mut entries = ErrorCollector::collect_all(named)?;
    let asked = requested_aliases(reader, aliases).into_iter().filter_map(|(name, needed)| {
        let (source, name) = (Arc::clone(&aliases.source), name.get_ref().clone());
        match find_alias_column(aliases, &name, &lookup)? {
            Ok(column) => Some(Ok(LogColumnRequest { name, column: column.clone(), source })),
            Err(tried) if needed => Some(Err(missing_column(aliases, &name, &tried, &lookup, path))),
            Err(_) => None,
        }
    });
    entries.extend(ErrorCollector::collect_all(asked)?);
    // As without aliases: the columns in the order of their names.
    entries.sort_by(|a, b| a.name.cmp(&b.name));
    let (time, time_unit) = time_column_and_unit(reader, aliases, &lookup, path)?;
    if entries.is_empty() {
        let names: Vec<&str> = aliases.alias_names().map(|it| it.get_ref().as_str()).collect();
        let message = format!(
            "{} has no column of the aliases that are asked for; there are aliases for {}",
            path.display(),
            join_shortened(&names)
        );
        return Err(scenario
            .error_at(word, message)
            .with_optional_help(lookup.describe_close_columns(&aliases.column_names().collect::<Vec<_>>())));
    }
    Ok(ColumnSelection { entries, time, time_unit })
}

/// The column that the scenario names: one of the file, or of an alias. Of neither, reading the file tells what it has.
fn resolve_alias<'a>(
    entry: LogColumnRequest,
    aliases: &'a SignalAliases,
    lookup: &ColumnLookup,
) -> Result<LogColumnRequest, Vec<&'a str>> {
    let own = &entry.column;
    let wanted = own.column.get_ref();
    if lookup.has_column(wanted) {
        return Ok(entry);
    }
    let Some(found) = find_alias_column(aliases, wanted, lookup).transpose()? else {
        return Ok(entry);
    };
    Ok(match own.has_conversion() {
        true => LogColumnRequest { column: own.with_alias(found), ..entry },
        false => LogColumnRequest {
            column: Column { gaps: own.gaps.or(found.gaps), ..found.clone() },
            source: Arc::clone(&aliases.source),
            ..entry
        },
    })
}

/// Looks up all names that may be columns.
fn look_up_names(
    reader: &LogReader,
    aliases: &SignalAliases,
    word: &Spanned<String>,
    path: &Path,
) -> Result<ColumnLookup, Error> {
    let columns = reader.file.columns.values();
    let mut names: Vec<&str> = columns.map(|it| it.get_ref().column.get_ref().as_str()).collect();
    names.extend(aliases.column_names());
    names.extend(reader.file.time.map(|time| time.get_ref().as_str()));
    names.sort_unstable();
    names.dedup();
    let found = look_up_columns(reader, word, path, &names)?;
    Ok(ColumnLookup(names.into_iter().map(str::to_owned).zip(found).collect()))
}

/// The first column of an alias that the file has, or all that were tried; nothing without such an alias.
fn find_alias_column<'a>(
    aliases: &'a SignalAliases,
    name: &str,
    lookup: &ColumnLookup,
) -> Option<Result<&'a Column, Vec<&'a str>>> {
    let (_, list) = aliases.find_alias(name)?;
    let found = list.iter().find(|column| lookup.has_column(column.column.get_ref()));
    Some(found.ok_or_else(|| list.iter().map(|it| it.column.get_ref().as_str()).collect()))
}

/// The error at an alias of which a file has no column.
fn missing_column(
    aliases: &SignalAliases,
    name: &str,
    tried: &[&str],
    lookup: &ColumnLookup,
    path: &Path,
) -> Error {
    let quoted: Vec<String> = tried.iter().map(|it| format!("`{it}`")).collect();
    let message = format!("{} has none of the columns of `{name}`: {}", path.display(), quoted.join(", "));
    let span = aliases.find_alias(name).map_or(0..0, |(name, _)| name.span());
    aliases.source.error_at(span, message, "").with_optional_help(lookup.describe_close_columns(tried))
}

/// The aliases that are asked for, each with whether it must be there.
fn requested_aliases<'a>(reader: &LogReader, aliases: &'a SignalAliases) -> Vec<(&'a Spanned<String>, bool)> {
    let columns = reader.file.columns;
    let is_named = |name: &str| columns.keys().any(|it| it.get_ref() == name);
    let names = aliases.alias_names().filter(|name| !is_named(name.get_ref()));
    match reader.request {
        AliasRequest::All if !columns.is_empty() => Vec::new(),
        AliasRequest::All => {
            let columns = names.filter(|name| name.get_ref() != TIME);
            columns.map(|name| (name, false)).collect()
        }
        AliasRequest::Needs(needs) => names
            .filter_map(|name| {
                let need = needs.iter().find(|need| need.name == *name.get_ref())?;
                Some((name, need.required))
            })
            .collect(),
    }
}

/// A word, with the file that it stands in.
type LocatedWord = Option<(Arc<SourceFiles>, Spanned<String>)>;

/// The column of the time and its unit: what the scenario names, or an alias.
fn time_column_and_unit(
    reader: &LogReader,
    aliases: &SignalAliases,
    lookup: &ColumnLookup,
    path: &Path,
) -> Result<(LocatedWord, LocatedWord), Error> {
    let own = |word: &Spanned<String>| (Arc::new(reader.scenario.source.clone()), word.clone());
    let (words, unit) = (reader.file.time, reader.file.time_unit.map(own));
    let name = words.map_or(TIME, |word| word.get_ref());
    if words.is_some_and(|word| lookup.has_column(word.get_ref())) {
        return Ok((words.map(own), unit));
    }
    match find_alias_column(aliases, name, lookup) {
        None => Ok((words.map(own), unit)),
        // A log may have a time of its own.
        Some(Err(_)) if words.is_none() => Ok((None, unit)),
        Some(Err(tried)) => Err(missing_column(aliases, name, &tried, lookup, path)),
        Some(Ok(column)) => {
            let of_alias = |word: &Spanned<String>| (Arc::clone(&aliases.source), word.clone());
            let unit = unit.or_else(|| column.unit.as_ref().map(of_alias));
            Ok((Some(of_alias(&column.column)), unit))
        }
    }
}
