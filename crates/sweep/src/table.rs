//! Holds the results of variants by columns, in memory and as Parquet.

mod arrow;
mod checksum;
mod csv;
mod reader;
mod writer;

use std::collections::{HashMap, HashSet};

pub use csv::table_to_csv;
pub use reader::{SweepTableReader, read_table};
pub use writer::{RowGroups, SweepTableWriter, write_table};

/// The verdict of a variant that passes all its checks.
pub const PASSED: &str = "passed";
/// The verdict of a variant that came to its end and has no checks.
pub const NO_CHECKS: &str = "no checks";
/// The verdict of a variant of which a check failed.
pub const FAILED: &str = "failed";
/// The verdict of a variant that did not come to its end.
pub const ERROR: &str = "error";

/// Columns of equal length: row k is variant k of those that the table has.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SweepTable {
    /// In the order of the file.
    pub columns: Vec<SweepColumn>,
}

/// A column of a table.
#[derive(Clone, Debug, PartialEq)]
pub struct SweepColumn {
    /// Its name in the file, which no other column has.
    pub name: String,
    /// Of its numbers, if they have one.
    pub unit: Option<String>,
    /// What it is of.
    pub role: SweepColumnRole,
    /// One for each row.
    pub values: SweepColumnValues,
}

/// What a column is of.
#[derive(Clone, Copy, Debug, Eq, Hash, PartialEq)]
pub enum SweepColumnRole {
    /// The number of the variant.
    Variant,
    /// What the variant is called, of a list with names.
    Name,
    /// The seed of its random streams.
    Seed,
    /// A value that varies.
    Parameter,
    /// [`PASSED`], [`FAILED`] or [`ERROR`].
    Verdict,
    /// How it ended early: text, node, call, time.
    Error,
    /// Whether a check passed.
    Check,
    /// How far a check was from failing, negative when it failed.
    Margin,
    /// What the scenario collects of a run.
    Collected,
    /// Steps and seconds by the clock.
    Effort,
}

/// The values of a column.
#[derive(Clone, Debug)]
pub enum SweepColumnValues {
    /// Integers, none missing.
    Integers(Vec<i64>),
    /// Numbers. NaN is a missing one, which is null in the file: there is no other way to have none.
    Numbers(Vec<f64>),
    /// `None` is a missing one, null in the file.
    Booleans(Vec<Option<bool>>),
    /// `None` is a missing one, null in the file.
    Texts(Vec<Option<String>>),
}

impl SweepColumnRole {
    /// All of them.
    pub const ALL: [SweepColumnRole; 10] = [
        SweepColumnRole::Variant,
        SweepColumnRole::Name,
        SweepColumnRole::Seed,
        SweepColumnRole::Parameter,
        SweepColumnRole::Verdict,
        SweepColumnRole::Error,
        SweepColumnRole::Check,
        SweepColumnRole::Margin,
        SweepColumnRole::Collected,
        SweepColumnRole::Effort,
    ];

    /// Its name in the metadata of the file.
    #[must_use]
    pub fn metadata_name(self) -> &'static str {
        match self {
            SweepColumnRole::Variant => "variant",
            SweepColumnRole::Name => "name",
            SweepColumnRole::Seed => "seed",
            SweepColumnRole::Parameter => "parameter",
            SweepColumnRole::Verdict => "verdict",
            SweepColumnRole::Error => "error",
            SweepColumnRole::Check => "check",
            SweepColumnRole::Margin => "margin",
            SweepColumnRole::Collected => "collected",
            SweepColumnRole::Effort => "effort",
        }
    }
}

impl SweepColumnValues {
    /// How many there are.
    #[must_use]
    pub fn len(&self) -> usize {
        match self {
            SweepColumnValues::Integers(values) => values.len(),
            SweepColumnValues::Numbers(values) => values.len(),
            SweepColumnValues::Booleans(values) => values.len(),
            SweepColumnValues::Texts(values) => values.len(),
        }
    }

    /// Whether there is none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Adds the bytes of a value, for checksums.
    pub fn push_value_bytes(&self, row: usize, bytes: &mut Vec<u8>) {
        match self {
            SweepColumnValues::Integers(all) => bytes.extend(all[row].to_le_bytes()),
            // Missing numbers are equal, whatever their bits.
            SweepColumnValues::Numbers(all) if all[row].is_nan() => {
                bytes.extend(f64::NAN.to_bits().to_le_bytes());
            }
            SweepColumnValues::Numbers(all) => bytes.extend(all[row].to_bits().to_le_bytes()),
            SweepColumnValues::Booleans(all) => bytes.push(all[row].map_or(2, u8::from)),
            SweepColumnValues::Texts(all) => {
                bytes.push(u8::from(all[row].is_some()));
                bytes.extend_from_slice(all[row].as_deref().unwrap_or_default().as_bytes());
                bytes.push(0);
            }
        }
    }

