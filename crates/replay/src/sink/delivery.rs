//! Hands a recording over: to a disk, which is waited for, or to a viewer, which must not hold up the run.

use std::path::PathBuf;
use std::time::Duration;

use diagnostics::Error;
use re_sdk::{RecordingStream, RecordingStreamBuilder};
use recording::Notice;

use super::courier::Courier;
use super::target::{CONNECT_PATIENCE, Target, open};

/// How long the disk may take to accept a batch.
const PATIENCE: Duration = Duration::from_secs(10);
/// How long a viewer may take to accept the last batch, and what analyses add, when the run is over.
const FAREWELL: Duration = Duration::from_secs(3);

/// The way of a recording to its file or its viewer.
pub(super) struct Delivery {
    /// `None` once nothing more can or shall be written.
    stream: Option<RecordingStream>,
    /// What errors call the recording.
    place: PathBuf,
    live: bool,
    /// Waits for a viewer.
    courier: Option<Courier>,
    /// How long to wait for a viewer now that the run is over; one that was waited for in vain is not waited for again.
    farewell: Duration,
    /// Viewers ask for the recording, and can do so as long as the stream is kept.
    serves: bool,
    url: Option<String>,
    warning: Option<String>,
}

impl Delivery {
    /// Opens the file, the connection or the server.
    ///
    /// # Errors
    /// When the file cannot be made or no viewer listens at the address.
    pub fn open(builder: RecordingStreamBuilder, target: &Target) -> Result<Self, Error> {
        let (place, live) = (target.place(), target.is_live());
        let failed = |what: String| Error::output(&place, what);
        let (stream, url) = open(builder, target).map_err(failed)?;
        if !stream.is_enabled() {
            return Err(failed("the environment variable RERUN switches it off".into()));
        }
        stream.set_log_time_enabled(false);
        let (stream, courier, farewell, warning) = (Some(stream), None, FAREWELL, None);
        let serves = url.is_some();
        Ok(Self { stream, place, live, courier, farewell, serves, url, warning })
    }

    /// Where to send, unless nothing more can be sent.
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
    pub fn notices(&mut self) -> Vec<Notice> {
        let url = self.url.take().map(Notice::Serving);
        url.into_iter().chain(self.warning.take().map(Notice::Warning)).collect()
    }

    /// Waits until the beginning has arrived: only then somebody is there.
    pub fn begun(&mut self, sent: Result<(), String>) -> Result<(), Error> {
        let Some(stream) = &self.stream else {
            return Ok(());
        };
        let result = sent.and_then(|()| settle(stream, CONNECT_PATIENCE));
        match result {
            Ok(()) if self.live => self.courier = Some(Courier::new(stream.clone())),
            Ok(()) => {}
            Err(_) => self.abandon(),
        }
        result.map_err(|what| Error::output(&self.place, what))
    }

    /// Whether all that was sent before has arrived, so that more can be sent: so errors are noticed and the memory stays
    /// bounded. Writing to a disk overlaps with computing, and is waited for; a viewer is not.
    pub fn accepts(&mut self) -> Result<bool, String> {
        self.wait(Duration::ZERO)
    }

    /// The same when the run is over, with a moment for a viewer.
    pub fn accepts_at_last(&mut self) -> Result<bool, String> {
        let accepts = self.wait(self.farewell)?;
        self.farewell = if accepts { FAREWELL } else { Duration::ZERO };
        Ok(accepts)
    }

    fn wait(&mut self, for_viewer: Duration) -> Result<bool, String> {
        match (&mut self.courier, &self.stream) {
            (Some(courier), _) => courier.accepted(for_viewer),
            (None, Some(stream)) => settle(stream, PATIENCE).map(|()| true),
            (None, None) => Ok(false),
        }
    }

    /// Notes that something was sent.
    pub fn sent(&mut self) {
        if let Some(courier) = &mut self.courier {
            courier.sent();
        }
    }

    /// Closes the file or the connection. Viewers can connect to a server as long as this is kept.
    pub fn end(&mut self) -> Result<(), String> {
        let arrived = if self.live && !self.serves {
            self.stream = None;
            self.courier.take().is_none_or(|courier| courier.close(FAREWELL))
        } else {
            self.accepts_at_last()?
        };
        if !arrived {
            self.stuck();
        }
        if !self.live {
            // The last stream that goes writes the footer and closes the file.
            self.stream = None;
        }
        Ok(())
    }

    /// Gives up a viewer that takes nothing any more.
    pub fn stuck(&mut self) {
        self.warn("did not take the end of the run: it is stuck");
        self.abandon();
    }

    /// Tells what a viewer misses.
    pub fn warn(&mut self, what: &str) {
        let place = self.place.display();
        self.warning = Some(match self.warning.take() {
            None => format!("the viewer at {place} {what}"),
            Some(before) => format!("{before}; it {what}"),
        });
    }

    /// A viewer that is lost does not concern the run; a file that cannot be written does.
    pub fn judge(&mut self, result: Result<(), String>) -> Result<(), Error> {
        let Err(what) = result else {
            return Ok(());
        };
        self.abandon();
        if self.live {
            self.warn(&format!("was lost: {what}"));
            return Ok(());
        }
        Err(Error::output(&self.place, what))
    }

    /// Gives up the stream without waiting for it: dropping one whose reader is stuck blocks for ever.
    fn abandon(&mut self) {
        std::mem::forget(self.stream.take());
        self.courier = None;
    }
}

/// Waits until all that was sent is written or handed over.
pub(super) fn settle(stream: &RecordingStream, patience: Duration) -> Result<(), String> {
    let accepted = stream.flush_with_timeout(patience);
    accepted.map_err(|it| format!("it takes no more data (disk full, or connection lost?): {it}"))
}
