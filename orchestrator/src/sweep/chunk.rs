//! Runs the chunks of a plan: each leaves a file when all of its variants are done, and what is done of it when the sweep ends early.

use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;
use std::sync::atomic::Ordering::Relaxed;
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use ::sweep::table::{self, Table};
use diagnostics::Error;

use super::crew::{Fate, Tally, Worker};
use super::plan::{PARTS, Plan};
use super::rows;
use super::settings::Setting;
use super::variant::Outcome;

/// What is done of chunks that go on is written so often.
const PERIOD: Duration = Duration::from_secs(10);

/// How the chunks of a plan ended.
#[derive(Debug, Clone, Copy, Default)]
pub struct Ended {
    /// How its variants ended, with those that were done before.
    pub tally: Tally,
    /// Whether somebody ended it before its end.
    pub stopped: bool,
    /// Whether instances of FMUs were used again, because that was proven to be the same.
    pub reused: bool,
}

/// A chunk that is being run.
struct Open {
    chunk: u64,
    values: Table,
    outcomes: Vec<Option<Outcome>>,
    /// The first row that no worker has had.
    next: usize,
}

/// What the workers share.
struct Shared<'a> {
    plan: &'a Plan,
    /// Chunks that nobody has begun, the next one last.
    waiting: Vec<u64>,
    open: Vec<Open>,
    tally: Tally,
    error: Option<Error>,
    written: Instant,
}

/// Runs these chunks of a plan by so many workers at a time. `progress` gets how many variants ended in which way, after each.
///
/// # Errors
/// When no worker starts, or a result cannot be written.
pub fn run_chunks(
    plan: &Plan,
    chunks: &[u64],
    jobs: usize,
    program: &Path,
    progress: &(dyn Fn(&Tally) + Sync),
) -> Result<Ended, Error> {
    let parts = plan.folder.join(PARTS);
    std::fs::create_dir_all(&parts).map_err(|error| Error::output(&parts, error))?;
    let mut shared = Shared {
        plan,
        waiting: Vec::new(),
        open: Vec::new(),
        tally: Tally::default(),
        error: None,
        written: Instant::now(),
    };
    for chunk in chunks.iter().rev() {
        match part(plan, *chunk)? {
            Some(done) => done.iter().for_each(|(_, outcome)| shared.tally.count(outcome)),
            None => shared.waiting.push(*chunk),
        }
    }
    let (shared, reused) = (Mutex::new(shared), AtomicBool::new(false));
    std::thread::scope(|scope| {
        for _ in 0..jobs.max(1) {
            scope.spawn(|| {
                let mut worker = Worker::new(&plan.folder, program, &reused);
                if let Err(error) = work(&shared, &mut worker, progress) {
                    lock(&shared).error.get_or_insert(error);
                }
            });
        }
    });
    let mut shared = shared.into_inner().unwrap_or_else(PoisonError::into_inner);
    shared.keep_open()?;
    if let Some(error) = shared.error.take() {
        return Err(error);
    }
    let stopped = !shared.open.is_empty() || !shared.waiting.is_empty();
    Ok(Ended { tally: shared.tally, stopped, reused: reused.load(Relaxed) })
}

fn lock<'l, 'a>(shared: &'l Mutex<Shared<'a>>) -> MutexGuard<'l, Shared<'a>> {
    shared.lock().unwrap_or_else(PoisonError::into_inner)
}

/// One worker runs variants until there are no more, or the sweep has to end.
fn work(
    shared: &Mutex<Shared>,
    worker: &mut Worker,
    progress: &(dyn Fn(&Tally) + Sync),
) -> Result<(), Error> {
    loop {
        let Some((chunk, row, settings)) = lock(shared).next()? else { return Ok(()) };
        let Fate::Done(outcome) = worker.run(&settings)? else { return Ok(()) };
        let (whole, tally) = lock(shared).take(chunk, row, *outcome)?;
        progress(&tally);
        if let Some(open) = whole {
            open.write(lock(shared).plan, true)?;
        }
    }
}

