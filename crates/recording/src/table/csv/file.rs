//! Holds a CSV file: its titles, units and rows.

use std::collections::HashMap;
use std::path::Path;

use super::cell::{self, Cell};
use super::error::CsvError;
use super::header::{self, Header};
use super::{reader, text};
use crate::table::title::{spelled, unit_cell};
use crate::table::wanted::{Decimal, Dialect, Separator};
use crate::table::{ColumnTitle, TableError};

/// First bytes of files that are given for CSV at times, and a remedy.
const FORMATS: [(&[u8], &str, &str); 5] = [
    (
        b"\xff\xfe",
        "text in UTF-16",
        "convert it, as in `iconv -f UTF-16 -t UTF-8 log.csv > utf8.csv`",
    ),
    (
        b"\xfe\xff",
        "text in UTF-16",
        "convert it, as in `iconv -f UTF-16 -t UTF-8 log.csv > utf8.csv`",
    ),
    (b"MDF ", "an MDF measurement", "export it as CSV"),
    (
        b"PK\x03\x04",
        "a ZIP archive or an Excel workbook",
        "export the sheet as CSV, or unpack the archive",
    ),
    (b"\x1f\x8b", "compressed by gzip", "unpack it, as in `gunzip -k log.csv.gz`"),
];

/// A CSV file whose titles are known.
pub(super) struct CsvFile<'a> {
    pub path: &'a Path,
    bytes: &'a [u8],
    pub header: Header,
    /// The units of the line below the titles.
    units: Vec<Option<String>>,
    /// The places of each whole title, and of each title without its unit.
    by_title: [HashMap<String, Vec<usize>>; 2],
    /// The first byte of the rows.
    begin: usize,
}

/// The rows of a file, with the cells of the wanted columns.
pub(super) struct Rows {
    /// The first byte of each row.
    pub begins: Vec<usize>,
    columns: Vec<Texts>,
    pub warning: Option<String>,
}

/// Texts, one behind the other: millions of them are too many to have a place of their own.
#[derive(Clone, Default)]
struct Texts {
    all: String,
    ends: Vec<usize>,
}

impl Texts {
    fn push(&mut self, text: &str) {
        self.all.push_str(text);
        self.ends.push(self.all.len());
    }
}

impl Rows {
    /// The cells of a wanted column.
    pub fn column(&self, column: usize) -> impl Iterator<Item = &str> {
        let Texts { all, ends } = &self.columns[column];
        let begins = std::iter::once(0).chain(ends.iter().copied());
        begins.zip(ends).map(|(begin, end)| &all[begin..*end])
    }
}

impl<'a> CsvFile<'a> {
    /// Finds the titles and the units.
    pub fn open(
        path: &'a Path,
        bytes: &'a [u8],
        titles: &[&str],
        dialect: &Dialect,
    ) -> Result<Self, CsvError> {
        let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
        let named = FORMATS.iter().find(|(magic, ..)| bytes.starts_with(magic));
        let binary = bytes.iter().take(1 << 12).any(|byte| *byte == 0);
        let zeros: (&[u8], _, _) = (&[], "no text, or text in UTF-16", "save it as UTF-8");
        if let Some((_, found, cure)) = named.copied().or(binary.then_some(zeros)) {
            return Err(CsvError::NoText { path: path.to_owned(), found, cure });
        }
        let empty = || CsvError::Empty { path: path.to_owned(), found: "nothing" };
        let header = header::find(bytes, titles, dialect.separator).ok_or_else(empty)?;
        let begin = header.end;
        let mut file =
            CsvFile { path, bytes, by_title: by_title(&header), header, units: Vec::new(), begin };
        if file.header.is_numbers {
            let names = (1..file.header.titles.len()).map(|k| format!("x{k}"));
            let example =
                std::iter::once("t".to_owned()).chain(names).collect::<Vec<_>>().join(",");
            let line = file.line(file.header.begin);
            return Err(CsvError::NoTitles { path: path.to_owned(), line, example });
        }
        file.take_units(dialect.unit_row);
        Ok(file)
    }

    /// Takes the line below the titles as units, if it is said or seen to be one.
    fn take_units(&mut self, said: Option<bool>) {
        let mut reader = reader(&self.bytes[self.begin..], self.header.separator);
        let mut record = ::csv::ByteRecord::new();
        let found = reader.read_byte_record(&mut record).unwrap_or(false);
        let cells: Vec<_> =
            record.iter().map(|cell| (text(cell), unit_cell(&text(cell)))).collect();
        let seen = || {
            let proper = |unit: &Option<Option<String>>| unit.as_ref().is_some_and(Option::is_some);
            let any = cells.iter().any(|(_, unit)| proper(unit));
            any && cells.iter().all(|(_, unit)| unit.is_some())
        };
        if !found || !said.unwrap_or_else(seen) {
            return;
        }
        let unit = |(cell, unit): (String, Option<Option<String>>)| {
            unit.unwrap_or_else(|| Some(spelled(&cell)))
        };
        self.units = cells.into_iter().map(unit).collect();
        self.begin += reader.position().byte() as usize;
    }

    /// The unit of a column: that in its title, or that of the line below.
    pub fn unit(&self, place: usize) -> Result<Option<String>, CsvError> {
        let title = &self.header.titles[place];
        let below = self.units.get(place).cloned().flatten();
        match (title.unit.clone(), below) {
            (Some(title), Some(below)) if title != below => {
                let (path, column) = (self.path.to_owned(), self.header.titles[place].text.clone());
                let line = self.line(self.header.end);
                Err(CsvError::TwoUnits { path, column, title, below, line })
            }
            (title, below) => Ok(title.or(below)),
        }
    }

