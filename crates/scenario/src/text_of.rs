//! Start values that are the text of a file: `{ text_of = "front.tir" }`.

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use toml::de::{DeTable, DeValue};

/// The only key of such a table.
pub(crate) const KEY: &str = "text_of";

/// The largest file whose text is a value [B].
const LARGEST: u64 = 16 << 20;

/// The file that a value names, when the value is the text of one.
pub(crate) fn text_file_path(value: &toml::Value) -> Option<&str> {
    let table = value.as_table().filter(|table| table.len() == 1)?;
    table.get(KEY)?.as_str()
}

/// The same of a value that still has the places of its words.
pub(crate) fn is_text_file_reference(table: &DeTable) -> bool {
    let text = |value: &DeValue| value.as_str().is_some();
    table.len() == 1 && table.get(KEY).is_some_and(|value| text(value.get_ref()))
}

/// A value that is the text of the file at a path, as it is typed.
pub(crate) fn text_file_literal(path: &Path) -> String {
    let table = toml::Table::from_iter([(KEY.to_owned(), path.to_string_lossy().into_owned().into())]);
    format!("{{ {} }}", table.to_string().trim())
}

/// The texts of the files that values name, each of which is read once.
#[derive(Debug, Default)]
pub(crate) struct TextCache(RefCell<BTreeMap<PathBuf, Result<String, String>>>);

impl TextCache {
    /// The text of a file, in UTF-8, in UTF-16 with its mark, or else in Latin-1, as instruments write.
    ///
    /// # Errors
    /// In words, when it cannot be read or is too large.
    pub fn read_text(&self, path: &Path) -> Result<String, String> {
        let mut known = self.0.borrow_mut();
        let text = known.entry(path.to_owned()).or_insert_with(|| {
            let bytes = diagnostics::read_bounded(path, LARGEST);
            let bytes =
                bytes.map_err(|error| format!("the file {} cannot be read: {error}", path.display()))?;
            Ok(text_encoding::decode_text(&bytes).into_owned())
        });
        text.clone()
    }

    /// The files that were read.
    pub fn cached_paths(&self) -> Vec<PathBuf> {
        let known = self.0.borrow();
        known.iter().filter(|(_, text)| text.is_ok()).map(|(path, _)| path.clone()).collect()
    }
}