impl Shared<'_> {
    /// The next variant: its chunk, its row there, and its values.
    fn next(&mut self) -> Result<Option<(u64, usize, Vec<Setting>)>, Error> {
        loop {
            if self.error.is_some() {
                return Ok(None);
            }
            for open in &mut self.open {
                while open.outcomes.get(open.next).is_some_and(Option::is_some) {
                    open.next += 1;
                }
                if open.next < open.outcomes.len() {
                    let row = open.next;
                    open.next += 1;
                    return Ok(Some((open.chunk, row, Plan::settings(&open.values, row))));
                }
            }
            let Some(chunk) = self.waiting.pop() else { return Ok(None) };
            let open = Open::new(self.plan, chunk)?;
            open.outcomes.iter().flatten().for_each(|outcome| self.tally.count(outcome));
            match open.is_whole() {
                true => open.write(self.plan, true)?,
                false => self.open.push(open),
            }
        }
    }

    /// Takes what came of a variant; the chunk, when that was its last one.
    fn take(
        &mut self,
        chunk: u64,
        row: usize,
        outcome: Outcome,
    ) -> Result<(Option<Open>, Tally), Error> {
        self.tally.count(&outcome);
        let place = self.open.iter().position(|open| open.chunk == chunk);
        let mut whole = None;
        if let Some(place) = place {
            self.open[place].outcomes[row] = Some(outcome);
            whole = self.open[place].is_whole().then(|| self.open.remove(place));
        }
        if self.written.elapsed() > PERIOD {
            self.keep_open()?;
        }
        Ok((whole, self.tally))
    }

    /// Writes what is done of chunks that are not.
    fn keep_open(&mut self) -> Result<(), Error> {
        self.written = Instant::now();
        let begun = self.open.iter().filter(|open| open.outcomes.iter().any(Option::is_some));
        begun.into_iter().try_for_each(|open| open.write(self.plan, false))
    }
}

impl Open {
    fn new(plan: &Plan, chunk: u64) -> Result<Self, Error> {
        let values = plan.values(chunk)?;
        let mut outcomes = vec![None; values.rows()];
        let first = plan.range(chunk).start;
        for (variant, outcome) in stored(plan, &partial(plan, chunk))?.unwrap_or_default() {
            let row = variant.checked_sub(first).and_then(|row| outcomes.get_mut(row as usize));
            if let Some(place) = row {
                *place = Some(outcome);
            }
        }
        Ok(Open { chunk, values, outcomes, next: 0 })
    }

    fn is_whole(&self) -> bool {
        self.outcomes.iter().all(Option::is_some)
    }

    fn write(&self, plan: &Plan, whole: bool) -> Result<(), Error> {
        let done = self.outcomes.iter().enumerate();
        let done: Vec<_> = done.filter_map(|(row, it)| Some((row, it.as_ref()?))).collect();
        let table = rows::table(&plan.about, &self.values, &done);
        let unfinished = partial(plan, self.chunk);
        if !whole {
            return table::write(&unfinished, &table);
        }
        table::write(&plan.part(self.chunk), &table)?;
        let _ = std::fs::remove_file(unfinished);
        Ok(())
    }
}

/// The file of what is done of a chunk that is not.
fn partial(plan: &Plan, chunk: u64) -> PathBuf {
    plan.part(chunk).with_extension("partial.parquet")
}

/// What came of the variants of a chunk, if all are done.
///
/// # Errors
/// When its file cannot be read.
pub(super) fn part(plan: &Plan, chunk: u64) -> Result<Option<Vec<(u64, Outcome)>>, Error> {
    let found = stored(plan, &plan.part(chunk))?;
    let range = plan.range(chunk);
    Ok(found.filter(|rows| rows.iter().map(|(variant, _)| *variant).eq(range)))
}

/// The rows of a file, if it is there and one of the plan.
fn stored(plan: &Plan, path: &Path) -> Result<Option<Vec<(u64, Outcome)>>, Error> {
    if !path.exists() {
        return Ok(None);
    }
    // A file that cannot be read is made again.
    let table = table::read(path).ok();
    Ok(table.and_then(|table| rows::outcomes(&plan.about, &table)))
}
