//! Collects the messages of the open chunk, and hands full chunks to a thread that compresses and writes them.

use std::collections::VecDeque;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use diagnostics::Error;

use super::file::McapFile;
use super::tail::TailFile;

/// A message closes its chunk at this size [B]. Chunks thus stay below 256 KiB, which bounds the memory of a reader.
const CHUNK: usize = 240 << 10;
/// A row closes its chunk at this size [B] after so much simulated time [s]: what is damaged later is little, and of a slow run the
/// file itself has nearly everything.
const SMALL_CHUNK: usize = 16 << 10;
const SPAN: f64 = 0.5;
/// What a killed program loses at most [s], of simulated time.
const LOST: f64 = 1.0;
/// By the clock the open chunk is saved as often: what a killed run loses was made within a second.
const SAVE: Duration = Duration::from_millis(400);
/// As many bytes of full chunks wake the thread up: that costs as much as to compress some of them. By the clock it looks for them, too.
const WAKE: usize = 32 << 10;
/// As many bytes of full chunks that wait for the thread make the run wait, which bounds the memory.
const WAITING: usize = 1 << 20;

/// The messages of a chunk, as records.
struct MessageChunk {
    /// The thread reads them while a tail may still get them, too.
    messages: Arc<Vec<u8>>,
    count: u64,
    /// The times of the last whole rows before it and in it [s].
    from: f64,
    last: f64,
    /// What of it is in a tail: as many bytes, and as many messages.
    saved: (usize, u64),
}

/// What the sink and the thread tell each other.
struct ChunkQueue {
    open: MessageChunk,
    /// Full chunks that are not yet in the file, and their size [B].
    full: VecDeque<MessageChunk>,
    waiting: usize,
    /// The memory of a written chunk.
    spare: Arc<Vec<u8>>,
    /// That in use first. The first chunk takes the other one, which is named `tail`.
    tails: [TailFile; 2],
    /// Messages in the file.
    written: u64,
    /// A killed program leaves all rows up to this time behind [s].
    saved: f64,
    /// Why the thread has ended before it was asked to.
    failed: Option<String>,
    closed: bool,
}

impl ChunkQueue {
    fn new(recording: &Path) -> Self {
        let (messages, never) = (Arc::default(), f64::NEG_INFINITY);
        ChunkQueue {
            open: MessageChunk { messages, count: 0, from: never, last: never, saved: (0, 0) },
            full: VecDeque::new(),
            waiting: 0,
            spare: Arc::default(),
            tails: TailFile::pair_beside(recording),
            written: 0,
            saved: never,
            failed: None,
            closed: false,
        }
    }

    /// Adds to a tail what is neither there nor in the file.
    fn save_to_tail_file(&mut self) -> Result<(), Error> {
        let ChunkQueue { open, full, tails, written, .. } = self;
        let mut before = *written;
        for chunk in full.iter_mut().chain([open]) {
            let (bytes, known) = chunk.saved;
            if known < chunk.count {
                if known == 0 && tails[1].through <= *written {
                    // The other one has the chunk before, which the thread may be at.
                    tails.swap(0, 1);
                    tails[0].restart();
                }
                tails[0].append_messages(before + known, &chunk.messages[bytes..], chunk.count - known)?;
                chunk.saved = (chunk.messages.len(), chunk.count);
            }
            before += chunk.count;
        }
        self.saved = self.open.last;
        Ok(())
    }

    /// Closes the open chunk.
    fn close_open_chunk(&mut self) {
        let (messages, last) = (std::mem::take(&mut self.spare), self.open.last);
        let next = MessageChunk { messages, count: 0, from: last, last, saved: (0, 0) };
        let full = std::mem::replace(&mut self.open, next);
        self.waiting += full.messages.len();
        self.full.push_back(full);
    }

