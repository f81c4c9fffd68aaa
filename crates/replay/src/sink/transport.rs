//! Transports a recording to a disk or a viewer. The run waits for the disk, and never for a viewer.

use std::path::PathBuf;
use std::time::Duration;

use diagnostics::Error;
use re_sdk::{RecordingStream, RecordingStreamBuilder};
use recording::SinkNotice;

use super::flush_worker::{FlushWorker, flush_stream};
use super::target::{CONNECT_PATIENCE, RecordingTarget, open_stream};

/// Time limit of a viewer for each batch after the end of the run.
const FAREWELL: Duration = Duration::from_secs(3);

/// The open file or connection of a recording.
pub(super) struct RecordingTransport {
    /// `None` once the recording is closed or given up.
    stream: Option<RecordingStream>,
    /// The name of the destination in messages.
    destination: PathBuf,
    live: bool,
    /// Waits for a viewer.
    flush_worker: Option<FlushWorker>,
    /// Time limit of a viewer after the end of the run; zero once it was exceeded.
    farewell: Duration,
    /// Viewers ask for the recording, and can do so as long as the stream is kept.
    serves: bool,
    url: Option<String>,
    warning: Option<String>,
}

impl RecordingTransport {
    /// Opens the file, the connection or the server.
    ///
    /// # Errors
    /// When the file cannot be made or no viewer listens at the address.
    pub fn open(builder: RecordingStreamBuilder, target: &RecordingTarget) -> Result<Self, Error> {
        let (destination, live) = (target.display_name(), target.is_live());
        let failed = |what: String| Error::output_failure(&destination, what);
        let (stream, url) = open_stream(builder, target).map_err(failed)?;
        if !stream.is_enabled() {
            return Err(failed("the environment variable RERUN switches it off".into()));
        }
        stream.set_log_time_enabled(false);
        let (stream, flush_worker, farewell, warning) = (Some(stream), None, FAREWELL, None);
        let serves = url.is_some();
        Ok(Self { stream, destination, live, flush_worker, farewell, serves, url, warning })
    }

    /// The stream, unless it is closed.
    pub fn stream(&self) -> Option<RecordingStream> {
        self.stream.clone()
    }

    pub fn is_open(&self) -> bool {
        self.stream.is_some()
    }

    pub fn is_live(&self) -> bool {
        self.live
    }

    /// The URL once, and the last warning once.
    pub fn notices(&mut self) -> Vec<SinkNotice> {
        let url = self.url.take().map(SinkNotice::Serving);
        url.into_iter().chain(self.warning.take().map(SinkNotice::Warning)).collect()
    }

    /// Waits until the beginning has arrived at a viewer: this proves the connection. What a disk refuses is told with the next
    /// batch, so a run does not wait for it.
    pub fn confirm_begin(&mut self, sent: Result<(), String>) -> Result<(), Error> {
        let Some(stream) = &self.stream else {
            return Ok(());
        };
        let arrives = || if self.live { flush_stream(stream, CONNECT_PATIENCE) } else { Ok(()) };
        let result = sent.and_then(|()| arrives());
        match result {
            Ok(()) if self.live => self.flush_worker = Some(FlushWorker::new(stream.clone())),
            Ok(()) => {}
            Err(_) => self.leak_stream(),
        }
        result.map_err(|what| Error::output_failure(&self.destination, what))
    }

    /// Whether everything so far has arrived. Checking this before each batch reveals errors and bounds the memory. It waits for a
    /// disk, whose writing overlaps with computing, and not for a viewer.
    pub fn is_everything_delivered(&mut self) -> Result<bool, String> {
        self.wait_for_delivery(Duration::ZERO)
    }

    /// The same after the end of the run, with some time for a viewer.
    pub fn is_delivered_at_end(&mut self) -> Result<bool, String> {
        let accepts = self.wait_for_delivery(self.farewell)?;
        self.farewell = if accepts { FAREWELL } else { Duration::ZERO };
        Ok(accepts)
    }

    fn wait_for_delivery(&mut self, for_viewer: Duration) -> Result<bool, String> {
        match (&mut self.flush_worker, &self.stream) {
            (Some(flush_worker), _) => flush_worker.is_flushed_within(for_viewer),
            // A disk is slow when the machine is busy; what it refuses is told at once.
            (None, Some(stream)) => flush_stream(stream, Duration::MAX).map(|()| true),
            (None, None) => Ok(false),
        }
    }

    /// Requests a confirmation of the data sent so far.
    pub fn request_confirmation(&mut self) {
        if let Some(flush_worker) = &mut self.flush_worker {
            flush_worker.request_flush();
        }
    }

    /// Closes the file or the connection. A server stays open as long as this value lives.
    pub fn close(&mut self) -> Result<(), String> {
        let arrived = if self.live && !self.serves {
            self.stream = None;
            self.flush_worker.take().is_none_or(|flush_worker| flush_worker.close(FAREWELL))
        } else {
            self.is_delivered_at_end()?
        };
        if !arrived {
            self.give_up_stuck_viewer();
        }
        if !self.live {
            // Dropping the last stream writes the footer and closes the file.
            self.stream = None;
        }
        Ok(())
    }

    /// Gives up a viewer that accepts no more data.
    pub fn give_up_stuck_viewer(&mut self) {
        self.add_viewer_warning("did not take the end of the run: it is stuck");
        self.leak_stream();
    }

    /// Adds to the warning about the viewer.
    pub fn add_viewer_warning(&mut self, what: &str) {
        let viewer = self.destination.display();
        self.warning = Some(match self.warning.take() {
            None => format!("the viewer at {viewer} {what}"),
            Some(before) => format!("{before}; it {what}"),
        });
    }

    /// A lost viewer is a warning; a file that cannot be written is an error.
    pub fn viewer_loss_to_warning(&mut self, result: Result<(), String>) -> Result<(), Error> {
        let Err(what) = result else {
            return Ok(());
        };
        self.leak_stream();
        if self.live {
            self.add_viewer_warning(&format!("was lost: {what}"));
            return Ok(());
        }
        Err(Error::output_failure(&self.destination, what))
    }

    /// Gives up the stream without dropping it: the drop would wait for a stuck viewer for ever.
    fn leak_stream(&mut self) {
        std::mem::forget(self.stream.take());
        self.flush_worker = None;
    }
}
