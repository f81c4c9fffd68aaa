//! Keeps what an error says as texts, for programs and files that outlive it: message, place, remedy.

use std::fmt;

use miette::Diagnostic as _;
use serde::{Deserialize, Serialize};

use crate::Error;

/// What an error says.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct ErrorRecord {
    /// The message.
    pub message: String,
    /// Where the mistake stands, if that is in a file.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub place: Option<ErrorPlace>,
    /// What to do, such as "did you mean `check`?".
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub help: Option<String>,
}

/// A place in a text file, line and column from 1 on.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct ErrorPlace {
    /// The file as messages name it.
    pub file: String,
    /// Its line.
    pub line: usize,
    /// The letter in the line.
    pub column: usize,
}

impl ErrorRecord {
    /// What one of [`Error::into_single_errors`] says.
    #[must_use]
    pub fn from_error(error: &Error) -> Self {
        let place = error.as_input().and_then(|input| input.file_line_and_column());
        let place = place.map(|(file, [line, column])| ErrorPlace { file: file.to_owned(), line, column });
        ErrorRecord { message: error.to_string(), place, help: error.help().map(|help| help.to_string()) }
    }
}

/// `suite/lane.toml:9:3`
impl fmt::Display for ErrorPlace {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(out, "{}:{}:{}", self.file, self.line, self.column)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{SourceFiles, TextFile, suggest};

    #[test]
    fn a_mistake_keeps_its_place_and_its_remedy() {
        let text = "title = \"x\"\n\n\u{e4} = 1\n[[chekc]]\n";
        let source = SourceFiles::from_generated(TextFile::new("suite/lane.toml", text));
        let at = text.find("chekc").expect("it is there");
        let error = suggest::unknown_name("key", "chekc", ["check"]).into_error_at(&source, at..at + 5);
        let record = ErrorRecord::from_error(&error);
        assert_eq!(record.message, "unknown key `chekc`");
        assert_eq!(record.place.map(|it| it.to_string()).as_deref(), Some("suite/lane.toml:4:3"));
        assert_eq!(record.help.as_deref(), Some("did you mean `check`?"));
        assert_eq!(ErrorRecord::from_error(&Error::invalid_input("no")).place, None);
    }
}
