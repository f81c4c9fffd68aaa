//! Defines the summary of a result for people: the JSON keys that plugins write and the program reads.

use serde::de::IgnoredAny;
use serde::{Deserialize, Deserializer, Serialize};

/// Keys of a result, all optional. What has another shape is left out.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct ResultSummary {
    /// Sentences, of which the first has the verdict.
    #[serde(deserialize_with = "deserialize_valid_items")]
    pub summary: Vec<String>,
    /// False where the result is not to be trusted.
    #[serde(deserialize_with = "unless_false")]
    pub sound: bool,
    /// What is told in rows and columns.
    #[serde(deserialize_with = "deserialize_valid_items")]
    pub tables: Vec<ResultTable>,
}

impl Default for ResultSummary {
    /// Nothing that anybody doubts.
    fn default() -> Self {
        Self { summary: Vec::new(), sound: true, tables: Vec::new() }
    }
}

/// A table of texts.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct ResultTable {
    /// Titles of the columns.
    #[serde(deserialize_with = "deserialize_valid_items")]
    pub head: Vec<String>,
    /// Cells, row by row.
    #[serde(deserialize_with = "deserialize_valid_items")]
    pub rows: Vec<ResultTableRow>,
}

/// A row of a table.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct ResultTableRow(#[serde(deserialize_with = "deserialize_valid_items")] pub Vec<String>);

impl ResultTable {
    /// A table from texts.
    pub fn new<const N: usize>(head: [&str; N], rows: impl IntoIterator<Item = [String; N]>) -> Self {
        let rows = rows.into_iter().map(|row| ResultTableRow(row.into())).collect();
        Self { head: head.map(str::to_owned).into(), rows }
    }
}

/// A value, or one of another shape.
#[derive(Deserialize)]
#[serde(untagged)]
enum LenientValue<T> {
    Fits(T),
    Other(IgnoredAny),
}

impl<T> LenientValue<T> {
    fn valid_value(self) -> Option<T> {
        match self {
            Self::Fits(value) => Some(value),
            Self::Other(_) => None,
        }
    }
}

fn deserialize_valid_items<'de, D: Deserializer<'de>, T: Deserialize<'de>>(
    from: D,
) -> Result<Vec<T>, D::Error> {
    let found: LenientValue<Vec<LenientValue<T>>> = LenientValue::deserialize(from)?;
    Ok(found.valid_value().into_iter().flatten().filter_map(LenientValue::valid_value).collect())
}

fn unless_false<'de, D: Deserializer<'de>>(from: D) -> Result<bool, D::Error> {
    let found: LenientValue<bool> = LenientValue::deserialize(from)?;
    Ok(found.valid_value().unwrap_or(true))
}
