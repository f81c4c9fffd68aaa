//! Holds the results of variants by columns, in memory and as Parquet.

mod arrow;
mod reader;
mod writer;

pub use reader::{Reader, read};
pub use writer::{RowGroups, Writer, write};

/// Columns of equal length: row k is variant k of those that the table has.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Table {
    /// In the order of the file.
    pub columns: Vec<Column>,
}

/// A column of a table.
#[derive(Clone, Debug, PartialEq)]
pub struct Column {
    /// Its name in the file, which no other column has.
    pub name: String,
    /// Of its numbers, if they have one.
    pub unit: Option<String>,
    /// What it is of.
    pub role: Role,
    /// One for each row.
    pub values: Values,
}

/// What a column is of.
#[derive(Clone, Copy, Debug, Eq, Hash, PartialEq)]
pub enum Role {
    /// The number of the variant.
    Variant,
    /// The seed of its random streams.
    Seed,
    /// A value that varies.
    Parameter,
    /// `passed`, `failed` or `error`.
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
pub enum Values {
    /// Integers, none missing.
    Integers(Vec<i64>),
    /// Numbers. NaN is a missing one, which is null in the file: there is no other way to have none.
    Numbers(Vec<f64>),
    /// `None` is a missing one, null in the file.
    Booleans(Vec<Option<bool>>),
    /// `None` is a missing one, null in the file.
    Texts(Vec<Option<String>>),
}

impl Role {
    /// All of them.
    pub const ALL: [Role; 9] = [
        Role::Variant,
        Role::Seed,
        Role::Parameter,
        Role::Verdict,
        Role::Error,
        Role::Check,
        Role::Margin,
        Role::Collected,
        Role::Effort,
    ];

    /// Its name in the metadata of the file.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Role::Variant => "variant",
            Role::Seed => "seed",
            Role::Parameter => "parameter",
            Role::Verdict => "verdict",
            Role::Error => "error",
            Role::Check => "check",
            Role::Margin => "margin",
            Role::Collected => "collected",
            Role::Effort => "effort",
        }
    }
}

impl Values {
    /// How many there are.
    #[must_use]
    pub fn len(&self) -> usize {
        match self {
            Values::Integers(values) => values.len(),
            Values::Numbers(values) => values.len(),
            Values::Booleans(values) => values.len(),
            Values::Texts(values) => values.len(),
        }
    }

    /// Whether there is none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// None yet, of the same kind.
    fn none(&self) -> Self {
        match self {
            Values::Integers(_) => Values::Integers(Vec::new()),
            Values::Numbers(_) => Values::Numbers(Vec::new()),
            Values::Booleans(_) => Values::Booleans(Vec::new()),
            Values::Texts(_) => Values::Texts(Vec::new()),
        }
    }

    /// Takes those of another column of the same kind behind its own; of another kind, none.
    fn append(&mut self, other: &Values) {
        match (self, other) {
            (Values::Integers(own), Values::Integers(other)) => own.extend(other),
            (Values::Numbers(own), Values::Numbers(other)) => own.extend(other),
            (Values::Booleans(own), Values::Booleans(other)) => own.extend(other),
            (Values::Texts(own), Values::Texts(other)) => own.extend(other.iter().cloned()),
            _ => {}
        }
    }

    /// Removes those in front of `at`, which come out.
    fn split_front(&mut self, at: usize) -> Self {
        match self {
            Values::Integers(own) => Values::Integers(own.drain(..at).collect()),
            Values::Numbers(own) => Values::Numbers(own.drain(..at).collect()),
            Values::Booleans(own) => Values::Booleans(own.drain(..at).collect()),
            Values::Texts(own) => Values::Texts(own.drain(..at).collect()),
        }
    }

    /// In words.
    #[must_use]
    pub fn kind(&self) -> &'static str {
        match self {
            Values::Integers(_) => "integers",
            Values::Numbers(_) => "numbers",
            Values::Booleans(_) => "booleans",
            Values::Texts(_) => "texts",
        }
    }
}

/// Missing numbers are equal to each other.
impl PartialEq for Values {
    fn eq(&self, other: &Self) -> bool {
        let same = |(a, b): (&f64, &f64)| a.to_bits() == b.to_bits() || (a.is_nan() && b.is_nan());
        match (self, other) {
            (Values::Integers(a), Values::Integers(b)) => a == b,
            (Values::Numbers(a), Values::Numbers(b)) => {
                a.len() == b.len() && a.iter().zip(b).all(same)
            }
            (Values::Booleans(a), Values::Booleans(b)) => a == b,
            (Values::Texts(a), Values::Texts(b)) => a == b,
            _ => false,
        }
    }
}