    /// The first full chunk is in the file now.
    fn remove_written_chunk(&mut self) {
        let Some(mut chunk) = self.full.pop_front() else { return };
        self.waiting -= chunk.messages.len();
        self.written += chunk.count;
        self.saved = self.saved.max(chunk.last);
        if let Some(messages) = Arc::get_mut(&mut chunk.messages) {
            messages.clear();
            self.spare = chunk.messages;
        }
    }
}

struct SharedChunkQueue {
    path: PathBuf,
    desk: Mutex<ChunkQueue>,
    /// The thread and the sink write it in turn.
    file: Mutex<McapFile>,
    /// For the thread: there is a chunk, or the end.
    work: Condvar,
    /// For the sink: a chunk is written.
    room: Condvar,
}

impl SharedChunkQueue {
    /// A panic of the thread is told by [`ChunkQueue::failed`].
    fn lock_queue(&self) -> MutexGuard<'_, ChunkQueue> {
        self.desk.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Waits for the thread.
    fn wait_while<'a>(
        &self,
        desk: MutexGuard<'a, ChunkQueue>,
        goes_on: impl Fn(&ChunkQueue) -> bool,
    ) -> Result<MutexGuard<'a, ChunkQueue>, Error> {
        let waited = self.room.wait_while(desk, |desk| desk.failed.is_none() && goes_on(desk));
        let desk = waited.unwrap_or_else(PoisonError::into_inner);
        match &desk.failed {
            Some(why) => Err(Error::output_failure(&self.path, why)),
            None => Ok(desk),
        }
    }

    /// Writes a chunk.
    fn write_chunk(&self, messages: &[u8]) -> io::Result<()> {
        let mut file = self.file.lock().unwrap_or_else(PoisonError::into_inner);
        file.write_messages(messages)
    }
}

/// The chunks of a recording, written on a thread of its own, which begins with the first message.
pub(super) struct ChunkWriter {
    shared: Arc<SharedChunkQueue>,
    thread: Option<JoinHandle<()>>,
}

impl ChunkWriter {
    pub fn new(path: &Path, file: McapFile) -> Self {
        let shared = SharedChunkQueue {
            path: path.to_owned(),
            desk: Mutex::new(ChunkQueue::new(path)),
            file: Mutex::new(file),
            work: Condvar::new(),
            room: Condvar::new(),
        };
        ChunkWriter { shared: Arc::new(shared), thread: None }
    }

    /// The open chunk, to add messages to. Waits while the thread falls behind, which bounds the memory.
    ///
    /// # Errors
    /// When an earlier chunk could not be written.
    pub fn open_chunk(&mut self) -> Result<OpenChunk<'_>, Error> {
        if self.thread.is_none() {
            let shared = Arc::clone(&self.shared);
            self.thread = Some(std::thread::spawn(move || run_writer_thread(&shared)));
        }
        let desk = self.shared.wait_while(self.shared.lock_queue(), |desk| desk.waiting >= WAITING)?;
        Ok(OpenChunk { shared: &self.shared, desk })
    }

    /// Closes the open chunk, and then writes to the file what is no message.
    ///
    /// # Errors
    /// When the file cannot be written, now or before.
    pub fn close_chunk_and_write<T>(
        &mut self,
        write: impl FnOnce(&mut McapFile) -> io::Result<T>,
    ) -> Result<T, Error> {
        if self.thread.is_some() {
            let mut open = self.open_chunk()?;
            if open.desk.open.count > 0 {
                open.close_and_wake_writer();
            }
            let OpenChunk { shared, desk } = open;
            shared.work.notify_one();
            drop(shared.wait_while(desk, |desk| !desk.full.is_empty())?);
        }
        let mut file = self.shared.file.lock().unwrap_or_else(PoisonError::into_inner);
        write(&mut file).map_err(|error| Error::output_failure(&self.shared.path, error))
    }

    /// Removes the files that a complete recording does not need.
    pub fn remove_tails(&self) {
        self.shared.lock_queue().tails.iter().for_each(TailFile::remove_file);
    }
}

