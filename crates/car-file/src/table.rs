//! Reads rows of numbers under a head, in SI units.

use crate::Error;
use crate::header::{self, ColumnSpec, HeaderColumn};

/// The numbers of a table: for each specified column those of its rows, or nothing when the table has no such column.
#[derive(Debug)]
pub(crate) struct CarTable {
    specs: &'static [ColumnSpec],
    columns: Vec<Option<Vec<f64>>>,
    /// Line of each row.
    pub lines: Vec<usize>,
    /// Line of the head.
    pub head: usize,
}

impl CarTable {
    /// Reads a text.
    ///
    /// # Errors
    /// With line and column: what the head has wrong, fields that are missing or no finite numbers; no head, or no rows.
    pub(crate) fn parse(text: &str, specs: &'static [ColumnSpec]) -> Result<Self, Error> {
        let wrong = |line: usize, message: String| Error { line, message };
        let mut lines = text
            .trim_start_matches('\u{feff}')
            .lines()
            .enumerate()
            .filter_map(|(index, line)| data_line(index, line));
        let Some((head, line)) = lines.next() else {
            let names: Vec<_> = specs.iter().map(ColumnSpec::name).collect();
            let message = format!("expected a table with the columns {}, found none", names.join(", "));
            return Err(wrong(1, message));
        };
        let separator = [';', '\t', ','].into_iter().find(|it| line.contains(*it));
        let names = header_names(line, separator);
        let read = header::parse_header(&names, specs).map_err(|message| wrong(head, message))?;
        let mut table = Self { specs, columns: vec![None; specs.len()], lines: Vec::new(), head };
        for column in &read {
            table.columns[column.meaning] = Some(Vec::new());
        }
        for (line, text) in lines {
            let found = split_on_separator_or_whitespace(text, separator);
            if found.len() != read.len() {
                let (expected, found) = (read.len(), found.len());
                return Err(wrong(line, format!("expected {expected} numbers, found {found}")));
            }
            for (index, (field, column)) in found.iter().zip(&read).enumerate() {
                let value = parse_si_value(field, separator, column).ok_or_else(|| {
                    let name = names[index].trim();
                    let place = index + 1;
                    wrong(
                        line,
                        format!("expected a finite number in column {place} `{name}`, found `{field}`"),
                    )
                })?;
                table.columns[column.meaning].iter_mut().for_each(|values| values.push(value));
            }
            table.lines.push(line);
        }
        if table.lines.is_empty() {
            return Err(wrong(head, "expected rows of numbers under the head, found none".to_owned()));
        }
        Ok(table)
    }

    /// The numbers of a column that may be missing.
    pub(crate) fn optional_column(&self, column: usize) -> Option<&[f64]> {
        self.columns[column].as_deref()
    }

    /// The numbers of a column.
    ///
    /// # Errors
    /// When the table has none of that name.
    pub(crate) fn required_column(&self, column: usize) -> Result<&[f64], Error> {
        self.optional_column(column).ok_or_else(|| {
            let ColumnSpec { unit, .. } = self.specs[column];
            let unit = if unit == "1" { String::new() } else { format!(" [{unit}]") };
            self.header_error(format!("expected a column `{}{unit}`", self.column_name(column)))
        })
    }

    /// Name of a column.
    pub(crate) fn column_name(&self, column: usize) -> &'static str {
        self.specs[column].name()
    }

    /// Unit of the numbers of a column.
    pub(crate) fn column_unit(&self, column: usize) -> &'static str {
        self.specs[column].unit
    }

    /// An error of the table as a whole, at its head.
    pub(crate) fn header_error(&self, message: String) -> Error {
        Error { line: self.head, message }
    }
}

/// The number and the text of a line that is neither empty nor a comment.
fn data_line(index: usize, line: &str) -> Option<(usize, &str)> {
    let line = line.trim_matches(|c: char| c.is_whitespace() && c != '\t');
    let nothing = line.trim().is_empty() || line.starts_with('#') || line.starts_with("//");
    (!nothing).then_some((index + 1, line))
}

/// The names of a head. Between blanks, a unit belongs to the name before it.
fn header_names(line: &str, separator: Option<char>) -> Vec<String> {
    let mut names: Vec<String> = Vec::new();
    for field in split_on_separator_or_whitespace(line, separator) {
        match names.last_mut().filter(|_| separator.is_none() && field.starts_with(['[', '('])) {
            Some(name) => name.push_str(field),
            None => names.push(field.to_owned()),
        }
    }
    names
}

fn split_on_separator_or_whitespace(line: &str, separator: Option<char>) -> Vec<&str> {
    let mut fields: Vec<&str> = match separator {
        Some(separator) => line.split(separator).collect(),
        None => line.split_whitespace().collect(),
    };
    fields.iter_mut().for_each(|it| *it = it.trim().trim_matches('"').trim());
    // A separator at the end of the row starts no field.
    if fields.last().is_some_and(|it| it.is_empty()) {
        fields.pop();
    }
    fields
}

/// The SI value of a field. Where no comma separates, one is a decimal comma.
fn parse_si_value(field: &str, separator: Option<char>, column: &HeaderColumn) -> Option<f64> {
    let comma = separator != Some(',') && field.matches(',').count() == 1 && !field.contains('.');
    let value: f64 = match comma {
        true => field.replace(',', ".").parse().ok()?,
        false => field.parse().ok()?,
    };
    Some(column.scale * value + column.offset).filter(|value| value.is_finite())
}
