//! Follows the chunks of a plan by their files and the queue of the engine, and submits again those that are missing and in no queue.

use std::collections::{BTreeMap, BTreeSet, HashMap, HashSet};
use std::time::{Duration, Instant};

use diagnostics::{Error, escape_for_terminal};

use super::super::chunk;
use super::super::file_names::PARTS;
use super::super::plan::SweepPlanFolder;
use super::super::worker_process::end_requested;
use super::engine::{EngineCommandError, TaskEngine, TaskState, UnfinishedTasks};
use super::submission::{LogTail, TaskArraySubmission, TaskArraySubmissions, TaskExit};

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
const FATAL_EXIT_CODES: [u8; 3] = [2, 126, 127];

/// How far the chunks of a plan are.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct ChunkProgress {
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
pub enum FollowOutcome {
    /// All chunks are done.
    Done,
    /// They are submitted, and nobody waits for them.
    Detached,
    /// Somebody ended it; the tasks go on.
    Left,
    /// Somebody ended it, and the tasks with it.
    Stopped,
}

/// Follows the chunks of a plan until all are done.
pub(super) struct ChunkFollower<'a> {
    plan: &'a SweepPlanFolder,
    engine: Box<dyn TaskEngine>,
    submissions: TaskArraySubmissions,
    /// Those that were listed last.
    listed: Vec<TaskArraySubmission>,
    /// The numbers of those that had tasks since this program looks.
    live: HashSet<u32>,
    /// Files of chunks that were no results when this program came.
    damaged: BTreeSet<u64>,
    /// How often this program submitted a chunk.
    attempts: HashMap<u64, u32>,
    /// Since when no task has these chunks.
    absent: BTreeMap<u64, Instant>,
    submitted: Option<Instant>,
    progress: ChunkProgress,
}

/// What a look shows.
struct QueueSnapshot {
    missing: BTreeSet<u64>,
    queue: HashMap<u64, TaskState>,
}

impl<'a> ChunkFollower<'a> {
    pub fn new(
        plan: &'a SweepPlanFolder,
        engine: Box<dyn TaskEngine>,
        submissions: TaskArraySubmissions,
    ) -> Result<Self, Error> {
        let mut damaged = BTreeSet::new();
        for number in chunks_with_files(plan)? {
            if chunk::read_completed_chunk(plan, number)?.is_none() {
                damaged.insert(number);
            }
        }
        let progress = ChunkProgress { chunks: plan.chunk_count() as usize, ..ChunkProgress::default() };
        Ok(ChunkFollower {
            plan,
            engine,
            submissions,
            listed: Vec::new(),
            live: HashSet::new(),
            damaged,
            attempts: HashMap::new(),
            absent: BTreeMap::new(),
            submitted: None,
            progress,
        })
    }

    /// Looks and submits until all chunks are done, or somebody ends it.
    ///
    /// # Errors
    /// When the engine refuses, a task fails for a reason that stays, or a chunk failed three times.
    pub fn follow_and_submit_chunks(
        &mut self,
        detach: bool,
        show: &mut dyn FnMut(&ChunkProgress),
    ) -> Result<FollowOutcome, Error> {
        let mut first = true;
        loop {
            let begin = Instant::now();
            let snapshot = match self.read_queue_snapshot() {
                Ok(snapshot) => Some(snapshot),
                Err(SnapshotError::Silent(refusal)) if !first => {
                    self.progress.silent = Some(refusal.describe());
                    None
                }
                Err(SnapshotError::Silent(refusal)) => {
                    return Err(refusal.to_sweep_error(self.engine.missing_engine_advice()));
                }
                Err(SnapshotError::Failed(error)) => return Err(error),
            };
            let asked = begin.elapsed();
            if let Some(snapshot) = snapshot {
                self.check_exit_codes(&snapshot)?;
                if snapshot.missing.is_empty() {
                    show(&self.progress);
                    return Ok(FollowOutcome::Done);
                }
                self.submit_absent(&snapshot, first)?;
            }
            show(&self.progress);
            if detach {
                return Ok(FollowOutcome::Detached);
            }
            first = false;
            let [least, most] = PERIODS;
            let period =
                if self.engine.outlives_program() { (asked * SHARE).clamp(least, most) } else { OWN };
            let until = Instant::now() + period;
            while Instant::now() < until {
                if end_requested() {
                    return Ok(self.stop_following());
                }
                std::thread::sleep(Duration::from_millis(50).min(period));
            }
        }
    }

