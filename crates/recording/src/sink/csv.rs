//! Writes a run as CSV: `time` and one column for each signal, with as many digits as it takes to read
//! the same numbers back, and texts in quotes behind the numbers.

use std::fs::File;
use std::io::{BufWriter, Write as _};
use std::path::PathBuf;

use diagnostics::Error;

use super::{RunHeader, Sink};
use crate::row::{Recorded, Row};

/// A CSV file that gets its name when it is complete.
pub struct CsvSink {
    path: PathBuf,
    partial: PathBuf,
    out: BufWriter<File>,
    line: String,
}

impl CsvSink {
    /// Begins the file `run.csv` of the run's folder.
    ///
    /// # Errors
    /// When the file cannot be made.
    pub fn new(header: &RunHeader) -> Result<Self, Error> {
        let path = header.folder.join("run.csv");
        let partial = header.folder.join("run.csv.partial");
        let file = File::create(&partial).map_err(|error| Error::output(&partial, error))?;
        let names = header.columns.iter().map(|column| name(column.name()));
        let mut sink = CsvSink { path, partial, out: BufWriter::new(file), line: String::new() };
        sink.line = names.fold("time".to_owned(), |line, name| line + "," + &name);
        sink.write_line()?;
        Ok(sink)
    }

    fn write_line(&mut self) -> Result<(), Error> {
        self.line.push('\n');
        let written = self.out.write_all(self.line.as_bytes());
        written.map_err(|error| Error::output(&self.partial, error))
    }
}

/// Names of array elements contain commas.
fn name(name: String) -> String {
    if name.contains(['"', ',']) { quoted(&name) } else { name }
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
        for value in row.numbers() {
            let _ = write!(self.line, ",{value}");
        }
        for text in row.texts() {
            let _ = write!(self.line, ",{}", quoted(text));
        }
        self.write_line()
    }

    fn finish(&mut self, _summary: &str, completed: bool) -> Result<(), Error> {
        self.out.flush().map_err(|error| Error::output(&self.partial, error))?;
        // A table that stops early looks like any other, so it does not get the name.
        if !completed {
            return Ok(());
        }
        std::fs::rename(&self.partial, &self.path).map_err(|error| Error::output(&self.path, error))
    }
}
