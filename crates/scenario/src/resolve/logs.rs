//! Reads the recorded files of `[[table]]` and `[analysis.table]` with their columns, units and aliases; an error points at the entry
//! that does not fit the file.

mod columns;
mod units;

use std::path::Path;
use std::sync::Arc;

use ::units::Unit;
use diagnostics::{Error, ErrorCollector, SourceFiles, Spanned};
use plugin::OwnedInputSignal;
use recording::table::{ColumnRequest, ColumnScaling, ColumnType, ReadRequest, TableError, TimeSeriesTable};

use self::columns::{ColumnSelection, LogColumnRequest};
use crate::document::{Column, Scenario, SignalAliases, TableFile};

/// A recorded file, or several one after another, as it was wanted.
pub(super) struct RecordedLog {
    /// The columns, in the order of their names.
    pub table: TimeSeriesTable,
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
    pub source: Arc<SourceFiles>,
    /// Its unit.
    pub unit: Option<String>,
    /// The path of the file, as in the scenario.
    pub path: String,
}

/// What aliases are asked for.
#[derive(Clone, Copy)]
pub(super) enum AliasRequest<'a> {
    /// What an analysis takes, as far as the file has it; what it needs must be there.
    Needs(&'a [OwnedInputSignal]),
    /// All, if no column is named.
    All,
}

/// Reads the columns as numbers over rising times.
pub(super) fn read_log_numbers(
    scenario: &Scenario,
    file: TableFile,
    aliases: Option<&SignalAliases>,
    request: AliasRequest,
    warnings: &mut Vec<String>,
) -> Result<RecordedLog, Error> {
    let reader = LogReader { scenario, file, aliases, request, reading_rule: None };
    let mut logs = Vec::new();
    let each = file.paths.iter().map(|path| reader.read_file(path, warnings));
    logs.extend(ErrorCollector::collect_all(each)?);
    units::join_logs(scenario, file, logs, warnings)
}

/// The form in which a column is read, by its name in the scenario and the words about it.
pub(super) type ColumnTypeRule<'r> = &'r dyn Fn(&str, &Column) -> ColumnType;

/// Reads the columns to play them back, each in its form; two rows may have one time.
pub(super) fn read_for_playback(
    scenario: &Scenario,
    file: TableFile,
    reading_rule: ColumnTypeRule,
    warnings: &mut Vec<String>,
) -> Result<RecordedLog, Error> {
    let [path] = file.paths else {
        let message = "several logs one after another are for analyses: expected one to play back";
        let second = file.paths.get(1);
        return Err(second.map_or_else(Error::already_reported, |second| scenario.error_at(second, message)));
    };
    let aliases = read_aliases(scenario, file)?;
    let reader = LogReader {
        scenario,
        file,
        aliases: aliases.as_ref(),
        request: AliasRequest::All,
        reading_rule: Some(reading_rule),
    };
    let mut log = reader.read_file(path, warnings)?;
    set_origin(scenario, file, &mut log.table)?;
    Ok(log)
}

/// The aliases of a file, if it has some.
pub(super) fn read_aliases(scenario: &Scenario, file: TableFile) -> Result<Option<SignalAliases>, Error> {
    let read = |word: &Spanned<String>| {
        SignalAliases::read(&scenario.source.resolve_path(word))
            .map_err(|error| error.unwrap_or_else(|message| scenario.error_at(word, message)))
    };
    let Some(aliases) = file.aliases.map(read).transpose()? else { return Ok(None) };
    let sound =
        aliases.candidate_columns().map(|Column { unit: word, gain, offset, sign, delay, .. }| {
            let source = &aliases.source;
            word.as_ref().map(|word| parse_unit(source, word)).transpose()?;
            delay.as_ref().map(|word| require_finite(source, word)).transpose()?;
            parse_scaling(source, gain, offset, sign).map(drop)
        });
    ErrorCollector::collect_all(sound)?;
    Ok(Some(aliases))
}

fn set_origin(scenario: &Scenario, file: TableFile, table: &mut TimeSeriesTable) -> Result<(), Error> {
    if let Some(origin) = file.origin.filter(|origin| !origin.get_ref().is_finite()) {
        let message = format!("`origin`: expected a time in s, found {}", origin.get_ref());
        return Err(scenario.error_at(origin, message));
    }
    table.set_origin(file.origin.map(|origin| *origin.get_ref()));
    Ok(())
}

/// What reads one file after another.
struct LogReader<'r> {
    scenario: &'r Scenario,
    file: TableFile<'r>,
    aliases: Option<&'r SignalAliases>,
    request: AliasRequest<'r>,
    reading_rule: Option<ColumnTypeRule<'r>>,
}

