//! Reads the recorded files of a scenario, and points at the word that does not fit the file.

use std::path::Path;

use diagnostics::{Error, Mistakes, Spanned};
use recording::table::{Reading, Scaling, Table, TableError, Wanted, WantedColumn};
use units::Unit;

use crate::words::{Column, RecordedFile, Scenario};

/// A file, as it was wanted.
pub(super) struct Log {
    /// The columns, in the order of their names.
    pub table: Table,
    /// Their units.
    pub units: Vec<Option<String>>,
}

/// Reads the columns as numbers over rising times.
pub(super) fn read(
    scenario: &Scenario,
    words: RecordedFile,
    warnings: &mut Vec<String>,
) -> Result<Log, Error> {
    read_as(scenario, (words, None), warnings)
}

/// The form in which a column is read, by its name in the scenario.
pub(super) type Readings<'r> = &'r dyn Fn(&str) -> Reading;

/// Reads the columns to play them back, each in its form; two rows may have one time.
pub(super) fn read_again(
    scenario: &Scenario,
    (words, readings): (RecordedFile, Readings),
    warnings: &mut Vec<String>,
) -> Result<Log, Error> {
    read_as(scenario, (words, Some(readings)), warnings)
}

fn read_as(
    scenario: &Scenario,
    (words, readings): (RecordedFile, Option<Readings>),
    warnings: &mut Vec<String>,
) -> Result<Log, Error> {
    let path = scenario.source.resolve(words.path);
    let units = Mistakes::all(words.columns.values().map(|column| {
        let word = column.get_ref().unit.as_ref();
        word.map(|word| super::unit::unit(scenario, word)).transpose()
    }));
    let table =
        wanted(scenario, words, readings).and_then(|wanted| whole(scenario, words, &path, &wanted));
    let (units, mut table) = Mistakes::both(units, table)?;
    if let Some(origin) = words.origin.filter(|origin| !origin.get_ref().is_finite()) {
        let message = format!("`origin`: expected a time in s, found {}", origin.get_ref());
        return Err(scenario.error(origin, message));
    }
    table.set_origin(words.origin.map(|origin| *origin.get_ref()));
    warnings.extend_from_slice(table.warnings());
    let units = words.columns.values().zip(units).zip(0..);
    let units = units.map(|((column, unit), place)| {
        agreed(scenario, (column.get_ref(), unit), table.unit(place))
    });
    Ok(Log { units: Mistakes::all(units)?, table })
}

/// The table with all columns, or what is wrong with each of them.
fn whole(
    scenario: &Scenario,
    words: RecordedFile,
    path: &Path,
    wanted: &Wanted,
) -> Result<Table, Error> {
    Table::read(path, wanted).map_err(|error| {
        let each = error.each().into_iter();
        let each =
            each.map(|error| scenario.error(wrong_word(words, &error), error.to_string())).map(Err);
        // Errors alone make an error.
        Mistakes::all::<Table>(each).err().unwrap_or_else(Error::follow_up)
    })
}

fn wanted(
    scenario: &Scenario,
    words: RecordedFile,
    readings: Option<Readings>,
) -> Result<Wanted, Error> {
    let column = |(name, column): (&Spanned<String>, &Spanned<Column>)| {
        let Column { column, gain, offset, sign, delay, gaps, .. } = column.get_ref();
        Ok(WantedColumn {
            name: name.get_ref().clone(),
            column: column.get_ref().clone(),
            reading: readings.map_or(Reading::Number, |reading| reading(name.get_ref())),
            gaps: gaps.unwrap_or(words.gaps),
            scaling: scaling(scenario, [gain, offset, sign])?,
            delay: delay.as_ref().map_or(Ok(0.0), |word| finite(scenario, word))?,
        })
    };
    Ok(Wanted {
        time: words.time.map(|time| time.get_ref().clone()),
        time_unit: words.time_unit.map(|word| time_unit(scenario, word)).transpose()?,
        columns: Mistakes::all(words.columns.iter().map(column))?,
        jumps: readings.is_some(),
        dialect: words.dialect,
    })
}

fn time_unit(scenario: &Scenario, word: &Spanned<String>) -> Result<Unit, Error> {
    let unit = super::unit::unit(scenario, word)?;
    match unit.dimension().as_str() {
        "s" => Ok(unit),
        found => {
            let message = format!("`{}` is a unit of {found}, not of time", word.get_ref());
            Err(scenario.error(word, message).help("expected s, ms, us, min or h"))
        }
    }
}

/// Gain, offset and sign, which are numbers that keep the values apart.
pub(super) fn scaling(
    scenario: &Scenario,
    [gain, offset, sign]: [&Option<Spanned<f64>>; 3],
) -> Result<Scaling, Error> {
    let wrong = |word: &Spanned<f64>, message: String| Err(scenario.error(word, message));
    let mut scaling = Scaling::default();
    if let Some(word) = gain {
        scaling.gain = *word.get_ref();
        if !scaling.gain.is_finite() || scaling.gain == 0.0 {
            return wrong(word, format!("expected a gain other than 0, found {}", scaling.gain));
        }
    }
    if let Some(word) = offset {
        scaling.offset = finite(scenario, word)?;
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

fn finite(scenario: &Scenario, word: &Spanned<f64>) -> Result<f64, Error> {
    match *word.get_ref() {
        number if number.is_finite() => Ok(number),
        number => Err(scenario.error(word, format!("expected a number, found {number}"))),
    }
}

/// The word of the scenario that does not fit the file.
fn wrong_word<'a>(wanted: RecordedFile<'a>, error: &TableError) -> &'a Spanned<String> {
    let columns = wanted.columns.values().map(|column| &column.get_ref().column);
    let mut words = columns.chain(wanted.time);
    let wrong = words.find(|word| Some(word.get_ref().as_str()) == error.word());
    wrong.unwrap_or(wanted.path)
}

/// The unit of a column: that of the scenario or that of the file, which must not contradict each other. A unit of the file
/// that is not known here gives way, and so does one of another dimension if the column has a gain, as that of a sensor in V.
/// Loggers write g for g0, too.
fn agreed(
    scenario: &Scenario,
    (column, unit): (&Column, Option<Unit>),
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
            let message =
                format!("`{name}` was recorded in [{recorded}], and is said to be in [{written}]");
            let help = "leave `unit` out: the recording's is taken, and connections convert; if the file is wrong, \
                        correct its values by a `gain`";
            Err(scenario.error(word, message).help(help))
        }
        _ => Ok(Some(written.clone())),
    }
}