    /// The number of the line that a row begins in; blank lines before it are skipped.
    pub fn line(&self, begin: usize) -> usize {
        let blank = self.bytes[begin..].iter().take_while(|byte| matches!(byte, b'\n' | b'\r'));
        let before = &self.bytes[..begin + blank.count()];
        let count = |end: u8| before.iter().filter(|byte| **byte == end).count();
        1 + match count(b'\n') {
            0 => count(b'\r'),
            lines => lines,
        }
    }

    /// Where the columns are.
    pub fn places(&self, wanted: &[&str]) -> Result<Vec<usize>, TableError> {
        wanted.iter().map(|name| self.place(name)).collect()
    }

    /// Where a column is: by the whole title, or by the title without its unit.
    pub fn place(&self, name: &str) -> Result<usize, TableError> {
        let [whole, plain] = &self.by_title;
        match whole.get(name).or_else(|| plain.get(name)).map(Vec::as_slice) {
            Some([place]) => Ok(*place),
            None => Err(TableError::missing(self.path, name, self.names())),
            Some(found) => Err(self.ambiguous(name, found).into()),
        }
    }

    /// Refuses several columns of one name, whatever their units are.
    pub fn only(&self, name: &str) -> Result<(), CsvError> {
        match self.by_title[1].get(name).map(Vec::as_slice) {
            None | Some([_]) => Ok(()),
            Some(found) => Err(self.ambiguous(name, found)),
        }
    }

    fn ambiguous(&self, name: &str, found: &[usize]) -> CsvError {
        let place = |at: &usize| format!("{} `{}`", at + 1, self.header.titles[*at].text);
        let places = found.iter().map(place).collect::<Vec<_>>().join(", ");
        let (path, column) = (self.path.to_owned(), name.to_owned());
        CsvError::Ambiguous { path, column, places }
    }

    /// The titles of the columns, with their units.
    pub fn titles(&self) -> Result<Vec<ColumnTitle>, CsvError> {
        let titles = self.header.titles.iter().enumerate();
        let titles = titles.filter(|(_, title)| !title.plain.is_empty()).map(|(place, title)| {
            let (text, name) = (title.text.clone(), title.plain.clone());
            Ok(ColumnTitle { text, name, unit: self.unit(place)? })
        });
        titles.collect()
    }

    /// The names of the columns.
    pub fn names(&self) -> Vec<String> {
        let plain = self.header.titles.iter().map(|title| title.plain.clone());
        plain.filter(|title| !title.is_empty()).collect()
    }

    /// The cells of the wanted columns. Rows without any content are left out, and so is a last one that was cut off.
    pub fn rows(&self, places: &[usize]) -> Result<Rows, CsvError> {
        let mut rows = Rows {
            begins: Vec::new(),
            columns: vec![Texts::default(); places.len()],
            warning: None,
        };
        let mut reader = reader(&self.bytes[self.begin..], self.header.separator);
        let mut record = ::csv::ByteRecord::new();
        let expected = self.header.titles.len();
        while reader.read_byte_record(&mut record).unwrap_or(false) {
            let begin = self.begin + record.position().map_or(0, |at| at.byte() as usize);
            let empty = |cell: &[u8]| cell.trim_ascii().is_empty();
            if record.get(0).is_some_and(is_comment) || record.iter().all(empty) {
                continue;
            }
            let more = record.iter().skip(expected).any(|cell| !empty(cell));
            if record.len() < expected && self.is_cut(&reader) && !rows.begins.is_empty() {
                let (path, line) = (self.path.display(), self.line(begin));
                let what = "the file was cut off in this line";
                rows.warning = Some(format!("line {line} of {path} is left out: {what}"));
                break;
            }
            if record.len() < expected || more {
                return Err(self.ragged(begin, record.len()));
            }
            rows.begins.push(begin);
            for (place, cells) in places.iter().zip(&mut rows.columns) {
                cells.push(&text(&record[*place]));
            }
        }
        match rows.begins.is_empty() {
            true => Err(CsvError::Empty { path: self.path.to_owned(), found: "only a header" }),
            false => Ok(rows),
        }
    }

    /// Whether the reader is at the end of a file that does not end with a line.
    fn is_cut(&self, reader: &::csv::Reader<&[u8]>) -> bool {
        let end = self.begin + reader.position().byte() as usize;
        end >= self.bytes.len() && !self.bytes.ends_with(b"\n") && !self.bytes.ends_with(b"\r")
    }

    fn ragged(&self, begin: usize, found: usize) -> CsvError {
        let (path, line, expected) =
            (self.path.to_owned(), self.line(begin), self.header.titles.len());
        let hint = match self.header.separator {
            Separator::Comma if found == 2 * expected => {
                "; numbers with decimal commas need another separator: export with semicolons"
            }
            _ => "; if a text has an opening quotation mark only, remove it",
        };
        CsvError::Ragged { path, line, expected, found, hint }
    }
}

fn by_title(header: &Header) -> [HashMap<String, Vec<usize>>; 2] {
    let mut by_title = [HashMap::<_, Vec<_>>::new(), HashMap::new()];
    for (place, title) in header.titles.iter().enumerate() {
        for (places, text) in by_title.iter_mut().zip([&title.text, &title.plain]) {
            places.entry(text.clone()).or_default().push(place);
        }
    }
    by_title
}

/// Whether a row that begins with this cell is a comment. `#N/A` is a gap.
fn is_comment(cell: &[u8]) -> bool {
    let gap = cell::cell(&text(cell), Decimal::Point) == Cell::Gap;
    cell.trim_ascii_start().starts_with(b"#") && !gap
}
