//! Tells whether a line of a CSV file explains its columns: their units, sensors or types.

use super::line::is_number;
use crate::table::title::{parse_title_unit, unit_in_cell};

/// Whether a line between titles and rows has units: at least half of its words are known ones.
pub(super) fn is_units(cells: &[String]) -> bool {
    let words: Vec<&str> = cells.iter().filter_map(|cell| unit_in_cell(cell)).collect();
    let known = words.iter().filter(|it| !is_number(it) && parse_title_unit(it, "").is_some()).count();
    known > 0 && 2 * known >= words.len()
}

/// Whether a line says something of the columns, and not which ones they are.
pub(super) fn is_explanation(cells: &[String]) -> bool {
    is_units(cells) || is_sensor_line(cells) || is_types(cells)
}

/// Whether a line has units and nothing else.
pub(super) fn has_only_units(cells: &[String]) -> bool {
    let known = |it: &str| !is_number(it) && parse_title_unit(it, "").is_some();
    is_units(cells) && cells.iter().filter_map(|cell| unit_in_cell(cell)).all(known)
}

/// The sensor in a cell such as `100: gps`, without its number.
pub(super) fn sensor_name(source: &str) -> &str {
    match source.split_once(": ") {
        Some((number, sensor)) if number.bytes().all(|it| it.is_ascii_digit()) => sensor,
        _ => source,
    }
}

pub(super) fn is_sensor_line(cells: &[String]) -> bool {
    cells.iter().any(|cell| sensor_name(cell) != cell)
}

pub(super) fn is_types(cells: &[String]) -> bool {
    let is_type = |cell: &str| {
        let mut letters = cell.chars();
        letters.next().is_some_and(|c| "fiusd".contains(c))
            && letters.clone().count() > 0
            && letters.all(|c| c.is_ascii_digit())
    };
    let mut words = cells.iter().map(|it| it.trim()).filter(|it| !it.is_empty()).peekable();
    words.peek().is_some() && words.all(is_type)
}
