//! Iterates over the rows of a CSV file whose titles and units are known.

use std::cell::Cell as Shared;
use std::collections::HashMap;
use std::io::{self, Read as _};
use std::path::Path;

use ::csv::ByteRecord;
use text_encoding::utf8_or_latin1;

use super::cell::{self, CsvCell};
use super::explanation::sensor_name;
use super::layout::{self, CsvLayout};
use super::text::CsvText;
use super::{csv_reader, line};
use crate::table::foreign::detect_foreign_format;
use crate::table::names::{ColumnHeading, UniqueColumnNames};
use crate::table::read_request::{CsvDialect, DecimalMark, Separator};
use crate::table::title::ParsedTitle;
use crate::table::{ColumnTitle, CsvError, TableError};

/// What is looked at to find the titles and the units has at most so many bytes [B].
const LARGEST_HEAD: u64 = 64 << 20;

/// The longest row [B]: a million numbers. The rest of a file without ends of lines stays unread.
const LONGEST_ROW: usize = 16 << 20;

/// A CSV file whose titles are known.
pub(super) struct CsvFile<'a> {
    pub path: &'a Path,
    text: &'a CsvText,
    pub layout: CsvLayout,
    names: UniqueColumnNames,
    /// The first column of the time that the profile names.
    own_time: Option<usize>,
    /// Whether its rows have times, so that one like the row before it, cell by cell, says nothing: some loggers write them.
    pub is_timed: bool,
}

/// Takes the first byte of a row and its cells, and says whether it wants more.
pub(super) type RowCallback<'t> = &'t mut dyn FnMut(u64, &ByteRecord) -> bool;

impl<'a> CsvFile<'a> {
    /// Finds the titles and the units.
    pub fn open(
        path: &'a Path,
        text: &'a CsvText,
        titles: &[&str],
        dialect: &CsvDialect,
    ) -> Result<Self, CsvError> {
        let unreadable = |source| CsvError::Read { path: path.to_owned(), source };
        let head = read_header_bytes(text).map_err(unreadable)?;
        let binary = head.iter().take(1 << 12).any(|byte| *byte == 0);
        let zeros = || ("no text, or text in UTF-16", "save it as UTF-8");
        if let Some((found, cure)) = detect_foreign_format(path, &head).or_else(|| binary.then(zeros)) {
            return Err(CsvError::NoText { path: path.to_owned(), found, cure });
        }
        if let Some(line) = line::longer_line(&head, LONGEST_ROW) {
            return Err(CsvError::LongRow { path: path.to_owned(), line, longest: LONGEST_ROW });
        }
        let empty = || CsvError::Empty { path: path.to_owned(), found: "nothing" };
        let layout = layout::detect_csv_layout(&head, titles, dialect).ok_or_else(empty)?;
        if layout.is_numbers {
            let names = (1..layout.titles.len()).map(|k| format!("x{k}"));
            let example = std::iter::once("t".to_owned()).chain(names).collect::<Vec<_>>().join(",");
            let line = layout.titles_line;
            return Err(CsvError::NoTitles { path: path.to_owned(), line, example });
        }
        let of_line = |place: usize| layout.sources.get(place).map(|it| sensor_name(it));
        let said = layout.titles.iter().enumerate().map(|(place, title)| ColumnHeading {
            text: &title.text,
            plain: &title.plain,
            source: of_line(place).filter(|it| !it.is_empty()).or(title.source.as_deref()),
        });
        let names = UniqueColumnNames::new(&said.collect::<Vec<_>>());
        let times = layout.profile.map_or(&[][..], |it| it.time).iter();
        let own_time = times.filter_map(|it| names.columns_named(it).first().copied()).next();
        Ok(CsvFile { path, text, layout, names, own_time, is_timed: false })
    }

    /// The column of the time that counts when none is named.
    pub fn default_time_column(&self) -> Option<usize> {
        self.own_time
    }

    /// What of the file above its rows is not read.
    pub fn unread_header_note(&self) -> Option<String> {
        let lines = self.layout.left_out.iter().map(ToString::to_string).collect::<Vec<_>>();
        let path = self.path.display();
        let cure = "name the lines of titles and units by `title_row` and `unit_row`";
        (!lines.is_empty()).then(|| {
            format!(
                "line {} of {path}, between titles and rows, is left out: {cure}, if it has them",
                lines.join(", ")
            )
        })
    }

    /// The unit of a column: that in its title, or that of the line below.
    pub fn column_unit(&self, place: usize) -> Result<Option<String>, CsvError> {
        let title = &self.layout.titles[place];
        let below = self.layout.units.get(place).cloned().flatten();
        match (title.unit.clone(), below) {
            (Some(title), Some(below)) if title != below => {
                let (path, column) = (self.path.to_owned(), self.layout.titles[place].text.clone());
                let line = self.layout.units_line.unwrap_or_default();
                Err(CsvError::TwoUnits { path, column, title, below, line })
            }
            (None, None) if self.own_time == Some(place) => {
                Ok(self.layout.profile.and_then(|it| it.time_unit).map(str::to_owned))
            }
            (title, below) => Ok(title.or(below)),
        }
    }