    /// None yet, of the same kind.
    fn empty_of_same_type(&self) -> Self {
        match self {
            SweepColumnValues::Integers(_) => SweepColumnValues::Integers(Vec::new()),
            SweepColumnValues::Numbers(_) => SweepColumnValues::Numbers(Vec::new()),
            SweepColumnValues::Booleans(_) => SweepColumnValues::Booleans(Vec::new()),
            SweepColumnValues::Texts(_) => SweepColumnValues::Texts(Vec::new()),
        }
    }

    /// Takes those of another column of the same kind behind its own; of another kind, none.
    fn append(&mut self, other: &SweepColumnValues) {
        match (self, other) {
            (SweepColumnValues::Integers(own), SweepColumnValues::Integers(other)) => own.extend(other),
            (SweepColumnValues::Numbers(own), SweepColumnValues::Numbers(other)) => own.extend(other),
            (SweepColumnValues::Booleans(own), SweepColumnValues::Booleans(other)) => own.extend(other),
            (SweepColumnValues::Texts(own), SweepColumnValues::Texts(other)) => {
                own.extend(other.iter().cloned())
            }
            _ => {}
        }
    }

    /// Removes those in front of `at`, which come out.
    fn split_front(&mut self, at: usize) -> Self {
        match self {
            SweepColumnValues::Integers(own) => SweepColumnValues::Integers(own.drain(..at).collect()),
            SweepColumnValues::Numbers(own) => SweepColumnValues::Numbers(own.drain(..at).collect()),
            SweepColumnValues::Booleans(own) => SweepColumnValues::Booleans(own.drain(..at).collect()),
            SweepColumnValues::Texts(own) => SweepColumnValues::Texts(own.drain(..at).collect()),
        }
    }

    /// In words.
    #[must_use]
    pub fn type_name(&self) -> &'static str {
        match self {
            SweepColumnValues::Integers(_) => "integers",
            SweepColumnValues::Numbers(_) => "numbers",
            SweepColumnValues::Booleans(_) => "booleans",
            SweepColumnValues::Texts(_) => "texts",
        }
    }
}

/// Missing numbers are equal to each other.
impl PartialEq for SweepColumnValues {
    fn eq(&self, other: &Self) -> bool {
        let same = |(a, b): (&f64, &f64)| a.to_bits() == b.to_bits() || (a.is_nan() && b.is_nan());
        match (self, other) {
            (SweepColumnValues::Integers(a), SweepColumnValues::Integers(b)) => a == b,
            (SweepColumnValues::Numbers(a), SweepColumnValues::Numbers(b)) => {
                a.len() == b.len() && a.iter().zip(b).all(same)
            }
            (SweepColumnValues::Booleans(a), SweepColumnValues::Booleans(b)) => a == b,
            (SweepColumnValues::Texts(a), SweepColumnValues::Texts(b)) => a == b,
            _ => false,
        }
    }
}

impl SweepColumn {
    /// A column without a unit.
    #[must_use]
    pub fn new(name: &str, role: SweepColumnRole, values: SweepColumnValues) -> Self {
        Self { name: name.to_owned(), unit: None, role, values }
    }

    /// With a unit.
    #[must_use]
    pub fn with_unit(mut self, unit: Option<&str>) -> Self {
        self.unit = unit.map(str::to_owned);
        self
    }

    /// The numbers, if these are numbers.
    #[must_use]
    pub fn as_numbers(&self) -> Option<&[f64]> {
        match &self.values {
            SweepColumnValues::Numbers(values) => Some(values),
            _ => None,
        }
    }

    /// The integers, if these are integers.
    #[must_use]
    pub fn as_integers(&self) -> Option<&[i64]> {
        match &self.values {
            SweepColumnValues::Integers(values) => Some(values),
            _ => None,
        }
    }

    /// The booleans, if these are booleans.
    #[must_use]
    pub fn as_booleans(&self) -> Option<&[Option<bool>]> {
        match &self.values {
            SweepColumnValues::Booleans(values) => Some(values),
            _ => None,
        }
    }

    /// The texts, if these are texts.
    #[must_use]
    pub fn as_texts(&self) -> Option<&[Option<String>]> {
        match &self.values {
            SweepColumnValues::Texts(values) => Some(values),
            _ => None,
        }
    }

