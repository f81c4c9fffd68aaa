//! Plays recorded columns of a CSV file back at any time.

use std::path::{Path, PathBuf};

use serde::Deserialize;

use crate::suggest::closest;

/// How a value between two recorded ones comes about.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Interpolation {
    /// On the straight line between its neighbours.
    #[default]
    Linear,
    /// The last recorded value.
    Hold,
}

/// Why a recording cannot be played back; lines count from 1, the header's.
#[derive(Debug, thiserror::Error)]
pub enum TableError {
    /// The file cannot be opened.
    #[error("cannot open the recording {}: {source}", path.display())]
    Open {
        /// The file.
        path: PathBuf,
        /// What the system says.
        source: std::io::Error,
    },
    /// The file cannot be read to its end, or is not UTF-8.
    #[error("cannot read the recording {}: {source}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// What the reader says.
        source: csv::Error,
    },
    /// There is no header or no row below it.
    #[error("expected a header and at least one row in {}, found {found}", path.display())]
    Empty {
        /// The file.
        path: PathBuf,
        /// What is there.
        found: &'static str,
    },
    /// The header does not have a column that the scenario asks for.
    #[error(
        "no column `{column}` in the header of {}: it has {}{}", path.display(), present.join(", "),
        suggestion.as_ref().map(|name| format!("; did you mean `{name}`?")).unwrap_or_default()
    )]
    MissingColumn {
        /// The file.
        path: PathBuf,
        /// The column that was asked for.
        column: String,
        /// The columns that are there.
        present: Vec<String>,
        /// The closest of them.
        suggestion: Option<String>,
    },
    /// A row has more or fewer cells than the header.
    #[error("line {line} of {} has {found} cells, expected {expected} as in the header", path.display())]
    Ragged {
        /// The file.
        path: PathBuf,
        /// The line.
        line: u64,
        /// The cells of the header.
        expected: u64,
        /// The cells of the line.
        found: u64,
    },
    /// A cell is not a number.
    #[error("line {line} of {}: expected a number in column `{column}`, found {text:?}", path.display())]
    NotANumber {
        /// The file.
        path: PathBuf,
        /// The line.
        line: u64,
        /// The column.
        column: String,
        /// The cell.
        text: String,
    },
    /// A cell is infinite or NaN.
    #[error(
        "line {line} of {}: expected a finite number in column `{column}`, found {text}; \
         remove the row or fill the gap", path.display()
    )]
    NotFinite {
        /// The file.
        path: PathBuf,
        /// The line.
        line: u64,
        /// The column.
        column: String,
        /// The cell.
        text: String,
    },
    /// A time stamp does not come after the one before it.
    #[error(
        "line {line} of {}: expected a time after {before} of the row before, found {found}; \
         sort the rows and remove repeated times", path.display()
    )]
    TimeNotIncreasing {
        /// The file.
        path: PathBuf,
        /// The line.
        line: u64,
        /// The time stamp of the row before [s].
        before: f64,
        /// The time stamp of the line [s].
        found: f64,
    },
}

/// Columns of a recording over its time stamps.
#[derive(Debug, Clone)]
pub struct Table {
    time: Vec<f64>,
    columns: Vec<Vec<f64>>,
    names: Vec<String>,
    origin: f64,
    interpolation: Interpolation,
    /// The row at or before the last time that was asked for: times mostly ascend.
    cursor: usize,
}

/// Scenario times are multiples of a decimal step, which rounding puts just before a time stamp
/// that they should meet [s].
const EDGE: f64 = 1e-9;

impl Table {
    /// Reads the time stamps [s] and the wanted columns, given as pairs of the name in the scenario
    /// and the name in the file's header, with linear interpolation and the scenario's time 0 at
    /// the first time stamp.
    ///
    /// # Errors
    /// When the file cannot be read, lacks a column or has a cell that cannot be played back.
    pub fn read(
        path: impl AsRef<Path>,
        time_column: &str,
        columns: &[(String, String)],
    ) -> Result<Self, TableError> {
        let path = path.as_ref();
        let file = std::fs::File::open(path)
            .map_err(|source| TableError::Open { path: path.to_owned(), source })?;
        let reader = csv::ReaderBuilder::new().buffer_capacity(1 << 16).from_reader(file);
        let mut source = Source { path, reader };
        let header = source.header()?;
        let wanted = std::iter::once(time_column)
            .chain(columns.iter().map(|(_, column)| column.as_str()))
            .map(|column| source.find(&header, column))
            .collect::<Result<Vec<_>, _>>()?;
        let mut cells = source.cells(&header, &wanted)?;
        let time = cells.remove(0);
        Ok(Self {
            columns: cells,
            names: columns.iter().map(|(name, _)| name.clone()).collect(),
            origin: time[0],
            time,
            interpolation: Interpolation::default(),
            cursor: 0,
        })
    }

    /// Plays back so that the scenario's time 0 is this time stamp [s], the first one when absent:
    /// scenario time is the file's time minus `stamp`.
    pub fn set_origin(&mut self, stamp: Option<f64>) {
        self.origin = stamp.unwrap_or_else(|| self.start());
    }

