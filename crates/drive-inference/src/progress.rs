//! Runs long work beside the thread that is told of its progress, and that may call it off at any time.

use std::panic::resume_unwind;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{RecvTimeoutError, Sender, channel};
use std::thread;
use std::time::Duration;

use crate::error::Error;

/// Longest time between two questions whether to go on.
const PATIENCE: Duration = Duration::from_millis(100);

/// Whether work has been called off: a flag that all who work on it share.
#[derive(Clone, Debug, Default)]
pub struct Cancel(Arc<AtomicBool>);

impl Cancel {
    /// Whether it has.
    #[inline]
    pub fn is_cancelled(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }
}

/// Where work tells how far it is.
#[derive(Clone, Debug)]
pub struct Board {
    stages: Sender<(f64, &'static str)>,
    /// For loops that cannot tell anything.
    pub cancel: Cancel,
}

impl Board {
    /// Tells the share that is done, and what comes next.
    ///
    /// # Errors
    ///
    /// [`Error::Cancelled`] if the work has been called off.
    pub fn tell(&self, share: f64, what: &'static str) -> Result<(), Error> {
        // Nobody listens any more once the work has been called off.
        let _ = self.stages.send((share, what));
        if self.cancel.is_cancelled() { Err(Error::Cancelled) } else { Ok(()) }
    }
}

/// Does work on a thread of its own, while this one tells `progress` of each stage, and asks it again and again during long
/// ones. Once it says `false`, the result does not count.
///
/// # Errors
///
/// Those of the work, and [`Error::Cancelled`].
pub fn watched<T: Send>(
    progress: &mut dyn FnMut(f64, &str) -> bool,
    work: impl FnOnce(&Board) -> Result<T, Error> + Send,
) -> Result<T, Error> {
    let (stages, told) = channel();
    let cancel = Cancel::default();
    let board = Board { stages, cancel: cancel.clone() };
    thread::scope(|scope| {
        // The channel closes with the board, when the work ends.
        let worker = scope.spawn(move || work(&board));
        let mut stage = None;
        loop {
            match told.recv_timeout(PATIENCE) {
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
        let mut told = Vec::new();
        let mut progress = |share: f64, what: &str| {
            if told.last() != Some(&(share, what.to_owned())) {
                told.push((share, what.to_owned()));
            }
            true
        };
        let sum = watched(&mut progress, |board| {
            board.tell(0.0, "one")?;
            board.tell(0.5, "two")?;
            Ok(1 + 2)
        });
        assert_eq!(sum, Ok(3));
        assert_eq!(told, [(0.0, "one".to_owned()), (0.5, "two".to_owned())]);
    }

    #[test]
    fn work_that_never_ends_can_be_called_off() {
        let mut asked = 0;
        let mut progress = |_: f64, _: &str| {
            asked += 1;
            asked < 3
        };
        let never: Result<(), _> = watched(&mut progress, |board| {
            board.tell(0.0, "a stage without end")?;
            loop {
                board.tell(0.0, "a stage without end")?;
                thread::sleep(Duration::from_millis(1));
            }
        });
        assert_eq!((never, asked), (Err(Error::Cancelled), 3));
    }
}
