//! Reads tables of results and stimuli: titles, a first column with the time, a cell of an array as values with blanks between.

use fmu_import::{FmiType, Value, from_hex};

/// A table.
#[derive(Debug)]
pub(super) struct CsvTable {
    /// The titles of the columns, that of the time too.
    pub(super) titles: Vec<String>,
    /// The time of each row [s].
    pub(super) times: Vec<f64>,
    rows: Vec<Vec<String>>,
}

impl CsvTable {
    /// Reads the text of a CSV file.
    ///
    /// # Errors
    /// When it has no time, or a row of another length, or time that is no number or goes back.
    pub(super) fn parse(bytes: &[u8]) -> Result<Self, String> {
        let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
        let mut reader = csv::ReaderBuilder::new().trim(csv::Trim::All).from_reader(bytes);
        let titles = reader.headers().map_err(|error| error.to_string())?;
        let titles: Vec<String> = titles.iter().map(str::to_owned).collect();
        if titles.first().map(String::as_str) != Some("time") {
            let found = titles.first().map_or("nothing", String::as_str);
            return Err(format!("expected the title \"time\" of the first column, found {found:?}"));
        }
        let (mut times, mut rows) = (Vec::new(), Vec::new());
        for (row, record) in reader.records().enumerate() {
            let record = record.map_err(|error| error.to_string())?;
            let cells: Vec<String> = record.iter().map(str::to_owned).collect();
            let line = row + 2;
            let time = cells.first().map_or("", String::as_str);
            let time: f64 = time
                .parse()
                .ok()
                .filter(|time: &f64| time.is_finite())
                .ok_or_else(|| format!("line {line}: expected a time, found {time:?}"))?;
            if times.last().is_some_and(|last| *last > time) {
                return Err(format!("line {line}: the time goes back to {time} s"));
            }
            times.push(time);
            rows.push(cells);
        }
        if times.is_empty() {
            return Err("expected rows, found titles only".to_owned());
        }
        Ok(CsvTable { titles, times, rows })
    }

    /// The values in a cell: one of a text, else as many as there are between blanks.
    pub(super) fn cell_words(&self, row: usize, column: usize, kind: FmiType) -> Vec<&str> {
        let cell = self.rows[row].get(column).map_or("", String::as_str);
        match kind {
            FmiType::String => vec![cell],
            _ => cell.split_whitespace().collect(),
        }
    }

    /// The number of the row that holds from this time on [s].
    pub(super) fn row_at(&self, time: f64) -> usize {
        self.times.partition_point(|it| *it <= time).saturating_sub(1)
    }
}

/// The value that a word stands for; none when it is none of the type.
pub(super) fn parse_value(word: &str, kind: FmiType) -> Option<Value> {
    Some(match kind {
        FmiType::Real => Value::Real(word.parse().ok()?),
        FmiType::Integer | FmiType::Enumeration => Value::Integer(word.parse().ok()?),
        FmiType::Boolean | FmiType::Clock => match word {
            "true" | "1" => Value::Boolean(true),
            "false" | "0" => Value::Boolean(false),
            _ => return None,
        },
        FmiType::String => Value::String(word.to_owned()),
        FmiType::Binary => Value::Binary(from_hex(word)?),
    })
}

/// The relative difference of a written and a found value, less what the digits of the written one leave open; `scale` is the size of
/// the values of the column. Infinite for values that are not numbers and differ.
pub(super) fn relative_difference(word: &str, expected: &Value, found: &Value, scale: f64) -> f64 {
    match (expected, found) {
        (expected, found) if expected == found => 0.0,
        (Value::Real(expected), Value::Real(found)) => {
            let apart = (expected - found).abs();
            if !apart.is_finite() {
                return f64::INFINITY;
            }
            let beyond = (apart - half_digit(word)).max(0.0);
            if beyond == 0.0 { 0.0 } else { beyond / scale.max(expected.abs()) }
        }
        _ => f64::INFINITY,
    }
}

/// Half a unit of the last digit of a written number.
fn half_digit(word: &str) -> f64 {
    let (mantissa, exponent) = word.split_once(['e', 'E']).unwrap_or((word, "0"));
    let decimals = mantissa.split_once('.').map_or(0, |(_, decimals)| decimals.len());
    let exponent: i32 = exponent.parse().unwrap_or(0);
    // Whole numbers without a point are taken to be exact.
    if decimals == 0 {
        return 0.0;
    }
    0.5 * 10.0_f64.powi(exponent.saturating_sub(i32::try_from(decimals).unwrap_or(i32::MAX)))
}
