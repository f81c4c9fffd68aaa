//! Follows the chunks of a plan: looks at their files and at the queue of the engine, and submits what is missing and in no queue.

use std::collections::{BTreeMap, BTreeSet, HashMap, HashSet};
use std::path::Path;
use std::time::{Duration, Instant};

use diagnostics::{Error, shown};

use super::super::chunk;
use super::super::crew::ends;
use super::super::plan::{PARTS, Plan};
use super::engine::{Engine, Queue, Refusal, State};
use super::submission::{Submission, Submissions};

/// A chunk is submitted so often at most by one command.
const ATTEMPTS: u32 = 3;
/// What is lost is collected this long, so that it becomes one array.
const COLLECT: Duration = Duration::from_secs(5);
/// How often the engine is asked: the answer may take a twentieth of the time, within these bounds.
const SHARE: u32 = 20;
const PERIODS: [Duration; 2] = [Duration::from_secs(1), Duration::from_secs(30)];
/// The same for processes of this one.
const OWN: Duration = Duration::from_millis(200);
/// Exit codes of a task that fails again wherever it runs: wrong input, and a program that is not there.
const HOPELESS: [u8; 3] = [2, 126, 127];

/// How far the chunks of a plan are.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Watched {
    /// All chunks.
    pub chunks: usize,
    /// Those that are done.
    pub done: usize,
    /// Those that run.
    pub running: usize,
    /// Those that wait.
    pub waiting: usize,
    /// How often a task was lost, or failed.
    pub lost: usize,
    /// Why the engine does not answer at the moment.
    pub silent: Option<String>,
}

/// How following ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Followed {
    /// All chunks are done.
    Done,
    /// They are submitted, and nobody waits for them.
    Detached,
    /// Somebody ended it; the tasks go on.
    Left,
    /// Somebody ended it, and the tasks with it.
    Stopped,
}

/// What follows the chunks of a plan.
pub(super) struct Follow<'a> {
    plan: &'a Plan,
    engine: Box<dyn Engine>,
    submissions: Submissions,
    /// Those that are there.
    known: Vec<Submission>,
    /// The numbers of those that had tasks since this program looks.
    live: HashSet<u32>,
    /// Files of chunks that were no results when this program came.
    damaged: BTreeSet<u64>,
    /// How often this program submitted a chunk.
    attempts: HashMap<u64, u32>,
    /// Since when no task has these chunks.
    absent: BTreeMap<u64, Instant>,
    submitted: Option<Instant>,
    watched: Watched,
}

/// What a look shows.
struct Seen {
    missing: BTreeSet<u64>,
    queue: HashMap<u64, State>,
}

impl<'a> Follow<'a> {
    pub fn new(
        plan: &'a Plan,
        engine: Box<dyn Engine>,
        submissions: Submissions,
    ) -> Result<Self, Error> {
        let mut damaged = BTreeSet::new();
        for number in present(plan)? {
            if chunk::part(plan, number)?.is_none() {
                damaged.insert(number);
            }
        }
        let watched = Watched { chunks: plan.chunks() as usize, ..Watched::default() };
        Ok(Follow {
            plan,
            engine,
            submissions,
            known: Vec::new(),
            live: HashSet::new(),
            damaged,
            attempts: HashMap::new(),
            absent: BTreeMap::new(),
            submitted: None,
            watched,
        })
    }

    /// Looks and submits until all chunks are done, or somebody ends it.
    ///
    /// # Errors
    /// When the engine refuses, a task fails for a reason that stays, or a chunk failed three times.
    pub fn run(&mut self, detach: bool, show: &mut dyn FnMut(&Watched)) -> Result<Followed, Error> {
        let mut first = true;
        loop {
            let begin = Instant::now();
            let seen = match self.look() {
                Ok(seen) => Some(seen),
                Err(Look::Silent(refusal)) if !first => {
                    self.watched.silent = Some(refusal.what());
                    None
                }
                Err(Look::Silent(refusal)) => return Err(refusal.error(self.engine.remedy())),
                Err(Look::Failed(error)) => return Err(error),
            };
            let asked = begin.elapsed();
            if let Some(seen) = seen {
                self.hopeless(&seen)?;
                if seen.missing.is_empty() {
                    show(&self.watched);
                    return Ok(Followed::Done);
                }
                self.submit_absent(&seen, first)?;
            }
            show(&self.watched);
            if detach {
                return Ok(Followed::Detached);
            }
            first = false;
            let [least, most] = PERIODS;
            let period =
                if self.engine.outlives() { (asked * SHARE).clamp(least, most) } else { OWN };
            let until = Instant::now() + period;
            while Instant::now() < until {
                if ends() {
                    return Ok(self.leave());
                }
                std::thread::sleep(Duration::from_millis(50).min(period));
            }
        }
    }