    /// The number of the line that a row begins in; blank lines before it are skipped. The file is read again up to there.
    pub fn line_number_at(&self, begin: u64) -> usize {
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
    pub fn column_indices(&self, wanted: &[&str]) -> Result<Vec<usize>, TableError> {
        wanted.iter().map(|name| self.column_index(name)).collect()
    }

    /// Where a column is: by its whole title, without its unit, or by a name that tells it from others of one title.
    pub fn column_index(&self, name: &str) -> Result<usize, TableError> {
        match self.names.columns_named(name) {
            [place] => Ok(*place),
            [] => Err(TableError::missing_column(self.path, name, self.unique_column_names())),
            found => Err(self.ambiguous_column_error(name, found).into()),
        }
    }

    /// Refuses several columns of one title, whatever their units are.
    pub fn check_unique_titles(&self) -> Result<(), CsvError> {
        let mut first: HashMap<&str, usize> = HashMap::new();
        for (place, title) in self.layout.titles.iter().enumerate().skip(1) {
            if !title.plain.is_empty()
                && let Some(twin) = first.insert(&title.plain, place)
            {
                return Err(self.ambiguous_column_error(&title.plain, &[twin, place]));
            }
        }
        Ok(())
    }

    fn ambiguous_column_error(&self, name: &str, found: &[usize]) -> CsvError {
        let places = found.iter().map(|at| format!("`{}`", self.names.unique_name(*at)));
        let places = places.collect::<Vec<_>>().join(", ");
        let (path, column) = (self.path.to_owned(), name.to_owned());
        CsvError::Ambiguous { path, column, places }
    }

    /// The titles of the columns, with their units.
    pub fn column_titles(&self) -> Result<Vec<ColumnTitle>, CsvError> {
        let titles = self.layout.titles.iter().enumerate();
        let titles = titles.filter(|(_, title)| !title.plain.is_empty()).map(|(place, title)| {
            let (text, plain) = (title.text.clone(), title.plain.clone());
            let (name, unit) = (self.names.unique_name(place).to_owned(), self.column_unit(place)?);
            Ok(ColumnTitle { text, plain, name, unit })
        });
        titles.collect()
    }

    /// A name of each column that is no other one's.
    pub fn unique_column_names(&self) -> Vec<String> {
        let titles = self.layout.titles.iter().enumerate();
        let named = titles.filter(|(_, it)| !it.plain.is_empty());
        named.map(|(place, _)| self.names.unique_name(place).to_owned()).collect()
    }

    /// The name of a column that is no other one's.
    pub fn unique_column_name(&self, place: usize) -> &str {
        self.names.unique_name(place)
    }

    /// Goes through the rows until `take` wants no more, and warns of a last one that was cut off, which is left out. So are rows
    /// without any content.
    pub fn visit_rows(&self, take: RowCallback) -> Result<Option<String>, CsvError> {
        let unreadable = |source| CsvError::Read { path: self.path.to_owned(), source };
        let (last, row, begin) = (Shared::new(b'\n'), Shared::new(0), self.layout.rows_begin as u64);
        let is_blank = self.layout.separator == Separator::Blank;
        let from = self.text.open_at(begin).map_err(unreadable)?;
        let text = RowReader { from, last: &last, row: &row, is_blank };
        let mut reader = csv_reader(text, self.layout.separator);
        let (mut record, mut next) = (ByteRecord::new(), ByteRecord::new());
        let expected = self.layout.titles.len();
        let (mut count, mut titles, mut repeated) = (0, SkippedRows::default(), SkippedRows::default());
        let mut previous = ByteRecord::new();
        let mut more = |into: &mut ByteRecord| {
            let read = reader.read_byte_record(into);
            if row.replace(0) > LONGEST_ROW {
                let line = self.line_number_at(begin + into.position().map_or(0, ::csv::Position::byte));
                return Err(CsvError::LongRow { path: self.path.to_owned(), line, longest: LONGEST_ROW });
            }
            if is_blank {
                remove_empty_cells(into);
            }
            read.map_err(|error| unreadable(error.into()))
        };
        while more(&mut record)? {
            let begin = begin + record.position().map_or(0, ::csv::Position::byte);
            let empty = |cell: &[u8]| cell.trim_ascii().is_empty();
            if record.get(0).is_some_and(is_comment) || record.iter().all(empty) {
                continue;
            }
            if self.is_titles(&record) {
                titles.count_row(begin);
                continue;
            }
            if self.is_timed && record.iter().eq(previous.iter()) {
                repeated.count_row(begin);
                continue;
            }
            let wider = record.iter().skip(expected).any(|cell| !empty(cell));
            if record.len() < expected
                && count > 0
                && !more(&mut next)?
                && ![b'\n', b'\r'].contains(&last.get())
            {
                let (path, line) = (self.path.display(), self.line_number_at(begin));
                let what = "the file was cut off in this line";
                return Ok(Some(format!("line {line} of {path} is left out: {what}")));
            }
            if record.len() < expected || wider {
                return Err(self.ragged_row_error(begin, record.len()));
            }
            count += 1;
            if !take(begin, &record) {
                return Ok(None);
            }
            if self.is_timed {
                previous.clone_from(&record);
            }
        }
        if count == 0 {
            let found = "only a header";
            return Err(CsvError::Empty { path: self.path.to_owned(), found });
        }
        let titles = titles.warning(self, "with the titles again");
        Ok(titles.or_else(|| repeated.warning(self, "like the row before, cell by cell,")))
    }

    /// Whether a row has the titles again, as where a logger began anew.
    fn is_titles(&self, record: &ByteRecord) -> bool {
        let titles = &self.layout.titles;
        let same = |(cell, title): (&[u8], &ParsedTitle)| utf8_or_latin1(cell).trim() == title.text;
        titles.len() > 1 && record.len() >= titles.len() && record.iter().zip(titles).all(same)
    }

    /// The first byte of a row.
    pub fn row_offset(&self, row: usize) -> u64 {
        let (mut number, mut found) = (0, self.layout.rows_begin as u64);
        // What is wrong with the rows before it is told already.
        let _ = self.visit_rows(&mut |begin, _| {
            found = begin;
            number += 1;
            number <= row
        });
        found
    }

    fn ragged_row_error(&self, begin: u64, found: usize) -> CsvError {
        let (path, line, expected) =
            (self.path.to_owned(), self.line_number_at(begin), self.layout.titles.len());
        let hint = match self.layout.separator {
            Separator::Comma if found == 2 * expected => {
                "; numbers with decimal commas need another separator: export with semicolons"
            }
            _ => "; if a text has an opening quotation mark only, remove it",
        };
        CsvError::Ragged { path, line, expected, found, hint }
    }
}

/// Rows that say nothing.
#[derive(Default)]
struct SkippedRows {
    count: usize,
    /// The first byte of the first one.
    first: u64,
}

impl SkippedRows {
    fn count_row(&mut self, begin: u64) {
        self.first = if self.count == 0 { begin } else { self.first };
        self.count += 1;
    }

