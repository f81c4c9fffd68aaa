//! Reads the configuration of an analysis, so that each error names its key.

use std::fmt::Display;

use serde::de::DeserializeOwned;
use serde_path_to_error::Segment;

use crate::error::ConfigError;

/// Reads a configuration in TOML.
///
/// serde loses the path inside of an enum with an internal tag. To keep it, read the tag and the rest separately.
///
/// # Errors
/// With the key, and serde's message about it.
pub fn from_toml<T: DeserializeOwned>(text: &str) -> Result<T, ConfigError> {
    let document = toml::Deserializer::parse(text);
    let document = document.map_err(|error| ConfigError::new(error.message()))?;
    serde_path_to_error::deserialize(document)
        .map_err(|error| config_error_at_path(error.path(), error.inner().message()))
}

/// An error at a path of serde.
fn config_error_at_path(path: &serde_path_to_error::Path, message: impl Into<String>) -> ConfigError {
    let key = |segment: &Segment| match segment {
        Segment::Map { key } => Some(key.clone()),
        Segment::Seq { index } => Some(index.to_string()),
        // The variant of an enum may be written as a key or not at all, and the rest has no name.
        Segment::Enum { .. } | Segment::Unknown => None,
    };
    ConfigError { path: path.iter().filter_map(key).collect(), message: message.into() }
}

impl<E: Display> From<serde_path_to_error::Error<E>> for ConfigError {
    fn from(error: serde_path_to_error::Error<E>) -> Self {
        config_error_at_path(error.path(), error.inner().to_string())
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use serde::Deserialize;

    use super::*;

    #[derive(Debug, Deserialize, PartialEq)]
    #[serde(deny_unknown_fields)]
    struct Config {
        #[serde(default)]
        axle: BTreeMap<String, Axle>,
        #[serde(default)]
        levels: Vec<f64>,
    }

    #[derive(Debug, Deserialize, PartialEq)]
    #[serde(deny_unknown_fields)]
    struct Axle {
        bounds: [f64; 2],
    }

    #[test]
    fn errors_name_the_key_that_caused_them() {
        for (text, path, message) in [
            ("axle.front.bounds = [1.0, \"x\"]", "axle.front.bounds.1", "invalid type: string"),
            ("axle.front.bounds = 3", "axle.front.bounds", "invalid type: integer"),
            ("levels = [1.0, 2.0, true]", "levels.2", "invalid type: boolean"),
            ("levels = 3.0", "levels", "invalid type"),
            ("axle.front.bonds = [1.0, 2.0]", "axle.front.bonds", "unknown field `bonds`"),
            ("lewels = []", "lewels", "unknown field `lewels`"),
            ("axle.front = {}", "axle.front", "missing field `bounds`"),
            ("axle = ", "", "value"),
        ] {
            let error = from_toml::<Config>(text).expect_err(text);
            assert_eq!(error.key_path(), path, "{text}: {error}");
            assert!(error.message.contains(message), "{text}: {error}");
            assert!(!error.message.contains('\n'), "{text}: {error}");
        }
        let found = from_toml::<Config>("levels = [1, 2.5]").expect("a configuration");
        assert_eq!(found, Config { axle: BTreeMap::new(), levels: vec![1.0, 2.5] });
    }
}
