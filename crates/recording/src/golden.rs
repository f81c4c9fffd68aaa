//! Reads a whole recording of a run, MCAP or CSV, as columns over time, for comparison with another run.

use std::collections::HashMap;
use std::path::Path;

use diagnostics::Error;

use crate::columns::Column;
use crate::reader::Recording;
use crate::row::{RecordedVariables, Row};
use crate::sink::Sink;
use crate::table::{self, CsvColumn};

/// The columns of a recording.
#[derive(Debug, Clone, Default)]
pub struct GoldenRecording {
    /// Time stamps [s], rising; at least one.
    pub times: Vec<f64>,
    /// The columns; of one name the output comes before the input.
    columns: Vec<GoldenColumn>,
    /// The first column of each name.
    by_name: HashMap<String, usize>,
}

/// A column of a recording.
#[derive(Debug, Clone)]
pub struct GoldenColumn {
    /// `node.variable`.
    pub name: String,
    /// Its unit, if the recording tells.
    pub unit: Option<String>,
    /// A value for each time stamp.
    pub values: GoldenValues,
}

/// The values of a column.
#[derive(Debug, Clone)]
pub enum GoldenValues {
    /// Numbers; NaN where a CSV file has none.
    Numbers(Vec<f64>),
    /// Texts.
    Texts(Vec<String>),
}

impl GoldenRecording {
    /// Reads `run.mcap` of a run, or CSV as `run.csv`, with the time in the first column. CSV does not tell which columns are
    /// `texts`: an empty one may be a number that is missing.
    ///
    /// # Errors
    /// When the file cannot be read, or is no recording of a run.
    pub fn read(path: &Path, texts: &[&str]) -> Result<Self, Error> {
        if path.extension().is_some_and(|it| it == "csv") {
            return Self::read_csv(path, None, texts);
        }
        let recording = Recording::open(path)?;
        let columns = &recording.header.columns;
        let numbers =
            columns.number_columns().map(|(_, it)| to_golden_column(it, GoldenValues::Numbers(Vec::new())));
        let texts =
            columns.text_columns().map(|(_, it)| to_golden_column(it, GoldenValues::Texts(Vec::new())));
        let mut all = GoldenRecording::new(Vec::new(), numbers.chain(texts).collect());
        recording.replay_into(&mut all)?;
        if all.times.is_empty() {
            return Err(Error::invalid_input(format!("{} has no complete row", path.display())));
        }
        Ok(all)
    }

    /// Reads a CSV file of any tool: its delimiter, its decimal mark and its units are detected. The time is the column called
    /// `time`, or else the first one. Columns called `texts` are read as they are.
    ///
    /// # Errors
    /// When the file cannot be read, or its times do not rise.
    pub fn read_csv(path: &Path, time: Option<&str>, texts: &[&str]) -> Result<Self, Error> {
        let read = table::read_csv_table(path, time, texts)
            .map_err(|error| Error::invalid_input(error.to_string()))?;
        let column = |CsvColumn { name, unit, numbers, texts }: CsvColumn| GoldenColumn {
            name,
            unit,
            values: numbers.map_or(GoldenValues::Texts(texts), GoldenValues::Numbers),
        };
        let columns = read.columns.into_iter().map(column).collect();
        Ok(GoldenRecording::new(read.times, columns))
    }

    /// The text of a CSV file with these columns, in the form of `run.csv`.
    #[must_use]
    pub fn csv_text(&self) -> String {
        let quoted = |text: &str| format!("\"{}\"", text.replace('"', "\"\""));
        let mut text = "time [s]".to_owned();
        for column in &self.columns {
            let title = table::format_title(&column.name, column.unit.as_deref());
            text += ",";
            text += &if title.contains(['"', ',', ';', '\t']) { quoted(&title) } else { title };
        }
        for (row, time) in self.times.iter().enumerate() {
            text += &format!("\n{time}");
            for column in &self.columns {
                text += ",";
                text += &match &column.values {
                    GoldenValues::Numbers(values) => values[row].to_string(),
                    GoldenValues::Texts(texts) => quoted(&texts[row]),
                };
            }
        }
        text + "\n"
    }

    /// Columns over these time stamps [s].
    #[must_use]
    pub fn new(times: Vec<f64>, columns: Vec<GoldenColumn>) -> Self {
        let mut by_name = HashMap::new();
        for (place, column) in columns.iter().enumerate() {
            by_name.entry(column.name.clone()).or_insert(place);
        }
        GoldenRecording { times, columns, by_name }
    }

    /// The columns; of one name the output comes before the input.
    #[must_use]
    pub fn columns(&self) -> &[GoldenColumn] {
        &self.columns
    }

    /// The first column of this name.
    #[must_use]
    pub fn find(&self, name: &str) -> Option<&GoldenColumn> {
        self.by_name.get(name).map(|place| &self.columns[*place])
    }
}

fn to_golden_column(column: &Column, values: GoldenValues) -> GoldenColumn {
    GoldenColumn { name: column.qualified_name(), unit: column.unit.clone(), values }
}

impl Sink for GoldenRecording {
    fn push_row(&mut self, _tick: u64, time: f64, row: &Row<RecordedVariables>) -> Result<(), Error> {
        self.times.push(time);
        let (mut numbers, mut texts) = (row.numbers().iter(), row.texts().iter());
        for column in &mut self.columns {
            match &mut column.values {
                GoldenValues::Numbers(values) => values.extend(numbers.next()),
                GoldenValues::Texts(values) => values.extend(texts.next().cloned()),
            }
        }
        Ok(())
    }
}