    fn warning(&self, file: &CsvFile, what: &str) -> Option<String> {
        let (count, path) = (self.count, file.path.display());
        let rows = if count == 1 { "row" } else { "rows" };
        (count > 0).then(|| {
            let line = file.line_number_at(self.first);
            format!("{count} {rows} of {path} {what} left out, the first one in line {line}")
        })
    }
}

/// The lines among which the titles and the units are.
fn read_header_bytes(text: &CsvText) -> io::Result<Vec<u8>> {
    let mut text = text.open()?.take(LARGEST_HEAD);
    let (mut head, mut lines) = (Vec::new(), 0);
    while lines <= 2 * line::HEAD {
        let before = head.len();
        (&mut text).take(1 << 16).read_to_end(&mut head)?;
        if head.len() == before {
            break;
        }
        lines += head[before..].iter().filter(|byte| matches!(byte, b'\n' | b'\r')).count();
    }
    Ok(head)
}

/// Remembers the last byte that was read, ends in a row that is too long, and makes blanks of tabulators where both separate.
struct RowReader<'l, R> {
    from: R,
    last: &'l Shared<u8>,
    /// Bytes since the last row was complete.
    row: &'l Shared<usize>,
    is_blank: bool,
}

impl<R: io::Read> io::Read for RowReader<'_, R> {
    fn read(&mut self, into: &mut [u8]) -> io::Result<usize> {
        if self.row.get() > LONGEST_ROW {
            return Ok(0);
        }
        let count = self.from.read(into)?;
        self.row.set(self.row.get() + count);
        if self.is_blank {
            into[..count].iter_mut().filter(|it| **it == b'\t').for_each(|it| *it = b' ');
        }
        if let Some(last) = into[..count].last() {
            self.last.set(*last);
        }
        Ok(count)
    }
}

/// Takes the empty cells between several blanks out.
fn remove_empty_cells(record: &mut ByteRecord) {
    let position = record.position().cloned();
    let mut cells = ByteRecord::from_iter(record.iter().filter(|cell| !cell.is_empty()));
    cells.set_position(position);
    *record = cells;
}

/// Whether a row that begins with this cell is a comment. `#N/A` is a gap.
fn is_comment(cell: &[u8]) -> bool {
    cell.trim_ascii_start().starts_with(b"#")
        && cell::parse_cell(&utf8_or_latin1(cell), DecimalMark::Point) != CsvCell::Gap
}
