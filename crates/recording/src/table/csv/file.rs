//! Holds a CSV file: its titles and units, and goes through its rows.

use std::borrow::Cow;
use std::cell::Cell as Shared;
use std::collections::HashMap;
use std::io::{self, Read as _};
use std::path::Path;

use ::csv::ByteRecord;

use super::cell::{self, Cell};
use super::error::CsvError;
use super::header::{self, Header};
use super::reader;
use super::text::Text;
use crate::table::title::{spelled, unit_cell};
use crate::table::wanted::{Decimal, Dialect, Separator};
use crate::table::{ColumnTitle, TableError};

/// First bytes of files that are given for CSV at times, and a remedy.
const FORMATS: [(&[u8], &str, &str); 2] = [
    (b"MDF ", "an MDF measurement", "export it as CSV"),
    (
        b"PK\x03\x04",
        "a ZIP archive or an Excel workbook",
        "export the sheet as CSV, or unpack the archive",
    ),
];

/// What is looked at to find the titles and the units has at most so many bytes [B].
const LARGEST_HEAD: u64 = 64 << 20;

/// A CSV file whose titles are known.
pub(super) struct CsvFile<'a> {
    pub path: &'a Path,
    text: &'a Text,
    pub header: Header,
    /// The units of the line below the titles.
    units: Vec<Option<String>>,
    /// The places of each whole title, and of each title without its unit.
    by_title: [HashMap<String, Vec<usize>>; 2],
    /// The first byte of the rows.
    begin: u64,
}

/// Takes the first byte of a row and its cells, and says whether it wants more.
pub(super) type TakeRow<'t> = &'t mut dyn FnMut(u64, &ByteRecord) -> bool;

impl<'a> CsvFile<'a> {
    /// Finds the titles and the units.
    pub fn open(
        path: &'a Path,
        text: &'a Text,
        titles: &[&str],
        dialect: &Dialect,
    ) -> Result<Self, CsvError> {
        let unreadable = |source| CsvError::Read { path: path.to_owned(), source };
        let head = head(text).map_err(unreadable)?;
        let named = FORMATS.iter().find(|(magic, ..)| head.starts_with(magic));
        let binary = head.iter().take(1 << 12).any(|byte| *byte == 0);
        let zeros: (&[u8], _, _) = (&[], "no text, or text in UTF-16", "save it as UTF-8");
        if let Some((_, found, cure)) = named.copied().or(binary.then_some(zeros)) {
            return Err(CsvError::NoText { path: path.to_owned(), found, cure });
        }
        let empty = || CsvError::Empty { path: path.to_owned(), found: "nothing" };
        let header = header::find(&head, titles, dialect.separator).ok_or_else(empty)?;
        let (by_title, units, begin) = (by_title(&header), Vec::new(), header.end as u64);
        let mut file = CsvFile { path, text, by_title, header, units, begin };
        if file.header.is_numbers {
            let names = (1..file.header.titles.len()).map(|k| format!("x{k}"));
            let example =
                std::iter::once("t".to_owned()).chain(names).collect::<Vec<_>>().join(",");
            let line = file.line(file.header.begin as u64);
            return Err(CsvError::NoTitles { path: path.to_owned(), line, example });
        }
        file.take_units(&head[file.header.end..], dialect.unit_row);
        Ok(file)
    }

    /// Takes the line below the titles as units, if it is said or seen to be one.
    fn take_units(&mut self, below: &[u8], said: Option<bool>) {
        let mut reader = reader(below, self.header.separator);
        let mut record = ByteRecord::new();
        let found = reader.read_byte_record(&mut record).unwrap_or(false);
        let cells: Vec<_> =
            record.iter().map(|cell| (text(cell).into_owned(), unit_cell(&text(cell)))).collect();
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
        self.begin += reader.position().byte();
    }

    /// The unit of a column: that in its title, or that of the line below.
    pub fn unit(&self, place: usize) -> Result<Option<String>, CsvError> {
        let title = &self.header.titles[place];
        let below = self.units.get(place).cloned().flatten();
        match (title.unit.clone(), below) {
            (Some(title), Some(below)) if title != below => {
                let (path, column) = (self.path.to_owned(), self.header.titles[place].text.clone());
                let line = self.line(self.header.end as u64);
                Err(CsvError::TwoUnits { path, column, title, below, line })
            }
            (title, below) => Ok(title.or(below)),
        }
    }

