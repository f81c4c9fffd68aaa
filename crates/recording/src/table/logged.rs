//! Reads columns of numbers, integers or texts from the log of a data logger.

mod found;
mod series;
mod stamps;

use std::path::Path;

use log_file::{Log, Time, Values};

pub use self::found::Found;
pub use self::series::{Cell, Growing};
use self::stamps::{Rising, Stamps};
use super::wanted::{Wanted, WantedColumn};
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

/// The columns of a log while they are read.
struct Reading<'w> {
    path: &'w Path,
    log: Log,
    found: Found,
    wanted: &'w Wanted,
    /// The channel of each column.
    places: Vec<Result<usize, TableError>>,
    columns: Vec<Growing>,
}

/// Reads the wanted columns; those of one clock share their time stamps.
pub fn read(path: &Path, log: Log, wanted: &Wanted) -> Result<Recorded, TableError> {
    if let Some(key) = wanted.dialect.first_key() {
        return Err(TableError::NotCsv { path: path.to_owned(), format: log.format, key });
    }
    let found = Found::new(path, &log);
    let places = wanted.columns.iter().map(|it| found.place(&it.column)).collect();
    let columns = wanted.columns.iter().map(|it| Growing::new(it.reading)).collect();
    let mut reading = Reading { path, log, found, wanted, places, columns };
    let (mut clocks, mut wrong_times) = (Vec::new(), Vec::new());
    for clock in reading.clocks() {
        match reading.clock(clock)? {
            Ok(stamps) => clocks.push((clock, stamps)),
            Err(error) => wrong_times.push(error),
        }
    }
    reading.recorded(clocks, wrong_times)
}

impl Reading<'_> {
    /// The clocks of the columns; of none, that of the time, which is judged all the same.
    fn clocks(&self) -> Vec<usize> {
        let mut clocks: Vec<usize> =
            self.places.iter().flatten().map(|it| self.found.clock(*it)).collect();
        if clocks.is_empty() {
            let of_time = self.wanted.time.as_ref().and_then(|time| self.found.clock_of(time));
            clocks.extend(of_time);
        }
        clocks.sort_unstable();
        clocks.dedup();
        clocks
    }

    /// Reads the columns of a clock, and its time stamps or what is wrong with them.
    fn clock(&mut self, clock: usize) -> Result<Result<Rising, TableError>, TableError> {
        let Self { path, log, found, wanted, places, columns } = self;
        let of_clock = |(column, place): (usize, &Result<usize, TableError>)| {
            let place = *place.as_ref().ok()?;
            (found.clock(place) == clock).then_some((column, place))
        };
        let (own, mut channels): (Vec<usize>, Vec<usize>) =
            places.iter().enumerate().filter_map(of_clock).unzip();
        let made = found.time(clock, wanted).and_then(|time| {
            if let Time::Channel(time) = time {
                channels.push(time);
            }
            Stamps::new((path, log.format), found, time, wanted)
        });
        let mut stamps = match made {
            Ok(stamps) => stamps,
            Err(error) => return Ok(Err(error)),
        };
        let taken = log.visit(clock, &channels, &mut |stretch: &[Values]| {
            for (column, values) in own.iter().zip(stretch) {
                columns[*column].take(values);
            }
            let rows = stretch.first().map_or(0, Values::len);
            stamps.take(stretch.get(own.len()), rows);
            true
        });
        taken.map_err(|error| wrong(path, error.to_string()))?;
        Ok(stamps.finish(wanted.jumps))
    }

    /// The columns with the stamps of their clocks, or all that is wrong.
    fn recorded(
        self,
        clocks: Vec<(usize, Rising)>,
        wrong_times: Vec<TableError>,
    ) -> Result<Recorded, TableError> {
        let Self { path, log, found, wanted, places, columns } = self;
        let column = |((place, growing), wanted): ((Result<usize, _>, Growing), &WantedColumn)| {
            let place = place?;
            let of = found.clock(place);
            let clock = clocks.iter().position(|(clock, _)| *clock == of).unwrap_or(0);
            let Growing { values, kept, gap, wrong: what, .. } = growing;
            match what {
                Some(what) => {
                    let (path, column) = (path.to_owned(), wanted.column.clone());
                    Err(TableError::Values { path, column, what })
                }
                None => Ok(Series { clock, values, kept, unit: found.unit(place), gap }),
            }
        };
        let columns: Vec<_> =
            places.into_iter().zip(columns).zip(&wanted.columns).map(column).collect();
        if !wrong_times.is_empty() {
            let wrong = columns.into_iter().filter_map(Result::err);
            return Err(TableError::all(wrong.chain(wrong_times)));
        }
        let zero = clocks.iter().map(|(_, it)| it.zero).reduce(f64::min).unwrap_or(0.0);
        let clocks = clocks.into_iter().map(|(_, it)| it.since(zero)).collect();
        let told = |it: String| format!("{}: {it}", path.display());
        let warnings = log.warnings().into_iter().map(told).collect();
        Ok(Recorded { clocks, columns, zero, warnings })
    }
}

#[cfg(test)]
mod tests;
