//! Surveys the columns of a CSV file.

use std::path::Path;

use super::cell::{Cell, DecimalEvidence, cell, clock, decimal_evidence};
use text_encoding::utf8_or_latin1;

use super::file::CsvFile;
use super::text_at;
use crate::survey::{Channel, Survey, Tally};
use crate::table::TableError;
use crate::table::read_request::{Decimal, Dialect, Separator};
use crate::table::title::unit_of_time;

/// So many rows tell the decimal mark.
const SAMPLE: usize = 10_000;
/// Usual titles of the time, in small letters; without any it is the first column.
const TIMES: [&str; 7] = ["t", "time", "timestamp", "ts", "elapsedtime", "logtime", "sessiontime"];

/// The survey of a CSV file.
pub fn csv_tallies(path: &Path) -> Result<Survey, TableError> {
    let source = text_at(path)?;
    let mut file = CsvFile::open(path, &source, &[], &Dialect::default())?;
    file.is_timed = true;
    let decimal = decimal(&file)?;
    let titles = file.layout.titles.iter().enumerate();
    let channels = titles.map(|(place, title)| {
        let name = if title.plain.is_empty() { "" } else { file.name(place) };
        let (name, unit) = (name.to_owned(), file.unit(place)?);
        Ok(Channel { name, unit, tally: Tally::default() })
    });
    let mut channels: Vec<Channel> = channels.collect::<Result<_, TableError>>()?;
    let bare = |name: &str| {
        let letters = name.chars().filter(char::is_ascii_alphanumeric);
        letters.collect::<String>().to_ascii_lowercase()
    };
    let is_time = |it: &Channel| {
        let name = bare(&it.name);
        TIMES.contains(&name.as_str())
            || TIMES.contains(&name.trim_end_matches("ms"))
            || TIMES.contains(&name.trim_end_matches('s'))
    };
    let usual = || channels.iter().position(is_time).unwrap_or(0);
    let time = file.own_time().unwrap_or_else(usual);
    let unit = match &channels[time].unit {
        Some(unit) => units::Unit::parse(unit).ok(),
        None => unit_of_time(&channels[time].name),
    };
    let factor = unit.map_or(1.0, |unit| unit.factor);
    let warning = file.rows(&mut |_, record| {
        let stamp = utf8_or_latin1(&record[time]);
        let stamp = clock(&stamp).or(match cell(&stamp, decimal) {
            Cell::Number(stamp) => Some(stamp * factor),
            _ => None,
        });
        let stamp = stamp.unwrap_or(f64::NAN);
        for (channel, content) in channels.iter_mut().zip(record) {
            let content = utf8_or_latin1(content);
            match cell(&content, decimal) {
                Cell::Number(number) => channel.tally.number(stamp, number),
                Cell::Gap => channel.tally.nothing(),
                Cell::Infinite | Cell::Other => channel.tally.text(stamp, content.trim()),
            }
        }
        true
    })?;
    let time = format!("`{}`, unless another column is named", channels[time].name);
    channels.retain(|it| !it.name.is_empty());
    let format = file.layout.description();
    let warnings = warning.into_iter().chain(file.left_out()).collect();
    Ok(Survey { format, time, channels, left_out: Vec::new(), warnings })
}

fn decimal(file: &CsvFile) -> Result<Decimal, TableError> {
    if file.layout.separator == Separator::Comma {
        return Ok(Decimal::Point);
    }
    let (mut rows, mut decimal) = (0, Decimal::Point);
    file.rows(&mut |_, record| {
        rows += 1;
        let comma = |content: &[u8]| {
            decimal_evidence(&utf8_or_latin1(content)) == DecimalEvidence::Decimal(Decimal::Comma)
        };
        if record.iter().any(comma) {
            decimal = Decimal::Comma;
        }
        rows < SAMPLE && decimal == Decimal::Point
    })?;
    Ok(decimal)
}