    /// Plays back with this interpolation.
    pub fn set_interpolation(&mut self, interpolation: Interpolation) {
        self.interpolation = interpolation;
    }

    /// The names in the scenario; their order is that of the column indices.
    #[must_use]
    pub fn names(&self) -> &[String] {
        &self.names
    }

    /// The time stamps, in times of the scenario [s].
    #[must_use]
    pub fn times(&self) -> Vec<f64> {
        self.time.iter().map(|stamp| stamp - self.origin).collect()
    }

    /// The values of a column at the time stamps.
    ///
    /// # Panics
    /// When `column` is not an index into [`Table::names`].
    #[must_use]
    pub fn column(&self, column: usize) -> &[f64] {
        &self.columns[column]
    }

    /// The first time stamp, as in the file [s].
    #[must_use]
    pub fn start(&self) -> f64 {
        self.time[0]
    }

    /// From the first to the last time stamp [s].
    #[must_use]
    pub fn duration(&self) -> f64 {
        self.time[self.time.len() - 1] - self.time[0]
    }

    /// The column's value at a time of the scenario [s]: the first one before the recording begins
    /// and the last one after it ends. Constant effort while times ascend.
    ///
    /// # Panics
    /// When `column` is not an index into [`Table::names`].
    pub fn value(&mut self, column: usize, time: f64) -> f64 {
        let stamp = time + self.origin;
        self.seek(stamp + EDGE);
        let (values, here) = (&self.columns[column], self.cursor);
        if here + 1 == values.len() || self.interpolation == Interpolation::Hold {
            return values[here];
        }
        let share = (stamp - self.time[here]) / (self.time[here + 1] - self.time[here]);
        let share = share.clamp(0.0, 1.0);
        values[here] * (1.0 - share) + values[here + 1] * share
    }

    fn seek(&mut self, stamp: f64) {
        if stamp < self.time[self.cursor] {
            let after = self.time[..self.cursor].partition_point(|t| *t <= stamp);
            self.cursor = after.saturating_sub(1);
        }
        while self.time.get(self.cursor + 1).is_some_and(|t| *t <= stamp) {
            self.cursor += 1;
        }
    }
}

struct Source<'a> {
    path: &'a Path,
    reader: csv::Reader<std::fs::File>,
}

