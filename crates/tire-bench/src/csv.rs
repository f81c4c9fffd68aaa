//! Reads tables as text: a line of names, perhaps one of units, and rows, with any usual delimiter.

use crate::channels::is_known;
use crate::sample::BenchError;
use crate::table::{BenchColumn, BenchTable, ROWS, parse_number};
use crate::text::numbered_lines;

/// Lines at the beginning that are looked at for the names.
const TITLES: usize = 200;

/// Reads a text; `named` are columns that the user names.
///
/// # Errors
/// When it has no line of names or no rows.
pub(crate) fn read_csv_table(text: &str, file: &str, named: &[&str]) -> Result<BenchTable, BenchError> {
    let mut table = BenchTable { file: file.to_owned(), ..BenchTable::default() };
    let filled = numbered_lines(text).filter(|(_, line)| !line.trim().is_empty());
    let first: Vec<_> = filled.clone().take(TITLES).collect();
    let (delimiter, head, line) = find_header(&first, named).ok_or_else(|| {
        table.error_at_line(
            None,
            "expected a line with names of columns, found none: a title may stand above it",
        )
    })?;
    table.head = Some(line);
    let names = split_csv_line(head, delimiter);
    table.columns = names.iter().map(|it| parse_column_title(it)).collect();
    let content = filled.skip_while(|it| it.0 <= line);
    let mut content = content.filter(|it| !is_comment(it.1)).peekable();
    if let Some((_, below)) = content.peek()
        && is_units(&split_csv_line(below, delimiter))
    {
        for (column, unit) in table.columns.iter_mut().zip(split_csv_line(below, delimiter)) {
            let unit = strip_brackets(unit.trim());
            if !unit.is_empty() {
                column.unit = Some(unit.to_owned());
            }
        }
        content.next();
    }
    let comma = delimiter != ',';
    for (rows, (at, line)) in content.enumerate() {
        if rows >= ROWS {
            return Err(table.error_at_line(Some(at), format!("expected at most {ROWS} rows, found more")));
        }
        let fields = split_csv_line(line, delimiter);
        for (place, column) in table.columns.iter_mut().enumerate() {
            column.push_field(fields.get(place).copied().unwrap_or(""), at, comma);
        }
    }
    if table.row_count() == 0 {
        return Err(table.error_at_line(table.head, "expected rows below the names, found none"));
    }
    Ok(table)
}

/// Notes of people, and Excel's word for the delimiter.
fn is_comment(line: &str) -> bool {
    let line = line.trim_start();
    ["#", "%", "!", "//", "sep="].iter().any(|it| line.starts_with(it))
}

/// A delimiter of ' ' stands for any number of spaces and tabs.
fn split_csv_line(line: &str, delimiter: char) -> Vec<&str> {
    match delimiter {
        ' ' => line.split_whitespace().map(strip_quotes).collect(),
        _ => line.split(delimiter).map(strip_quotes).collect(),
    }
}

fn strip_quotes(field: &str) -> &str {
    field.trim().trim_matches('"').trim()
}

/// The delimiter and the line of the names: the first line with at least two names that are known; without one, the first line.
fn find_header<'a>(first: &[(usize, &'a str)], named: &[&str]) -> Option<(char, &'a str, usize)> {
    let known = |line: &str, delimiter: char| {
        let names = split_csv_line(line, delimiter);
        let of = names.iter().map(|it| parse_column_title(it).name);
        of.filter(|name| is_known(name) || named.contains(&name.as_str())).count()
    };
    for (at, line) in first {
        // Some write the names as a comment.
        let line = line.trim_start_matches(['#', '%', ' ']);
        let counts = ['\t', ';', ',', ' '].map(|it| (known(line, it), it));
        // The first of the best: a tab rather than spaces, which names in brackets may have.
        let best = counts.iter().rev().max_by_key(|it| it.0)?;
        if best.0 >= 2 {
            return Some((best.1, line, *at));
        }
    }
    let (at, line) = first.iter().find(|it| !is_comment(it.1))?;
    let delimiter = [',', ';', '\t'].into_iter().find(|it| line.contains(*it)).unwrap_or(' ');
    Some((delimiter, line, *at))
}

/// Whether a line has words where rows have numbers.
fn is_units(fields: &[&str]) -> bool {
    let words = fields.iter().filter(|it| !it.is_empty());
    let short = |it: &&&str| it.chars().count() <= 12 && parse_number(it, true).is_none();
    words.clone().count() >= 2 && words.clone().all(|it| short(&it)) && words.clone().any(|it| is_unit(it))
}

fn is_unit(field: &str) -> bool {
    let field = strip_brackets(field);
    units::Unit::parse(field).is_ok() || units::unit_for_spelling(field).is_some()
}

fn strip_brackets(text: &str) -> &str {
    let inner = |open, close| text.strip_prefix(open).and_then(|it: &str| it.strip_suffix(close));
    inner('[', ']').or_else(|| inner('(', ')')).unwrap_or(text).trim()
}

/// A column of a title such as `SA [deg]`, `FZ(N)` or `SA`.
fn parse_column_title(title: &str) -> BenchColumn {
    for (open, close) in [('[', ']'), ('(', ')'), ('{', '}')] {
        if let Some((name, rest)) = title.split_once(open)
            && let Some(unit) = rest.trim().strip_suffix(close)
            && !name.trim().is_empty()
        {
            return BenchColumn::new(name, unit);
        }
    }
    BenchColumn::new(title, "")
}
