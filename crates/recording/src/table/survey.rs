//! Surveys all channels of a file of any format, in one pass.

use std::path::Path;

use log_file::{ChannelKind, Log, Time, Values};

use super::csv::csv_tallies;
use super::mcap::mcap_tallies;
use super::title::unit_of_time;
use super::{File, TableError, log};
use crate::survey::{Channel, Survey, Tally};

/// Goes through a file of any format and size in constant memory, and tells what is in it.
///
/// # Errors
/// When it cannot be read, or is no log.
pub fn survey(path: &Path) -> Result<Survey, TableError> {
    match File::open(path)? {
        File::Mcap => mcap_tallies(path),
        File::Log(log) => of_log(path, *log),
        File::Csv => csv_tallies(path),
    }
}

fn of_log(path: &Path, mut log: Log) -> Result<Survey, TableError> {
    let found = log::ChannelIndex::new(path, &log);
    let titles = found.titles().into_iter();
    let mut channels: Vec<Channel> = titles
        .map(|title| Channel { name: title.name, unit: title.unit, tally: Tally::default() })
        .collect();
    let mut times = Vec::new();
    for clock in 0..log.clocks().len() {
        let time = log.clocks()[clock].time;
        times.push(match time {
            Time::Rate(_) => "the rate of each channel".to_owned(),
            Time::Channel(time) => format!("`{}`", log.channels()[time].name),
            Time::Unknown => "none: name the column of the time".to_owned(),
        });
        let of_clock = |it: &usize| log.channels()[*it].clock == clock;
        let places: Vec<usize> = (0..channels.len()).filter(of_clock).collect();
        let kinds: Vec<ChannelKind> = places.iter().map(|it| log.channels()[*it].kind).collect();
        let time_place = match time {
            Time::Channel(time) => places.iter().position(|it| *it == time),
            _ => None,
        };
        let factor = match time_place.map(|it| (kinds[it], found.unit(places[it]))) {
            Some((ChannelKind::Stamp(per_second), _)) => 1.0 / per_second as f64,
            Some((_, Some(unit))) => units::Unit::parse(&unit).map_or(1.0, |it| it.factor),
            Some((_, None)) => time_place
                .and_then(|it| unit_of_time(&channels[places[it]].name))
                .map_or(1.0, |unit| unit.factor),
            None => 1.0,
        };
        let mut row = 0u64;
        let taken = log.read_chunks(clock, &places, &mut |stretch: &[Values]| {
            let rows = stretch.first().map_or(0, Values::len);
            let stamp = |k: usize| match (time, time_place) {
                (Time::Rate(rate), _) => (row + k as u64) as f64 / rate,
                (_, Some(place)) => stretch[place].number(k).unwrap_or(f64::NAN) * factor,
                _ => f64::NAN,
            };
            for ((place, values), kind) in places.iter().zip(stretch).zip(&kinds) {
                count(&mut channels[*place].tally, values, *kind, &stamp);
            }
            row += rows as u64;
            true
        });
        taken
            .map_err(|error| TableError::Log { path: path.to_owned(), what: error.to_string() })?;
    }
    times.dedup();
    let (left_out, warnings) = (log.left_out(), log.warnings());
    let (format, time) = (log.format.to_owned(), times.join(", "));
    Ok(Survey { format, time, channels, left_out, warnings })
}

fn count(tally: &mut Tally, values: &Values, kind: ChannelKind, stamp: &dyn Fn(usize) -> f64) {
    let factor = if let ChannelKind::Stamp(per_second) = kind { per_second as f64 } else { 1.0 };
    match values {
        Values::Texts(texts) => {
            for (k, text) in texts.iter().enumerate() {
                match text {
                    Some(text) => tally.text(stamp(k), text),
                    None => tally.nothing(),
                }
            }
        }
        numbers => {
            for k in 0..numbers.len() {
                tally.number(stamp(k), numbers.number(k).unwrap_or(f64::NAN) / factor);
            }
        }
    }
}

#[cfg(test)]
mod tests;
