//! Reads TYDEX files (Unrau and Zamow, TYDEX-Format, Release 1.3, 1997): one measurement each, with constants and channels.

use crate::sample::BenchError;
use crate::table::{BenchColumn, BenchTable, ROWS, is_missing, parse_number};
use crate::text::numbered_lines;

// Columns of a line of a constant or a channel, in characters: name, comment, unit, and numbers of 10 each.
const COMMENT: usize = 10;
const UNIT: usize = 40;
const VALUE: usize = 50;
const WIDTH: usize = 10;

/// Constants that are conditions or numbers of the tire; other ones are left to people.
const CONDITIONS: [&str; 12] = [
    "INFLPRES", "FZW", "FZH", "FZC", "FZ", "INCLANGL", "SLIPANGL", "LONGSLIP", "TRAJVELW", "TRAJVELH",
    "LONGVEL", "DISTGRWC",
];

/// What is converted by `physical = factor (raw + first) + second`.
#[derive(Clone, Copy)]
struct RawValueConversion {
    factor: f64,
    first: f64,
    second: f64,
}

/// Whether a text is of this format: its first keyword is `**HEADER`, or it has `**MEASURDATA`.
pub(crate) fn is_tydex(text: &str) -> bool {
    let mut keywords = numbered_lines(text).take(2_000).filter_map(|(_, line)| parse_keyword(line));
    keywords.any(|it| it == "HEADER" || it == "MEASURCHANNELS" || it == "MEASURDATA")
}

fn parse_keyword(line: &str) -> Option<String> {
    let word = line.trim_start_matches('\u{feff}').trim().strip_prefix("**")?;
    let word = word.split(|it: char| !it.is_ascii_alphanumeric()).next()?;
    Some(word.to_ascii_uppercase())
}

/// Reads a text.
///
/// # Errors
/// When it has no channels or data, or a line that does not fit them.
pub(crate) fn read_tydex_table(text: &str, file: &str) -> Result<BenchTable, BenchError> {
    let mut table = BenchTable { file: file.to_owned(), one_sweep: true, ..BenchTable::default() };
    let (mut conversions, mut section, mut fields) = (Vec::new(), String::new(), Vec::new());
    let decimal_comma = has_decimal_comma(text);
    for (number, line) in numbered_lines(text) {
        if let Some(found) = parse_keyword(line) {
            if found == "END" {
                break;
            }
            if found == "MEASURDATA" {
                table.head.get_or_insert(number);
            }
            section = found;
            continue;
        }
        if line.trim().is_empty() || line.trim_start().starts_with('!') {
            continue;
        }
        match section.as_str() {
            "CONSTANTS" => table.columns.extend(parse_constant(line, number, decimal_comma)),
            "MEASURCHANNELS" => {
                let (column, conversion) = parse_channel(&table, line, number, decimal_comma)?;
                conversions.push(conversion);
                // Channels stand before constants, so that fields of data find them by their place.
                table.columns.insert(conversions.len() - 1, column);
            }
            "MEASURDATA" => {
                if conversions.is_empty() {
                    return Err(table.error_at_line(
                        Some(number),
                        "expected **MEASURCHANNELS before **MEASURDATA, found none",
                    ));
                }
                parse_data_line(&mut table, &mut fields, line, number, conversions.len(), decimal_comma)?;
            }
            _ => {}
        }
    }
    fill_columns(table, &conversions, &fields)
}

fn fill_columns(
    mut table: BenchTable,
    conversions: &[RawValueConversion],
    fields: &[String],
) -> Result<BenchTable, BenchError> {
    if table.row_count() == 0 {
        return Err(table.error_at_line(
            table.head,
            "expected rows below **MEASURDATA, found none: was the file copied whole?",
        ));
    }
    if !fields.is_empty() {
        let (count, line) = (conversions.len(), table.head);
        let text = format!(
            "expected {count} fields for each sample, found {} in the last one: was the file copied whole?",
            fields.len()
        );
        return Err(table.error_at_line(line, text));
    }
    let mut shifted = Vec::new();
    for (column, it) in table.columns.iter_mut().zip(conversions) {
        if it.first != 0.0 {
            shifted.push(column.name.clone());
        }
        if (it.factor, it.first, it.second) != (1.0, 0.0, 0.0) {
            column.values.iter_mut().for_each(|value| *value = it.factor * (*value + it.first) + it.second);
        }
    }
    if !shifted.is_empty() {
        table
            .notes
            .push(format!("offsets of raw values were added before the factor ({})", shifted.join(", ")));
    }
    Ok(table)
}

/// Whether numbers of the data have a comma before their decimals and never a point.
fn has_decimal_comma(text: &str) -> bool {
    let data =
        numbered_lines(text).skip_while(|it| parse_keyword(it.1).is_none_or(|it| it != "MEASURDATA")).skip(1);
    let data: Vec<_> = data.map(|it| it.1).filter(|it| it.contains([',', '.'])).take(20).collect();
    !data.is_empty() && data.iter().all(|it| it.contains(',') && !it.contains('.'))
}

/// A part of a line by its columns; empty when the line is shorter.
fn line_slice(line: &[char], begin: usize, end: usize) -> String {
    let end = end.min(line.len());
    let part: String = line.get(begin.min(end)..end).unwrap_or(&[]).iter().collect();
    part.trim().to_owned()
}