impl Drop for ChunkWriter {
    fn drop(&mut self) {
        self.shared.lock_queue().closed = true;
        self.shared.work.notify_one();
        if let Some(thread) = self.thread.take() {
            // Its panic was told as an error of the recording.
            let _ = thread.join();
        }
    }
}

/// The open chunk, while messages are added.
pub(super) struct OpenChunk<'a> {
    shared: &'a SharedChunkQueue,
    desk: MutexGuard<'a, ChunkQueue>,
}

impl OpenChunk<'_> {
    /// Adds a message, which `append` appends as a record.
    pub fn append_message(&mut self, append: impl FnOnce(&mut Vec<u8>)) {
        if self.desk.open.messages.len() > CHUNK {
            self.close_and_wake_writer();
        }
        let open = &mut self.desk.open;
        append(Arc::make_mut(&mut open.messages));
        open.count += 1;
    }

    fn close_and_wake_writer(&mut self) {
        let before = self.desk.waiting;
        self.desk.close_open_chunk();
        // A thread that is at work looks for more by itself.
        if before < WAKE && self.desk.waiting >= WAKE {
            self.shared.work.notify_one();
        }
    }

    /// Ends the row of this time [s]. Closes the chunk if it is large enough, or saves it if a killed program lost too much
    /// otherwise.
    ///
    /// # Errors
    /// When it cannot be saved.
    pub fn end_row(mut self, time: f64) -> Result<(), Error> {
        let open = &mut self.desk.open;
        let before = std::mem::replace(&mut open.last, time);
        // The first row shows that there is a run at all.
        let step = if before.is_finite() { time - before } else { 0.0 };
        // Half a step beside the edge, where rounding would decide.
        if open.messages.len() >= SMALL_CHUNK && time + 0.5 * step >= open.from + SPAN {
            self.close_and_wake_writer();
        }
        match time + step - self.desk.saved > LOST {
            true => self.save_to_tail_file(),
            false => Ok(()),
        }
    }

    /// Saves the open chunk, so that a killed program leaves it behind.
    ///
    /// # Errors
    /// When that fails.
    pub fn save_to_tail_file(mut self) -> Result<(), Error> {
        self.desk.save_to_tail_file()
    }
}

/// Tells the sink that the thread is gone, for whatever reason.
struct WriterExitGuard<'a>(&'a SharedChunkQueue, Option<String>);

impl Drop for WriterExitGuard<'_> {
    fn drop(&mut self) {
        self.0.lock_queue().failed = self.1.take();
        self.0.room.notify_one();
    }
}

/// Writes chunks until the recording is closed.
fn run_writer_thread(shared: &SharedChunkQueue) {
    let mut ends = WriterExitGuard(shared, Some("the thread that writes it has ended".to_owned()));
    ends.1 = write_chunks(shared).err();
}

/// The message of the system: the error gets the name of the recording later.
fn output_error_message(error: Error) -> String {
    match error {
        Error::Output { what, .. } => what,
        error => error.to_string(),
    }
}

/// # Errors
/// Why the file cannot be written.
fn write_chunks(shared: &SharedChunkQueue) -> Result<(), String> {
    let mut next_save = Instant::now() + SAVE;
    let mut desk = shared.lock_queue();
    loop {
        let waits = |desk: &mut ChunkQueue| desk.full.is_empty() && !desk.closed;
        let patience = next_save.saturating_duration_since(Instant::now());
        let waited = shared.work.wait_timeout_while(desk, patience, waits);
        desk = waited.unwrap_or_else(PoisonError::into_inner).0;
        if let Some(chunk) = desk.full.front() {
            let messages = Arc::clone(&chunk.messages);
            drop(desk);
            shared.write_chunk(&messages).map_err(|error| error.to_string())?;
            drop(messages);
            desk = shared.lock_queue();
            desk.remove_written_chunk();
            shared.room.notify_one();
        } else if desk.closed {
            return Ok(());
        }
        if Instant::now() >= next_save {
            desk.save_to_tail_file().map_err(output_error_message)?;
            next_save = Instant::now() + SAVE;
        }
    }
}
