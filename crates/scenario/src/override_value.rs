//! The value of an override: typed where it comes from, and written as text only for reports and files.

use std::fmt;
use std::path::PathBuf;

use serde::{Deserialize, Serialize};

use crate::text_of;

/// The value of an override.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub enum OverrideValue {
    /// A number, in the unit of the variable unless it has one of its own.
    Number {
        /// The number.
        value: f64,
        /// Its unit.
        unit: Option<String>,
    },
    /// An integer.
    Integer(i64),
    /// True or false.
    Boolean(bool),
    /// As typed on the command line: TOML, a number with a unit, or else the letters themselves, as the type of the variable has it.
    Typed(String),
    /// The text of the file at this path.
    TextOf(PathBuf),
    /// A value of a TOML file.
    Toml(#[serde(with = "toml_text")] toml::Value),
}

/// A TOML value as text: formats that do not describe themselves cannot hold it otherwise.
mod toml_text {
    use serde::{Deserialize as _, Deserializer, Serializer, de::Error as _};

    pub fn serialize<S: Serializer>(value: &toml::Value, out: S) -> Result<S::Ok, S::Error> {
        out.serialize_str(&value.to_string())
    }

    pub fn deserialize<'de, D: Deserializer<'de>>(text: D) -> Result<toml::Value, D::Error> {
        String::deserialize(text)?.parse().map_err(D::Error::custom)
    }
}

/// As it is written on the command line.
impl fmt::Display for OverrideValue {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            // To the last bit.
            OverrideValue::Number { value, unit: None } => write!(f, "{value:?}"),
            OverrideValue::Number { value, unit: Some(unit) } => write!(f, "{value:?} {unit}"),
            OverrideValue::Integer(value) => write!(f, "{value}"),
            OverrideValue::Boolean(value) => write!(f, "{value}"),
            OverrideValue::Typed(text) => f.write_str(text),
            OverrideValue::TextOf(path) => f.write_str(&text_of::text_file_literal(path)),
            OverrideValue::Toml(value) => write!(f, "{value}"),
        }
    }
}

impl OverrideValue {
    /// The value of a text on the command line.
    #[must_use]
    pub fn parse(text: &str) -> Self {
        let toml = text.parse::<toml::Value>().ok();
        match toml.as_ref().and_then(text_of::text_file_path) {
            Some(file) => OverrideValue::TextOf(file.into()),
            None => OverrideValue::Typed(text.to_owned()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_value_is_written_as_on_the_command_line() {
        let third = OverrideValue::Number { value: 1.0 / 3.0, unit: Some("kN".to_owned()) };
        let cases = [
            (third, "0.3333333333333333 kN"),
            (OverrideValue::Number { value: 2.0, unit: None }, "2.0"),
            (OverrideValue::Integer(-3), "-3"),
            (OverrideValue::Boolean(true), "true"),
            (OverrideValue::Typed("0.5 kg".to_owned()), "0.5 kg"),
            (OverrideValue::TextOf("a/front.tir".into()), "{ text_of = \"a/front.tir\" }"),
            (OverrideValue::Toml(toml::Value::String("wet".to_owned())), "\"wet\""),
        ];
        for (value, text) in cases {
            assert_eq!(value.to_string(), text);
        }
    }

    #[test]
    fn a_typed_text_is_the_file_of_text_of_or_stays_as_it_is() {
        let file = OverrideValue::TextOf("front.tir".into());
        assert_eq!(OverrideValue::parse("{ text_of = \"front.tir\" }"), file);
        for text in ["3", "0.5 kg", "wet road", "[1, 2]", ""] {
            assert_eq!(OverrideValue::parse(text), OverrideValue::Typed(text.to_owned()));
        }
    }

    #[test]
    fn a_value_of_toml_is_the_same_after_serialization() {
        for text in ["1.5", "[1.0, 2.5]", "true", "\"a \\\"b\\\"\"", "7"] {
            let value = OverrideValue::Toml(text.parse().expect("it is TOML"));
            let json = serde_json::to_string(&value).expect("it is written");
            assert_eq!(serde_json::from_str::<OverrideValue>(&json).expect("it is read"), value);
        }
    }
}
