//! Parses the text of a file without loss: sections, assignments, tables; every line stays as it was written.

use std::fmt::{self, Write as _};
use std::ops::Range;

/// A file: all its lines, and what they say.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TirFile {
    /// Without their ends.
    pub(crate) lines: Vec<String>,
    /// What the lines end with.
    pub(crate) line_end: &'static str,
    /// The assignments, in the order of the file.
    pub entries: Vec<TirEntry>,
    /// The tables, such as `[SHAPE]`.
    pub tables: Vec<TirTable>,
    /// Numbers of the lines, from 1, that are neither.
    pub(crate) others: Vec<usize>,
}

/// An assignment.
#[derive(Clone, Debug, PartialEq)]
pub struct TirEntry {
    /// The section, in capitals.
    pub section: String,
    /// The key, in capitals.
    pub key: String,
    /// The value.
    pub value: TirValue,
    /// Its line, from 1.
    pub line: usize,
    /// The place of the value in the line [B].
    pub(crate) place: Range<usize>,
}

/// A value.
#[derive(Clone, Debug, PartialEq)]
pub enum TirValue {
    /// A number.
    Number(f64),
    /// A text, in quotes or a bare word.
    Text(String),
    /// Nothing.
    Empty,
}

impl fmt::Display for TirValue {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Number(number) => write!(f, "{number}"),
            Self::Text(text) => write!(f, "`{}`", truncate_for_message(text)),
            Self::Empty => f.write_str("nothing"),
        }
    }
}

/// Numbers in rows.
#[derive(Clone, Debug, PartialEq)]
pub struct TirTable {
    /// The section, in capitals.
    pub section: String,
    /// The names of the columns, where the file has them.
    pub columns: Option<Vec<String>>,
    /// The rows.
    pub rows: Vec<Vec<f64>>,
}

impl TirFile {
    /// Takes a text apart. Any text is a file; what it misses shows when it is asked for [`TirFile::to_coefficients`].
    pub fn parse(text: &str) -> Self {
        let text = text.strip_prefix('\u{feff}').unwrap_or(text);
        let line_end = match (text.contains('\n'), text.contains("\r\n")) {
            (_, true) => "\r\n",
            (false, _) if text.contains('\r') => "\r",
            _ => "\n",
        };
        let lines: Vec<String> = match line_end {
            "\r" => text.split_terminator('\r').map(str::to_owned).collect(),
            _ => text.lines().map(str::to_owned).collect(),
        };
        let mut file = Self { line_end, ..Self::default() };
        let (mut section, mut free_text) = (String::new(), false);
        for (number, line) in lines.iter().enumerate() {
            let content = &line[..line.len() - trailing_comment(line).len()];
            let trimmed = content.trim();
            if let Some(name) = trimmed.strip_prefix('[').and_then(|rest| rest.split(']').next()) {
                (section, free_text) = (name.trim().to_ascii_uppercase(), false);
            } else if trimmed.starts_with('(') {
                free_text = true;
            } else if free_text || trimmed.is_empty() {
            } else if let Some((key, _)) = content.split_once('=') {
                let place = value_byte_range(content);
                let value = parse_value(&content[place.clone()]);
                let key = key.trim().to_ascii_uppercase();
                file.entries.push(TirEntry { section: section.clone(), key, value, line: number + 1, place });
            } else if !file.parse_table_line(&section, trimmed) {
                file.others.push(number + 1);
            }
        }
        file.lines = lines;
        file
    }