impl LogReader<'_> {
    fn read_file(&self, word: &Spanned<String>, warnings: &mut Vec<String>) -> Result<RecordedLog, Error> {
        let Self { scenario, .. } = *self;
        let path = scenario.source.resolve_path(word);
        let selection = columns::select_columns(self, word, &path)?;
        let units = ErrorCollector::collect_all(selection.entries.iter().map(|entry| {
            let word = entry.column.unit.as_ref();
            word.map(|word| parse_unit(&entry.source, word)).transpose()
        }));
        let table = self
            .table_request(&selection)
            .and_then(|wanted| self.read_table(word, &path, &wanted, &selection));
        let (units, table) = ErrorCollector::collect_both(units, table)?;
        warnings.extend_from_slice(table.warnings());
        for (index, LogColumnRequest { column, .. }) in selection.entries.iter().enumerate() {
            if column.unit.is_none() {
                let (name, path) = (column.column.get_ref(), word.get_ref());
                warnings.extend(units::unknown_unit_note(name, table.column_unit(index), path));
            }
        }
        let columns = selection.entries.into_iter().zip(units).zip(0..);
        let columns = columns.map(|((entry, unit), index)| {
            let unit = units::reconcile_unit(&entry, unit, table.column_unit(index))?;
            let LogColumnRequest { name, column, source } = entry;
            Ok(LogColumn { name, column, source, unit, path: word.get_ref().clone() })
        });
        Ok(RecordedLog { columns: ErrorCollector::collect_all(columns)?, table })
    }

    /// The table with all columns, or what is wrong with each of them.
    fn read_table(
        &self,
        word: &Spanned<String>,
        path: &Path,
        wanted: &ReadRequest,
        selection: &ColumnSelection,
    ) -> Result<TimeSeriesTable, Error> {
        TimeSeriesTable::read(path, wanted).map_err(|error| {
            let each =
                error.into_errors().into_iter().map(|error| self.error_at_column(word, selection, &error));
            // Errors alone make an error.
            ErrorCollector::collect_all::<TimeSeriesTable>(each.map(Err))
                .err()
                .unwrap_or_else(Error::already_reported)
        })
    }

    fn table_request(&self, selection: &ColumnSelection) -> Result<ReadRequest, Error> {
        let Self { file, reading_rule, .. } = *self;
        let column = |request: &LogColumnRequest| {
            let LogColumnRequest { name, column, source } = request;
            let Column { gain, offset, sign, delay, gaps, .. } = column;
            Ok(ColumnRequest {
                name: name.clone(),
                column: column.column.get_ref().clone(),
                column_type: reading_rule.map_or(ColumnType::Number, |reading| reading(name, column)),
                gaps: gaps.unwrap_or(file.gaps),
                scaling: parse_scaling(source, gain, offset, sign)?,
                delay: delay.as_ref().map_or(Ok(0.0), |word| require_finite(source, word))?,
            })
        };
        let time_unit = |(source, word): &(Arc<SourceFiles>, Spanned<String>)| time_unit(source, word);
        Ok(ReadRequest {
            time: selection.time.as_ref().map(|(_, time)| time.get_ref().clone()),
            time_unit: selection.time_unit.as_ref().map(time_unit).transpose()?,
            columns: ErrorCollector::collect_all(selection.entries.iter().map(column))?,
            jumps: reading_rule.is_some(),
            dialect: file.dialect,
        })
    }

    /// An error at the word that does not fit the file, of the scenario or of an alias.
    fn error_at_column(
        &self,
        path: &Spanned<String>,
        selection: &ColumnSelection,
        error: &TableError,
    ) -> Error {
        let columns = selection.entries.iter().map(|entry| (entry.source.as_ref(), &entry.column.column));
        let time = selection.time.iter().map(|(source, word)| (source.as_ref(), word));
        let is = |(_, word): &(&SourceFiles, &Spanned<String>)| {
            Some(word.get_ref().as_str()) == error.offending_word()
        };
        match columns.chain(time).find(is) {
            Some((source, word)) => source.error_at(word.span(), error.to_string(), ""),
            None => self.scenario.error_at(path, error.to_string()),
        }
    }
}

fn parse_unit(source: &SourceFiles, word: &Spanned<String>) -> Result<Unit, Error> {
    Unit::parse(word.get_ref()).map_err(|error| source.error_at(word.span(), error.to_string(), ""))
}

fn time_unit(source: &SourceFiles, word: &Spanned<String>) -> Result<Unit, Error> {
    let unit = parse_unit(source, word)?;
    match unit.dimension_text().as_str() {
        "s" => Ok(unit),
        found => {
            let message = format!("`{}` is a unit of {found}, not of time", word.get_ref());
            let error = source.error_at(word.span(), message, "");
            Err(error.with_help("expected s, ms, us, min or h"))
        }
    }
}

/// Gain, offset and sign, which are numbers that keep the values apart.
pub(super) fn parse_scaling(
    source: &SourceFiles,
    gain: &Option<Spanned<f64>>,
    offset: &Option<Spanned<f64>>,
    sign: &Option<Spanned<f64>>,
) -> Result<ColumnScaling, Error> {
    let wrong = |word: &Spanned<f64>, message: String| Err(source.error_at(word.span(), message, ""));
    let mut scaling = ColumnScaling::default();
    if let Some(word) = gain {
        scaling.gain = *word.get_ref();
        if !scaling.gain.is_finite() || scaling.gain == 0.0 {
            return wrong(word, format!("expected a gain other than 0, found {}", scaling.gain));
        }
    }
    if let Some(word) = offset {
        scaling.offset = require_finite(source, word)?;
    }
    if let Some(word) = sign {
        scaling.sign = *word.get_ref();
        if scaling.sign.abs() != 1.0 {
            let message = format!("`sign` is 1 or -1, found {}: factors are a `gain`", scaling.sign);
            return wrong(word, message);
        }
    }
    Ok(scaling)
}

fn require_finite(source: &SourceFiles, word: &Spanned<f64>) -> Result<f64, Error> {
    match *word.get_ref() {
        number if number.is_finite() => Ok(number),
        number => Err(source.error_at(word.span(), format!("expected a number, found {number}"), "")),
    }
}

/// The titles of a file that can be one of its columns.
fn look_up_columns(
    reader: &LogReader,
    word: &Spanned<String>,
    path: &Path,
    names: &[&str],
) -> Result<Vec<Result<(), TableError>>, Error> {
    let found = recording::table::check_columns_exist(path, names, &reader.file.dialect);
    found.map_err(|error| reader.scenario.error_at(word, error.to_string()))
}

#[cfg(test)]
mod tests;
