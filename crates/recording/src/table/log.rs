//! Reads columns of numbers, integers or texts from the log of a data logger.

mod channel_index;
mod series_builder;
mod stamps;

use std::path::Path;

use log_file::{ChannelValues, ClockTime, LogFile};

pub use self::channel_index::ChannelIndex;
pub use self::series_builder::{ChannelValue, SeriesBuilder};
use self::stamps::{MonotonicStamps, StampBuilder};
use super::read_request::{ColumnRequest, ReadRequest};
use super::{ReadColumns, ReadSeries, TableError};

/// A file that has none of the formats of data loggers is nothing.
pub fn open_log(path: &Path) -> Result<Option<LogFile>, TableError> {
    // What is no file can be read only once.
    if std::fs::metadata(path).is_ok_and(|about| !about.is_file()) {
        return Ok(None);
    }
    LogFile::open(path).map_err(|error| log_error(path, error.to_string()))
}

fn log_error(path: &Path, what: String) -> TableError {
    TableError::Log { path: path.to_owned(), what }
}

/// The columns of a log while they are read.
struct LogTableReader<'w> {
    path: &'w Path,
    log: LogFile,
    found: ChannelIndex,
    request: &'w ReadRequest,
    /// The channel of each column.
    places: Vec<Result<usize, TableError>>,
    columns: Vec<SeriesBuilder>,
}

/// Reads the wanted columns; those of one clock share their time stamps.
pub fn read_log_columns(path: &Path, log: LogFile, request: &ReadRequest) -> Result<ReadColumns, TableError> {
    if let Some(key) = request.dialect.first_key() {
        return Err(TableError::NotCsv { path: path.to_owned(), format: log.format, key });
    }
    let found = ChannelIndex::new(path, &log);
    let places = request.columns.iter().map(|it| found.find_channel(&it.column)).collect();
    let columns = request.columns.iter().map(|it| SeriesBuilder::new(it.column_type)).collect();
    let mut reader = LogTableReader { path, log, found, request, places, columns };
    let (mut clocks, mut wrong_times) = (Vec::new(), Vec::new());
    for clock in reader.requested_clocks() {
        match reader.read_clock(clock)? {
            Ok(stamps) => clocks.push((clock, stamps)),
            Err(error) => wrong_times.push(error),
        }
    }
    reader.into_read_columns(clocks, wrong_times)
}

impl LogTableReader<'_> {
    /// The clocks of the columns; of none, that of the time, which is judged all the same.
    fn requested_clocks(&self) -> Vec<usize> {
        let mut clocks: Vec<usize> =
            self.places.iter().flatten().map(|it| self.found.channel_clock(*it)).collect();
        if clocks.is_empty() {
            let of_time = self.request.time.as_ref().and_then(|time| self.found.clock_by_channel_name(time));
            clocks.extend(of_time);
        }
        clocks.sort_unstable();
        clocks.dedup();
        clocks
    }

    /// Reads the columns of a clock, and its time stamps or what is wrong with them.
    fn read_clock(&mut self, clock: usize) -> Result<Result<MonotonicStamps, TableError>, TableError> {
        let Self { path, log, found, request, places, columns } = self;
        let of_clock = |(column, place): (usize, &Result<usize, TableError>)| {
            let place = *place.as_ref().ok()?;
            (found.channel_clock(place) == clock).then_some((column, place))
        };
        let (own, mut channels): (Vec<usize>, Vec<usize>) =
            places.iter().enumerate().filter_map(of_clock).unzip();
        let made = found.clock_time(clock, request).and_then(|time| {
            if let ClockTime::Channel(time) = time {
                channels.push(time);
            }
            StampBuilder::new(path, log.format, found, time, request)
        });
        let mut stamps = match made {
            Ok(stamps) => stamps,
            Err(error) => return Ok(Err(error)),
        };
        let taken = log.read_chunks(clock, &channels, &mut |stretch: &[ChannelValues]| {
            for (column, values) in own.iter().zip(stretch) {
                columns[*column].push_chunk(values);
            }
            let rows = stretch.first().map_or(0, ChannelValues::len);
            stamps.push_times(stretch.get(own.len()), rows);
            true
        });
        taken.map_err(|error| log_error(path, error.to_string()))?;
        Ok(stamps.into_rising_stamps(request.jumps))
    }

    /// The columns with the stamps of their clocks, or all that is wrong.
    fn into_read_columns(
        self,
        clocks: Vec<(usize, MonotonicStamps)>,
        wrong_times: Vec<TableError>,
    ) -> Result<ReadColumns, TableError> {
        let Self { path, log, found, request, places, columns } = self;
        let column = |((place, growing), request): ((Result<usize, _>, SeriesBuilder), &ColumnRequest)| {
            let place = place?;
            let of = found.channel_clock(place);
            let clock = clocks.iter().position(|(clock, _)| *clock == of).unwrap_or(0);
            let SeriesBuilder { values, exact, gap, wrong: what, .. } = growing;
            match what {
                Some(what) => {
                    let (path, column) = (path.to_owned(), request.column.clone());
                    Err(TableError::Values { path, column, what })
                }
                None => Ok(ReadSeries { clock, values, exact, unit: found.channel_unit(place), gap }),
            }
        };
        let columns: Vec<_> = places.into_iter().zip(columns).zip(&request.columns).map(column).collect();
        if !wrong_times.is_empty() {
            let wrong = columns.into_iter().filter_map(Result::err);
            return Err(TableError::from_errors(wrong.chain(wrong_times)));
        }
        let zero = clocks.iter().map(|(_, it)| it.zero).reduce(f64::min).unwrap_or(0.0);
        let clocks = clocks.into_iter().map(|(_, it)| it.relative_to(zero)).collect();
        let told = |it: String| format!("{}: {it}", path.display());
        let warnings = log.warnings().into_iter().map(told).collect();
        Ok(ReadColumns { clocks, columns, zero, warnings })
    }
}

#[cfg(test)]
mod tests;
