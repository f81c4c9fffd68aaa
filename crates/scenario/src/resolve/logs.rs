//! Reads the recorded files of a scenario, and points at the word that does not fit the file.

mod columns;
mod units;

use std::path::{Path, PathBuf};
use std::sync::Arc;

use ::units::Unit;
use diagnostics::{Error, Mistakes, Source, Spanned};
use plugin::OwnedInputSignal;
use recording::table::{ColumnRequest, ColumnType, ReadRequest, Scaling, Table, TableError};

use self::columns::{Chosen, Entry};
use crate::words::{Aliases, Column, RecordedFile, Scenario};

/// A recorded file, or several one after another, as it was wanted.
pub(super) struct Log {
    /// The columns, in the order of their names.
    pub table: Table,
    /// Where they come from.
    pub columns: Vec<LogColumn>,
}

/// A column of a recorded file.
pub(super) struct LogColumn {
    /// Its name in the scenario.
    pub name: String,
    /// The words about it, of the scenario or of an alias.
    pub column: Column,
    /// The file that these words stand in.
    pub source: Arc<Source>,
    /// Its unit.
    pub unit: Option<String>,
    /// The path of the file, as in the scenario.
    pub path: String,
}

/// What aliases are asked for.
#[derive(Clone, Copy)]
pub(super) enum Asked<'a> {
    /// What an analysis takes, as far as the file has it; what it needs must be there.
    Needs(&'a [OwnedInputSignal]),
    /// All, if no column is named.
    All,
}

/// Reads the columns as numbers over rising times.
pub(super) fn read(
    scenario: &Scenario,
    (words, aliases): (RecordedFile, Option<&Aliases>),
    asked: Asked,
    warnings: &mut Vec<String>,
) -> Result<Log, Error> {
    let reader = Reader { scenario, words, aliases, asked, readings: None };
    let mut logs = Vec::new();
    let each = words.paths.iter().map(|path| reader.read(path, warnings));
    logs.extend(Mistakes::all(each)?);
    units::join(scenario, words, logs, warnings)
}

/// The form in which a column is read, by its name in the scenario and the words about it.
pub(super) type Readings<'r> = &'r dyn Fn(&str, &Column) -> ColumnType;

/// Reads the columns to play them back, each in its form; two rows may have one time.
pub(super) fn read_again(
    scenario: &Scenario,
    (words, readings): (RecordedFile, Readings),
    warnings: &mut Vec<String>,
) -> Result<Log, Error> {
    let [path] = words.paths else {
        let message = "several logs one after another are for analyses: expected one to play back";
        let place = words.paths.get(1);
        return Err(place.map_or_else(Error::follow_up, |second| scenario.error(second, message)));
    };
    let aliases = aliases(scenario, words)?;
    let (aliases, readings) = (aliases.as_ref(), Some(readings));
    let reader = Reader { scenario, words, aliases, asked: Asked::All, readings };
    let mut log = reader.read(path, warnings)?;
    set_origin(scenario, words, &mut log.table)?;
    Ok(log)
}

/// The aliases of a file, if it has some.
pub(super) fn aliases(scenario: &Scenario, words: RecordedFile) -> Result<Option<Aliases>, Error> {
    let read = |word: &Spanned<String>| {
        Aliases::read(&scenario.source.resolve(word))
            .map_err(|error| error.unwrap_or_else(|message| scenario.error(word, message)))
    };
    let Some(aliases) = words.aliases.map(read).transpose()? else { return Ok(None) };
    let sound = aliases.all().map(|Column { unit: word, gain, offset, sign, delay, .. }| {
        let source = &aliases.source;
        word.as_ref().map(|word| unit(source, word)).transpose()?;
        delay.as_ref().map(|word| finite(source, word)).transpose()?;
        scaling(source, [gain, offset, sign]).map(drop)
    });
    Mistakes::all(sound)?;
    Ok(Some(aliases))
}

fn set_origin(scenario: &Scenario, words: RecordedFile, table: &mut Table) -> Result<(), Error> {
    if let Some(origin) = words.origin.filter(|origin| !origin.get_ref().is_finite()) {
        let message = format!("`origin`: expected a time in s, found {}", origin.get_ref());
        return Err(scenario.error(origin, message));
    }
    table.set_origin(words.origin.map(|origin| *origin.get_ref()));
    Ok(())
}

/// What reads one file after another.
struct Reader<'r> {
    scenario: &'r Scenario,
    words: RecordedFile<'r>,
    aliases: Option<&'r Aliases>,
    asked: Asked<'r>,
    readings: Option<Readings<'r>>,
}