    /// The number of the line that a row begins in; blank lines before it are skipped. The file is read again up to there.
    pub fn line(&self, begin: u64) -> usize {
        let (mut ends, mut returns, mut at) = (0, 0, 0u64);
        let Ok(text) = self.text.open() else { return 1 };
        for byte in io::BufReader::with_capacity(1 << 16, text).bytes().map_while(Result::ok) {
            match byte {
                b'\n' => ends += 1,
                b'\r' => returns += 1,
                _ if at >= begin => break,
                _ => {}
            }
            at += 1;
        }
        1 + if ends == 0 { returns } else { ends }
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

    /// Goes through the rows until `take` wants no more, and warns of a last one that was cut off, which is left out. So are rows
    /// without any content.
    pub fn rows(&self, take: TakeRow) -> Result<Option<String>, CsvError> {
        let unreadable = |source| CsvError::Read { path: self.path.to_owned(), source };
        let last = Shared::new(b'\n');
        let text =
            Watched { from: self.text.open_at(self.begin).map_err(unreadable)?, last: &last };
        let mut reader = reader(text, self.header.separator);
        let (mut record, mut next) = (ByteRecord::new(), ByteRecord::new());
        let expected = self.header.titles.len();
        let mut count = 0;
        let mut more = |into: &mut ByteRecord| {
            reader.read_byte_record(into).map_err(|error| unreadable(error.into()))
        };
        while more(&mut record)? {
            let begin = self.begin + record.position().map_or(0, ::csv::Position::byte);
            let empty = |cell: &[u8]| cell.trim_ascii().is_empty();
            if record.get(0).is_some_and(is_comment) || record.iter().all(empty) {
                continue;
            }
            let wider = record.iter().skip(expected).any(|cell| !empty(cell));
            if record.len() < expected
                && count > 0
                && !more(&mut next)?
                && ![b'\n', b'\r'].contains(&last.get())
            {
                let (path, line) = (self.path.display(), self.line(begin));
                let what = "the file was cut off in this line";
                return Ok(Some(format!("line {line} of {path} is left out: {what}")));
            }
            if record.len() < expected || wider {
                return Err(self.ragged(begin, record.len()));
            }
            count += 1;
            if !take(begin, &record) {
                return Ok(None);
            }
        }
        match count {
            0 => Err(CsvError::Empty { path: self.path.to_owned(), found: "only a header" }),
            _ => Ok(None),
        }
    }

    /// The first byte of a row.
    pub fn begin_of(&self, row: usize) -> u64 {
        let (mut number, mut found) = (0, self.begin);
        // What is wrong with the rows before it is told already.
        let _ = self.rows(&mut |begin, _| {
            found = begin;
            number += 1;
            number <= row
        });
        found
    }

    fn ragged(&self, begin: u64, found: usize) -> CsvError {
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

/// The lines among which the titles and the units are.
fn head(text: &Text) -> io::Result<Vec<u8>> {
    let mut text = text.open()?.take(LARGEST_HEAD);
    let (mut head, mut lines) = (Vec::new(), 0);
    while lines <= 2 * header::HEAD {
        let before = head.len();
        (&mut text).take(1 << 16).read_to_end(&mut head)?;
        if head.len() == before {
            break;
        }
        lines += head[before..].iter().filter(|byte| matches!(byte, b'\n' | b'\r')).count();
    }
    Ok(head)
}

/// Remembers the last byte that was read.
struct Watched<'l, R> {
    from: R,
    last: &'l Shared<u8>,
}

impl<R: io::Read> io::Read for Watched<'_, R> {
    fn read(&mut self, into: &mut [u8]) -> io::Result<usize> {
        let count = self.from.read(into)?;
        if let Some(last) = into[..count].last() {
            self.last.set(*last);
        }
        Ok(count)
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
    cell.trim_ascii_start().starts_with(b"#")
        && cell::cell(&text(cell), Decimal::Point) != Cell::Gap
}

/// A text of the file, which may be of Western Windows.
pub(super) fn text(bytes: &[u8]) -> Cow<'_, str> {
    match std::str::from_utf8(bytes) {
        Ok(text) => text.into(),
        Err(_) => bytes.iter().map(|byte| char::from(*byte)).collect::<String>().into(),
    }
}
