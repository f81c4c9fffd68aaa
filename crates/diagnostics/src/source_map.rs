//! A source map: from positions in a generated text to positions in the files that it was generated from.

use std::fmt;
use std::path::Path;
use std::sync::Arc;

/// The origins of ranges of a generated text, and files that users know by other names than the program.
#[derive(Clone, Default)]
pub struct SourceMap {
    /// The first bytes of the stretches, in rising order. A place is written when an error asks for it.
    begins: Vec<(usize, Arc<dyn fmt::Display + Send + Sync>)>,
    /// A path, and what users know it by.
    renamed: Vec<(String, String)>,
}

impl SourceMap {
    /// Says where what begins at a byte of the text stands.
    pub fn add_mapping(&mut self, at: usize, place: impl fmt::Display + Send + Sync + 'static) {
        self.begins.push((at, Arc::new(place)));
    }

    /// Has messages name a path as users know it.
    pub fn rename_path(&mut self, path: &Path, shown: &Path) {
        self.renamed.push((path.display().to_string(), shown.display().to_string()));
    }

    /// Where the byte of the text stands in the files of the user; nothing when the text is one of them.
    pub(crate) fn original_position(&self, at: usize) -> Option<String> {
        let after = self.begins.partition_point(|(begin, _)| *begin <= at);
        let (_, place) = self.begins.get(after.checked_sub(1)?)?;
        Some(place.to_string())
    }

    /// A message with paths as users know them.
    pub(crate) fn with_renamed_paths(&self, message: String) -> String {
        let rename = |text: String, (path, shown): &(String, String)| text.replace(path, shown);
        self.renamed.iter().fold(message, rename)
    }
}

impl fmt::Debug for SourceMap {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let begins = self.begins.iter().map(|(at, place)| (at, place.to_string()));
        f.debug_map().entries(begins).finish()
    }
}
