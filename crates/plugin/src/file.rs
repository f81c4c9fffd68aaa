//! Carries files of `[analysis.files]` in a configuration: texts as they are, other contents in base64.

use std::fmt;

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use serde::de::{Error, MapAccess, Visitor};
use serde::{Deserialize, Deserializer};

/// The key of contents that are no text.
const KEY: &str = "base64";

/// The contents of a file that the user names. A configuration has a text as a string; contents that are no UTF-8 are a table with one key,
/// `base64`. So plugins that want texts go on with `String`, and those that read any file have a `ConfigFile`.
///
/// ```
/// use std::collections::BTreeMap;
///
/// #[derive(serde::Deserialize)]
/// struct Config { files: BTreeMap<String, plugin::ConfigFile> }
///
/// let text = "[files]\nlog = \"t,v\\n\"\npacked = { base64 = \"H4sA/w==\" }\n";
/// let Config { files } = plugin::from_toml(text)?;
/// assert_eq!(files["log"].bytes(), b"t,v\n");
/// assert_eq!(files["packed"].bytes(), [0x1f, 0x8b, 0, 0xff]);
/// assert_eq!(plugin::ConfigFile::config_value(vec![0x1f, 0x8b, 0, 0xff]).to_string(), "{ base64 = \"H4sA/w==\" }");
/// # Ok::<(), plugin::ConfigError>(())
/// ```
#[derive(Clone, Default, PartialEq, Eq)]
pub struct ConfigFile(Vec<u8>);

impl ConfigFile {
    /// The contents.
    #[must_use]
    pub fn bytes(&self) -> &[u8] {
        &self.0
    }

    /// How a configuration has these contents.
    #[must_use]
    pub fn config_value(bytes: Vec<u8>) -> toml::Value {
        match String::from_utf8(bytes) {
            Ok(text) => text.into(),
            Err(other) => {
                let packed = STANDARD.encode(other.as_bytes());
                toml::Table::from_iter([(KEY.to_owned(), packed.into())]).into()
            }
        }
    }
}

impl From<&str> for ConfigFile {
    fn from(text: &str) -> Self {
        Self(text.as_bytes().to_vec())
    }
}

impl fmt::Debug for ConfigFile {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "File({} bytes)", self.0.len())
    }
}

impl<'de> Deserialize<'de> for ConfigFile {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(FileVisitor)
    }
}

struct FileVisitor;

impl<'de> Visitor<'de> for FileVisitor {
    type Value = ConfigFile;

    fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "a text, or a table with {KEY}")
    }

    fn visit_str<E: Error>(self, text: &str) -> Result<ConfigFile, E> {
        Ok(text.into())
    }

    fn visit_string<E: Error>(self, text: String) -> Result<ConfigFile, E> {
        Ok(ConfigFile(text.into_bytes()))
    }

    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<ConfigFile, A::Error> {
        let Some((key, packed)) = map.next_entry::<String, String>()? else {
            return Err(Error::missing_field(KEY));
        };
        if key != KEY {
            return Err(Error::unknown_field(&key, &[KEY]));
        }
        if let Some(key) = map.next_key::<String>()? {
            return Err(Error::unknown_field(&key, &[KEY]));
        }
        let bytes = STANDARD.decode(packed).map_err(|error| Error::custom(format!("{KEY}: {error}")))?;
        Ok(ConfigFile(bytes))
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use super::*;
    use crate::from_toml;

    #[test]
    fn contents_go_through_a_configuration_unchanged() {
        for bytes in [b"".to_vec(), "a\n\"\u{e9}\"\0".into(), (0..=255).collect(), vec![0xff; 7]] {
            let table = toml::Table::from_iter([("a".to_owned(), ConfigFile::config_value(bytes.clone()))]);
            let text = toml::to_string(&table).expect("TOML");
            let found: BTreeMap<String, ConfigFile> = from_toml(&text).expect("a file");
            assert_eq!(found["a"].bytes(), bytes);
        }
    }

    #[test]
    fn other_tables_are_refused_at_their_key() {
        for (text, message) in [
            ("a = 1", "expected a text, or a table with base64"),
            ("a = {}", "missing field `base64`"),
            ("a = { hex = \"00\" }", "unknown field `hex`"),
            ("a = { base64 = \"00==\", more = \"\" }", "unknown field `more`"),
            ("a = { base64 = \"?\" }", "base64: Invalid"),
        ] {
            let error = from_toml::<BTreeMap<String, ConfigFile>>(text).expect_err(text);
            assert!(error.path.first().is_some_and(|it| it == "a"), "{text}: {error}");
            assert!(error.message.contains(message), "{text}: {error}");
        }
    }
}
