//! Keeps a copy of the messages that are not yet in a closed chunk, in a small file beside the recording: what a killed run had made.

use std::fs::File;
use std::os::unix::fs::FileExt as _;
use std::path::{Path, PathBuf};

use diagnostics::Error;

use crate::records::tail;

/// A file that is written from its start again once all of its messages are in closed chunks.
pub(super) struct TailFile {
    path: PathBuf,
    file: Option<File>,
    /// The last piece that was written; kept for its memory.
    piece: Vec<u8>,
    /// Where the next piece goes [B].
    end: u64,
    /// The number of the message behind its last one.
    pub through: u64,
}

impl TailFile {
    /// The files beside this recording, neither of which exists yet: two, as one always has messages that are needed.
    pub fn pair_beside(recording: &Path) -> [Self; 2] {
        tail::tail_paths(recording).map(|path| {
            let tail = TailFile { path, file: None, piece: Vec::new(), end: 0, through: 0 };
            tail.remove_file();
            tail
        })
    }

    /// Begins at the start of the file. It is written over, in memory that the system has already: a reader tells by the numbers of
    /// messages what is old.
    pub fn restart(&mut self) {
        self.end = 0;
    }

    /// Adds `count` messages that follow `before` others.
    ///
    /// # Errors
    /// When the file cannot be written.
    pub fn append_messages(&mut self, before: u64, messages: &[u8], count: u64) -> Result<(), Error> {
        self.piece.clear();
        tail::append_tail_piece(before, messages, &mut self.piece);
        let file = match &mut self.file {
            Some(file) => Ok(file),
            none => File::create(&self.path).map(|file| none.insert(file)),
        };
        let written = file.and_then(|file| file.write_all_at(&self.piece, self.end));
        written.map_err(|error| Error::output_failure(&self.path, error))?;
        self.end += self.piece.len() as u64;
        self.through = before + count;
        Ok(())
    }

    /// Removes the file, which a complete recording does not need.
    pub fn remove_file(&self) {
        let _ = std::fs::remove_file(&self.path);
    }
}