    fn stop_following(&mut self) -> FollowOutcome {
        if self.engine.outlives_program() {
            return FollowOutcome::Left;
        }
        self.engine.cancel_tasks(&self.listed);
        FollowOutcome::Stopped
    }

    /// Looks at files and at the queue.
    fn read_queue_snapshot(&mut self) -> Result<QueueSnapshot, SnapshotError> {
        self.listed = self.submissions.read_all();
        // The queue first: a task that ends in between has left its file.
        let queue = self.engine.unfinished_tasks(&self.listed).map_err(SnapshotError::Silent)?;
        let done = self.finished_chunks().map_err(SnapshotError::Failed)?;
        let missing: BTreeSet<u64> =
            (0..self.plan.chunk_count()).filter(|chunk| !done.contains(chunk)).collect();
        let queue = self.by_chunk(&queue);
        let count = |state| queue.values().filter(|it| **it == state).count();
        let progress = &mut self.progress;
        (progress.running, progress.waiting) = (count(TaskState::Running), count(TaskState::Waiting));
        progress.done = progress.chunks - missing.len();
        progress.silent = None;
        Ok(QueueSnapshot { missing, queue })
    }

    /// The chunks whose results are there.
    fn finished_chunks(&mut self) -> Result<BTreeSet<u64>, Error> {
        let mut done = chunks_with_files(self.plan)?;
        let mut mended = Vec::new();
        for number in self.damaged.intersection(&done) {
            if chunk::read_completed_chunk(self.plan, *number)?.is_some() {
                mended.push(*number);
            }
        }
        mended.iter().for_each(|number| {
            self.damaged.remove(number);
        });
        done.retain(|number| !self.damaged.contains(number));
        Ok(done)
    }

    fn by_chunk(&mut self, queue: &UnfinishedTasks) -> HashMap<u64, TaskState> {
        let mut chunks = HashMap::new();
        for ((number, task), state) in queue {
            self.live.insert(*number);
            let submission = self.listed.iter().find(|it| it.number == *number);
            let Some(chunk) = submission.and_then(|it| it.chunks.get(*task)) else { continue };
            if *state == TaskState::Running || !chunks.contains_key(chunk) {
                chunks.insert(*chunk, *state);
            }
        }
        chunks
    }

    /// Ends all when a task failed for a reason that stays.
    fn check_exit_codes(&mut self, snapshot: &QueueSnapshot) -> Result<(), Error> {
        for submission in self.listed.iter().filter(|it| self.live.contains(&it.number)) {
            let exits = submission.task_exits().into_iter();
            let mut fatal = exits
                .filter(|it| FATAL_EXIT_CODES.contains(&it.code) && snapshot.missing.contains(&it.chunk));
            if let Some(TaskExit { chunk, code }) = fatal.next() {
                let tail = submission.log_tail(chunk);
                self.engine.cancel_tasks(&self.listed);
                return Err(Error::invalid_input(format!(
                    "chunk {chunk} ended with exit code {code}, as each other one would; all tasks are cancelled: {}",
                    describe_log_tail(&tail)
                ))
                .with_help("mend it, and give the same command again: what is done is kept"));
            }
        }
        Ok(())
    }

    /// Submits the missing chunks that no task has: at once in the beginning, later when they stay absent.
    fn submit_absent(&mut self, snapshot: &QueueSnapshot, first: bool) -> Result<(), Error> {
        let now = Instant::now();
        let absent = |chunk: &&u64| !snapshot.queue.contains_key(chunk);
        let absent: BTreeSet<u64> = snapshot.missing.iter().filter(absent).copied().collect();
        self.absent.retain(|chunk, _| absent.contains(chunk));
        for chunk in &absent {
            self.absent.entry(*chunk).or_insert(now);
        }
        // A file may be seen a moment later than the end of its task.
        let lasting = self.absent.iter().filter(|(_, since)| first || **since < now);
        let lasting: BTreeSet<u64> = lasting.map(|(chunk, _)| *chunk).collect();
        let is_exhausted = |chunk: &u64| self.attempts.get(chunk).is_some_and(|it| *it >= ATTEMPTS);
        let again: BTreeSet<u64> = lasting.iter().filter(|it| !is_exhausted(it)).copied().collect();
        if again.is_empty() {
            if snapshot.queue.is_empty() && lasting.len() == snapshot.missing.len() {
                return Err(self.attempts_exhausted(&lasting));
            }
            return Ok(());
        }
        let is_due = self.submitted.is_none_or(|since| since.elapsed() > COLLECT);
        if is_due || snapshot.queue.is_empty() { self.submit_chunks(&again, first) } else { Ok(()) }
    }

