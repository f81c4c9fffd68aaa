//! Holds the text of a parameter: it is cloned with every state of the driver, and may be long.

use std::sync::Arc;

use serde::{Deserialize, Serialize};

/// A text that its clones share.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(from = "String", into = "String")]
pub struct Text(Arc<String>);

impl Text {
    /// The text.
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
    /// When the file cannot be read, by its name.
    pub fn loaded(&self, name: &str) -> Result<Text, String> {
        if self.get().is_empty() || self.get().contains('\n') {
            return Ok(self.clone());
        }
        let path = self.get();
        let text = std::fs::read_to_string(path).map_err(|error| {
            format!(
                "{name} has one line, so it is the path of a file: `{path}` cannot be read: {error}"
            )
        })?;
        Ok(Text::from(text))
    }
}

impl From<String> for Text {
    fn from(text: String) -> Self {
        Text(Arc::new(text))
    }
}

impl From<Text> for String {
    fn from(text: Text) -> Self {
        Arc::unwrap_or_clone(text.0)
    }
}