    fn leave(&mut self) -> Followed {
        if self.engine.outlives() {
            return Followed::Left;
        }
        self.engine.cancel(&self.known);
        Followed::Stopped
    }

    /// Looks at files and at the queue.
    fn look(&mut self) -> Result<Seen, Look> {
        self.known = self.submissions.list();
        // The queue first: a task that ends in between has left its file.
        let queue = self.engine.queue(&self.known).map_err(Look::Silent)?;
        let done = self.done().map_err(Look::Failed)?;
        let missing: BTreeSet<u64> =
            (0..self.plan.chunks()).filter(|chunk| !done.contains(chunk)).collect();
        let queue = self.by_chunk(&queue);
        let count = |state| queue.values().filter(|it| **it == state).count();
        let watched = &mut self.watched;
        (watched.running, watched.waiting) = (count(State::Running), count(State::Waiting));
        watched.done = watched.chunks - missing.len();
        watched.silent = None;
        Ok(Seen { missing, queue })
    }

    /// The chunks whose results are there.
    fn done(&mut self) -> Result<BTreeSet<u64>, Error> {
        let mut done = present(self.plan)?;
        let mut mended = Vec::new();
        for number in self.damaged.intersection(&done) {
            if chunk::part(self.plan, *number)?.is_some() {
                mended.push(*number);
            }
        }
        mended.iter().for_each(|number| {
            self.damaged.remove(number);
        });
        done.retain(|number| !self.damaged.contains(number));
        Ok(done)
    }

    fn by_chunk(&mut self, queue: &Queue) -> HashMap<u64, State> {
        let mut chunks = HashMap::new();
        for ((number, task), state) in queue {
            self.live.insert(*number);
            let submission = self.known.iter().find(|it| it.number == *number);
            let Some(chunk) = submission.and_then(|it| it.chunks.get(*task)) else { continue };
            if *state == State::Running || !chunks.contains_key(chunk) {
                chunks.insert(*chunk, *state);
            }
        }
        chunks
    }

    /// Ends all when a task failed for a reason that stays.
    fn hopeless(&mut self, seen: &Seen) -> Result<(), Error> {
        for submission in self.known.iter().filter(|it| self.live.contains(&it.number)) {
            let failed = submission.ended().into_iter();
            let mut failed = failed
                .filter(|(chunk, code)| HOPELESS.contains(code) && seen.missing.contains(chunk));
            if let Some((chunk, code)) = failed.next() {
                let (log, words) = submission.last_words(chunk);
                self.engine.cancel(&self.known);
                return Err(Error::input(format!(
                    "chunk {chunk} ended with exit code {code}, as each other one would; all tasks are cancelled: {}",
                    told(&log, &words)
                ))
                .help("mend it, and give the same command again: what is done is kept"));
            }
        }
        Ok(())
    }

    /// Submits the missing chunks that no task has: at once in the beginning, later when they stay absent.
    fn submit_absent(&mut self, seen: &Seen, first: bool) -> Result<(), Error> {
        let now = Instant::now();
        let absent = |chunk: &&u64| !seen.queue.contains_key(chunk);
        let absent: BTreeSet<u64> = seen.missing.iter().filter(absent).copied().collect();
        self.absent.retain(|chunk, _| absent.contains(chunk));
        for chunk in &absent {
            self.absent.entry(*chunk).or_insert(now);
        }
        // A file may be seen a moment later than the end of its task.
        let lasting = self.absent.iter().filter(|(_, since)| first || **since < now);
        let lasting: BTreeSet<u64> = lasting.map(|(chunk, _)| *chunk).collect();
        let spent = |chunk: &u64| self.attempts.get(chunk).is_some_and(|it| *it >= ATTEMPTS);
        let again: BTreeSet<u64> = lasting.iter().filter(|it| !spent(it)).copied().collect();
        if again.is_empty() {
            if seen.queue.is_empty() && lasting.len() == seen.missing.len() {
                return Err(self.given_up(&lasting));
            }
            return Ok(());
        }
        let collected = self.submitted.is_none_or(|since| since.elapsed() > COLLECT);
        if collected || seen.queue.is_empty() { self.submit(&again, first) } else { Ok(()) }
    }

