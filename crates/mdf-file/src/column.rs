//! Describes what is written: the file, its columns, and the cells of their rows.

use crate::layout::StartTime;

/// What a file says about itself.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MdfDescription {
    /// What it is.
    pub comment: Option<String>,
    /// Names with values, such as the seed of a run.
    pub properties: Vec<(String, String)>,
    /// The name of the group of channels.
    pub group: Option<String>,
    /// The program that writes, with its version.
    pub tool: Option<(String, String)>,
    /// When the measurement began; without it the file says 1970.
    pub start: Option<StartTime>,
}

/// A column of the file.
#[derive(Clone, Debug, PartialEq)]
pub struct MdfColumn {
    /// Its name.
    pub name: String,
    /// Its unit.
    pub unit: Option<String>,
    /// What it is.
    pub comment: Option<String>,
    /// What its values are.
    pub kind: MdfColumnType,
}

/// What the values of a column are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MdfColumnType {
    /// Doubles.
    Real,
    /// Integers of 64 bits with a sign.
    Signed,
    /// Integers of 64 bits without a sign.
    Unsigned,
    /// 0 or 1, in a byte.
    Boolean,
    /// Texts of any length, UTF-8.
    Text,
}

impl MdfColumnType {
    /// Bytes in a record; of a text it is where it stands.
    pub(crate) fn record_bytes(self) -> u32 {
        if self == MdfColumnType::Boolean { 1 } else { 8 }
    }
}

/// A value of a row.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum MdfCell<'t> {
    /// For [`MdfColumnType::Real`].
    Real(f64),
    /// For [`MdfColumnType::Signed`].
    Signed(i64),
    /// For [`MdfColumnType::Unsigned`].
    Unsigned(u64),
    /// For [`MdfColumnType::Boolean`].
    Boolean(bool),
    /// For [`MdfColumnType::Text`].
    Text(&'t str),
}
