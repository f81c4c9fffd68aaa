//! Runs long work on a thread of its own, with progress reports and cancellation.

use std::panic::resume_unwind;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{RecvTimeoutError, Sender, channel};
use std::thread;
use std::time::Duration;

use crate::error::Error;

/// Longest time between two questions whether to go on.
const PATIENCE: Duration = Duration::from_millis(100);

/// Whether work has been cancelled: a flag that all who work on it share.
#[derive(Clone, Debug, Default)]
pub struct CancellationFlag(Arc<AtomicBool>);

impl CancellationFlag {
    /// Whether it has been.
    #[inline]
    pub fn is_cancelled(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }
}

/// Takes progress reports.
#[derive(Clone, Debug)]
pub struct ProgressReporter {
    stages: Sender<(f64, &'static str)>,
    /// For loops that cannot report anything.
    pub cancel: CancellationFlag,
}

impl ProgressReporter {
    /// Reports the share done and the next stage.
    ///
    /// # Errors
    ///
    /// [`Error::Cancelled`] if the work has been cancelled.
    pub fn report_stage(&self, share: f64, what: &'static str) -> Result<(), Error> {
        // Nobody listens any more after a cancellation.
        let _ = self.stages.send((share, what));
        if self.cancel.is_cancelled() { Err(Error::Cancelled) } else { Ok(()) }
    }
}

/// Does work on a thread of its own; this one calls `progress` at each stage, and again and again during long ones. Once that returns
/// `false`, the result does not count.
///
/// # Errors
///
/// Those of the work, and [`Error::Cancelled`].
pub fn with_progress<T: Send>(
    progress: &mut dyn FnMut(f64, &str) -> bool,
    work: impl FnOnce(&ProgressReporter) -> Result<T, Error> + Send,
) -> Result<T, Error> {
    let (stages, reported) = channel();
    let cancel = CancellationFlag::default();
    let shared = ProgressReporter { stages, cancel: cancel.clone() };
    thread::scope(|scope| {
        // The channel closes with the sender, when the work ends.
        let worker = scope.spawn(move || work(&shared));
        let mut stage = None;
        loop {
            match reported.recv_timeout(PATIENCE) {
                Ok(next) => stage = Some(next),
                Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => break,
            }
            if let Some((share, what)) = stage
                && !cancel.is_cancelled()
                && !progress(share, what)
            {
                cancel.0.store(true, Ordering::Relaxed);
            }
        }
        let done = worker.join().unwrap_or_else(|panic| resume_unwind(panic));
        if cancel.is_cancelled() { Err(Error::Cancelled) } else { done }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stages_are_told_in_their_order() {
        let mut reported = Vec::new();
        let mut progress = |share: f64, what: &str| {
            if reported.last() != Some(&(share, what.to_owned())) {
                reported.push((share, what.to_owned()));
            }
            true
        };
        let sum = with_progress(&mut progress, |progress| {
            progress.report_stage(0.0, "one")?;
            progress.report_stage(0.5, "two")?;
            Ok(1 + 2)
        });
        assert_eq!(sum, Ok(3));
        assert_eq!(reported, [(0.0, "one".to_owned()), (0.5, "two".to_owned())]);
    }

    #[test]
    fn work_that_never_ends_can_be_called_off() {
        let mut asked = 0;
        let mut progress = |_: f64, _: &str| {
            asked += 1;
            asked < 3
        };
        let never: Result<(), _> = with_progress(&mut progress, |progress| {
            progress.report_stage(0.0, "a stage without end")?;
            loop {
                progress.report_stage(0.0, "a stage without end")?;
                thread::sleep(Duration::from_millis(1));
            }
        });
        assert_eq!((never, asked), (Err(Error::Cancelled), 3));
    }
}