    /// Submits those of these chunks that still have no task.
    fn submit(&mut self, chunks: &BTreeSet<u64>, first: bool) -> Result<(), Error> {
        let _lock = self.submissions.lock();
        let seen = match self.look() {
            Ok(seen) => seen,
            Err(Look::Failed(error)) => return Err(error),
            Err(Look::Silent(refusal)) => return self.refused(&refusal, first),
        };
        let still = |chunk: &u64| seen.missing.contains(chunk) && !seen.queue.contains_key(chunk);
        let chunks: Vec<u64> = chunks.iter().copied().filter(still).collect();
        let largest = self.engine.largest();
        for array in chunks.chunks(largest) {
            let submission = self.submissions.add(array.to_vec())?;
            if let Err(refusal) = self.engine.submit(&submission) {
                Submissions::remove(&submission);
                let nothing = seen.queue.is_empty() && array.first() == chunks.first();
                return self.refused(&refusal, nothing);
            }
            self.live.insert(submission.number);
            self.submitted = Some(Instant::now());
            self.watched.waiting += array.len();
            for chunk in array {
                self.absent.remove(chunk);
                let attempts = self.attempts.entry(*chunk).or_default();
                self.watched.lost += usize::from(*attempts > 0 || !first);
                *attempts += 1;
            }
            self.known.push(submission);
        }
        Ok(())
    }

    /// A refusal is an error when no task of this plan is there that could end and make room.
    fn refused(&mut self, refusal: &Refusal, nothing: bool) -> Result<(), Error> {
        if nothing || matches!(refusal, Refusal::Missing(_)) {
            return Err(refusal.error(self.engine.remedy()));
        }
        self.submitted = Some(Instant::now());
        self.watched.silent = Some(refusal.what());
        Ok(())
    }

    fn given_up(&self, chunks: &BTreeSet<u64>) -> Error {
        let names: Vec<_> = chunks.iter().take(20).map(ToString::to_string).collect();
        let mut message = format!(
            "{} of {} chunks were submitted {ATTEMPTS} times and are not done: {}",
            chunks.len(),
            self.watched.chunks,
            names.join(", ")
        );
        let last = chunks.first().and_then(|chunk| {
            let with = self.known.iter().rev().find(|it| it.chunks.contains(chunk))?;
            let code = with.ended().into_iter().find(|(ended, _)| ended == chunk);
            let code = code.map_or("it left no exit code".to_owned(), |(_, code)| {
                format!("its exit code was {code}")
            });
            let (log, words) = with.last_words(*chunk);
            Some(format!("; of chunk {chunk}: {code}; {}", told(&log, &words)))
        });
        message += &last.unwrap_or_default();
        Error::input(message)
            .help("look at the memory and the time that a task may take; the same command submits them again")
    }
}

/// Why a look shows nothing.
enum Look {
    /// The engine does not answer.
    Silent(Refusal),
    Failed(Error),
}

/// The chunks that have a file of results.
fn present(plan: &Plan) -> Result<BTreeSet<u64>, Error> {
    let folder = plan.folder.join(PARTS);
    let files = match std::fs::read_dir(&folder) {
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Ok(BTreeSet::new()),
        files => files
            .map_err(|error| Error::input(format!("cannot read {}: {error}", folder.display())))?,
    };
    let number = |name: std::ffi::OsString| name.to_str()?.strip_suffix(".parquet")?.parse().ok();
    Ok(files.flatten().filter_map(|file| number(file.file_name())).collect())
}

/// What a log says, and where it is.
fn told(log: &Path, words: &str) -> String {
    match words {
        "" => format!("it printed nothing into {}", log.display()),
        words => format!("{} (the end of {})", shown(words), log.display()),
    }
}
