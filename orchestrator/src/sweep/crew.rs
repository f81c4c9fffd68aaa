//! Lets worker processes run variants, a thread for each, and goes on when one of them is lost.

use std::fs::File;
use std::io::{Read as _, Seek as _, SeekFrom};
use std::path::Path;
use std::process::{Command, Stdio};
use std::sync::atomic::AtomicBool;
use std::sync::atomic::Ordering::Relaxed;
use std::time::{Duration, Instant};

use diagnostics::Error;
use isolation::{Guest, GuestEnd, Packet};

use super::settings::Setting;
use super::variant::{Failure, Outcome};
use super::worker::{Answer, Question};
use crate::stop::GRACE;

/// What a worker may have written to standard error before that is emptied [bytes].
const LOUD: u64 = 1 << 20;
/// What is read of it [bytes].
const TOLD: u64 = 16 << 10;

/// A worker that is lost before its first variant is started so often.
const STARTS: u32 = 3;

/// How many variants ended in which way.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Tally {
    /// All that are done.
    pub done: u64,
    /// In which all checks passed.
    pub passed: u64,
    /// That did not come to their end.
    pub failed_to_run: u64,
}

impl Tally {
    /// With those of another one.
    #[must_use]
    pub fn with(&self, other: &Tally) -> Tally {
        Tally {
            done: self.done + other.done,
            passed: self.passed + other.passed,
            failed_to_run: self.failed_to_run + other.failed_to_run,
        }
    }

    /// Counts one more.
    pub fn count(&mut self, outcome: &Outcome) {
        self.done += 1;
        self.passed += u64::from(outcome.passed());
        self.failed_to_run += u64::from(outcome.failure.is_some());
    }
}

/// What became of a variant.
pub(super) enum Fate {
    /// It ran, or failed twice.
    Done(Box<Outcome>),
    /// The sweep has to end.
    Stopped,
}

/// A worker process, and what replaces it when it is lost.
pub(super) struct Worker<'a> {
    plan: &'a Path,
    program: &'a Path,
    process: Option<Process>,
    talk: Packet,
    /// Whether instances of FMUs are used again, for whoever asks afterwards.
    pub reused: &'a AtomicBool,
}

struct Process {
    guest: Guest,
    /// Its standard error.
    said: File,
    /// What a variant may take.
    limit: Duration,
}

impl<'a> Worker<'a> {
    pub fn new(plan: &'a Path, program: &'a Path, reused: &'a AtomicBool) -> Self {
        Worker { plan, program, process: None, talk: Packet::default(), reused }
    }

    /// Runs a variant. When its process is lost, it runs once more in another one.
    ///
    /// # Errors
    /// When no process starts, or the plan cannot be opened.
    pub fn run(&mut self, settings: &[Setting]) -> Result<Fate, Error> {
        let mut lost = None;
        for _ in 0..2 {
            if ends() {
                return Ok(Fate::Stopped);
            }
            let question = Question::Run(settings.to_vec());
            match self.ask(&question)? {
                Ok(Answer::Ran(outcome, reused)) => {
                    self.reused.store(reused, Relaxed);
                    return Ok(Fate::Done(outcome));
                }
                Ok(Answer::Opened(_)) => lost = Some(nonsense()),
                Err(failure) => lost = Some(failure),
            }
            self.process = None;
        }
        match ends() {
            true => Ok(Fate::Stopped),
            false => {
                let failure = Some(lost.unwrap_or_else(nonsense));
                Ok(Fate::Done(Box::new(Outcome { failure, ..Outcome::default() })))
            }
        }
    }

    /// The answer of the process, or how it was lost.
    fn ask(&mut self, question: &Question) -> Result<Result<Answer, Failure>, Error> {
        if self.process.is_none() {
            self.process = Some(self.start()?);
        }
        let Some(process) = &mut self.process else { return Err(Error::follow_up()) };
        process.quieten();
        Ok(process.ask(question, &mut self.talk))
    }

    /// Starts a process. One that is lost before its first variant may be somebody's kill: another one gets the chance.
    fn start(&mut self) -> Result<Process, Error> {
        let mut lost = nonsense();
        for _ in 0..STARTS {
            match self.try_start()? {
                Ok(process) => return Ok(process),
                Err(failure) => lost = failure,
            }
            if ends() {
                break;
            }
        }
        Err(Error::input(format!(
            "a worker of the sweep was lost before its first variant: {}",
            lost.what
        )))
    }

