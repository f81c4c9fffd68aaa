//! Reads a file of aliases: names of signals, each with the columns that may have it.

use std::collections::BTreeMap;
use std::fmt;
use std::path::Path;
use std::sync::Arc;

use diagnostics::{Error, Source, Spanned};
use serde::de::value::{MapAccessDeserializer, SeqAccessDeserializer};
use serde::de::{MapAccess, SeqAccess, Visitor};
use serde::{Deserialize, Deserializer};

use super::table_file::{Column, ColumnEntry};

/// A file of aliases.
#[derive(Debug)]
pub(crate) struct Aliases {
    /// The file, for messages that point into it.
    pub source: Arc<Source>,
    entries: BTreeMap<Spanned<String>, Vec<Column>>,
}

/// The columns of an alias: one, or several of which the first one is taken that a file has.
struct Candidates(Vec<Spanned<ColumnEntry>>);

impl<'de> Deserialize<'de> for Candidates {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Either;
        impl<'de> Visitor<'de> for Either {
            type Value = Candidates;

            fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
                f.write_str("the name of a column, a table with `column`, or a list of these")
            }

            fn visit_str<E>(self, text: &str) -> Result<Candidates, E> {
                // Its span is that of the whole entry.
                Ok(Candidates(vec![Spanned::new(0..0, ColumnEntry::Name(text.to_owned()))]))
            }

            fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<Candidates, A::Error> {
                let table = MapAccessDeserializer::new(map);
                let word = Column::deserialize(table).map(Box::new).map(ColumnEntry::Whole);
                Ok(Candidates(vec![Spanned::new(0..0, word?)]))
            }

            fn visit_seq<A: SeqAccess<'de>>(self, list: A) -> Result<Candidates, A::Error> {
                Vec::deserialize(SeqAccessDeserializer::new(list)).map(Candidates)
            }
        }
        deserializer.deserialize_any(Either)
    }
}

impl Aliases {
    /// Reads a file.
    ///
    /// # Errors
    /// In words, when it cannot be read; at its span, when a word is wrong.
    pub fn read(path: &Path) -> Result<Self, Result<Error, String>> {
        let source = Source::read(path).map_err(Err)?;
        Self::of(source).map_err(Ok)
    }

    fn of(source: Source) -> Result<Self, Error> {
        let wrong = |error: toml::de::Error| {
            source.error(error.span().unwrap_or(0..0), error.message(), "here")
        };
        let words: BTreeMap<Spanned<String>, Spanned<Candidates>> =
            toml::from_str(&source.concatenated()).map_err(wrong)?;
        let mut entries = BTreeMap::new();
        for (name, word) in words {
            let span = word.span();
            let Candidates(list) = word.into_inner();
            if list.is_empty() {
                let message = format!("expected at least one column for `{}`", name.get_ref());
                return Err(source.error(span, message, ""));
            }
            let placed = |word: Spanned<ColumnEntry>| match word.span().is_empty() {
                true => Spanned::new(span.clone(), word.into_inner()),
                false => word,
            };
            let columns = list.into_iter().map(|it| Column::of(placed(it)).into_inner());
            entries.insert(name, columns.collect());
        }
        Ok(Aliases { source: Arc::new(source), entries })
    }

    /// The names.
    pub fn names(&self) -> impl Iterator<Item = &Spanned<String>> {
        self.entries.keys()
    }

    /// The name as it stands in the file, and the columns that may have it.
    pub fn get(&self, name: &str) -> Option<(&Spanned<String>, &[Column])> {
        let mut entries = self.entries.iter();
        entries.find(|(it, _)| it.get_ref() == name).map(|(name, list)| (name, list.as_slice()))
    }

    /// The columns of all aliases.
    pub fn all(&self) -> impl Iterator<Item = &Column> {
        self.entries.values().flatten()
    }

    /// The names of all columns.
    pub fn columns(&self) -> impl Iterator<Item = &str> {
        self.all().map(|column| column.column.get_ref().as_str())
    }
}
