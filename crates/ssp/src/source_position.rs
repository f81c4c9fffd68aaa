//! Defines a position in a file, for messages: line, column, byte.

use std::fmt;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// The text of a file, and the name that users know it by.
pub(crate) struct SourceText {
    /// For a file of an archive: the path of the archive and the path inside of it.
    pub(crate) path: PathBuf,
    pub(crate) text: String,
}

/// A place in a file. Files of an archive are named by the path of the archive and the path inside of it.
#[derive(Clone)]
pub struct SourcePosition {
    text: Arc<SourceText>,
    offset: usize,
}

impl SourcePosition {
    pub(crate) fn new(text: &Arc<SourceText>, offset: usize) -> Self {
        let text = Arc::clone(text);
        let mut offset = offset.min(text.text.len());
        while !text.text.is_char_boundary(offset) {
            offset -= 1;
        }
        SourcePosition { text, offset }
    }

    /// The place of a line and a column, both counted from 1.
    pub(crate) fn from_line_and_column(text: &Arc<SourceText>, line: usize, column: usize) -> Self {
        let start: usize = text.text.split_inclusive('\n').take(line.saturating_sub(1)).map(str::len).sum();
        let rest = text.text.get(start..).unwrap_or_default();
        let within: usize = rest.chars().take(column.saturating_sub(1)).map(char::len_utf8).sum();
        SourcePosition::new(text, start + within)
    }

    /// The file.
    #[must_use]
    pub fn file_path(&self) -> &Path {
        &self.text.path
    }

    /// The line, counted from 1.
    #[must_use]
    pub fn line(&self) -> usize {
        self.text_before().matches('\n').count() + 1
    }

    /// The character of the line, counted from 1.
    #[must_use]
    pub fn column(&self) -> usize {
        let before = self.text_before();
        let line = before.rfind('\n').map_or(0, |end| end + 1);
        before[line..].chars().count() + 1
    }

    /// The byte of the file.
    pub(crate) fn byte_offset(&self) -> usize {
        self.offset
    }

    /// Whether both are the same place of the same file that was read once.
    pub(crate) fn is_same_place(&self, other: &SourcePosition) -> bool {
        Arc::ptr_eq(&self.text, &other.text) && self.offset == other.offset
    }

    fn text_before(&self) -> &str {
        &self.text.text[..self.offset]
    }
}

impl fmt::Display for SourcePosition {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}:{}:{}", self.file_path().display(), self.line(), self.column())
    }
}

impl fmt::Debug for SourcePosition {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Display::fmt(self, f)
    }
}