    /// Takes a line without an assignment as the columns of a table, or one of its rows; false when it is neither.
    fn parse_table_line(&mut self, section: &str, line: &str) -> bool {
        let row: Option<Vec<f64>> = line.split_whitespace().map(parse_number).collect();
        if row.is_none() && !line.starts_with('{') {
            return false;
        }
        let known = self.tables.iter().position(|table| table.section == section);
        let table = known.unwrap_or_else(|| {
            let section = section.to_owned();
            self.tables.push(TirTable { section, columns: None, rows: Vec::new() });
            self.tables.len() - 1
        });
        if let Some(names) = line.strip_prefix('{') {
            let names = names.trim_end_matches('}').split_whitespace();
            self.tables[table].columns = Some(names.map(str::to_owned).collect());
        } else {
            self.tables[table].rows.extend(row);
        }
        true
    }

    /// The last assignment of a key in a section; of a key in several sections, the last one if `section` is empty.
    pub fn find_entry(&self, section: &str, key: &str) -> Option<&TirEntry> {
        let is_it = |it: &&TirEntry| it.key == key && (section.is_empty() || it.section == section);
        self.entries.iter().rfind(is_it)
    }

    /// The text of the file, with what was changed in it.
    pub fn to_text(&self) -> String {
        let mut text = String::new();
        for line in &self.lines {
            let _ = write!(text, "{line}{}", self.line_end);
        }
        text
    }
}

/// Signs that begin a comment: those of TeimOrbit, and those of programs that people write such files with.
const COMMENT: [char; 5] = ['$', '!', '%', '#', ';'];

/// The comment at the end of a line, with its sign, outside of quotes.
fn trailing_comment(line: &str) -> &str {
    let mut quote = None;
    // A quote opens a text only where a value begins: a comment may have apostrophes.
    let mut begins = false;
    for (at, letter) in line.char_indices() {
        match (quote, letter) {
            (Some(open), _) if letter == open => quote = None,
            (Some(_), _) => {}
            (None, sign) if COMMENT.contains(&sign) => return &line[at..],
            (None, '\'' | '"') if begins || line[..at].trim().is_empty() => quote = Some(letter),
            (None, '=') => begins = true,
            (None, _) if !letter.is_whitespace() => begins = false,
            (None, _) => {}
        }
    }
    // A quote that never closes is a letter.
    if quote.is_some() {
        let at = line.find(COMMENT).unwrap_or(line.len());
        return &line[at..];
    }
    ""
}

/// The place of the value behind the sign of an assignment, without blanks.
fn value_byte_range(content: &str) -> Range<usize> {
    let begin = content.find('=').map_or(content.len(), |at| at + 1);
    let value = &content[begin..];
    let begin = begin + value.len() - value.trim_start().len();
    begin..begin + value.trim().len()
}

fn parse_value(written: &str) -> TirValue {
    let quoted = |quote: char| {
        let inner = written.strip_prefix(quote)?;
        inner.strip_suffix(quote)
    };
    if written.is_empty() {
        TirValue::Empty
    } else if let Some(text) = quoted('\'').or_else(|| quoted('"')) {
        TirValue::Text(text.to_owned())
    } else if let Some(number) = parse_number(written) {
        TirValue::Number(number)
    } else {
        TirValue::Text(written.to_owned())
    }
}

/// A number as C or Fortran write it: `-.1E+01`, `7.`, `1D-3`, `1.5-101`.
fn parse_number(written: &str) -> Option<f64> {
    let is_number = written.bytes().any(|it| it.is_ascii_digit())
        && written.bytes().all(|it| it.is_ascii_digit() || b"+-.eEdD".contains(&it));
    if !is_number {
        return None;
    }
    let number = written.replace(['d', 'D'], "e");
    // Fortran leaves the letter out before an exponent of three digits.
    let has_letter = number.contains(['e', 'E']);
    let sign = number.rfind(['+', '-']).filter(|at| *at > 0 && number.len() == at + 4 && !has_letter);
    match sign.map(|at| number.split_at(at)) {
        Some((digits, exponent)) => format!("{digits}e{exponent}").parse().ok(),
        None => number.parse().ok(),
    }
}

/// As much of a text as a message shows.
pub(crate) fn truncate_for_message(text: &str) -> String {
    text.chars().take(60).collect()
}
