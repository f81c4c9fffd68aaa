//! Deserializes what is either a text or a table, with the places of the words of the table.

use std::fmt;

use serde::Deserialize;
use serde::de::value::MapAccessDeserializer;
use serde::de::{Error, MapAccess, Visitor};

/// A visitor of a text or a table `W`. Serde's own choice between the two would lose the places in the file.
pub(super) struct TextOrTable<T, W> {
    /// What is expected, for messages.
    pub expected: &'static str,
    /// The value of a text.
    pub from_text: fn(String) -> T,
    /// The value of a table.
    pub from_table: fn(W) -> T,
}

impl<'de, T, W: Deserialize<'de>> Visitor<'de> for TextOrTable<T, W> {
    type Value = T;

    fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(self.expected)
    }

    fn visit_str<E: Error>(self, text: &str) -> Result<T, E> {
        Ok((self.from_text)(text.to_owned()))
    }

    fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<T, A::Error> {
        W::deserialize(MapAccessDeserializer::new(map)).map(self.from_table)
    }
}
