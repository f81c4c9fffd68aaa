//! The host's side of a worker process that runs variants: it starts the process, and replaces it when it is lost.

use std::fs::File;
use std::io::{Read as _, Seek as _, SeekFrom};
use std::path::Path;
use std::process::{Command, Stdio};
use std::sync::atomic::AtomicBool;
use std::sync::atomic::Ordering::Relaxed;
use std::time::{Duration, Instant};

use diagnostics::Error;
use isolation::{ChannelPacket, IsolatedGuest, NoAnswerReason};
use scenario::resolve::Override;

use super::variant::{VariantFailure, VariantOutcome};
use super::worker::{WorkerRequest, WorkerResponse};
use crate::stop::GRACE;

/// The size of standard error of a worker at which it is emptied [bytes].
const STDERR_LIMIT: u64 = 1 << 20;
/// The part at its end that is read [bytes].
const TAIL: u64 = 16 << 10;

/// A worker that is lost before its first variant is started so often.
const STARTS: u32 = 3;

/// How many variants ended in which way.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct VariantCounts {
    /// All that are done.
    pub done: u64,
    /// In which all checks passed.
    pub passed: u64,
    /// That did not come to their end.
    pub failed_to_run: u64,
}

impl VariantCounts {
    /// With those of another one.
    #[must_use]
    pub fn sum_with(&self, other: &VariantCounts) -> VariantCounts {
        VariantCounts {
            done: self.done + other.done,
            passed: self.passed + other.passed,
            failed_to_run: self.failed_to_run + other.failed_to_run,
        }
    }

    /// Counts one more.
    pub fn count_outcome(&mut self, outcome: &VariantOutcome) {
        self.done += 1;
        self.passed += u64::from(outcome.has_passed());
        self.failed_to_run += u64::from(outcome.failure.is_some());
    }
}

/// How the run of a variant in a worker ended.
pub(super) enum WorkerOutcome {
    /// It ran, or failed twice.
    Done(Box<VariantOutcome>),
    /// The sweep has to end.
    Stopped,
}

/// A worker process, and what replaces it when it is lost.
pub(super) struct WorkerProcess<'a> {
    plan: &'a Path,
    program: &'a Path,
    process: Option<WorkerChildProcess>,
    talk: ChannelPacket,
    /// Whether instances of FMUs are used again, for whoever asks afterwards.
    pub reused: &'a AtomicBool,
}

struct WorkerChildProcess {
    guest: IsolatedGuest,
    /// Its standard error.
    stderr: File,
    /// What a variant may take.
    limit: Duration,
}

impl<'a> WorkerProcess<'a> {
    pub fn new(plan: &'a Path, program: &'a Path, reused: &'a AtomicBool) -> Self {
        WorkerProcess { plan, program, process: None, talk: ChannelPacket::default(), reused }
    }

    /// Runs a variant. When its process is lost, it runs once more in another one.
    ///
    /// # Errors
    /// When no process starts, or the plan cannot be opened.
    pub fn run_variant(&mut self, overrides: &[Override]) -> Result<WorkerOutcome, Error> {
        let mut lost = None;
        for _ in 0..2 {
            if end_requested() {
                return Ok(WorkerOutcome::Stopped);
            }
            match self.request_response(&WorkerRequest::Run(overrides.to_vec()))? {
                Ok(WorkerResponse::Ran(outcome, reused)) => {
                    self.reused.store(reused, Relaxed);
                    return Ok(WorkerOutcome::Done(outcome));
                }
                Ok(WorkerResponse::Opened(_)) => lost = Some(malformed_response()),
                Err(failure) => lost = Some(failure),
            }
            self.process = None;
        }
        match end_requested() {
            true => Ok(WorkerOutcome::Stopped),
            false => {
                let failure = Some(lost.unwrap_or_else(malformed_response));
                Ok(WorkerOutcome::Done(Box::new(VariantOutcome { failure, ..VariantOutcome::default() })))
            }
        }
    }

    /// The answer of the process, or how it was lost.
    fn request_response(
        &mut self,
        request: &WorkerRequest,
    ) -> Result<Result<WorkerResponse, VariantFailure>, Error> {
        if self.process.is_none() {
            self.process = Some(self.start_process()?);
        }
        let Some(process) = &mut self.process else { return Err(Error::already_reported()) };
        process.truncate_stderr();
        Ok(process.request_response(request, &mut self.talk))
    }

    /// Starts a process. One that is lost before its first variant may be somebody's kill: another one gets the chance.
    fn start_process(&mut self) -> Result<WorkerChildProcess, Error> {
        let mut lost = malformed_response();
        for _ in 0..STARTS {
            match self.try_start()? {
                Ok(process) => return Ok(process),
                Err(failure) => lost = failure,
            }
            if end_requested() {
                break;
            }
        }
        Err(Error::invalid_input(format!(
            "a worker of the sweep was lost before its first variant: {}",
            lost.what
        )))
    }

