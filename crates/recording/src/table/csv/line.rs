//! Splits the first lines of a CSV file into cells.

use std::collections::HashSet;

use super::cell::{CsvCell, parse_cell, parse_clock_seconds};
use crate::table::read_request::{DecimalMark, Separator};
use crate::table::title::ParsedTitle;

/// The lines at the beginning of a file among which the titles are looked for.
pub const HEAD: usize = 400;

/// A line at the beginning of the file.
pub(super) struct CsvLine<'a> {
    /// Its number, from 1 on.
    pub number: usize,
    /// Its first byte.
    pub begin: usize,
    /// The first byte behind it.
    pub end: usize,
    text: &'a [u8],
    /// Whether a line without any content stands above it.
    pub is_apart: bool,
}

/// The lines with any content.
pub(super) fn split_into_lines(bytes: &[u8]) -> Vec<CsvLine<'_>> {
    let (mut begin, mut number, mut is_apart, mut lines) = (0, 0, false, Vec::new());
    while begin < bytes.len() && number < HEAD {
        let rest = &bytes[begin..];
        let length = rest.iter().position(|it| matches!(it, b'\n' | b'\r')).unwrap_or(rest.len());
        let more = match (rest.get(length), rest.get(length + 1)) {
            (Some(b'\r'), Some(b'\n')) => 2,
            (Some(_), _) => 1,
            (None, _) => 0,
        };
        number += 1;
        let (text, end) = (&rest[..length], begin + length + more);
        let line = CsvLine { number, begin, end, text, is_apart };
        is_apart = line.is_empty();
        if !is_apart {
            lines.push(line);
        }
        begin = end;
    }
    lines
}

/// The number of the first line with more bytes than these.
pub(super) fn longer_line(bytes: &[u8], longest: usize) -> Option<usize> {
    let lines = bytes.split(|byte| matches!(byte, b'\n' | b'\r'));
    let ends = |lines: &[u8]| 1 + lines.iter().filter(|byte| **byte == b'\n').count();
    lines.enumerate().find(|(_, line)| line.len() > longest).map(|(_, line)| {
        let begin = line.as_ptr() as usize - bytes.as_ptr() as usize;
        ends(&bytes[..begin])
    })
}

/// Whether a cell is a number, a clock or a date, in whatever notation.
pub(super) fn is_number(text: &str) -> bool {
    let text = text.trim();
    let digits = text.trim_start_matches(['+', '-', '.', ',']);
    let is_sign = |c: char| c.is_ascii_digit() || "+-.,:/' eETZxX".contains(c);
    let plain = digits.starts_with(|c: char| c.is_ascii_digit()) && text.chars().all(is_sign);
    let value = || matches!(parse_cell(text, DecimalMark::Point), CsvCell::Number(_) | CsvCell::Infinite);
    plain || value() || parse_clock_seconds(text).is_some()
}

/// Whether a cell has no value.
pub(super) fn is_gap(text: &str) -> bool {
    parse_cell(text, DecimalMark::Point) == CsvCell::Gap
}

/// The number of cells up to the last one with any content.
pub(super) fn filled_cell_count(cells: &[String]) -> usize {
    cells.iter().rposition(|cell| !cell.trim().is_empty()).map_or(0, |last| last + 1)
}

impl CsvLine<'_> {
    fn is_empty(&self) -> bool {
        self.text.iter().all(|byte| byte.is_ascii_whitespace() || b",;\"".contains(byte))
    }

    pub fn is_comment(&self) -> bool {
        self.text.trim_ascii_start().starts_with(b"#")
    }

    /// Its cells; of a comment those behind its sign.
    pub fn split_cells(&self, separator: Separator) -> Vec<String> {
        let is_sign = |byte: &u8| *byte == b'#' || byte.is_ascii_whitespace();
        let signs = self.text.iter().take_while(|byte| self.is_comment() && is_sign(byte)).count();
        let text = &self.text[signs..];
        match separator {
            Separator::Blank => join_units_to_names(raw_cells(text, separator)),
            _ => raw_cells(text, separator),
        }
    }

    /// The line as a line of titles, without empty ones at its end.
    pub fn parse_titles(&self, separator: Separator) -> Vec<ParsedTitle> {
        let mut cells = self.split_cells(separator);
        cells.truncate(filled_cell_count(&cells).max(1));
        cells.iter().map(|cell| ParsedTitle::parse(cell)).collect()
    }
}

fn raw_cells(text: &[u8], separator: Separator) -> Vec<String> {
    let text_of = |cell: &[u8]| text_encoding::utf8_or_latin1(cell).into_owned();
    let is_between = |byte: &u8| match separator {
        Separator::Blank => byte.is_ascii_whitespace(),
        _ => *byte == separator.as_byte(),
    };
    // Several blanks separate as one does.
    let is_cell = |cell: &&[u8]| separator != Separator::Blank || !cell.is_empty();
    // A reader for each line takes longer than all the rest.
    if !text.contains(&b'"') {
        return text.split(is_between).filter(is_cell).map(text_of).collect();
    }
    let mut reader = super::csv_reader(text, separator);
    let mut record = ::csv::ByteRecord::new();
    // Memory can be read, and any bytes are some record.
    let _ = reader.read_byte_record(&mut record);
    record.iter().filter(is_cell).map(text_of).collect()
}

/// Of cells between blanks, joins `v_x` and `[m/s]`.
fn join_units_to_names(cells: Vec<String>) -> Vec<String> {
    let mut joined: Vec<String> = Vec::new();
    for cell in cells {
        let is_unit =
            cell.starts_with('[') && cell.ends_with(']') || cell.starts_with('(') && cell.ends_with(')');
        match joined.last_mut().filter(|_| is_unit) {
            // A second one belongs to no title: it is a line of units.
            Some(title) if !title.ends_with([']', ')']) => *title = format!("{title} {cell}"),
            _ => joined.push(cell),
        }
    }
    joined
}

/// How many of the wanted columns a line of titles has.
pub(super) fn count_requested_titles(titles: &[ParsedTitle], wanted: &[&str]) -> usize {
    let titles = titles.iter().flat_map(|title| [title.text.as_str(), &title.plain]);
    let titles: HashSet<_> = titles.collect();
    wanted.iter().filter(|name| titles.contains(**name)).count()
}
