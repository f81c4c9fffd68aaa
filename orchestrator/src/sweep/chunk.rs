//! Runs the chunks of a plan: each writes a file of results when all of its variants are done, a partial one when the sweep ends early.

use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;
use std::sync::atomic::Ordering::Relaxed;
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use ::sweep::table::{self, SweepTable, SweepTableReader};
use diagnostics::Error;
use scenario::resolve::Override;

use super::file_names::PARTS;
use super::plan::SweepPlanFolder;
use super::result_rows::{self, NumberedOutcome, RowOutcome};
use super::variant::VariantOutcome;
use super::worker_process::{VariantCounts, WorkerOutcome, WorkerProcess};

/// The outcomes of unfinished chunks are written this often.
const PERIOD: Duration = Duration::from_secs(10);

/// How the chunks of a plan ended.
#[derive(Debug, Clone, Copy, Default)]
pub struct ChunksOutcome {
    /// How its variants ended, with those that were done before.
    pub counts: VariantCounts,
    /// Whether somebody ended it before its end.
    pub stopped: bool,
    /// Whether instances of FMUs were used again, because that was proven to be the same.
    pub reused: bool,
}

/// A chunk that is being run.
struct UnfinishedChunk {
    chunk: u64,
    values: SweepTable,
    outcomes: Vec<Option<VariantOutcome>>,
    /// The first row that no worker has had.
    next: usize,
}

/// A variant for a worker to run.
struct VariantTask {
    chunk: u64,
    /// Its row in the chunk.
    row: usize,
    overrides: Vec<Override>,
}

/// What changed in the queue with an outcome.
struct StoredOutcome {
    /// The chunk, when the outcome was its last one.
    finished: Option<UnfinishedChunk>,
    counts: VariantCounts,
}

/// What the workers share.
struct WorkQueue<'a> {
    plan: &'a SweepPlanFolder,
    /// Chunks that nobody has begun, the next one last.
    waiting: Vec<u64>,
    open: Vec<UnfinishedChunk>,
    counts: VariantCounts,
    error: Option<Error>,
    written: Instant,
}

/// Runs these chunks of a plan by so many workers at a time. `progress` gets how many variants ended in which way, after each.
///
/// # Errors
/// When no worker starts, or a result cannot be written.
pub fn run_chunks(
    plan: &SweepPlanFolder,
    chunks: &[u64],
    jobs: usize,
    program: &Path,
    progress: &(dyn Fn(&VariantCounts) + Sync),
) -> Result<ChunksOutcome, Error> {
    let parts = plan.folder.join(PARTS);
    std::fs::create_dir_all(&parts).map_err(|error| Error::output_failure(&parts, error))?;
    let mut shared = WorkQueue {
        plan,
        waiting: Vec::new(),
        open: Vec::new(),
        counts: VariantCounts::default(),
        error: None,
        written: Instant::now(),
    };
    for chunk in chunks.iter().rev() {
        match read_completed_chunk(plan, *chunk)? {
            Some(done) => done.iter().for_each(|it| shared.counts.count_outcome(&it.outcome)),
            None => shared.waiting.push(*chunk),
        }
    }
    let (shared, reused) = (Mutex::new(shared), AtomicBool::new(false));
    std::thread::scope(|scope| {
        for _ in 0..jobs.max(1) {
            scope.spawn(|| {
                let mut worker = WorkerProcess::new(&plan.folder, program, &reused);
                if let Err(error) = run_variants_until_done(&shared, &mut worker, progress) {
                    lock_queue(&shared).error.get_or_insert(error);
                }
            });
        }
    });
    let mut shared = shared.into_inner().unwrap_or_else(PoisonError::into_inner);
    shared.write_unfinished_chunks()?;
    if let Some(error) = shared.error.take() {
        return Err(error);
    }
    let stopped = !shared.open.is_empty() || !shared.waiting.is_empty();
    Ok(ChunksOutcome { counts: shared.counts, stopped, reused: reused.load(Relaxed) })
}

fn lock_queue<'l, 'a>(shared: &'l Mutex<WorkQueue<'a>>) -> MutexGuard<'l, WorkQueue<'a>> {
    shared.lock().unwrap_or_else(PoisonError::into_inner)
}

/// One worker runs variants until there are no more, or the sweep has to end.
fn run_variants_until_done(
    shared: &Mutex<WorkQueue>,
    worker: &mut WorkerProcess,
    progress: &(dyn Fn(&VariantCounts) + Sync),
) -> Result<(), Error> {
    loop {
        let Some(task) = lock_queue(shared).next_variant()? else { return Ok(()) };
        let WorkerOutcome::Done(outcome) = worker.run_variant(&task.overrides)? else {
            return Ok(());
        };
        let stored = lock_queue(shared).store_outcome(&task, *outcome)?;
        progress(&stored.counts);
        if let Some(open) = stored.finished {
            open.write_results(lock_queue(shared).plan, true)?;
        }
    }
}

