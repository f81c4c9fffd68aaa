//! Waits for a viewer in the place of the run, which must not be held up by one that is slow, stuck or gone.

use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::time::Duration;

use re_sdk::RecordingStream;

use super::delivery::settle;

/// Knows how much of what was sent has been accepted.
pub(super) struct Courier {
    /// Asks to wait for all that was sent so far.
    requests: Sender<()>,
    /// Tells that it was accepted, or why it will not be; closed when the connection is.
    answers: Receiver<Result<(), String>>,
    /// Requests that were not answered yet.
    pending: usize,
}

impl Courier {
    /// Begins to wait for what this stream sends.
    pub fn new(stream: RecordingStream) -> Self {
        let (requests, asked) = channel();
        let (tell, answers) = channel();
        std::thread::spawn(move || {
            while asked.recv().is_ok() {
                // Ends when the viewer goes away.
                if tell.send(settle(&stream, Duration::MAX)).is_err() {
                    break;
                }
            }
            // Closing the connection waits for the viewer too. Then the channel tells that it is closed.
            drop(stream);
            drop(tell);
        });
        Self { requests, answers, pending: 0 }
    }

    /// Notes that something was sent.
    pub fn sent(&mut self) {
        self.pending += usize::from(self.requests.send(()).is_ok());
    }

    /// Whether all that was sent has been accepted, after waiting for so long at most for each part of it.
    ///
    /// # Errors
    /// When the viewer is gone.
    pub fn accepted(&mut self, patience: Duration) -> Result<bool, String> {
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

    /// Closes the connection, when nobody else holds the stream, and tells whether that took no longer than this.
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
