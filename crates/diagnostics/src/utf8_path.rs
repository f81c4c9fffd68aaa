//! Refuses paths that reports and recordings cannot name.

use std::path::Path;

use crate::error::Error;

/// The path as a text, which reports, recordings and messages name it by.
///
/// # Errors
/// When it has other bytes than UTF-8.
pub fn utf8_path(path: &Path) -> Result<&str, Error> {
    path.to_str().ok_or_else(|| {
        let message = format!("{}: expected a path in UTF-8, found other bytes in it", path.display());
        Error::invalid_input(message)
            .with_help("rename the file or its folder: reports and recordings name it")
    })
}