    fn try_start(&mut self) -> Result<Result<Process, Failure>, Error> {
        let failed = |error: std::io::Error| {
            Error::input(format!("a worker of the sweep does not start: {error}"))
        };
        let said = archive::nameless_file().map_err(failed)?;
        // Whoever writes goes on at the end, so that it can be emptied.
        rustix::fs::fcntl_setfl(&said, rustix::fs::OFlags::APPEND)
            .map_err(|error| failed(error.into()))?;
        let mut command = Command::new(self.program);
        command.args(["sweep", "worker"]).stdout(Stdio::null());
        command.stderr(said.try_clone().map_err(failed)?);
        let guest = Guest::start(command, 0).map_err(failed)?;
        let mut process = Process { guest, said, limit: Duration::from_secs(3600) };
        match process.ask(&Question::Open(self.plan.to_owned()), &mut self.talk) {
            Ok(Answer::Opened(Ok(limit))) => {
                process.limit = Duration::try_from_secs_f64(limit).unwrap_or(Duration::MAX);
                Ok(Ok(process))
            }
            Ok(Answer::Opened(Err(what))) => Err(Error::input(what)),
            Ok(Answer::Ran(..)) => Ok(Err(nonsense())),
            Err(failure) => Ok(Err(failure)),
        }
    }
}

impl Drop for Worker<'_> {
    fn drop(&mut self) {
        if let (Some(process), Ok(leave)) =
            (&mut self.process, postcard::to_stdvec(&Question::Leave))
        {
            process.guest.shut_down(&leave);
        }
    }
}

/// Whether somebody asked this program to end.
pub(super) fn ends() -> bool {
    fmu_import::termination_signal().is_some()
}

fn nonsense() -> Failure {
    let what = "the process of the variant gave an answer without meaning".to_owned();
    Failure { what, ..Failure::default() }
}

impl Process {
    fn ask(&mut self, question: &Question, talk: &mut Packet) -> Result<Answer, Failure> {
        let Ok(bytes) = postcard::to_stdvec(question) else { return Err(nonsense()) };
        // It ends itself at its limit, and says which call does not return.
        let (begin, limit) = (Instant::now(), self.limit.saturating_add(4 * GRACE));
        let asked = self.guest.ask(&[], &bytes, talk, |_| ends() || begin.elapsed() > limit);
        match asked {
            Ok(()) => postcard::from_bytes(&talk.bytes).map_err(|_| nonsense()),
            Err(end) => Err(self.lost(end)),
        }
    }

    /// Why it does not answer, by its last words.
    fn lost(&mut self, end: GuestEnd) -> Failure {
        let said = self.end_of_said().unwrap_or_default();
        let line = said
            .lines()
            .map(str::trim)
            .rfind(|line| !line.is_empty() && !line.starts_with("warning:"));
        match line {
            Some(line) => last_words(line),
            None => {
                let what = format!("the process of the variant was lost: {end}");
                Failure { what, ..Failure::default() }
            }
        }
    }

    fn end_of_said(&mut self) -> std::io::Result<String> {
        let length = self.said.metadata()?.len();
        self.said.seek(SeekFrom::Start(length.saturating_sub(TOLD)))?;
        let mut bytes = Vec::new();
        self.said.by_ref().take(TOLD).read_to_end(&mut bytes)?;
        Ok(String::from_utf8_lossy(&bytes).into_owned())
    }

    /// FMUs may chatter.
    fn quieten(&mut self) {
        if self.said.metadata().is_ok_and(|file| file.len() > LOUD) {
            let _ = self.said.set_len(0);
        }
    }
}

/// The node, the call and the time of a line such as "node `plant`: fmi2DoStep at t = 1.5 s ended this program: ...".
fn last_words(line: &str) -> Failure {
    let what = line.replacen("ended this program", "ended its process", 1);
    let parts = line.strip_prefix("node `").and_then(|rest| rest.split_once("`: "));
    let Some((node, rest)) = parts else { return Failure { what, ..Failure::default() } };
    let call = rest.split(' ').next().map(str::to_owned);
    let time = rest.split_once(" at t = ").and_then(|(_, rest)| rest.split(' ').next());
    let time = time.and_then(|time| time.parse().ok());
    Failure { what, node: Some(node.to_owned()), call, time }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn last_words_tell_node_call_and_time() {
        let line =
            "node `plant`: fmi2DoStep at t = 1.5 s ended this program: the FMU aborted (SIGABRT)";
        let expected = Failure {
            what:
                "node `plant`: fmi2DoStep at t = 1.5 s ended its process: the FMU aborted (SIGABRT)"
                    .to_owned(),
            node: Some("plant".to_owned()),
            call: Some("fmi2DoStep".to_owned()),
            time: Some(1.5),
        };
        assert_eq!(last_words(line), expected);
        let early = last_words("node `a b`: fmi3Reset ended this program: the FMU called exit");
        assert_eq!((early.node.as_deref(), early.time), (Some("a b"), None));
        assert_eq!(last_words("terminate called").node, None);
    }
}