impl Reader<'_> {
    fn read(&self, word: &Spanned<String>, warnings: &mut Vec<String>) -> Result<Log, Error> {
        let Self { scenario, .. } = *self;
        let path = scenario.source.resolve(word);
        let chosen = columns::choose(self, (word, &path))?;
        let units = Mistakes::all(chosen.entries.iter().map(|entry| {
            let word = entry.column.unit.as_ref();
            word.map(|word| unit(&entry.source, word)).transpose()
        }));
        let table = self.wanted(&chosen);
        let table = table.and_then(|wanted| self.whole((word, &path), &wanted, &chosen));
        let (units, table) = Mistakes::both(units, table)?;
        warnings.extend_from_slice(table.warnings());
        let said = chosen.entries.iter().map(|it| (it.column.column.get_ref(), &it.column.unit));
        let unknown = said.zip(0..).filter_map(|((name, said), place)| match said {
            Some(_) => None,
            None => units::unknown(name, table.unit(place), word.get_ref()),
        });
        warnings.extend(unknown);
        let columns = chosen.entries.into_iter().zip(units).zip(0..);
        let columns = columns.map(|((entry, unit), place)| {
            let unit = units::agreed(&entry, unit, table.unit(place))?;
            let Entry { name, column, source } = entry;
            Ok(LogColumn { name, column, source, unit, path: word.get_ref().clone() })
        });
        Ok(Log { columns: Mistakes::all(columns)?, table })
    }

    /// The table with all columns, or what is wrong with each of them.
    fn whole(
        &self,
        (word, path): (&Spanned<String>, &PathBuf),
        wanted: &ReadRequest,
        chosen: &Chosen,
    ) -> Result<Table, Error> {
        Table::read(path, wanted).map_err(|error| {
            let each = error.each().into_iter().map(|error| self.wrong(word, chosen, &error));
            // Errors alone make an error.
            Mistakes::all::<Table>(each.map(Err)).err().unwrap_or_else(Error::follow_up)
        })
    }

    fn wanted(&self, chosen: &Chosen) -> Result<ReadRequest, Error> {
        let Self { words, readings, .. } = *self;
        let column = |Entry { name, column: words_of, source, .. }: &Entry| {
            let Column { column, gain, offset, sign, delay, gaps, .. } = words_of;
            Ok(ColumnRequest {
                name: name.clone(),
                column: column.get_ref().clone(),
                column_type: readings.map_or(ColumnType::Number, |reading| reading(name, words_of)),
                gaps: gaps.unwrap_or(words.gaps),
                scaling: scaling(source, [gain, offset, sign])?,
                delay: delay.as_ref().map_or(Ok(0.0), |word| finite(source, word))?,
            })
        };
        let time_unit = |(source, word): &(Arc<Source>, Spanned<String>)| time_unit(source, word);
        Ok(ReadRequest {
            time: chosen.time.as_ref().map(|(_, time)| time.get_ref().clone()),
            time_unit: chosen.time_unit.as_ref().map(time_unit).transpose()?,
            columns: Mistakes::all(chosen.entries.iter().map(column))?,
            jumps: readings.is_some(),
            dialect: words.dialect,
        })
    }

    /// An error at the word that does not fit the file, of the scenario or of an alias.
    fn wrong(&self, path: &Spanned<String>, chosen: &Chosen, error: &TableError) -> Error {
        let columns =
            chosen.entries.iter().map(|entry| (entry.source.as_ref(), &entry.column.column));
        let time = chosen.time.iter().map(|(source, word)| (source.as_ref(), word));
        let is =
            |(_, word): &(&Source, &Spanned<String>)| Some(word.get_ref().as_str()) == error.word();
        match columns.chain(time).find(is) {
            Some((source, word)) => source.error(word.span(), error.to_string(), ""),
            None => self.scenario.error(path, error.to_string()),
        }
    }
}

fn unit(source: &Source, word: &Spanned<String>) -> Result<Unit, Error> {
    Unit::parse(word.get_ref()).map_err(|error| source.error(word.span(), error.to_string(), ""))
}

fn time_unit(source: &Source, word: &Spanned<String>) -> Result<Unit, Error> {
    let unit = unit(source, word)?;
    match unit.dimension().as_str() {
        "s" => Ok(unit),
        found => {
            let message = format!("`{}` is a unit of {found}, not of time", word.get_ref());
            let error = source.error(word.span(), message, "");
            Err(error.help("expected s, ms, us, min or h"))
        }
    }
}

/// Gain, offset and sign, which are numbers that keep the values apart.
pub(super) fn scaling(
    source: &Source,
    [gain, offset, sign]: [&Option<Spanned<f64>>; 3],
) -> Result<Scaling, Error> {
    let wrong = |word: &Spanned<f64>, message: String| Err(source.error(word.span(), message, ""));
    let mut scaling = Scaling::default();
    if let Some(word) = gain {
        scaling.gain = *word.get_ref();
        if !scaling.gain.is_finite() || scaling.gain == 0.0 {
            return wrong(word, format!("expected a gain other than 0, found {}", scaling.gain));
        }
    }
    if let Some(word) = offset {
        scaling.offset = finite(source, word)?;
    }
    if let Some(word) = sign {
        scaling.sign = *word.get_ref();
        if scaling.sign.abs() != 1.0 {
            let message =
                format!("`sign` is 1 or -1, found {}: factors are a `gain`", scaling.sign);
            return wrong(word, message);
        }
    }
    Ok(scaling)
}

fn finite(source: &Source, word: &Spanned<f64>) -> Result<f64, Error> {
    match *word.get_ref() {
        number if number.is_finite() => Ok(number),
        number => Err(source.error(word.span(), format!("expected a number, found {number}"), "")),
    }
}

/// The titles of a file that can be one of its columns.
fn looked_up(
    reader: &Reader,
    (word, path): (&Spanned<String>, &Path),
    names: &[&str],
) -> Result<Vec<Result<(), TableError>>, Error> {
    let found = recording::table::look_up(path, names, &reader.words.dialect);
    found.map_err(|error| reader.scenario.error(word, error.to_string()))
}

#[cfg(test)]
mod tests;