impl WorkQueue<'_> {
    /// The next variant; none when there are no more, or a worker failed.
    fn next_variant(&mut self) -> Result<Option<VariantTask>, Error> {
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
                    let overrides = SweepPlanFolder::row_overrides(&open.values, row);
                    return Ok(Some(VariantTask { chunk: open.chunk, row, overrides }));
                }
            }
            let Some(chunk) = self.waiting.pop() else { return Ok(None) };
            let open = UnfinishedChunk::new(self.plan, chunk)?;
            open.outcomes.iter().flatten().for_each(|outcome| self.counts.count_outcome(outcome));
            match open.is_complete() {
                true => open.write_results(self.plan, true)?,
                false => self.open.push(open),
            }
        }
    }

    /// Stores the outcome of a variant.
    fn store_outcome(&mut self, task: &VariantTask, outcome: VariantOutcome) -> Result<StoredOutcome, Error> {
        self.counts.count_outcome(&outcome);
        let place = self.open.iter().position(|open| open.chunk == task.chunk);
        let mut finished = None;
        if let Some(place) = place {
            self.open[place].outcomes[task.row] = Some(outcome);
            finished = self.open[place].is_complete().then(|| self.open.remove(place));
        }
        if self.written.elapsed() > PERIOD {
            self.write_unfinished_chunks()?;
        }
        Ok(StoredOutcome { finished, counts: self.counts })
    }

    /// Writes the outcomes of chunks that are not finished.
    fn write_unfinished_chunks(&mut self) -> Result<(), Error> {
        self.written = Instant::now();
        let with_outcomes = self.open.iter().filter(|open| open.outcomes.iter().any(Option::is_some));
        with_outcomes.into_iter().try_for_each(|open| open.write_results(self.plan, false))
    }
}

impl UnfinishedChunk {
    fn new(plan: &SweepPlanFolder, chunk: u64) -> Result<Self, Error> {
        let values = plan.chunk_values(chunk)?;
        let mut outcomes = vec![None; values.row_count()];
        let first = plan.variants_of_chunk(chunk).start;
        for NumberedOutcome { variant, outcome } in
            read_outcomes_file(plan, &partial_chunk_path(plan, chunk))?.unwrap_or_default()
        {
            let row = variant.checked_sub(first).and_then(|row| outcomes.get_mut(row as usize));
            if let Some(place) = row {
                *place = Some(outcome);
            }
        }
        Ok(UnfinishedChunk { chunk, values, outcomes, next: 0 })
    }

    fn is_complete(&self) -> bool {
        self.outcomes.iter().all(Option::is_some)
    }

    fn write_results(&self, plan: &SweepPlanFolder, complete: bool) -> Result<(), Error> {
        let rows = self.outcomes.iter().enumerate();
        let done: Vec<_> =
            rows.filter_map(|(row, it)| Some(RowOutcome { row, outcome: it.as_ref()? })).collect();
        let table = result_rows::outcomes_to_table(&plan.metadata, &self.values, &done);
        let partial = partial_chunk_path(plan, self.chunk);
        if !complete {
            return table::write_table(&partial, &table);
        }
        table::write_table(&plan.chunk_result_path(self.chunk), &table)?;
        let _ = std::fs::remove_file(partial);
        Ok(())
    }
}

/// The file of the outcomes of an unfinished chunk.
fn partial_chunk_path(plan: &SweepPlanFolder, chunk: u64) -> PathBuf {
    plan.chunk_result_path(chunk).with_extension("partial.parquet")
}

/// The outcomes of the variants of a chunk, if all are done.
///
/// # Errors
/// When its file cannot be read.
pub(super) fn read_completed_chunk(
    plan: &SweepPlanFolder,
    chunk: u64,
) -> Result<Option<Vec<NumberedOutcome>>, Error> {
    let found = read_outcomes_file(plan, &plan.chunk_result_path(chunk))?;
    let range = plan.variants_of_chunk(chunk);
    Ok(found.filter(|rows| rows.iter().map(|it| it.variant).eq(range)))
}

/// The rows of a file, if it is there and one of the plan. One whose rows were changed is an error: somebody may have to know.
fn read_outcomes_file(plan: &SweepPlanFolder, path: &Path) -> Result<Option<Vec<NumberedOutcome>>, Error> {
    if !path.exists() {
        return Ok(None);
    }
    // A file that cannot be read is made again.
    let Ok(reader) = SweepTableReader::open(path) else { return Ok(None) };
    let Ok(table) = reader.read_all_rows() else { return Ok(None) };
    reader.check_rows(&table)?;
    Ok(result_rows::outcomes_from_table(&plan.metadata, &table))
}