impl Source<'_> {
    /// The trimmed names of the columns; numpy writes the header as a comment that begins with `#`.
    fn header(&mut self) -> Result<Vec<String>, TableError> {
        let record = self
            .reader
            .headers()
            .map_err(|source| TableError::Read { path: self.path.to_owned(), source })?;
        let mut names: Vec<String> = record.iter().map(|cell| cell.trim().to_owned()).collect();
        match names.first_mut() {
            Some(first) => *first = first.trim_start_matches('#').trim_start().to_owned(),
            None => return Err(self.empty("nothing")),
        }
        Ok(names)
    }

    fn empty(&self, found: &'static str) -> TableError {
        TableError::Empty { path: self.path.to_owned(), found }
    }

    fn find(&self, header: &[String], column: &str) -> Result<usize, TableError> {
        let found = header.iter().position(|name| name == column);
        found.ok_or_else(|| TableError::MissingColumn {
            path: self.path.to_owned(),
            column: column.to_owned(),
            present: header.to_vec(),
            suggestion: closest(column, header.iter().map(String::as_str)).map(str::to_owned),
        })
    }

    /// The wanted columns, of which the first is the time.
    fn cells(&mut self, header: &[String], wanted: &[usize]) -> Result<Vec<Vec<f64>>, TableError> {
        let mut cells = vec![Vec::new(); wanted.len()];
        let mut record = csv::StringRecord::new();
        loop {
            match self.reader.read_record(&mut record) {
                Ok(true) => {}
                Ok(false) if cells[0].is_empty() => return Err(self.empty("only a header")),
                Ok(false) => return Ok(cells),
                Err(source) => return Err(self.failure(source)),
            }
            let line = record.position().map_or(0, csv::Position::line);
            for (index, values) in wanted.iter().zip(&mut cells) {
                values.push(self.number(&record[*index], line, &header[*index])?);
            }
            if let [.., before, found] = cells[0][..]
                && found <= before
            {
                return Err(TableError::TimeNotIncreasing {
                    path: self.path.to_owned(),
                    line,
                    before,
                    found,
                });
            }
        }
    }

    fn number(&self, cell: &str, line: u64, column: &str) -> Result<f64, TableError> {
        let (path, column, text) = (self.path, column, cell.trim());
        match text.parse::<f64>() {
            Ok(value) if value.is_finite() => Ok(value),
            Ok(_) => Err(TableError::NotFinite {
                path: path.to_owned(),
                line,
                column: column.to_owned(),
                text: text.to_owned(),
            }),
            Err(_) => Err(TableError::NotANumber {
                path: path.to_owned(),
                line,
                column: column.to_owned(),
                text: text.to_owned(),
            }),
        }
    }

    fn failure(&self, source: csv::Error) -> TableError {
        let path = self.path.to_owned();
        match source.kind() {
            csv::ErrorKind::UnequalLengths { pos, expected_len, len } => TableError::Ragged {
                path,
                line: pos.as_ref().map_or(0, csv::Position::line),
                expected: *expected_len,
                found: *len,
            },
            _ => TableError::Read { path, source },
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(name: &str, text: &str, columns: &[&str]) -> Result<Table, TableError> {
        let file = format!("table-{name}-{}.csv", std::process::id());
        let path = std::env::temp_dir().join(file);
        std::fs::write(&path, text).expect("the temporary folder is writable");
        let columns: Vec<_> =
            columns.iter().map(|name| (format!("node.{name}"), (*name).to_owned())).collect();
        let table = Table::read(&path, "t", &columns);
        std::fs::remove_file(&path).expect("it has just been written");
        table
    }

    const RECORDING: &str = "# t , v, note,a\n10, 1,first,-1\n10.5,2,second,-2\n12,5e0,third,-3\n";

    #[test]
    fn values_are_interpolated_held_and_clamped() {
        let mut linear = read("linear", RECORDING, &["a", "v"]).expect("it is well-formed");
        assert_eq!(linear.names(), ["node.a", "node.v"]);
        assert_eq!((linear.start(), linear.duration()), (10.0, 2.0));
        assert_eq!(linear.value(0, 0.5), -2.0);
        linear.set_origin(Some(0.0));
        let mut hold = linear.clone();
        hold.set_interpolation(Interpolation::Hold);
        for (stamp, between, last) in [
            (0.0, 1.0, 1.0),
            (10.0, 1.0, 1.0),
            (10.25, 1.5, 1.0),
            (10.5, 2.0, 2.0),
            (11.0, 3.0, 2.0),
            (12.0, 5.0, 5.0),
            (99.0, 5.0, 5.0),
            (10.25, 1.5, 1.0),
            (-1.0, 1.0, 1.0),
        ] {
            assert_eq!(linear.value(1, stamp), between, "{stamp}");
            assert_eq!(hold.value(1, stamp), last, "{stamp}");
        }
        let mut shifted = linear.clone();
        for (origin, expected) in [(Some(9.5), 2.0), (Some(10.0), 3.0), (None, 3.0)] {
            shifted.set_origin(origin);
            assert_eq!(shifted.value(1, 1.0), expected, "{origin:?}");
        }
    }

    #[test]
    fn any_order_of_times_gives_the_same_values() {
        let rows = (0..50).map(|i| format!("{},{}\n", f64::from(i) * 0.1, i * i % 17));
        let text = format!("t,x\n{}", rows.collect::<String>());
        let mut table = read("order", &text, &["x"]).expect("it is well-formed");
        let fresh = table.clone();
        for i in 0..200 {
            let time = f64::from(i * 37 % 200) * 0.025;
            let expected = fresh.clone().value(0, time);
            assert_eq!(table.value(0, time), expected, "{time}");
        }
    }

    #[test]
    fn held_values_change_at_times_that_rounding_puts_before_their_stamp() {
        let text = "t,x\n0,0\n0.1,1\n0.2,2\n0.3,3\n0.6,6\n0.7,7\n1.1,11\n";
        let mut table = read("edge", text, &["x"]).expect("it is well-formed");
        table.set_interpolation(Interpolation::Hold);
        for stamp in [0.1, 0.2, 0.3, 0.6, 0.7, 1.1_f64] {
            assert_eq!(table.value(0, stamp - 1e-12), (stamp * 10.0).round(), "{stamp}");
        }
    }

    #[test]
    fn errors_name_the_line_and_the_column() {
        #[rustfmt::skip]
        let cases = [
            ("empty", "", "found nothing"),
            ("header", "t,v\n", "found only a header"),
            ("column", "t,vel\n0,1\n", "no column `v` in the header"),
            ("list", "t,V,w\n0,1,2\n", "it has t, V, w; did you mean `V`?"),
            ("time", "x,v\n0,1\n", "no column `t`"),
            ("cell", "t,v\n0,1\n1,abc\n", "line 3 of"),
            ("text", "t,v\n0,1\n1,abc\n", "in column `v`, found \"abc\""),
            ("gap", "t,v\n0,\n", "expected a number in column `v`, found \"\""),
            ("nan", "t,v\n0,1\n1,2\n2,NaN\n", "line 4 of"),
            ("infinite", "t,v\n0,inf\n", "a finite number in column `v`, found inf"),
            ("repeated", "t,v\n0,1\n\n1,2\n1,3\n", "line 5 of"),
            ("falling", "t,v\n0,1\n2,2\n1.5,3\n", "a time after 2 of the row before, found 1.5"),
            ("ragged", "t,v\n0,1\n1\n", "line 3 of"),
            ("cells", "t,v\n0,1,7\n", "has 3 cells, expected 2"),
        ];
        for (name, text, part) in cases {
            let error = read(name, text, &["v"]).expect_err(name).to_string();
            assert!(error.contains(part), "{name}: {error}");
        }
        let missing = Table::read("no/such/file.csv", "t", &[]).expect_err("it does not exist");
        assert!(missing.to_string().starts_with("cannot open"), "{missing}");
    }
}
