//! Chooses the columns of a file: those that the scenario names, and of aliases the first ones that the file has.

use std::collections::HashMap;
use std::path::Path;
use std::sync::Arc;

use diagnostics::suggest::shortened;
use diagnostics::{Error, Mistakes, Source, Spanned};
use recording::table::TableError;

use super::{Asked, Reader, looked_up};
use crate::words::{Aliases, Column};

/// A column that is read, with the words about it.
pub struct Entry {
    /// Its name in the scenario.
    pub name: String,
    pub column: Column,
    /// The file that these words stand in.
    pub source: Arc<Source>,
}

/// The time and the columns of a file. Words stand in the scenario or in the aliases.
pub struct Chosen {
    pub entries: Vec<Entry>,
    pub time: Option<(Arc<Source>, Spanned<String>)>,
    pub time_unit: Option<(Arc<Source>, Spanned<String>)>,
}

/// The alias that is the time where the scenario names none.
const TIME: &str = "time";

/// What a file has of some names, each with what is wrong where it is not there.
struct There(HashMap<String, Result<(), TableError>>);

impl There {
    /// Whether the file has the column; that there are several of one name is told when it is read.
    fn has(&self, name: &str) -> bool {
        !matches!(self.0.get(name), None | Some(Err(TableError::MissingColumn { .. })))
    }

    /// The columns of the file that are close to a name, or all of them.
    fn close(&self, names: &[&str]) -> Option<String> {
        let missing = |name: &&str| match self.0.get(*name) {
            Some(Err(TableError::MissingColumn { hint, present, .. })) => Some((hint, present)),
            _ => None,
        };
        let found: Vec<_> = names.iter().filter_map(missing).collect();
        let hints = found.iter().filter_map(|(hint, _)| hint.as_deref());
        match hints.collect::<Vec<_>>() {
            hints if !hints.is_empty() => Some(hints.join(" ")),
            _ => Some(format!("the file has {}", shortened(found.first()?.1))),
        }
    }
}

/// Chooses the columns of a file.
pub fn choose(reader: &Reader, (word, path): (&Spanned<String>, &Path)) -> Result<Chosen, Error> {
    let Reader { scenario, words, aliases, .. } = *reader;
    // One for all columns: there may be a hundred thousand.
    let own = Arc::new(scenario.source.clone());
    let plain = |(name, column): (&Spanned<String>, &Spanned<Column>)| Entry {
        name: name.get_ref().clone(),
        column: column.get_ref().clone(),
        source: Arc::clone(&own),
    };
    let of_scenario = |word: &Spanned<String>| (Arc::clone(&own), word.clone());
    let Some(aliases) = aliases else {
        if words.columns.is_empty() {
            let message = "expected `columns`, or a file of `aliases`, for this file";
            return Err(scenario.error(word, message));
        }
        return Ok(Chosen {
            entries: words.columns.iter().map(plain).collect(),
            time: words.time.map(of_scenario),
            time_unit: words.time_unit.map(of_scenario),
        });
    };
    let there = there(reader, aliases, (word, path))?;
    let named = words.columns.iter().map(|(name, column)| {
        named(plain((name, column)), aliases, &there).map_err(|tried| {
            let wanted = column.get_ref().column.get_ref();
            missing(aliases, wanted, &tried, &there, path)
        })
    });
    let mut entries = Mistakes::all(named)?;
    let asked = asked(reader, aliases).into_iter().filter_map(|(name, needed)| {
        let (source, name) = (Arc::clone(&aliases.source), name.get_ref().clone());
        match alias(aliases, &name, &there)? {
            Ok(column) => Some(Ok(Entry { name, column: column.clone(), source })),
            Err(tried) if needed => Some(Err(missing(aliases, &name, &tried, &there, path))),
            Err(_) => None,
        }
    });
    entries.extend(Mistakes::all(asked)?);
    // As without aliases: the columns in the order of their names.
    entries.sort_by(|a, b| a.name.cmp(&b.name));
    let (time, time_unit) = time(reader, aliases, &there, path)?;
    if entries.is_empty() {
        let names: Vec<&str> = aliases.names().map(|it| it.get_ref().as_str()).collect();
        let message = format!(
            "{} has no column of the aliases that are asked for; there are aliases for {}",
            path.display(),
            shortened(&names)
        );
        return Err(scenario
            .error(word, message)
            .hint(there.close(&aliases.columns().collect::<Vec<_>>())));
    }
    Ok(Chosen { entries, time, time_unit })
}

