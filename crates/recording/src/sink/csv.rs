//! Writes a run as CSV: the time, a column for each number with all digits, then a quoted column for each text. Titles have
//! the unit in brackets.

use std::fs::File;
use std::io::{BufWriter, Write as _};
use std::path::{Path, PathBuf};

use diagnostics::Error;

use super::{RunHeader, Sink, partial};
use crate::columns::Column;
use crate::row::{Recorded, Row};
use crate::table::title;
use expression::{IntegerIndex, NumberIndex};

/// A CSV file. It gets its name when it is complete.
pub struct CsvSink {
    path: PathBuf,
    partial: PathBuf,
    out: BufWriter<File>,
    line: String,
    /// The numbers that are written exactly, as integers.
    integers: Vec<(IntegerIndex<Recorded>, NumberIndex<Recorded>)>,
}

impl CsvSink {
    /// The files that it may leave.
    pub const FILES: &[&str] = &["run.csv", "run.csv.partial"];

    /// Begins the file `run.csv` of the run's folder.
    ///
    /// # Errors
    /// When the file cannot be created.
    pub fn new(header: &RunHeader) -> Result<Self, Error> {
        Self::create(header, &header.folder.join("run.csv"))
    }

    /// Begins a file of any name. Until it is complete it has the ending `.partial` as well.
    ///
    /// # Errors
    /// When the file cannot be created.
    pub fn create(header: &RunHeader, path: &Path) -> Result<Self, Error> {
        let partial = partial(path);
        let file = File::create(&partial).map_err(|error| Error::output(&partial, error))?;
        let names = header.columns.iter().map(heading);
        let (out, integers) = (BufWriter::new(file), header.columns.integers().collect());
        let path = path.to_owned();
        let mut sink = CsvSink { path, partial, out, line: String::new(), integers };
        sink.line = names.fold("time [s]".to_owned(), |line, name| line + "," + &name);
        sink.write_line()?;
        Ok(sink)
    }

    fn write_line(&mut self) -> Result<(), Error> {
        self.line.push('\n');
        let written = self.out.write_all(self.line.as_bytes());
        written.map_err(|error| Error::output(&self.partial, error))
    }
}

/// The title in the line of titles. Names of array elements contain commas.
fn heading(column: &Column) -> String {
    let title = title(&column.name(), column.unit.as_deref());
    if title.contains(['"', ',', ';', '\t']) { quoted(&title) } else { title }
}

fn quoted(text: &str) -> String {
    format!("\"{}\"", text.replace('"', "\"\""))
}

impl Sink for CsvSink {
    fn row(&mut self, _tick: u64, time: f64, row: &Row<Recorded>) -> Result<(), Error> {
        use std::fmt::Write as _;
        self.line.clear();
        // Writing into a string cannot fail.
        let _ = write!(self.line, "{time}");
        let mut integers = self.integers.iter().peekable();
        for (place, value) in row.numbers().iter().enumerate() {
            let _ = match integers.next_if(|(_, number)| number.position() == place) {
                Some((integer, _)) => write!(self.line, ",{}", row[*integer]),
                None => write!(self.line, ",{value}"),
            };
        }
        for text in row.texts() {
            let _ = write!(self.line, ",{}", quoted(text));
        }
        self.write_line()
    }

    fn finish(&mut self, _summary: &str, completed: bool) -> Result<(), Error> {
        self.out.flush().map_err(|error| Error::output(&self.partial, error))?;
        super::name(&self.partial, &self.path, completed)
    }
}