    /// Submits those of these chunks that still have no task.
    fn submit_chunks(&mut self, chunks: &BTreeSet<u64>, first: bool) -> Result<(), Error> {
        let _lock = self.submissions.lock_submissions();
        let snapshot = match self.read_queue_snapshot() {
            Ok(snapshot) => snapshot,
            Err(SnapshotError::Failed(error)) => return Err(error),
            Err(SnapshotError::Silent(refusal)) => {
                return self.wait_or_fail_on_engine_error(&refusal, first);
            }
        };
        let still = |chunk: &u64| snapshot.missing.contains(chunk) && !snapshot.queue.contains_key(chunk);
        let chunks: Vec<u64> = chunks.iter().copied().filter(still).collect();
        let largest = self.engine.max_array_size();
        for array in chunks.chunks(largest) {
            let submission = self.submissions.write_submission(array.to_vec())?;
            if let Err(refusal) = self.engine.submit_tasks(&submission) {
                TaskArraySubmissions::remove_submission_files(&submission);
                let nothing = snapshot.queue.is_empty() && array.first() == chunks.first();
                return self.wait_or_fail_on_engine_error(&refusal, nothing);
            }
            self.live.insert(submission.number);
            self.submitted = Some(Instant::now());
            self.progress.waiting += array.len();
            for chunk in array {
                self.absent.remove(chunk);
                let attempts = self.attempts.entry(*chunk).or_default();
                self.progress.lost += usize::from(*attempts > 0 || !first);
                *attempts += 1;
            }
            self.listed.push(submission);
        }
        Ok(())
    }

    /// A refusal is an error when no task of this plan is there that could end and make room.
    fn wait_or_fail_on_engine_error(
        &mut self,
        refusal: &EngineCommandError,
        nothing: bool,
    ) -> Result<(), Error> {
        if nothing || matches!(refusal, EngineCommandError::Missing(_)) {
            return Err(refusal.to_sweep_error(self.engine.missing_engine_advice()));
        }
        self.submitted = Some(Instant::now());
        self.progress.silent = Some(refusal.describe());
        Ok(())
    }

    fn attempts_exhausted(&self, chunks: &BTreeSet<u64>) -> Error {
        let names: Vec<_> = chunks.iter().take(20).map(ToString::to_string).collect();
        let mut message = format!(
            "{} of {} chunks were submitted {ATTEMPTS} times and are not done: {}",
            chunks.len(),
            self.progress.chunks,
            names.join(", ")
        );
        let last = chunks.first().and_then(|chunk| {
            let submission = self.listed.iter().rev().find(|it| it.chunks.contains(chunk))?;
            let exit = submission.task_exits().into_iter().find(|it| it.chunk == *chunk);
            let code = exit
                .map_or("it left no exit code".to_owned(), |exit| format!("its exit code was {}", exit.code));
            let tail = submission.log_tail(*chunk);
            Some(format!("; of chunk {chunk}: {code}; {}", describe_log_tail(&tail)))
        });
        message += &last.unwrap_or_default();
        Error::invalid_input(message).with_help(
            "look at the memory and the time that a task may take; the same command submits them again",
        )
    }
}

/// Why a look shows nothing.
enum SnapshotError {
    /// The engine does not answer.
    Silent(EngineCommandError),
    Failed(Error),
}

/// The chunks that have a file of results.
fn chunks_with_files(plan: &SweepPlanFolder) -> Result<BTreeSet<u64>, Error> {
    let folder = plan.folder.join(PARTS);
    let files = match std::fs::read_dir(&folder) {
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Ok(BTreeSet::new()),
        files => files
            .map_err(|error| Error::invalid_input(format!("cannot read {}: {error}", folder.display())))?,
    };
    let number = |name: std::ffi::OsString| name.to_str()?.strip_suffix(".parquet")?.parse().ok();
    Ok(files.flatten().filter_map(|file| number(file.file_name())).collect())
}

/// What a log says, and where it is.
fn describe_log_tail(LogTail { path, text }: &LogTail) -> String {
    match text.as_str() {
        "" => format!("it printed nothing into {}", path.display()),
        text => format!("{} (the end of {})", escape_for_terminal(text), path.display()),
    }
}
