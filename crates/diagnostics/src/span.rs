//! A parsed value with its span in a text file.

use std::borrow::Cow;
use std::ops::Range;

use schemars::{JsonSchema, Schema, SchemaGenerator};
use serde::Deserialize;

/// A word with its place in a TOML file. Comparison and order are those of the word alone.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Hash, Deserialize)]
#[serde(transparent)]
pub struct Spanned<T>(toml::Spanned<T>);

impl<T> Spanned<T> {
    /// A word at a place.
    pub fn new(span: Range<usize>, word: T) -> Self {
        Spanned(toml::Spanned::new(span, word))
    }

    /// The place in bytes of the file.
    pub fn span(&self) -> Range<usize> {
        self.0.span()
    }

    /// The word.
    pub fn get_ref(&self) -> &T {
        self.0.get_ref()
    }

    /// The word without its place.
    pub fn into_inner(self) -> T {
        self.0.into_inner()
    }
}

/// The schema of the word: an editor does not see places.
impl<T: JsonSchema> JsonSchema for Spanned<T> {
    fn inline_schema() -> bool {
        T::inline_schema()
    }

    fn schema_name() -> Cow<'static, str> {
        T::schema_name()
    }

    fn schema_id() -> Cow<'static, str> {
        T::schema_id()
    }

    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        T::json_schema(generator)
    }
}
