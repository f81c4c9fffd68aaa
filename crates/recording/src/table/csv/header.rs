//! Finds the line of titles of a CSV file, and with it the separator.

use std::collections::HashSet;

use crate::table::title::Title;
use crate::table::wanted::Separator;

/// The lines at the beginning of a file among which the titles are looked for.
pub const HEAD: usize = 400;

/// The line of titles.
#[derive(Debug, Clone)]
pub(super) struct Header {
    pub titles: Vec<Title>,
    pub separator: Separator,
    /// The first byte behind the line.
    pub end: usize,
    /// Whether its cells are numbers, not titles.
    pub is_numbers: bool,
    /// Its first byte.
    pub begin: usize,
}

/// A line at the beginning of the file.
struct Line<'a> {
    begin: usize,
    end: usize,
    text: &'a [u8],
}

/// Finds the first of the lines with the most wanted titles. Without any, the titles are the first of the widest lines: those
/// above it are comments, or notes about the drive. `None` when the file has no line.
pub(super) fn find(bytes: &[u8], wanted: &[&str], separator: Option<Separator>) -> Option<Header> {
    let separators = match separator {
        Some(separator) => vec![separator],
        None => Separator::ALL.to_vec(),
    };
    let lines: Vec<_> = lines(bytes).filter(|line| !line.text.trim_ascii().is_empty()).collect();
    let mut best: Option<(usize, Header)> = None;
    for line in &lines {
        for separator in &separators {
            let mut header = line.header(*separator);
            let found = header.count(wanted);
            // Titles may be numbers, if these are wanted.
            header.is_numbers &= found == 0;
            if found == wanted.len() && found > 0 {
                return Some(header);
            }
            if found > best.as_ref().map_or(0, |(most, _)| *most) {
                best = Some((found, header));
            }
        }
    }
    best.map(|(_, header)| header).or_else(|| widest(&lines, &separators))
}

/// The first of the widest lines; a comment above a line of numbers has the titles, as numpy writes them.
fn widest(lines: &[Line], separators: &[Separator]) -> Option<Header> {
    let wide = |lines: &mut dyn Iterator<Item = &Line>| {
        let headers = lines.flat_map(|line| separators.iter().map(|it| line.header(*it)));
        headers.reduce(|best, it| if it.titles.len() > best.titles.len() { it } else { best })
    };
    let found = wide(&mut lines.iter().filter(|line| !line.is_comment()));
    let Some(found) = found else { return wide(&mut lines.iter()) };
    // Decimal commas make rows wide; then the titles above them have no comma.
    if found.separator == Separator::Comma {
        let others = [Separator::Semicolon, Separator::Tab].into_iter();
        let mut others = others.filter(|it| separators.contains(it));
        if let Some(other) = others.find_map(|it| regular(lines, it, found.begin)) {
            return Some(other);
        }
    }
    let above = lines.iter().rev().find(|line| line.begin < found.begin);
    match above.filter(|line| found.is_numbers && line.is_comment()) {
        Some(comment) => Some(comment.header(found.separator)),
        None => Some(found),
    }
}

/// The first of the widest lines of a separator, if it stands at a place or before, and nine of ten lines below are as wide.
fn regular(lines: &[Line], separator: Separator, until: usize) -> Option<Header> {
    let lines = || lines.iter().filter(|line| !line.is_comment());
    let headers = lines().map(|line| line.header(separator));
    let found = headers.reduce(|best, it| match it.titles.len() > best.titles.len() {
        true => it,
        false => best,
    })?;
    let width = found.titles.len();
    let below = lines().filter(|line| line.begin > found.begin);
    let (mut all, mut alike) = (0, 0);
    for line in below {
        all += 1;
        alike += usize::from(line.cells(separator).len() == width);
    }
    (width > 1 && found.begin <= until && !found.is_numbers && 10 * alike >= 9 * all)
        .then_some(found)
}

fn lines(bytes: &[u8]) -> impl Iterator<Item = Line<'_>> {
    let mut begin = 0;
    let lines = std::iter::from_fn(move || {
        let rest = bytes.get(begin..).filter(|rest| !rest.is_empty())?;
        let stop = rest.iter().position(|byte| matches!(byte, b'\n' | b'\r'));
        let length = stop.unwrap_or(rest.len());
        let more = match (rest.get(length), rest.get(length + 1)) {
            (Some(b'\r'), Some(b'\n')) => 2,
            (Some(_), _) => 1,
            (None, _) => 0,
        };
        let line = Line { begin, end: begin + length + more, text: &rest[..length] };
        begin = line.end;
        Some(line)
    });
    lines.take(HEAD)
}

/// The text of a cell.
fn text(cell: &[u8]) -> String {
    super::file::text(cell).into_owned()
}

impl Line<'_> {
    fn is_comment(&self) -> bool {
        self.text.trim_ascii_start().starts_with(b"#")
    }

    fn cells(&self, separator: Separator) -> Vec<String> {
        // A reader for each line takes longer than all the rest.
        if !self.text.contains(&b'"') {
            return self.text.split(|byte| *byte == separator.byte()).map(text).collect();
        }
        let mut reader = super::reader(self.text, separator);
        let mut record = ::csv::ByteRecord::new();
        // Memory can be read, and any bytes are some record.
        let _ = reader.read_byte_record(&mut record);
        record.iter().map(text).collect()
    }

    /// The line as a line of titles; numpy writes it as a comment.
    fn header(&self, separator: Separator) -> Header {
        let cells = self.cells(separator);
        let title = |(place, cell): (usize, &String)| match place {
            0 => Title::read(cell.trim_start().trim_start_matches('#')),
            _ => Title::read(cell),
        };
        let number = |cell: &String| cell.trim().is_empty() || cell.trim().parse::<f64>().is_ok();
        Header {
            titles: cells.iter().enumerate().map(title).collect(),
            separator,
            end: self.end,
            is_numbers: cells.iter().all(number),
            begin: self.begin,
        }
    }
}

impl Header {
    /// How many of the wanted titles it has.
    fn count(&self, wanted: &[&str]) -> usize {
        let titles = self.titles.iter().flat_map(|title| [title.text.as_str(), &title.plain]);
        let titles: HashSet<_> = titles.collect();
        wanted.iter().filter(|name| titles.contains(**name)).count()
    }
}
