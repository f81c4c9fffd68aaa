//! Defines the errors of a script and of its process.

use std::fmt;

use serde::Deserialize;

/// An exception of a script.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize)]
pub struct PythonException {
    /// Its type and its message.
    pub message: String,
    /// The file of the script that it comes from, relative to the folder of the script.
    #[serde(default)]
    pub file: Option<String>,
    /// The line in it, from 1 on.
    #[serde(default)]
    pub line: Option<usize>,
    /// The function.
    #[serde(default, rename = "where")]
    pub function: Option<String>,
}

impl fmt::Display for PythonException {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        if let Some(file) = &self.file {
            write!(f, "{file}")?;
            if let Some(line) = self.line {
                write!(f, ":{line}")?;
            }
            if let Some(function) = self.function.as_ref().filter(|it| *it != "<module>") {
                write!(f, ", in {function}")?;
            }
            write!(f, ": ")?;
        }
        f.write_str(&self.message)
    }
}

/// Why a question has no answer.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum ScriptError {
    /// The script raised an exception; it answers the next question.
    #[error("{0}")]
    Exception(PythonException),
    /// The script ends the simulation as planned.
    #[error("{0}")]
    Terminated(String),
    /// There is no process any more, or none began.
    #[error("{0}")]
    Ended(String),
}
