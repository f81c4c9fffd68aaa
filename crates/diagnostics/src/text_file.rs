//! Reads text files.

use std::path::{Path, PathBuf};

/// A text file.
#[derive(Debug, Clone, Default)]
pub struct TextFile {
    /// Its path as the user wrote it.
    pub path: PathBuf,
    /// Its contents.
    pub text: String,
}

pub(crate) fn read(path: &Path) -> Result<TextFile, String> {
    match std::fs::read_to_string(path) {
        // A byte order mark is known to parsers at the beginning only, where the text may not be.
        Ok(text) => {
            Ok(TextFile { path: path.to_owned(), text: text.replacen('\u{feff}', "   ", 1) })
        }
        Err(error) => Err(format!("cannot read the scenario {}: {error}", path.display())),
    }
}
