//! The stop condition of a run: a signal that ends the program, or its time limit.

use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError};
use std::time::{Duration, Instant};

use diagnostics::{Error, print_to_stderr};

/// The exit code of a run in which foreign code failed.
const FOREIGN_FAILED: u8 = 3;
/// A call of foreign code that goes on this long after the limit does not return.
pub(crate) const GRACE: Duration = Duration::from_secs(5);

/// So often a thread looks whether a signal came.
const LOOK: Duration = Duration::from_millis(100);

/// Whether a run has to end, by a signal or its time limit.
pub(crate) struct StopCondition {
    begin: Instant,
    limit: Option<Duration>,
    hang_reports: HangReports,
    /// Ends the thread that watches the limit when it is dropped.
    _watch: Option<Sender<()>>,
}

/// Writes the report of a run that did not come back from a call of foreign code, with this error.
type HangReport = Box<dyn Fn(&Error) + Send>;

/// Those of the runs that go on, a validation behind the run that it validates.
#[derive(Clone, Default)]
struct HangReports(Arc<Mutex<Vec<HangReport>>>);

impl HangReports {
    fn lock(&self) -> MutexGuard<'_, Vec<HangReport>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Takes a report away again when it is dropped: the run writes it itself.
pub(crate) struct HangReportGuard(HangReports);

impl Drop for HangReportGuard {
    fn drop(&mut self) {
        self.0.lock().pop();
    }
}

impl StopCondition {
    /// Notes signals from here on, and the time that the run takes.
    pub fn new(limit: Option<Duration>) -> Self {
        fmu_import::catch_termination_signals();
        Self::watching(limit)
    }

    /// The time limit alone: signals are for the process that started this one.
    pub fn with_time_limit_only(limit: Duration) -> Self {
        Self::watching(Some(limit))
    }

    /// Calls of FMUs under Wine are given up before the program would be ended for them.
    fn watching(limit: Option<Duration>) -> Self {
        let hang_reports = HangReports::default();
        let watch = limit.and_then(|limit| watch_for_hanging_calls(limit, hang_reports.clone()));
        let stop = StopCondition { begin: Instant::now(), limit, hang_reports, _watch: watch };
        fmu_import::cancel_wine_calls_when(stop.call_overdue_after(GRACE / 2));
        stop
    }

    /// Has this report written when a call does not return and the program is ended for it, until the result is dropped.
    pub fn report_hang_by(&self, report: HangReport) -> HangReportGuard {
        self.hang_reports.lock().push(report);
        HangReportGuard(self.hang_reports.clone())
    }

    /// Ends the program a moment after a signal, until the result is dropped: what is read then may be endless, and nothing is
    /// written yet.
    pub fn watch_while_loading(&self) -> Option<Sender<()>> {
        let (sender, dropped) = channel();
        let thread = std::thread::Builder::new().name("loading".to_owned());
        // Without the thread a second signal ends the program.
        thread.spawn(move || exit_on_signal(&dropped)).is_ok().then_some(sender)
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
fn watch_for_hanging_calls(limit: Duration, reports: HangReports) -> Option<Sender<()>> {
    let (sender, dropped) = channel();
    let thread = std::thread::Builder::new().name("limit".to_owned());
    let spawned = thread.spawn(move || exit_on_hanging_call(limit, &dropped, &reports));
    // Without the thread the limit is looked at between two calls only.
    spawned.is_ok().then_some(sender)
}

fn exit_on_signal(dropped: &Receiver<()>) {
    while dropped.recv_timeout(LOOK) == Err(RecvTimeoutError::Timeout) {
        if let Some(signal) = fmu_import::termination_signal() {
            let error = Error::Interrupted(signal);
            print_to_stderr(&format!("{error}, while it loaded its files"));
            fmu_import::exit_without_destructors(error.exit_code());
        }
    }
}

fn exit_on_hanging_call(limit: Duration, dropped: &Receiver<()>, reports: &HangReports) {
    let lasts = |time| dropped.recv_timeout(time) == Err(RecvTimeoutError::Timeout);
    if !lasts(limit) {
        return;
    }
    let mut before = fmu_import::active_calls();
    while lasts(GRACE) {
        let now = fmu_import::active_calls();
        if let Some((_, call)) = now.iter().find(|call| before.contains(call)) {
            let error = Error::Overdue(format!("{call} did not return; {}", time_limit_message(limit)));
            print_to_stderr(&format!("\n{error}"));
            let completed = fmu_import::final_exit_code();
            match completed {
                Some(_) => print_to_stderr("warning: its results are complete, and its verdict stands"),
                None => reports.lock().iter().rev().for_each(|write| write(&error)),
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
