//! Reports failures of an analysis, with the key of the configuration that caused them.

use std::error::Error;
use std::fmt::{self, Display};

/// A mistake in the configuration of an analysis, or in its choice of signals.
///
/// The program points at the key in the user's file.
///
/// ```
/// use plugin::ConfigError;
///
/// let error = ConfigError::new("expected two rising numbers, found 3 and 1").with_parent_key("B");
/// let error = error.with_parent_key("bounds").with_parent_key("lateral");
/// assert_eq!(error.path, ["lateral", "bounds", "B"]);
/// assert_eq!(error.to_string(), "lateral.bounds.B: expected two rising numbers, found 3 and 1");
/// ```
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ConfigError {
    /// The keys that lead to the wrong value, from the outermost on. Items of a list are numbers from 0 on. Empty
    /// when no single key is wrong.
    pub path: Vec<String>,
    /// What was expected, what was found, and what to do.
    pub message: String,
}

impl ConfigError {
    /// An error of the configuration as a whole.
    #[must_use]
    pub fn new(message: impl Into<String>) -> Self {
        Self { path: Vec::new(), message: message.into() }
    }

    /// An error at a key. A dot leads into a table: `lateral.bounds.B`.
    #[must_use]
    pub fn at_key(path: &str, message: impl Into<String>) -> Self {
        let keys = path.split('.').filter(|key| !key.is_empty());
        Self { path: keys.map(str::to_owned).collect(), message: message.into() }
    }

    /// The same error, seen from a table in which the part with the error has this key.
    #[must_use]
    pub fn with_parent_key(mut self, key: impl Into<String>) -> Self {
        self.path.insert(0, key.into());
        self
    }

    /// The keys with dots between them; empty when no single key is wrong.
    #[must_use]
    pub fn key_path(&self) -> String {
        self.path.join(".")
    }
}

impl Display for ConfigError {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        if self.path.is_empty() {
            return f.write_str(&self.message);
        }
        write!(f, "{}: {}", self.key_path(), self.message)
    }
}

impl Error for ConfigError {}

impl From<String> for ConfigError {
    fn from(message: String) -> Self {
        Self::new(message)
    }
}

impl From<&str> for ConfigError {
    fn from(message: &str) -> Self {
        Self::new(message)
    }
}

/// Failure of an analysis.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum AnalysisError {
    /// The user asked for something impossible.
    Config(ConfigError),
    /// The work failed.
    Failed(String),
}

impl Display for AnalysisError {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Self::Config(error) => error.fmt(f),
            Self::Failed(message) => f.write_str(message),
        }
    }
}

impl Error for AnalysisError {}

impl From<ConfigError> for AnalysisError {
    fn from(error: ConfigError) -> Self {
        Self::Config(error)
    }
}

impl From<String> for AnalysisError {
    fn from(message: String) -> Self {
        Self::Failed(message)
    }
}

impl From<&str> for AnalysisError {
    fn from(message: &str) -> Self {
        Self::Failed(message.to_owned())
    }
}
