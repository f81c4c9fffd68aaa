//! Deserializes a text or a list of texts as a list.

use std::fmt;

use diagnostics::Spanned;
use schemars::JsonSchema;
use serde::de::value::SeqAccessDeserializer;
use serde::de::{SeqAccess, Visitor};
use serde::{Deserialize, Deserializer};

/// A text, or a list of texts.
#[derive(JsonSchema)]
#[schemars(untagged)]
#[allow(dead_code, reason = "the schema is made of it")]
pub enum OneOrMore {
    /// One.
    One(String),
    /// Several.
    More(Vec<Spanned<String>>),
}

/// Serde's own choice between a text and a list would lose the places in the file.
impl<'de> Deserialize<'de> for OneOrMore {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Either;
        impl<'de> Visitor<'de> for Either {
            type Value = OneOrMore;

            fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
                f.write_str("a text, or a list of texts")
            }

            fn visit_str<E>(self, text: &str) -> Result<OneOrMore, E> {
                Ok(OneOrMore::One(text.to_owned()))
            }

            fn visit_seq<A: SeqAccess<'de>>(self, list: A) -> Result<OneOrMore, A::Error> {
                Vec::deserialize(SeqAccessDeserializer::new(list)).map(OneOrMore::More)
            }
        }
        deserializer.deserialize_any(Either)
    }
}

/// Reads one text or several as a list.
pub(super) fn one_or_more<'de, D: Deserializer<'de>>(
    deserializer: D,
) -> Result<Vec<Spanned<String>>, D::Error> {
    let words = Spanned::<OneOrMore>::deserialize(deserializer)?;
    let span = words.span();
    Ok(match words.into_inner() {
        OneOrMore::One(text) => vec![Spanned::new(span, text)],
        OneOrMore::More(list) => list,
    })
}
