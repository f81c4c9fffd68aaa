//! Defines a String parameter that is a file or its path; clones share the text, since each state of a model has one.

use std::sync::Arc;

use serde::{Deserialize, Serialize};

/// The largest file [B].
const LARGEST: u64 = 16 << 20;

/// A text that its clones share.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(from = "String", into = "String")]
pub struct SharedText(Arc<String>);

impl SharedText {
    /// The text.
    #[must_use]
    pub fn get(&self) -> &str {
        &self.0
    }

    /// The text, to be written; its clones keep theirs.
    pub fn get_mut(&mut self) -> &mut String {
        Arc::make_mut(&mut self.0)
    }

    /// The text itself when it has several lines; otherwise that of the file whose path it is.
    ///
    /// # Errors
    /// When the file cannot be read or is too large; `name` is that of the parameter.
    pub fn load_if_path(&self, name: &str) -> Result<SharedText, String> {
        if self.get().trim().is_empty() || self.get().contains('\n') {
            return Ok(self.clone());
        }
        let path = self.get().trim();
        let wrong =
            |what: String| format!("{name} has one line, so it is the path of a file: `{path}` {what}");
        let read = || -> std::io::Result<Result<Vec<u8>, u64>> {
            let size = std::fs::metadata(path)?.len();
            if size > LARGEST { Ok(Err(size)) } else { std::fs::read(path).map(Ok) }
        };
        let bytes = read().map_err(|error| wrong(format!("cannot be read: {error}")))?;
        let bytes = bytes.map_err(|size| wrong(format!("has {size} B, expected at most {LARGEST} B")))?;
        // In UTF-8 or else in Latin-1, as instruments write.
        Ok(SharedText::from(text_encoding::utf8_or_latin1(&bytes).into_owned()))
    }
}

impl From<String> for SharedText {
    fn from(text: String) -> Self {
        SharedText(Arc::new(text))
    }
}

impl From<SharedText> for String {
    fn from(text: SharedText) -> Self {
        Arc::unwrap_or_clone(text.0)
    }
}
