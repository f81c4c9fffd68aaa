//! Reads columns of numbers, integers or texts from the log of a data logger.

mod found;
mod series;
mod stamps;

use std::path::Path;

use log_file::{Log, Time, Values};

pub use self::found::Found;
use self::series::Growing;
use self::stamps::Stamps;
use super::wanted::Wanted;
use super::{Recorded, Series, TableError};

/// A file that has none of the formats of data loggers is nothing.
pub fn open(path: &Path) -> Result<Option<Log>, TableError> {
    // What is no file can be read only once.
    if std::fs::metadata(path).is_ok_and(|about| !about.is_file()) {
        return Ok(None);
    }
    Log::open(path).map_err(|error| wrong(path, error.to_string()))
}

fn wrong(path: &Path, what: String) -> TableError {
    TableError::Log { path: path.to_owned(), what }
}

/// Reads the wanted columns; those of one clock share their time stamps.
pub fn read(path: &Path, mut log: Log, wanted: &Wanted) -> Result<Recorded, TableError> {
    if let Some(key) = wanted.dialect.first_key() {
        return Err(TableError::NotCsv { path: path.to_owned(), format: log.format, key });
    }
    let (format, found) = (log.format, Found::new(path, &log));
    let places = wanted.columns.iter().map(|it| found.place(&it.column));
    let places: Vec<Result<usize, TableError>> = places.collect();
    let right: Vec<usize> = places.iter().flatten().copied().collect();
    let mut clocks: Vec<usize> = right.iter().map(|it| log.channels()[*it].clock).collect();
    if clocks.is_empty() {
        // The time is judged although no column is.
        clocks.extend(wanted.time.as_ref().and_then(|time| Some(found.clock_of(time)?)));
    }
    clocks.sort_unstable();
    clocks.dedup();
    let mut growing: Vec<Growing> =
        wanted.columns.iter().map(|it| Growing::new(it.reading)).collect();
    let (mut read, mut wrong_times) = (Vec::new(), Vec::new());
    for clock in clocks {
        let of_clock = |place: &Result<usize, TableError>| {
            place.as_ref().is_ok_and(|it| log.channels()[*it].clock == clock)
        };
        let columns = (0..places.len()).filter(|it| of_clock(&places[*it]));
        let columns: Vec<usize> = columns.collect();
        let mut channels: Vec<usize> =
            columns.iter().filter_map(|it| places[*it].as_ref().ok().copied()).collect();
        let made = found.time(clock, wanted).and_then(|time| {
            let stamps = Stamps::new((path, format), &found, time, wanted)?;
            channels.extend(match time {
                Time::Channel(time) => Some(time),
                _ => None,
            });
            Ok(stamps)
        });
        let mut stamps = match made {
            Ok(stamps) => stamps,
            Err(error) => {
                wrong_times.push(error);
                continue;
            }
        };
        let taken = log.visit(clock, &channels, &mut |stretch: &[Values]| {
            for (column, values) in columns.iter().zip(stretch) {
                growing[*column].take(values);
            }
            let rows = stretch.first().map_or(0, Values::len);
            stamps.take(stretch.get(columns.len()), rows);
            true
        });
        taken.map_err(|error| wrong(path, error.to_string()))?;
        match stamps.finish(wanted.jumps) {
            Ok(stamps) => read.push((clock, stamps)),
            Err(error) => wrong_times.push(error),
        }
    }
    let mut columns = Vec::new();
    for ((place, growing), column) in places.into_iter().zip(growing).zip(&wanted.columns) {
        columns.push(place.and_then(|place| {
            let of = found.clock(place);
            let clock = read.iter().position(|(clock, _)| *clock == of).unwrap_or(0);
            let unit = found.unit(place);
            let Growing { values, kept, gap, wrong: what, .. } = growing;
            match what {
                Some(what) => {
                    let (path, column) = (path.to_owned(), column.column.clone());
                    Err(TableError::Values { path, column, what })
                }
                None => Ok(Series { clock, values, kept, unit, gap }),
            }
        }));
    }
    if !wrong_times.is_empty() {
        let wrong = columns.into_iter().filter_map(Result::err);
        return Err(TableError::all(wrong.chain(wrong_times)));
    }
    let zero = read.iter().map(|(_, it)| it.zero).reduce(f64::min).unwrap_or(0.0);
    let clocks = read.into_iter().map(|(_, it)| it.since(zero)).collect();
    let told = |it: String| format!("{}: {it}", path.display());
    Ok(Recorded { clocks, columns, zero, warnings: log.warnings().into_iter().map(told).collect() })
}

#[cfg(test)]
mod tests;
