//! Joins a cell array of texts to one value.

use crate::{MatFile, MatValue, MatVariable};

/// Where the members of a cell begin among what was found.
pub(crate) struct CellStart {
    variables: usize,
    skipped: usize,
}

impl CellStart {
    pub fn at_end_of(found: &MatFile) -> Self {
        Self { variables: found.variables.len(), skipped: found.skipped.len() }
    }

    /// Replaces the members by one value with the name of the cell, if all are texts of one row, or empty.
    pub fn join_texts(self, found: &mut MatFile, name: &str, members: usize) {
        let text = |it: &MatVariable| match &it.value {
            MatValue::Texts(texts) if texts.len() == 1 => texts.first().cloned(),
            MatValue::Numbers(array) if array.values.is_empty() => Some(String::new()),
            _ => None,
        };
        let own = &found.variables[self.variables..];
        let texts: Option<Vec<_>> = own.iter().map(text).collect();
        let only = found.skipped.len() == self.skipped && own.len() == members;
        let some = own.iter().any(|it| matches!(it.value, MatValue::Texts(_)));
        if let Some(texts) = texts.filter(|_| only && some) {
            found.variables.truncate(self.variables);
            found.variables.push(MatVariable { name: name.to_owned(), value: MatValue::Texts(texts) });
        }
    }
}
