//! Defines what to read from a recorded file: time, columns, gap rules, scaling, CSV dialect.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use units::Unit;

/// Rows without a value: empty cells and NaN.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[schemars(rename = "Gaps")]
#[serde(rename_all = "lowercase")]
pub enum GapRule {
    /// They are an error.
    #[default]
    Refuse,
    /// They get the last value before them.
    Hold,
    /// They get the value on the straight line between their neighbours in time.
    Interpolate,
    /// They are left out of the column, which then has time stamps of its own.
    Drop,
}

/// Value = `sign` * `gain` * recorded value + `offset`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ColumnScaling {
    /// Factor, such as a steering ratio.
    pub gain: f64,
    /// Sum, in the unit of the value.
    pub offset: f64,
    /// 1, or -1 where the file has the opposite sign convention.
    pub sign: f64,
}

impl Default for ColumnScaling {
    fn default() -> Self {
        ColumnScaling { gain: 1.0, offset: 0.0, sign: 1.0 }
    }
}

impl ColumnScaling {
    /// The value. Without gain, offset and sign it is the recorded one to the bit.
    #[must_use]
    pub fn apply(&self, recorded: f64) -> f64 {
        if *self == ColumnScaling::default() {
            return recorded;
        }
        self.sign * self.gain * recorded + self.offset
    }
}

/// The form in which a column is read and played back.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum ColumnType {
    /// As numbers.
    #[default]
    Number,
    /// As integers of up to 64 bits, exactly; held between rows.
    Integer,
    /// As texts; held between rows.
    Text,
}

/// How a CSV file is written; what is not given is detected.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct CsvDialect {
    /// Between two cells.
    pub separator: Option<Separator>,
    /// Between the whole and the broken part of a number.
    pub decimal: Option<DecimalMark>,
    /// The line of the titles, from 1 on.
    pub title_row: Option<usize>,
    /// Whether a line of units follows the titles, or which one it is.
    pub unit_row: Option<UnitRow>,
}

/// Where the units of a CSV file are.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(untagged)]
pub enum UnitRow {
    /// Whether they are in the line below the titles.
    Below(bool),
    /// In the line of this number, from 1 on.
    Line(usize),
}

impl CsvDialect {
    /// The key of the first property that is given.
    pub(super) fn first_key(&self) -> Option<&'static str> {
        let keys = [
            ("separator", self.separator.is_some()),
            ("decimal", self.decimal.is_some()),
            ("title_row", self.title_row.is_some()),
            ("unit_row", self.unit_row.is_some()),
        ];
        keys.into_iter().find_map(|(key, given)| given.then_some(key))
    }
}

/// The letter between two cells of a CSV file.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
pub enum Separator {
    /// Tabulator, also written as `"\t"`.
    #[serde(rename = "tab", alias = "\t")]
    Tab,
    /// Semicolon.
    #[serde(rename = ";")]
    Semicolon,
    /// Comma.
    #[serde(rename = ",")]
    Comma,
    /// Blanks or tabulators, as many as there are.
    #[serde(rename = " ")]
    Blank,
}

impl Separator {
    /// Signs that separate wherever they stand.
    pub(super) const ALL: [Self; 3] = [Self::Comma, Self::Semicolon, Self::Tab];

    pub(super) fn as_byte(self) -> u8 {
        match self {
            Separator::Tab => b'\t',
            Separator::Semicolon => b';',
            Separator::Comma => b',',
            Separator::Blank => b' ',
        }
    }
}

/// The decimal mark of a CSV file.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
pub enum DecimalMark {
    /// Decimal point.
    #[serde(rename = ".")]
    Point,
    /// Decimal comma.
    #[serde(rename = ",")]
    Comma,
}

/// A column that is wanted of a file.
#[derive(Debug, Clone, Default)]
pub struct ColumnRequest {
    /// Its name in the scenario.
    pub name: String,
    /// Its name in the file.
    pub column: String,
    /// The form of its values.
    pub column_type: ColumnType,
    /// The rule for rows without a value.
    pub gaps: GapRule,
    /// Gain, offset and sign.
    pub scaling: ColumnScaling,
    /// Time by which it is late [s].
    pub delay: f64,
}

/// All that is wanted of a file.
#[derive(Debug, Clone, Default)]
pub struct ReadRequest {
    /// The column of the time, or the time stamp of an MCAP recording.
    pub time: Option<String>,
    /// The unit of the time, if it is not that of the file, or [s].
    pub time_unit: Option<Unit>,
    /// The columns.
    pub columns: Vec<ColumnRequest>,
    /// Whether two rows may have one time: values jump there from those of the first row to those of the second.
    pub jumps: bool,
    /// How a CSV file is written.
    pub dialect: CsvDialect,
}

impl ReadRequest {
    /// Columns by their names in the file, with the time in one of them.
    #[must_use]
    pub fn from_names(time: &str, columns: &[&str]) -> Self {
        let column = |name: &&str| ColumnRequest {
            name: (*name).to_owned(),
            column: (*name).to_owned(),
            ..ColumnRequest::default()
        };
        ReadRequest {
            time: Some(time.to_owned()),
            columns: columns.iter().map(column).collect(),
            ..ReadRequest::default()
        }
    }

    pub(super) fn requested_titles(&self) -> Vec<&str> {
        self.columns.iter().map(|wanted| wanted.column.as_str()).collect()
    }
}
