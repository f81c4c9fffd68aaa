//! Writes a run as CSV: the time, a column for each number with all digits, then a quoted column for each text. Titles have
//! the unit in brackets.

use std::fs::File;
use std::io::{BufWriter, Write as _};
use std::path::{Path, PathBuf};

use diagnostics::Error;

use super::{RunHeader, Sink, partial_path};
use crate::columns::Column;
use crate::row::{RecordedVariables, Row};
use crate::table::format_title;
use expression::{IntegerIndex, NumberIndex};

/// A CSV file. It gets its name when it is complete.
pub struct CsvSink {
    path: PathBuf,
    partial: PathBuf,
    out: BufWriter<File>,
    line: String,
    /// The numbers that are written exactly, as integers.
    integers: Vec<(IntegerIndex<RecordedVariables>, NumberIndex<RecordedVariables>)>,
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
        let partial = partial_path(path);
        let file = File::create(&partial).map_err(|error| Error::output_failure(&partial, error))?;
        let names = header.columns.iter().map(csv_heading);
        let (out, integers) = (BufWriter::new(file), header.columns.integer_columns().collect());
        let path = path.to_owned();
        let mut sink = CsvSink { path, partial, out, line: String::new(), integers };
        sink.line = names.fold("time [s]".to_owned(), |line, name| line + "," + &name);
        sink.write_line()?;
        Ok(sink)
    }

    fn write_line(&mut self) -> Result<(), Error> {
        self.line.push('\n');
        let written = self.out.write_all(self.line.as_bytes());
        written.map_err(|error| Error::output_failure(&self.partial, error))
    }
}

/// The title in the line of titles. Names of array elements contain commas.
fn csv_heading(column: &Column) -> String {
    let title = format_title(&column.qualified_name(), column.unit.as_deref());
    if title.contains(['"', ',', ';', '\t']) { csv_quoted(&title) } else { title }
}

fn csv_quoted(text: &str) -> String {
    format!("\"{}\"", text.replace('"', "\"\""))
}

impl Sink for CsvSink {
    fn push_row(&mut self, _tick: u64, time: f64, row: &Row<RecordedVariables>) -> Result<(), Error> {
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
            let _ = write!(self.line, ",{}", csv_quoted(text));
        }
        self.write_line()
    }

    fn finish(&mut self, _summary: &str, completed: bool) -> Result<(), Error> {
        self.out.flush().map_err(|error| Error::output_failure(&self.partial, error))?;
        super::rename_completed_file(&self.partial, &self.path, completed)
    }
}
