//! Finds the spans of keys and values by the keys that lead to them.

use std::ops::Range;

use serde_json::Value;
use toml::Spanned;
use toml::de::DeValue;

use super::{Scenario, read};
use crate::schema::{self, SchemaViolation};

impl Scenario {
    /// The number of these keys that the files have, and the span of the last one of them. Entries of lists are numbers
    /// from 0 on, in the order of the document. None when the files do not even have the first key.
    #[must_use]
    pub fn deepest_key_span(&self, path: &[&str]) -> Option<(usize, Range<usize>)> {
        let texts = self.source.padded_texts();
        let document = DeValue::Table(read::merge_files(&self.source, &texts).ok()?);
        let (mut value, mut found) = (&document, None);
        for (index, key) in path.iter().enumerate() {
            let Some((span, inner)) = child_with_span(value, key) else { break };
            found = Some((index + 1, span));
            value = inner;
        }
        found
    }

    /// The entries of a table that break a schema, such as those of the configuration of a plugin; `path` as for
    /// [`Scenario::deepest_key_span`].
    #[must_use]
    pub fn schema_violations(&self, path: &[&str], schema: &Value) -> Vec<SchemaViolation> {
        let texts = self.source.padded_texts();
        let Ok(document) = read::merge_files(&self.source, &texts) else { return Vec::new() };
        let document = DeValue::Table(document);
        let (mut value, mut table_span) = (&document, 0..0);
        for key in path {
            let Some((span, inner)) = child_with_span(value, key) else { return Vec::new() };
            (value, table_span) = (inner, span);
        }
        let table = value.as_table();
        table.map_or_else(Vec::new, |table| schema::validate_table(schema, table_span, table))
    }
}

/// The span of a key, or of an entry of a list, and its value.
fn child_with_span<'v, 't>(value: &'v DeValue<'t>, key: &str) -> Option<(Range<usize>, &'v DeValue<'t>)> {
    match value {
        DeValue::Table(table) => {
            let (key, value) = table.iter().find(|(known, _)| known.get_ref() == key)?;
            Some((key.span(), value.get_ref()))
        }
        DeValue::Array(list) => {
            let entry: &Spanned<DeValue> = list.get(key.parse::<usize>().ok()?)?;
            Some((entry.span(), entry.get_ref()))
        }
        _ => None,
    }
}
