//! Flushes a stream: to a viewer on a thread of its own, so that a slow, stuck or lost viewer does not delay the run.

use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::time::Duration;

use re_sdk::RecordingStream;

/// A thread that flushes the stream on request.
pub(super) struct FlushWorker {
    /// Requests to flush all data so far.
    requests: Sender<()>,
    /// The outcome of each request; closed with the connection.
    answers: Receiver<Result<(), String>>,
    /// Requests without an answer.
    pending: usize,
}

impl FlushWorker {
    /// Starts the thread.
    pub fn new(stream: RecordingStream) -> Self {
        let (requests, asked) = channel();
        let (answer, answers) = channel();
        std::thread::spawn(move || {
            while asked.recv().is_ok() {
                // Ends when the viewer goes away.
                if answer.send(flush_stream(&stream, Duration::MAX)).is_err() {
                    break;
                }
            }
            // Closing the connection waits for the viewer, too. The closed channel reports its end.
            drop(stream);
            drop(answer);
        });
        Self { requests, answers, pending: 0 }
    }

    /// Requests a flush of all data so far.
    pub fn request_flush(&mut self) {
        self.pending += usize::from(self.requests.send(()).is_ok());
    }

    /// Whether all data has been accepted; waits up to `patience` for each request.
    ///
    /// # Errors
    /// When the viewer is gone.
    pub fn is_flushed_within(&mut self, patience: Duration) -> Result<bool, String> {
        while self.pending > 0 {
            match self.answers.recv_timeout(patience) {
                Ok(answer) => answer?,
                Err(RecvTimeoutError::Timeout) => return Ok(false),
                Err(RecvTimeoutError::Disconnected) => return Err("it was closed".to_owned()),
            }
            self.pending -= 1;
        }
        Ok(true)
    }

    /// Closes the connection, if this holds the last stream. Returns whether that took less than `patience`.
    pub fn close(self, patience: Duration) -> bool {
        drop(self.requests);
        loop {
            match self.answers.recv_timeout(patience) {
                Ok(_) => {}
                Err(end) => return end == RecvTimeoutError::Disconnected,
            }
        }
    }
}

/// Waits until all data is written or handed over.
pub(super) fn flush_stream(stream: &RecordingStream, patience: Duration) -> Result<(), String> {
    let accepted = stream.flush_with_timeout(patience);
    accepted.map_err(|it| format!("it takes no more data (disk full, or connection lost?): {it}"))
}
