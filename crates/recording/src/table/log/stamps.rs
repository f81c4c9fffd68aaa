//! Converts the times of a log to rising time stamps.

use std::path::{Path, PathBuf};

use log_file::{ChannelKind, ChannelValues, ClockTime};
use units::Unit;

use super::channel_index::ChannelIndex;
use crate::table::title::time_unit_in_name;
use crate::table::{CsvError, ReadRequest, TableError};

/// The time stamps of a clock, while they are read.
pub struct StampBuilder {
    path: PathBuf,
    /// The column of the time.
    column: String,
    form: StampUnit,
    /// The time of the file at which the stamps are 0 [s].
    base: f64,
    stamps: Vec<f64>,
    /// The first row without a time.
    gap: Option<usize>,
}

/// How times become stamps.
enum StampUnit {
    /// So many rows in a second.
    Rate(f64),
    /// Numbers in a unit of so many seconds.
    Unit(f64),
    /// So many integers in a second.
    Integers(i64),
}

/// Stamps in rising order.
pub struct MonotonicStamps {
    stamps: Vec<f64>,
    /// The time of the file at which they are 0 [s].
    pub zero: f64,
}

impl MonotonicStamps {
    /// The stamps as from a time on that is before all of them [s].
    pub fn relative_to(self, zero: f64) -> Vec<f64> {
        let late = self.zero - zero;
        match late == 0.0 {
            true => self.stamps,
            false => self.stamps.into_iter().map(|stamp| stamp + late).collect(),
        }
    }
}

impl StampBuilder {
    pub fn new(
        path: &Path,
        format: &'static str,
        found: &ChannelIndex,
        time: ClockTime,
        request: &ReadRequest,
    ) -> Result<Self, TableError> {
        let (column, form) = match time {
            ClockTime::Rate(rate) => (format!("the clock of {format}"), StampUnit::Rate(rate)),
            ClockTime::Channel(place) => {
                let channel = found.channel(place);
                let form = match channel.kind {
                    ChannelKind::Stamp(per_second) => StampUnit::Integers(per_second),
                    _ => StampUnit::Unit(seconds_per_unit(
                        path,
                        &channel.name,
                        found.channel_unit(place),
                        request,
                    )?),
                };
                (channel.name.clone(), form)
            }
            ClockTime::Unknown => (String::new(), StampUnit::Unit(1.0)),
        };
        let (path, stamps) = (path.to_owned(), Vec::new());
        Ok(StampBuilder { path, column, form, base: 0.0, stamps, gap: None })
    }

    /// Takes the times of a stretch, or the number of its rows where these have a rate.
    pub fn push_times(&mut self, times: Option<&ChannelValues>, rows: usize) {
        for row in 0..times.map_or(rows, ChannelValues::len) {
            let stamp = match (&self.form, times) {
                (StampUnit::Rate(rate), _) => self.stamps.len() as f64 / rate,
                (StampUnit::Integers(per_second), Some(ChannelValues::Integers(all))) => {
                    let per_second = i128::from(*per_second);
                    if self.stamps.is_empty() {
                        // Whole seconds: what is left has all its digits.
                        self.base = all[row].map_or(0.0, |it| it.div_euclid(per_second) as f64);
                    }
                    let since = |it: i128| it - self.base as i128 * per_second;
                    all[row].map_or(f64::NAN, |it| since(it) as f64 / per_second as f64)
                }
                (StampUnit::Unit(factor), Some(times)) => {
                    let number = times.number_at(row).unwrap_or(f64::NAN);
                    if *factor == 1.0 { number } else { number * factor }
                }
                _ => f64::NAN,
            };
            if !stamp.is_finite() && self.gap.is_none() {
                self.gap = Some(self.stamps.len() + 1);
            }
            self.stamps.push(stamp);
        }
    }

    /// The stamps, which must rise; with `jumps` two rows may have one time.
    pub fn into_rising_stamps(self, jumps: bool) -> Result<MonotonicStamps, TableError> {
        let StampBuilder { path, column, base: zero, stamps, gap, .. } = self;
        let wrong = |what: String| {
            let (path, column) = (path.clone(), column.clone());
            Err(TableError::Values { path, column, what })
        };
        if stamps.is_empty() {
            return wrong("expected at least one row, found none".to_owned());
        }
        if let Some(row) = gap {
            return wrong(format!("expected a time in each row, found none in row {row}"));
        }
        let rises = |row: usize, pair: &[f64]| match pair[1] == pair[0] {
            true => jumps && (row == 0 || stamps[row - 1] < pair[0]),
            false => pair[1] > pair[0],
        };
        let mut pairs = stamps.windows(2).enumerate();
        if let Some(row) = pairs.position(|(row, pair)| !rises(row, pair)) {
            let (before, found) = (stamps[row] + zero, stamps[row + 1] + zero);
            let cure = "write the log again without such rows";
            return wrong(format!(
                "expected a time after {before} s in row {}, found {found} s: {cure}",
                row + 2
            ));
        }
        Ok(MonotonicStamps { stamps, zero })
    }
}

/// The seconds in one unit of the time.
fn seconds_per_unit(
    path: &Path,
    column: &str,
    written: Option<String>,
    request: &ReadRequest,
) -> Result<f64, TableError> {
    let Some(unit) = written else {
        return Ok(request.time_unit.or_else(|| time_unit_in_name(column)).map_or(1.0, |unit| unit.factor));
    };
    let is_time = |it: &Unit| Unit::parse("s").is_ok_and(|second| it.same_dimension(&second));
    let known = Unit::parse(&unit).ok().filter(is_time);
    let why = match (known, request.time_unit) {
        (Some(known), Some(said)) if known != said => "and `time_unit` is another one: leave it out",
        (Some(known), _) => return Ok(known.factor),
        (None, Some(said)) => return Ok(said.factor),
        (None, None) => "which is no unit of time that is known here: say `time_unit = \"ms\"`, for example",
    };
    let (path, column) = (path.to_owned(), column.to_owned());
    Err(CsvError::TimeUnit { path, column, unit, why }.into())
}
