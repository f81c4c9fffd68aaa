//! Keeps a copy of the messages that are not yet in a closed chunk, in a small file beside the recording: a killed run that is slower
//! than real time has made them long ago.

use std::fs::File;
use std::io::Write as _;
use std::path::{Path, PathBuf};

use ::mcap::records::{MessageHeader, op};
use diagnostics::Error;

use crate::records::tail;

/// The messages of the open chunk.
pub(super) struct Tail {
    path: PathBuf,
    partial: PathBuf,
    /// As records.
    messages: Vec<u8>,
    count: u64,
    /// Messages in closed chunks.
    before: u64,
    /// As many of the messages are in the file.
    saved: u64,
}

impl Tail {
    /// The file beside this recording, which does not exist yet.
    pub fn beside(recording: &Path) -> Self {
        let path = tail::beside(recording);
        let partial = path.with_added_extension("partial");
        let tail = Tail { path, partial, messages: Vec::new(), count: 0, before: 0, saved: 0 };
        tail.remove();
        tail
    }

    /// The size of the messages [B].
    pub fn size(&self) -> usize {
        self.messages.len()
    }

    pub fn add(&mut self, header: &MessageHeader, data: &[u8]) {
        self.messages.push(op::MESSAGE);
        self.messages.extend_from_slice(&(22 + data.len() as u64).to_le_bytes());
        self.messages.extend_from_slice(&header.channel_id.to_le_bytes());
        self.messages.extend_from_slice(&header.sequence.to_le_bytes());
        self.messages.extend_from_slice(&header.log_time.to_le_bytes());
        self.messages.extend_from_slice(&header.publish_time.to_le_bytes());
        self.messages.extend_from_slice(data);
        self.count += 1;
    }

    /// The chunk is closed.
    pub fn clear(&mut self) {
        self.messages.clear();
        self.before += self.count;
        (self.count, self.saved) = (0, 0);
    }

    /// Writes the messages, if there are new ones. At every moment there is one whole file.
    ///
    /// # Errors
    /// When the file cannot be written.
    pub fn save(&mut self) -> Result<(), Error> {
        if self.saved == self.count {
            return Ok(());
        }
        let failed = |error| Error::output(&self.path, error);
        let record = tail::record(self.before, &self.messages);
        let written = File::create(&self.partial).and_then(|mut file| file.write_all(&record));
        written.map_err(failed)?;
        std::fs::rename(&self.partial, &self.path).map_err(failed)?;
        self.saved = self.count;
        Ok(())
    }

    /// Removes the file, which a complete recording does not need.
    pub fn remove(&self) {
        let _ = std::fs::remove_file(&self.path);
        let _ = std::fs::remove_file(&self.partial);
    }
}