/// Name, unit and the fields behind them. Lines with tabs are not laid out in columns: their fields stand between tabs, or the last
/// words are the numbers and the one before them is the unit.
fn split_definition_line(line: &str) -> (String, String, Vec<String>) {
    let plain: Vec<char> = line.trim_start_matches('\u{feff}').chars().collect();
    let words: Vec<_> = line.split_whitespace().map(str::to_owned).collect();
    let name = words.first().cloned().unwrap_or_default();
    if line.trim().contains('\t') {
        let fields: Vec<_> = line.split('\t').map(|it| it.trim().to_owned()).collect();
        if fields.len() >= 4 {
            let numbers = fields[3..].iter().flat_map(|it| it.split_whitespace()).map(str::to_owned);
            return (fields[0].clone(), fields[2].clone(), numbers.collect());
        }
    }
    let laid_out = name.chars().count() <= COMMENT && plain.len() > UNIT && !line.contains('\t');
    let tail = line_slice(&plain, VALUE, plain.len());
    let cut_unit = plain.get(UNIT - 1).is_some_and(|it| !it.is_whitespace())
        && plain.get(UNIT).is_some_and(|it| !it.is_whitespace());
    if laid_out && !cut_unit {
        let numbers = (0..).map(|k| line_slice(&plain, VALUE + k * WIDTH, VALUE + (k + 1) * WIDTH));
        let count = plain.len().saturating_sub(VALUE).div_ceil(WIDTH);
        let by_columns: Vec<_> = numbers.take(count).collect();
        // Longer numbers than their column, or shifted ones, are told apart by spaces.
        let by_spaces: Vec<_> = tail.split_whitespace().map(str::to_owned).collect();
        let fits = by_columns.iter().all(|it| it.split_whitespace().count() <= 1);
        let joined: String = by_columns.concat();
        let same = by_columns.iter().filter(|it| !it.is_empty()).count() == by_spaces.len();
        let fields = if fits && same && !joined.is_empty() { by_columns } else { by_spaces };
        return (name, line_slice(&plain, UNIT, VALUE), fields);
    }
    let numbers = words
        .iter()
        .rev()
        .take_while(|it| parse_number(it, true).is_some())
        .count()
        .min(words.len().saturating_sub(1));
    let begin = words.len() - numbers;
    let unit = if begin > 1 { words[begin - 1].clone() } else { String::new() };
    (name, unit, words[begin..].to_vec())
}

fn parse_channel(
    table: &BenchTable,
    line: &str,
    at: usize,
    comma: bool,
) -> Result<(BenchColumn, RawValueConversion), BenchError> {
    let (name, unit, fields) = split_definition_line(line);
    let mut numbers = [1.0, 0.0, 0.0];
    for (value, field) in numbers.iter_mut().zip(&fields) {
        if is_missing(field) {
            continue;
        }
        *value = parse_number(field, comma).ok_or_else(|| {
            table.error_at_line(
                Some(at),
                format!("{name}: expected a conversion factor or an offset, found `{field}`"),
            )
        })?;
    }
    let [factor, first, second] = numbers;
    if factor == 0.0 {
        return Err(table
            .error_at_line(Some(at), format!("{name}: expected a conversion factor other than 0, found 0")));
    }
    Ok((BenchColumn::new(&name, &unit), RawValueConversion { factor, first, second }))
}

/// A constant that is a condition and has a number.
fn parse_constant(line: &str, at: usize, comma: bool) -> Option<BenchColumn> {
    let (name, unit, fields) = split_definition_line(line);
    if !CONDITIONS.iter().any(|it| it.eq_ignore_ascii_case(&name)) {
        return None;
    }
    let mut column = BenchColumn { constant: true, ..BenchColumn::new(&name, &unit) };
    let field = fields.iter().find(|it| !it.is_empty())?;
    column.push_field(field, at, comma);
    Some(column)
}

/// Takes the fields of a line. A sample that has more than fit into one line goes on in the next.
fn parse_data_line(
    table: &mut BenchTable,
    fields: &mut Vec<String>,
    line: &str,
    at: usize,
    count: usize,
    comma: bool,
) -> Result<(), BenchError> {
    let split = |it: char| it.is_whitespace() || it == ';' || it == ',' && !comma;
    let mut words: Vec<_> = line.split(split).filter(|it| !it.is_empty()).map(str::to_owned).collect();
    if fields.is_empty() && words.len() < count {
        // Long numbers fill their columns and touch the next ones.
        let characters: Vec<_> = line.chars().collect();
        let by_columns: Vec<_> =
            (0..count).map(|k| line_slice(&characters, k * WIDTH, (k + 1) * WIDTH)).collect();
        let whole = characters.len() <= count * WIDTH;
        if whole && by_columns.iter().all(|it| parse_number(it, comma).is_some()) {
            words = by_columns;
        }
    }
    fields.extend(words);
    if fields.len() > count {
        let text = format!("expected {count} fields, one for each channel, found {}", fields.len());
        return Err(table.error_at_line(Some(at), text));
    }
    if table.columns[0].values.len() >= ROWS {
        return Err(table.error_at_line(Some(at), format!("expected at most {ROWS} samples, found more")));
    }
    if fields.len() == count {
        for (column, field) in table.columns.iter_mut().zip(fields.drain(..)) {
            column.push_field(&field, at, comma);
        }
    }
    Ok(())
}