/// The column that the scenario names: one of the file, or of an alias. Of neither, reading the file tells what it has.
fn named<'a>(entry: Entry, aliases: &'a Aliases, there: &There) -> Result<Entry, Vec<&'a str>> {
    let own = &entry.column;
    let wanted = own.column.get_ref();
    if there.has(wanted) {
        return Ok(entry);
    }
    let Some(found) = alias(aliases, wanted, there).transpose()? else { return Ok(entry) };
    Ok(match own.says_more() {
        true => Entry { column: own.over(found), ..entry },
        false => Entry {
            column: Column { gaps: own.gaps.or(found.gaps), ..found.clone() },
            source: Arc::clone(&aliases.source),
            ..entry
        },
    })
}

/// Looks up all names that may be columns.
fn there(
    reader: &Reader,
    aliases: &Aliases,
    file: (&Spanned<String>, &Path),
) -> Result<There, Error> {
    let columns = reader.words.columns.values();
    let mut names: Vec<&str> = columns.map(|it| it.get_ref().column.get_ref().as_str()).collect();
    names.extend(aliases.columns());
    names.extend(reader.words.time.map(|time| time.get_ref().as_str()));
    names.sort_unstable();
    names.dedup();
    let found = looked_up(reader, file, &names)?;
    Ok(There(names.into_iter().map(str::to_owned).zip(found).collect()))
}

/// The first column of an alias that the file has, or all that were tried; nothing without such an alias.
fn alias<'a>(
    aliases: &'a Aliases,
    name: &str,
    there: &There,
) -> Option<Result<&'a Column, Vec<&'a str>>> {
    let (_, list) = aliases.get(name)?;
    let found = list.iter().find(|column| there.has(column.column.get_ref()));
    Some(found.ok_or_else(|| list.iter().map(|it| it.column.get_ref().as_str()).collect()))
}

/// The error at an alias of which a file has no column.
fn missing(aliases: &Aliases, name: &str, tried: &[&str], there: &There, path: &Path) -> Error {
    let quoted: Vec<String> = tried.iter().map(|it| format!("`{it}`")).collect();
    let message =
        format!("{} has none of the columns of `{name}`: {}", path.display(), quoted.join(", "));
    let place = aliases.get(name).map_or(0..0, |(name, _)| name.span());
    aliases.source.error(place, message, "").hint(there.close(tried))
}

/// The aliases that are asked for, each with whether it must be there.
fn asked<'a>(reader: &Reader, aliases: &'a Aliases) -> Vec<(&'a Spanned<String>, bool)> {
    let columns = reader.words.columns;
    let is_named = |name: &str| columns.keys().any(|it| it.get_ref() == name);
    let names = aliases.names().filter(|name| !is_named(name.get_ref()));
    match reader.asked {
        Asked::All if !columns.is_empty() => Vec::new(),
        Asked::All => {
            let columns = names.filter(|name| name.get_ref() != TIME);
            columns.map(|name| (name, false)).collect()
        }
        Asked::Needs(needs) => names
            .filter_map(|name| {
                let need = needs.iter().find(|need| need.name == *name.get_ref())?;
                Some((name, need.required))
            })
            .collect(),
    }
}

/// A word, with the file that it stands in.
type Placed = Option<(Arc<Source>, Spanned<String>)>;

/// The column of the time and its unit: what the scenario names, or an alias.
fn time(
    reader: &Reader,
    aliases: &Aliases,
    there: &There,
    path: &Path,
) -> Result<(Placed, Placed), Error> {
    let own = |word: &Spanned<String>| (Arc::new(reader.scenario.source.clone()), word.clone());
    let (words, unit) = (reader.words.time, reader.words.time_unit.map(own));
    let name = words.map_or(TIME, |word| word.get_ref());
    if words.is_some_and(|word| there.has(word.get_ref())) {
        return Ok((words.map(own), unit));
    }
    match alias(aliases, name, there) {
        None => Ok((words.map(own), unit)),
        // A log may have a time of its own.
        Some(Err(_)) if words.is_none() => Ok((None, unit)),
        Some(Err(tried)) => Err(missing(aliases, name, &tried, there, path)),
        Some(Ok(column)) => {
            let of_alias = |word: &Spanned<String>| (Arc::clone(&aliases.source), word.clone());
            let unit = unit.or_else(|| column.unit.as_ref().map(of_alias));
            Ok((Some(of_alias(&column.column)), unit))
        }
    }
}
