//! Surveys all channels of a file of any format, in one pass.

use std::path::Path;

use log_file::{ChannelKind, ChannelValues, ClockTime, LogFile};

use super::csv::survey_csv;
use super::mcap::survey_message_recording;
use super::title::time_unit_in_name;
use super::{TableError, TableFileFormat, log};
use crate::survey::{BEGINNING_SIZE, ChannelStatistics, ChannelSurvey, LogSurvey, SurveyExtent};

/// Goes through a file of any format and size in constant memory, or through its beginning, and tells what is in it.
///
/// # Errors
/// When it cannot be read, or is no log.
pub fn survey_file(path: &Path, extent: SurveyExtent) -> Result<LogSurvey, TableError> {
    let size = std::fs::metadata(path).map_or(0, |about| about.len());
    let large = (extent == SurveyExtent::Beginning && size > BEGINNING_SIZE).then_some(size);
    match TableFileFormat::detect(path)? {
        TableFileFormat::Mcap => survey_message_recording(path, large),
        TableFileFormat::Log(log) => survey_log(path, *log, large),
        TableFileFormat::Csv => survey_csv(path),
    }
}

fn survey_log(path: &Path, mut log: LogFile, large: Option<u64>) -> Result<LogSurvey, TableError> {
    let found = log::ChannelIndex::new(path, &log);
    let titles = found.column_titles().into_iter();
    let mut channels: Vec<ChannelSurvey> = titles
        .map(|title| ChannelSurvey { name: title.name, unit: title.unit, ..ChannelSurvey::default() })
        .collect();
    // Each clock gets its part, whatever the order of the groups in the file.
    let most = BEGINNING_SIZE / log.clocks().len().max(1) as u64;
    let mut is_cut = false;
    let mut times = Vec::new();
    for clock in 0..log.clocks().len() {
        let time = log.clocks()[clock].time;
        times.push(match time {
            ClockTime::Rate(_) => "the rate of each channel".to_owned(),
            ClockTime::Channel(time) => format!("`{}`", log.channels()[time].name),
            ClockTime::Unknown => "none: name the column of the time".to_owned(),
        });
        let of_clock = |it: &usize| log.channels()[*it].clock == clock;
        let places: Vec<usize> = (0..channels.len()).filter(of_clock).collect();
        let kinds: Vec<ChannelKind> = places.iter().map(|it| log.channels()[*it].kind).collect();
        let time_place = match time {
            ClockTime::Channel(time) => places.iter().position(|it| *it == time),
            _ => None,
        };
        let factor = match time_place.map(|it| (kinds[it], found.channel_unit(places[it]))) {
            Some((ChannelKind::Stamp(per_second), _)) => 1.0 / per_second as f64,
            Some((_, Some(unit))) => units::Unit::parse(&unit).map_or(1.0, |it| it.factor),
            Some((_, None)) => time_place
                .and_then(|it| time_unit_in_name(&channels[places[it]].name))
                .map_or(1.0, |unit| unit.factor),
            None => 1.0,
        };
        let indexed = log.clocks()[clock].rows.filter(|_| large.is_some());
        let row_bytes = size_of::<f64>() as u64 * places.len() as u64;
        let mut row = 0u64;
        let taken = log.read_chunks(clock, &places, &mut |stretch: &[ChannelValues]| {
            let rows = stretch.first().map_or(0, ChannelValues::len);
            let stamp = |k: usize| match (time, time_place) {
                (ClockTime::Rate(rate), _) => (row + k as u64) as f64 / rate,
                (_, Some(place)) => stretch[place].number_at(k).unwrap_or(f64::NAN) * factor,
                _ => f64::NAN,
            };
            for ((place, values), kind) in places.iter().zip(stretch).zip(&kinds) {
                count_values(&mut channels[*place].tally, values, *kind, &stamp);
            }
            row += rows as u64;
            indexed.is_none() || row * row_bytes < most
        });
        taken.map_err(|error| TableError::Log { path: path.to_owned(), what: error.to_string() })?;
        if let Some(rows) = indexed.filter(|rows| *rows > row) {
            is_cut = true;
            places.iter().for_each(|place| channels[*place].indexed_rows = Some(rows));
        }
    }
    times.dedup();
    let (left_out, warnings) = (log.skipped_contents(), log.warnings());
    let part_of = large.filter(|_| is_cut);
    let (format, time) = (log.format.to_owned(), times.join(", "));
    Ok(LogSurvey { format, time, channels, left_out, warnings, part_of })
}

fn count_values(
    tally: &mut ChannelStatistics,
    values: &ChannelValues,
    kind: ChannelKind,
    stamp: &dyn Fn(usize) -> f64,
) {
    let factor = if let ChannelKind::Stamp(per_second) = kind { per_second as f64 } else { 1.0 };
    match values {
        ChannelValues::Texts(texts) => {
            for (k, text) in texts.iter().enumerate() {
                match text {
                    Some(text) => tally.add_text(stamp(k), text),
                    None => tally.add_gap(),
                }
            }
        }
        numbers => {
            for k in 0..numbers.len() {
                tally.add_number(stamp(k), numbers.number_at(k).unwrap_or(f64::NAN) / factor);
            }
        }
    }
}

#[cfg(test)]
mod tests;
