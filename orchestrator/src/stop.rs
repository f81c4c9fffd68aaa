//! The stop condition of a run: a signal that ends the program, or its time limit.

use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::sync::{Arc, OnceLock};
use std::time::{Duration, Instant};

use diagnostics::{Error, print_to_stderr};

/// The exit code of a run in which foreign code failed.
const FOREIGN_FAILED: u8 = 3;
/// A call of foreign code that goes on this long after the limit does not return.
pub(crate) const GRACE: Duration = Duration::from_secs(5);

/// Whether a run has to end, by a signal or its time limit.
pub(crate) struct StopCondition {
    begin: Instant,
    limit: Option<Duration>,
    /// Ends the thread that watches the limit when it is dropped.
    _watch: Option<Sender<()>>,
}

impl StopCondition {
    /// Notes signals from here on, and the time that the run takes.
    pub fn new(limit: Option<Duration>) -> Self {
        fmu_import::catch_termination_signals();
        StopCondition { begin: Instant::now(), limit, _watch: limit.and_then(watch_for_hanging_calls) }
            .cancelling_wine_calls()
    }

    /// The time limit alone: signals are for the process that started this one.
    pub fn with_time_limit_only(limit: Duration) -> Self {
        StopCondition { begin: Instant::now(), limit: Some(limit), _watch: watch_for_hanging_calls(limit) }
            .cancelling_wine_calls()
    }

    /// Calls of FMUs under Wine are given up before the program would be ended for them.
    fn cancelling_wine_calls(self) -> Self {
        fmu_import::cancel_wine_calls_when(self.call_overdue_after(GRACE / 2));
        self
    }

    /// True when a call of foreign code is to be given up: some time after the run has to end.
    pub fn overdue_call_condition(&self) -> Arc<dyn Fn() -> bool + Send + Sync> {
        self.call_overdue_after(GRACE)
    }

    fn call_overdue_after(&self, grace: Duration) -> Arc<dyn Fn() -> bool + Send + Sync> {
        let (begin, limit, asked) = (self.begin, self.limit, OnceLock::new());
        Arc::new(move || {
            let overdue = limit.is_some_and(|limit| begin.elapsed() > limit.saturating_add(grace));
            let asked = fmu_import::termination_signal().map(|_| asked.get_or_init(Instant::now));
            overdue || asked.is_some_and(|since| since.elapsed() > grace)
        })
    }

    /// The error of a run that has to end, if it does; or else this one.
    pub fn stop_error_or(&self, error: Error) -> Error {
        match self.check_may_continue() {
            Ok(()) => error,
            // It says so itself.
            Err(Error::Overdue(_)) if matches!(error, Error::Overdue(_)) => error,
            Err(Error::Overdue(limit)) => Error::Overdue(format!("{error}; {limit}")),
            Err(end) => end,
        }
    }

    /// Whether the run goes on.
    ///
    /// # Errors
    /// When it has to end.
    pub fn check_may_continue(&self) -> Result<(), Error> {
        if let Some(signal) = fmu_import::termination_signal() {
            return Err(Error::Interrupted(signal));
        }
        match self.limit.filter(|limit| self.begin.elapsed() > *limit) {
            Some(limit) => Err(Error::Overdue(time_limit_message(limit))),
            None => Ok(()),
        }
    }
}

fn time_limit_message(limit: Duration) -> String {
    format!("the run was not over after {} s, its time limit", limit.as_secs_f64())
}

/// Ends the program if, after the limit, a call of foreign code does not return. A thread does that until the result is dropped.
fn watch_for_hanging_calls(limit: Duration) -> Option<Sender<()>> {
    let (sender, dropped) = channel();
    let thread = std::thread::Builder::new().name("limit".to_owned());
    let spawned = thread.spawn(move || exit_on_hanging_call(limit, &dropped));
    // Without the thread the limit is looked at between two calls only.
    spawned.is_ok().then_some(sender)
}

fn exit_on_hanging_call(limit: Duration, dropped: &Receiver<()>) {
    let lasts = |time| dropped.recv_timeout(time) == Err(RecvTimeoutError::Timeout);
    if !lasts(limit) {
        return;
    }
    let mut before = fmu_import::active_calls();
    while lasts(GRACE) {
        let now = fmu_import::active_calls();
        if let Some((_, call)) = now.iter().find(|call| before.contains(call)) {
            print_to_stderr(&format!("\n{call} did not return; {}", time_limit_message(limit)));
            let completed = fmu_import::final_exit_code();
            if completed.is_some() {
                print_to_stderr("warning: its results are complete, and its verdict stands");
            }
            fmu_import::exit_without_destructors(completed.unwrap_or(FOREIGN_FAILED));
        }
        before = now;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_run_over_its_limit_says_so_once() {
        let stop = StopCondition::with_time_limit_only(Duration::ZERO);
        std::thread::sleep(Duration::from_millis(1));
        let overdue = stop.check_may_continue().expect_err("it is over");
        assert_eq!(stop.stop_error_or(overdue).to_string(), time_limit_message(Duration::ZERO));
        let failed = stop.stop_error_or(Error::invalid_input("a node failed"));
        assert!(failed.to_string().starts_with("a node failed; the run was not over"), "{failed}");
    }
}
