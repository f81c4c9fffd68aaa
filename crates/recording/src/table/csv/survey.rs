//! Surveys the columns of a CSV file.

use std::path::Path;

use super::cell::{CsvCell, DecimalEvidence, decimal_evidence, parse_cell, parse_clock_seconds};
use text_encoding::utf8_or_latin1;

use super::file::CsvFile;
use super::open_csv_text;
use crate::survey::{ChannelSurvey, LogSurvey};
use crate::table::TableError;
use crate::table::read_request::{CsvDialect, DecimalMark, Separator};
use crate::table::title::time_unit_in_name;

/// So many rows tell the decimal mark.
const SAMPLE: usize = 10_000;
/// Usual titles of the time, in small letters; without any it is the first column.
const TIMES: [&str; 7] = ["t", "time", "timestamp", "ts", "elapsedtime", "logtime", "sessiontime"];

/// The survey of a CSV file.
pub fn survey_csv(path: &Path) -> Result<LogSurvey, TableError> {
    let source = open_csv_text(path)?;
    let mut file = CsvFile::open(path, &source, &[], &CsvDialect::default())?;
    file.is_timed = true;
    let decimal = detect_decimal_mark(&file)?;
    let titles = file.layout.titles.iter().enumerate();
    let channels = titles.map(|(place, title)| {
        let name = if title.plain.is_empty() { "" } else { file.unique_column_name(place) };
        let (name, unit) = (name.to_owned(), file.column_unit(place)?);
        Ok(ChannelSurvey { name, unit, ..ChannelSurvey::default() })
    });
    let mut channels: Vec<ChannelSurvey> = channels.collect::<Result<_, TableError>>()?;
    let bare = |name: &str| {
        let letters = name.chars().filter(char::is_ascii_alphanumeric);
        letters.collect::<String>().to_ascii_lowercase()
    };
    let is_time = |it: &ChannelSurvey| {
        let name = bare(&it.name);
        TIMES.contains(&name.as_str())
            || TIMES.contains(&name.trim_end_matches("ms"))
            || TIMES.contains(&name.trim_end_matches('s'))
    };
    let usual = || channels.iter().position(is_time).unwrap_or(0);
    let time = file.default_time_column().unwrap_or_else(usual);
    let unit = match &channels[time].unit {
        Some(unit) => units::Unit::parse(unit).ok(),
        None => time_unit_in_name(&channels[time].name),
    };
    let factor = unit.map_or(1.0, |unit| unit.factor);
    let warning = file.visit_rows(&mut |_, record| {
        let stamp = utf8_or_latin1(&record[time]);
        let stamp = parse_clock_seconds(&stamp).or(match parse_cell(&stamp, decimal) {
            CsvCell::Number(stamp) => Some(stamp * factor),
            _ => None,
        });
        let stamp = stamp.unwrap_or(f64::NAN);
        for (channel, content) in channels.iter_mut().zip(record) {
            let content = utf8_or_latin1(content);
            match parse_cell(&content, decimal) {
                CsvCell::Number(number) => channel.tally.add_number(stamp, number),
                CsvCell::Gap => channel.tally.add_gap(),
                CsvCell::Infinite | CsvCell::Other => channel.tally.add_text(stamp, content.trim()),
            }
        }
        true
    })?;
    let time = format!("`{}`, unless another column is named", channels[time].name);
    channels.retain(|it| !it.name.is_empty());
    let format = file.layout.describe_layout();
    let warnings = warning.into_iter().chain(file.unread_header_note()).collect();
    Ok(LogSurvey { format, time, channels, warnings, ..LogSurvey::default() })
}

fn detect_decimal_mark(file: &CsvFile) -> Result<DecimalMark, TableError> {
    if file.layout.separator == Separator::Comma {
        return Ok(DecimalMark::Point);
    }
    let (mut rows, mut decimal) = (0, DecimalMark::Point);
    file.visit_rows(&mut |_, record| {
        rows += 1;
        let comma = |content: &[u8]| {
            decimal_evidence(&utf8_or_latin1(content)) == DecimalEvidence::Decimal(DecimalMark::Comma)
        };
        if record.iter().any(comma) {
            decimal = DecimalMark::Comma;
        }
        rows < SAMPLE && decimal == DecimalMark::Point
    })?;
    Ok(decimal)
}