    fn try_start(&mut self) -> Result<Result<WorkerChildProcess, VariantFailure>, Error> {
        let failed = |error: std::io::Error| {
            Error::invalid_input(format!("a worker of the sweep does not start: {error}"))
        };
        let stderr = archive::unnamed_temporary_file().map_err(failed)?;
        // Whoever writes goes on at the end, so that it can be emptied.
        rustix::fs::fcntl_setfl(&stderr, rustix::fs::OFlags::APPEND).map_err(|error| failed(error.into()))?;
        let mut command = Command::new(self.program);
        command.args(["sweep", "worker"]).stdout(Stdio::null());
        command.stderr(stderr.try_clone().map_err(failed)?);
        let guest = IsolatedGuest::start(command, 0, None).map_err(failed)?;
        let mut process = WorkerChildProcess { guest, stderr, limit: Duration::from_secs(3600) };
        match process.request_response(&WorkerRequest::Open(self.plan.to_owned()), &mut self.talk) {
            Ok(WorkerResponse::Opened(Ok(limit))) => {
                process.limit = Duration::try_from_secs_f64(limit).unwrap_or(Duration::MAX);
                Ok(Ok(process))
            }
            Ok(WorkerResponse::Opened(Err(what))) => Err(Error::invalid_input(what)),
            Ok(WorkerResponse::Ran(..)) => Ok(Err(malformed_response())),
            Err(failure) => Ok(Err(failure)),
        }
    }
}

impl Drop for WorkerProcess<'_> {
    fn drop(&mut self) {
        if let (Some(process), Ok(leave)) = (&mut self.process, postcard::to_stdvec(&WorkerRequest::Leave)) {
            process.guest.shut_down(&leave);
        }
    }
}

/// Whether somebody asked this program to end.
pub(super) fn end_requested() -> bool {
    fmu_import::termination_signal().is_some()
}

fn malformed_response() -> VariantFailure {
    let what = "the process of the variant gave an answer without meaning".to_owned();
    VariantFailure { what, ..VariantFailure::default() }
}

impl WorkerChildProcess {
    fn request_response(
        &mut self,
        request: &WorkerRequest,
        talk: &mut ChannelPacket,
    ) -> Result<WorkerResponse, VariantFailure> {
        let Ok(bytes) = postcard::to_stdvec(request) else { return Err(malformed_response()) };
        // It ends itself at its limit, and says which call does not return.
        let (begin, limit) = (Instant::now(), self.limit.saturating_add(4 * GRACE));
        let asked =
            self.guest.request_answer(&[], &bytes, talk, |_| end_requested() || begin.elapsed() > limit);
        match asked {
            Ok(()) => postcard::from_bytes(&talk.bytes).map_err(|_| malformed_response()),
            Err(end) => Err(self.failure_from_stderr(end)),
        }
    }

    /// Why it does not answer, by the last line of its standard error.
    fn failure_from_stderr(&mut self, end: NoAnswerReason) -> VariantFailure {
        let stderr = self.stderr_tail().unwrap_or_default();
        let line =
            stderr.lines().map(str::trim).rfind(|line| !line.is_empty() && !line.starts_with("warning:"));
        match line {
            Some(line) => parse_failure_line(line),
            None => {
                let what = format!("the process of the variant was lost: {end}");
                VariantFailure { what, ..VariantFailure::default() }
            }
        }
    }

    fn stderr_tail(&mut self) -> std::io::Result<String> {
        let length = self.stderr.metadata()?.len();
        self.stderr.seek(SeekFrom::Start(length.saturating_sub(TAIL)))?;
        let mut bytes = Vec::new();
        self.stderr.by_ref().take(TAIL).read_to_end(&mut bytes)?;
        Ok(String::from_utf8_lossy(&bytes).into_owned())
    }

    /// FMUs may chatter.
    fn truncate_stderr(&mut self) {
        if self.stderr.metadata().is_ok_and(|file| file.len() > STDERR_LIMIT) {
            let _ = self.stderr.set_len(0);
        }
    }
}

/// The node, the call and the time of a line such as "node `plant`: fmi2DoStep at t = 1.5 s ended this program: ...".
fn parse_failure_line(line: &str) -> VariantFailure {
    let what = line.replacen("ended this program", "ended its process", 1);
    let parts = line.strip_prefix("node `").and_then(|rest| rest.split_once("`: "));
    let Some((node, rest)) = parts else {
        return VariantFailure { what, ..VariantFailure::default() };
    };
    let call = rest.split(' ').next().map(str::to_owned);
    let time = rest.split_once(" at t = ").and_then(|(_, rest)| rest.split(' ').next());
    let time = time.and_then(|time| time.parse().ok());
    VariantFailure { what, node: Some(node.to_owned()), call, time }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn failure_of_last_line_has_node_call_and_time() {
        let line = "node `plant`: fmi2DoStep at t = 1.5 s ended this program: the FMU aborted (SIGABRT)";
        let expected = VariantFailure {
            what: "node `plant`: fmi2DoStep at t = 1.5 s ended its process: the FMU aborted (SIGABRT)"
                .to_owned(),
            node: Some("plant".to_owned()),
            call: Some("fmi2DoStep".to_owned()),
            time: Some(1.5),
        };
        assert_eq!(parse_failure_line(line), expected);
        let early = parse_failure_line("node `a b`: fmi3Reset ended this program: the FMU called exit");
        assert_eq!((early.node.as_deref(), early.time), (Some("a b"), None));
        assert_eq!(parse_failure_line("terminate called").node, None);
    }
}