    /// Its values as numbers: booleans are 0 and 1, texts their places among all different ones, and what is missing is NaN.
    #[must_use]
    pub fn to_numbers(&self) -> Vec<f64> {
        match &self.values {
            SweepColumnValues::Integers(values) => values.iter().map(|&value| value as f64).collect(),
            SweepColumnValues::Numbers(values) => values.clone(),
            SweepColumnValues::Booleans(values) => {
                let number = |value: &Option<bool>| value.map_or(f64::NAN, f64::from);
                values.iter().map(number).collect()
            }
            SweepColumnValues::Texts(texts) => {
                let known = self.distinct_texts().into_iter().enumerate();
                let places: HashMap<&str, f64> = known.map(|(place, text)| (text, place as f64)).collect();
                let place = |text: &str| places.get(text).copied().unwrap_or(f64::NAN);
                texts.iter().map(|text| text.as_deref().map_or(f64::NAN, place)).collect()
            }
        }
    }

    /// The different texts in it, in the order in which they come first: that of the list that names them.
    #[must_use]
    pub fn distinct_texts(&self) -> Vec<&str> {
        let mut seen = HashSet::new();
        let texts = self.as_texts().unwrap_or_default().iter().flatten().map(String::as_str);
        texts.filter(|text| seen.insert(*text)).collect()
    }

    /// Whether all but the values is the same.
    fn same_signature(&self, other: &SweepColumn) -> bool {
        (&self.name, &self.unit, self.role, self.values.type_name())
            == (&other.name, &other.unit, other.role, other.values.type_name())
    }
}

impl SweepTable {
    /// How many variants it has: the length of its shortest column.
    #[must_use]
    pub fn row_count(&self) -> usize {
        self.columns.iter().map(|column| column.values.len()).min().unwrap_or(0)
    }

    /// The column of a name.
    #[must_use]
    pub fn column(&self, name: &str) -> Option<&SweepColumn> {
        self.columns.iter().find(|column| column.name == name)
    }

    /// The columns of a role, in their order.
    pub fn columns_with_role(&self, role: SweepColumnRole) -> impl Iterator<Item = &SweepColumn> {
        self.columns.iter().filter(move |column| column.role == role)
    }

    /// How each variant ended, in the words [`PASSED`], [`FAILED`] and [`ERROR`]; nothing in a table without verdicts.
    #[must_use]
    pub fn verdicts(&self) -> &[Option<String>] {
        let mut columns = self.columns_with_role(SweepColumnRole::Verdict);
        columns.next().and_then(SweepColumn::as_texts).unwrap_or_default()
    }

    /// The same columns without rows.
    #[must_use]
    pub fn without_rows(&self) -> Self {
        let none = |column: &SweepColumn| SweepColumn {
            values: column.values.empty_of_same_type(),
            ..column.clone()
        };
        Self { columns: self.columns.iter().map(none).collect() }
    }

    /// Takes the rows of another table behind its own.
    ///
    /// # Errors
    /// A sentence about the first column that differs by more than its values, or is shorter than others.
    pub fn append_rows(&mut self, other: &SweepTable) -> Result<(), String> {
        other.check_columns()?;
        if self.columns.len() != other.columns.len() {
            let [own, found] = [self, other].map(|table| table.columns.len());
            return Err(format!("expected {own} columns, found {found}"));
        }
        let differs = self.columns.iter().zip(&other.columns).find(|(own, other)| !own.same_signature(other));
        if let Some((own, found)) = differs {
            return Err(format!("expected {}, found {}", column_signature(own), column_signature(found)));
        }
        for (own, other) in self.columns.iter_mut().zip(&other.columns) {
            own.values.append(&other.values);
        }
        Ok(())
    }

    /// Removes the first rows, which come out: all that there are, if there are fewer.
    fn split_front(&mut self, rows: usize) -> Self {
        let rows = rows.min(self.row_count());
        let mut front = self.without_rows();
        for (front, own) in front.columns.iter_mut().zip(&mut self.columns) {
            front.values = own.values.split_front(rows);
        }
        front
    }

    /// Whether all columns have the same length, and names of their own.
    fn check_columns(&self) -> Result<(), String> {
        let mut names = HashSet::new();
        for column in &self.columns {
            let (rows, found) = (self.columns[0].values.len(), column.values.len());
            if found != rows {
                let name = &column.name;
                return Err(format!("expected {rows} rows in column `{name}`, found {found}"));
            }
            if !names.insert(&column.name) {
                return Err(format!("two columns have the name `{}`", column.name));
            }
        }
        Ok(())
    }
}

fn column_signature(column: &SweepColumn) -> String {
    let SweepColumn { name, unit, role, values } = column;
    let unit = unit.as_ref().map(|unit| format!(" [{unit}]")).unwrap_or_default();
    format!("column `{name}`{unit} of {} ({})", values.type_name(), role.metadata_name())
}