impl Column {
    /// A column without a unit.
    #[must_use]
    pub fn new(name: &str, role: Role, values: Values) -> Self {
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
    pub fn numbers(&self) -> Option<&[f64]> {
        match &self.values {
            Values::Numbers(values) => Some(values),
            _ => None,
        }
    }

    /// The integers, if these are integers.
    #[must_use]
    pub fn integers(&self) -> Option<&[i64]> {
        match &self.values {
            Values::Integers(values) => Some(values),
            _ => None,
        }
    }

    /// The booleans, if these are booleans.
    #[must_use]
    pub fn booleans(&self) -> Option<&[Option<bool>]> {
        match &self.values {
            Values::Booleans(values) => Some(values),
            _ => None,
        }
    }

    /// The texts, if these are texts.
    #[must_use]
    pub fn texts(&self) -> Option<&[Option<String>]> {
        match &self.values {
            Values::Texts(values) => Some(values),
            _ => None,
        }
    }

    /// Its values as numbers: booleans are 0 and 1, texts their places among all different ones, and what is missing is NaN.
    #[must_use]
    pub fn to_numbers(&self) -> Vec<f64> {
        match &self.values {
            Values::Integers(values) => values.iter().map(|&value| value as f64).collect(),
            Values::Numbers(values) => values.clone(),
            Values::Booleans(values) => {
                let number = |value: &Option<bool>| value.map_or(f64::NAN, f64::from);
                values.iter().map(number).collect()
            }
            Values::Texts(texts) => {
                let known = self.distinct_texts();
                let place =
                    |text: &str| known.binary_search(&text).map_or(f64::NAN, |it| it as f64);
                texts.iter().map(|text| text.as_deref().map_or(f64::NAN, place)).collect()
            }
        }
    }

    /// The different texts in it, in alphabetical order.
    #[must_use]
    pub fn distinct_texts(&self) -> Vec<&str> {
        let texts = self.texts().unwrap_or_default().iter().flatten();
        texts.map(String::as_str).collect::<std::collections::BTreeSet<_>>().into_iter().collect()
    }

    /// Whether all but the values is the same.
    fn same_signature(&self, other: &Column) -> bool {
        (&self.name, &self.unit, self.role, self.values.kind())
            == (&other.name, &other.unit, other.role, other.values.kind())
    }
}

impl Table {
    /// How many variants it has: the length of its shortest column.
    #[must_use]
    pub fn rows(&self) -> usize {
        self.columns.iter().map(|column| column.values.len()).min().unwrap_or(0)
    }

    /// The column of a name.
    #[must_use]
    pub fn column(&self, name: &str) -> Option<&Column> {
        self.columns.iter().find(|column| column.name == name)
    }

    /// The columns of a role, in their order.
    pub fn of(&self, role: Role) -> impl Iterator<Item = &Column> {
        self.columns.iter().filter(move |column| column.role == role)
    }

    /// The same columns without rows.
    #[must_use]
    pub fn without_rows(&self) -> Self {
        let none = |column: &Column| Column { values: column.values.none(), ..column.clone() };
        Self { columns: self.columns.iter().map(none).collect() }
    }

    /// Takes the rows of another table behind its own.
    ///
    /// # Errors
    /// A sentence about the first column that differs by more than its values, or is shorter than others.
    pub fn append(&mut self, other: &Table) -> Result<(), String> {
        other.check_columns()?;
        if self.columns.len() != other.columns.len() {
            let [own, found] = [self, other].map(|table| table.columns.len());
            return Err(format!("expected {own} columns, found {found}"));
        }
        let differs =
            self.columns.iter().zip(&other.columns).find(|(own, other)| !own.same_signature(other));
        if let Some((own, found)) = differs {
            return Err(format!(
                "expected {}, found {}",
                column_signature(own),
                column_signature(found)
            ));
        }
        for (own, other) in self.columns.iter_mut().zip(&other.columns) {
            own.values.append(&other.values);
        }
        Ok(())
    }

    /// Removes the first rows, which come out: all that there are, if there are fewer.
    fn split_front(&mut self, rows: usize) -> Self {
        let rows = rows.min(self.rows());
        let mut front = self.without_rows();
        for (front, own) in front.columns.iter_mut().zip(&mut self.columns) {
            front.values = own.values.split_front(rows);
        }
        front
    }

    /// Whether all columns have the same length, and names of their own.
    fn check_columns(&self) -> Result<(), String> {
        let mut names = std::collections::HashSet::new();
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

fn column_signature(column: &Column) -> String {
    let Column { name, unit, role, values } = column;
    let unit = unit.as_ref().map(|unit| format!(" [{unit}]")).unwrap_or_default();
    format!("column `{name}`{unit} of {} ({})", values.kind(), role.name())
}
