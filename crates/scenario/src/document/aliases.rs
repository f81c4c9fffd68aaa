//! Reads a file of aliases: names of signals, each with the columns that may have it.

use std::collections::BTreeMap;
use std::fmt;
use std::path::Path;
use std::sync::Arc;

use diagnostics::{Error, SourceFiles, Spanned};
use serde::de::value::{MapAccessDeserializer, SeqAccessDeserializer};
use serde::de::{MapAccess, SeqAccess, Visitor};
use serde::{Deserialize, Deserializer};

use super::table_file::{Column, ColumnEntry};

/// A file of aliases.
#[derive(Debug)]
pub(crate) struct SignalAliases {
    /// The file, for messages that point into it.
    pub source: Arc<SourceFiles>,
    entries: BTreeMap<Spanned<String>, Vec<Column>>,
}

/// The columns of an alias: one, or several of which the first one is taken that a file has.
struct AliasCandidates(Vec<Spanned<ColumnEntry>>);

impl<'de> Deserialize<'de> for AliasCandidates {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Either;
        impl<'de> Visitor<'de> for Either {
            type Value = AliasCandidates;

            fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
                f.write_str("the name of a column, a table with `column`, or a list of these")
            }

            fn visit_str<E>(self, text: &str) -> Result<AliasCandidates, E> {
                // Its span is that of the whole entry.
                Ok(AliasCandidates(vec![Spanned::new(0..0, ColumnEntry::Name(text.to_owned()))]))
            }

            fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<AliasCandidates, A::Error> {
                let table = MapAccessDeserializer::new(map);
                let word = Column::deserialize(table).map(Box::new).map(ColumnEntry::Whole);
                Ok(AliasCandidates(vec![Spanned::new(0..0, word?)]))
            }

            fn visit_seq<A: SeqAccess<'de>>(self, list: A) -> Result<AliasCandidates, A::Error> {
                Vec::deserialize(SeqAccessDeserializer::new(list)).map(AliasCandidates)
            }
        }
        deserializer.deserialize_any(Either)
    }
}

impl SignalAliases {
    /// Reads a file.
    ///
    /// # Errors
    /// In words, when it cannot be read; at its span, when a word is wrong.
    pub fn read(path: &Path) -> Result<Self, Result<Error, String>> {
        let source = SourceFiles::read_main_file(path).map_err(Err)?;
        Self::from_source(source).map_err(Ok)
    }

    fn from_source(source: SourceFiles) -> Result<Self, Error> {
        let wrong =
            |error: toml::de::Error| source.error_at(error.span().unwrap_or(0..0), error.message(), "here");
        let words: BTreeMap<Spanned<String>, Spanned<AliasCandidates>> =
            toml::from_str(&source.concatenated_text()).map_err(wrong)?;
        let mut entries = BTreeMap::new();
        for (name, word) in words {
            let span = word.span();
            let AliasCandidates(list) = word.into_inner();
            if list.is_empty() {
                let message = format!("expected at least one column for `{}`", name.get_ref());
                return Err(source.error_at(span, message, ""));
            }
            let placed = |word: Spanned<ColumnEntry>| match word.span().is_empty() {
                true => Spanned::new(span.clone(), word.into_inner()),
                false => word,
            };
            let columns = list.into_iter().map(|it| Column::from_entry(placed(it)).into_inner());
            entries.insert(name, columns.collect());
        }
        Ok(SignalAliases { source: Arc::new(source), entries })
    }

    /// The names.
    pub fn alias_names(&self) -> impl Iterator<Item = &Spanned<String>> {
        self.entries.keys()
    }

    /// The name as it stands in the file, and the columns that may have it.
    pub fn find_alias(&self, name: &str) -> Option<(&Spanned<String>, &[Column])> {
        let mut entries = self.entries.iter();
        entries.find(|(it, _)| it.get_ref() == name).map(|(name, list)| (name, list.as_slice()))
    }

    /// The columns of all aliases.
    pub fn candidate_columns(&self) -> impl Iterator<Item = &Column> {
        self.entries.values().flatten()
    }

    /// The names of all columns.
    pub fn column_names(&self) -> impl Iterator<Item = &str> {
        self.candidate_columns().map(|column| column.column.get_ref().as_str())
    }
}
