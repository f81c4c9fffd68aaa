//! Errors of files that are no TOML, with the sentence that says what to type for the usual slips: a decimal comma, and one pair of
//! brackets where a list has two.

use std::ops::Range;

use diagnostics::{ErrorCollector, SourceFiles, suggest};

use crate::schema;

/// The errors of a parser; `text` is that of the file at its place among all files.
pub(super) fn syntax_errors(source: &SourceFiles, text: &str, errors: &[toml::de::Error]) -> ErrorCollector {
    let mut mistakes = ErrorCollector::default();
    // The rest of a table that begins for the second time.
    let (mut reported, mut lists) = (0..0, Vec::new());
    for error in errors {
        let span = error.span().unwrap_or(text.len()..text.len());
        if reported.contains(&span.start) {
            continue;
        }
        let line = line_at(text, span.start);
        if let Some((number, point)) = decimal_comma(text, line.clone()) {
            let message = format!("a number has a decimal point: write {point}");
            mistakes.push(source.error_at(number, message, "here"));
            reported = line;
        } else if let Some((header, name)) = single_brackets(text, line.clone(), error.message()) {
            if !lists.contains(&name) {
                let message = format!("`{name}` is a list of tables: write [[{name}]] for each of them");
                mistakes.push(source.error_at(header, message, "here"));
                lists.push(name);
            }
            reported = line.start..next_header(text, line.end);
        } else {
            mistakes.push(source.error_at(span, error.message(), "here"));
        }
    }
    mistakes
}

/// The line that a byte stands in.
fn line_at(text: &str, at: usize) -> Range<usize> {
    let start = text[..at].rfind('\n').map_or(0, |end| end + 1);
    let end = text[at..].find('\n').map_or(text.len(), |length| at + length);
    start..end
}

/// A value of this line that is a number with a decimal comma, and the number with a point.
fn decimal_comma(text: &str, line: Range<usize>) -> Option<(Range<usize>, String)> {
    let letters = &text[line.clone()];
    letters.match_indices('=').find_map(|(at, _)| {
        let value = letters[at + 1..].trim_start();
        let length =
            value.find(|c: char| !(c.is_ascii_digit() || "+-,.eE".contains(c))).unwrap_or(value.len());
        let start = line.start + letters.len() - value.len();
        Some((start..start + length, suggest::number_with_point(&value[..length])?))
    })
}

/// The head of a table that begins again in this line, if it has to be the head of an entry of a list, and its name.
fn single_brackets(text: &str, line: Range<usize>, message: &str) -> Option<(Range<usize>, String)> {
    let letters = &text[line.clone()];
    let header = letters.split('#').next()?.trim();
    let name = header.strip_prefix('[')?.strip_suffix(']')?.trim();
    let name = name.strip_prefix('[').and_then(|it| it.strip_suffix(']')).unwrap_or(name).trim();
    let keys: Vec<_> = name.split('.').map(str::trim).collect();
    let is_list = schema::is_list_of_tables_at(super::scenario_schema_value(), &keys);
    let start = line.start + letters.find('[')?;
    (message == "duplicate key" && is_list).then(|| (start..start + header.len(), name.to_owned()))
}

/// The beginning of the next line with a head of a table, at or behind this byte.
fn next_header(text: &str, from: usize) -> usize {
    text[from..].find("\n[").map_or(text.len(), |length| from + length + 1)
}
