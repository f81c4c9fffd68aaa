//! Runs a sink on a thread of its own, so that a run does not wait for its recordings.

use std::panic::resume_unwind;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::Duration;

use diagnostics::Error;

use super::{AnalysisColumns, BoxedSink, RunEvent, Sink, SinkNotice, StatusChange, TestTrackLayout};
use crate::row::{RecordedVariables, Row};

/// As many waiting rows [B] wake the thread up. Waking it costs some microseconds, as much as writing so many rows takes or less.
const BYTES: usize = 64 << 10;
/// As many waiting rows [B] make the run wait, which bounds the memory.
const WAITING: usize = 8 * BYTES;
/// The thread looks for rows at least as often: a viewer is as much behind the run.
const LOOK: Duration = Duration::from_millis(50);

/// An item of a batch.
enum QueuedItem {
    /// A row: its tick, its time, and its texts if they are not those of the row before; the batch holds its other values.
    Row(u64, f64, Option<Vec<String>>),
    Event(RunEvent),
    Status(StatusChange),
}

#[derive(Default)]
struct SinkBatch {
    items: Vec<QueuedItem>,
    rows: usize,
    /// The numbers of all rows, one row after the other; and their integers of 64 bits.
    numbers: Vec<f64>,
    integers: Vec<i128>,
    /// What all items take [B].
    bytes: usize,
}

impl SinkBatch {
    fn add_row(&mut self, tick: u64, time: f64, row: &Row<RecordedVariables>, texts: Option<Vec<String>>) {
        self.numbers.extend_from_slice(row.numbers());
        self.integers.extend_from_slice(row.integers());
        self.bytes += size_of_val(row.numbers()) + size_of_val(row.integers());
        self.rows += 1;
        self.add_item(QueuedItem::Row(tick, time, texts));
    }

    fn add_item(&mut self, item: QueuedItem) {
        let texts: usize = match &item {
            QueuedItem::Row(_, _, texts) => texts.iter().flatten().map(String::len).sum(),
            QueuedItem::Event(event) => event.source.len() + event.message.len(),
            QueuedItem::Status(_) => 0,
        };
        self.bytes += size_of::<QueuedItem>() + texts;
        self.items.push(item);
    }

    fn clear(&mut self) {
        self.items.clear();
        self.numbers.clear();
        self.integers.clear();
        (self.rows, self.bytes) = (0, 0);
    }
}

/// What the run and the thread tell each other.
#[derive(Default)]
struct SharedBatch {
    batch: SinkBatch,
    /// No item follows.
    closed: bool,
    /// The thread takes no more, because of an error.
    failed: bool,
}

#[derive(Default)]
struct SharedBatchQueue {
    desk: Mutex<SharedBatch>,
    /// For the thread: there is work.
    work: Condvar,
    /// For the run: there is room.
    room: Condvar,
}

impl SharedBatchQueue {
    /// A panic of the other side does not matter here: joining the thread tells it.
    fn lock_batch(&self) -> MutexGuard<'_, SharedBatch> {
        self.desk.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

type ThreadResult = (BoxedSink, Result<(), Error>);

/// The state of the sink.
enum SinkThreadState {
    /// Not on a thread: before the first item, and after the last row.
    Idle(BoxedSink),
    Working(Arc<SharedBatchQueue>, JoinHandle<ThreadResult>),
    /// Between the two.
    Changing,
}

/// A sink on a thread of its own, from its first item to its last row. Its errors come from a later call, at the latest from
/// [`Sink::finish`].
pub struct ThreadedSink {
    state: SinkThreadState,
    /// The texts of the last row.
    texts: Vec<String>,
}

impl ThreadedSink {
    /// Wraps a sink. Its thread starts with the first item.
    pub fn new(sink: BoxedSink) -> Self {
        ThreadedSink { state: SinkThreadState::Idle(sink), texts: Vec::new() }
    }

    /// The desk of the thread, which is started if it does not run.
    fn ensure_thread(&mut self) -> &Arc<SharedBatchQueue> {
        if let SinkThreadState::Idle(_) = self.state
            && let SinkThreadState::Idle(sink) = std::mem::replace(&mut self.state, SinkThreadState::Changing)
        {
            let shared = Arc::<SharedBatchQueue>::default();
            let of_thread = Arc::clone(&shared);
            let thread = std::thread::spawn(move || run_sink_thread(sink, &of_thread));
            self.state = SinkThreadState::Working(shared, thread);
        }
        let SinkThreadState::Working(shared, _) = &self.state else { unreachable!("it has just begun") };
        shared
    }

    /// Puts something into the batch, and waits while the thread falls behind.
    fn push_to_batch(&mut self, add: impl FnOnce(&mut SinkBatch)) -> Result<(), Error> {
        let shared = self.ensure_thread();
        let mut desk = shared.lock_batch();
        let before = desk.batch.bytes;
        add(&mut desk.batch);
        if before < BYTES && desk.batch.bytes >= BYTES {
            shared.work.notify_one();
        }
        if desk.batch.bytes >= WAITING {
            let waits = |desk: &mut SharedBatch| !desk.failed && desk.batch.bytes >= WAITING;
            desk = shared.room.wait_while(desk, waits).unwrap_or_else(PoisonError::into_inner);
        }
        let failed = desk.failed;
        drop(desk);
        if failed { self.caught_up().map(drop) } else { Ok(()) }
    }

    /// The sink, after it took all items so far.
    fn caught_up(&mut self) -> Result<&mut BoxedSink, Error> {
        let mut result = Ok(());
        self.state = match std::mem::replace(&mut self.state, SinkThreadState::Changing) {
            SinkThreadState::Working(shared, thread) => {
                shared.lock_batch().closed = true;
                shared.work.notify_one();
                let (sink, ended) = thread.join().unwrap_or_else(|panic| resume_unwind(panic));
                result = ended;
                SinkThreadState::Idle(sink)
            }
            other => other,
        };
        let SinkThreadState::Idle(sink) = &mut self.state else { unreachable!("the thread has ended") };
        result.map(|()| sink)
    }
}

impl Drop for ThreadedSink {
    /// The thread of a sink that is not finished ends, too.
    fn drop(&mut self) {
        if let SinkThreadState::Working(shared, _) = &self.state {
            shared.lock_batch().closed = true;
            shared.work.notify_one();
        }
    }
}

/// Tells the run when the thread is gone, for whatever reason.
struct ThreadExitGuard<'a>(&'a SharedBatchQueue);

impl Drop for ThreadExitGuard<'_> {
    fn drop(&mut self) {
        self.0.lock_batch().failed = true;
        self.0.room.notify_one();
    }
}

fn run_sink_thread(mut sink: BoxedSink, shared: &SharedBatchQueue) -> ThreadResult {
    let _ends = ThreadExitGuard(shared);
    let (mut batch, mut row) = (SinkBatch::default(), Row::default());
    loop {
        let waiting = |desk: &mut SharedBatch| !desk.closed && desk.batch.bytes < BYTES;
        let waited = shared.work.wait_timeout_while(shared.lock_batch(), LOOK, waiting);
        let (mut desk, _) = waited.unwrap_or_else(PoisonError::into_inner);
        // Both keep their memory.
        std::mem::swap(&mut batch, &mut desk.batch);
        let closed = desk.closed;
        drop(desk);
        shared.room.notify_one();
        let result = write_batch_to_sink(&mut sink, &mut batch, &mut row);
        batch.clear();
        if closed || result.is_err() {
            return (sink, result);
        }
    }
}

fn write_batch_to_sink(
    sink: &mut BoxedSink,
    batch: &mut SinkBatch,
    row: &mut Row<RecordedVariables>,
) -> Result<(), Error> {
    let [numbers, integers] = [batch.numbers.len(), batch.integers.len()].map(|all| all / batch.rows.max(1));
    let (mut number, mut integer) = (0, 0);
    for item in batch.items.drain(..) {
        match item {
            QueuedItem::Row(tick, time, texts) => {
                let values = &batch.numbers[number..number + numbers];
                let exact = &batch.integers[integer..integer + integers];
                row.set_values(values, texts, exact);
                (number, integer) = (number + numbers, integer + integers);
                sink.push_row(tick, time, row)?;
            }
            QueuedItem::Event(event) => sink.push_event(&event)?,
            QueuedItem::Status(change) => sink.push_status_change(&change)?,
        }
    }
    Ok(())
}

impl Sink for ThreadedSink {
    fn push_row(&mut self, tick: u64, time: f64, row: &Row<RecordedVariables>) -> Result<(), Error> {
        let changed = self.texts != row.texts();
        let texts = changed.then(|| row.texts().to_vec());
        if changed {
            self.texts.clear();
            self.texts.extend_from_slice(row.texts());
        }
        self.push_to_batch(|batch| batch.add_row(tick, time, row, texts))
    }

    fn push_event(&mut self, event: &RunEvent) -> Result<(), Error> {
        let event = event.clone();
        self.push_to_batch(|batch| batch.add_item(QueuedItem::Event(event)))
    }

    fn push_status_change(&mut self, change: &StatusChange) -> Result<(), Error> {
        let change = change.clone();
        self.push_to_batch(|batch| batch.add_item(QueuedItem::Status(change)))
    }

    fn push_derived_columns(&mut self, derived: &AnalysisColumns) -> Result<(), Error> {
        self.caught_up()?.push_derived_columns(derived)
    }

    fn push_diagram(&mut self, analysis: &str, group: &str, diagram: &plugin::Diagram) -> Result<(), Error> {
        self.caught_up()?.push_diagram(analysis, group, diagram)
    }

    fn push_test_track(&mut self, track: &TestTrackLayout) -> Result<(), Error> {
        self.caught_up()?.push_test_track(track)
    }

    fn finish(&mut self, summary: &str, completed: bool) -> Result<(), Error> {
        self.caught_up()?.finish(summary, completed)
    }

    /// The notices of the sink; none while it works on its thread.
    fn take_notices(&mut self) -> Vec<SinkNotice> {
        match &mut self.state {
            SinkThreadState::Idle(sink) => sink.take_notices(),
            SinkThreadState::Working(..) | SinkThreadState::Changing => Vec::new(),
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::{Arc, Mutex};

    use super::*;
    use crate::sink::EventLevel;

    /// Notes each call, and fails at a tick.
    struct Notes {
        notes: Arc<Mutex<Vec<String>>>,
        fails_at: u64,
    }

    impl Notes {
        fn note(&self, what: String) {
            self.notes.lock().expect("no panic").push(what);
        }
    }

    impl Sink for Notes {
        fn push_row(&mut self, tick: u64, time: f64, row: &Row<RecordedVariables>) -> Result<(), Error> {
            if tick == self.fails_at {
                return Err(Error::invalid_input("the disk is full"));
            }
            self.note(format!("{tick} {time} {:?} {:?}", row.numbers(), row.texts()));
            Ok(())
        }

        fn push_event(&mut self, event: &RunEvent) -> Result<(), Error> {
            self.note(event.message.clone());
            Ok(())
        }

        fn finish(&mut self, summary: &str, _: bool) -> Result<(), Error> {
            self.note(summary.to_owned());
            Ok(())
        }
    }

    fn threaded(fails_at: u64) -> (ThreadedSink, Arc<Mutex<Vec<String>>>) {
        let notes = Arc::default();
        let sink = Notes { notes: Arc::clone(&notes), fails_at };
        (ThreadedSink::new(Box::new(sink)), notes)
    }

    fn row(tick: u64) -> Row<RecordedVariables> {
        Row::from_values(vec![tick as f64, 0.5], vec![format!("t{tick}")])
    }

    fn event(time: f64, message: &str) -> RunEvent {
        let message = message.to_owned();
        RunEvent { time, level: EventLevel::Info, source: String::new(), message, again: 0 }
    }

    #[test]
    fn items_arrive_in_their_order() {
        let (mut sink, notes) = threaded(u64::MAX);
        sink.push_event(&event(0.0, "before")).expect("taken");
        for tick in 0..1000 {
            sink.push_row(tick, 1e-3 * tick as f64, &row(tick)).expect("taken");
            if tick == 500 {
                sink.push_event(&event(0.5, "between")).expect("taken");
            }
        }
        sink.finish("after", true).expect("finished");
        let notes = notes.lock().expect("no panic");
        assert_eq!(notes.len(), 1003);
        assert_eq!((notes[0].as_str(), notes[1002].as_str()), ("before", "after"));
        assert_eq!(notes[501], r#"500 0.5 [500.0, 0.5] ["t500"]"#);
        assert_eq!(notes[502], "between");
    }

    #[test]
    fn texts_hold_until_they_change() {
        let (mut sink, notes) = threaded(u64::MAX);
        for tick in 0..10_000 {
            let text = format!("from {}", tick / 3_000);
            sink.push_row(tick, 0.0, &Row::from_values(vec![1.0], vec![text])).expect("taken");
        }
        sink.finish("after", true).expect("finished");
        let notes = notes.lock().expect("no panic");
        assert_eq!(notes.len(), 10_001);
        for (tick, note) in notes.iter().take(10_000).enumerate() {
            assert_eq!(*note, format!(r#"{tick} 0 [1.0] ["from {}"]"#, tick / 3_000));
        }
    }

    #[test]
    fn a_later_call_returns_the_error_of_the_thread_and_the_sink_can_still_be_finished() {
        let (mut sink, notes) = threaded(300);
        let failed = (0..100_000).find_map(|tick| sink.push_row(tick, tick as f64, &row(tick)).err());
        assert!(failed.expect("an error").to_string().contains("the disk is full"));
        assert_eq!(notes.lock().expect("no panic").len(), 300);
        sink.finish("after", false).expect("finished");
        let (mut sink, _) = threaded(3);
        (0..5).for_each(|tick| sink.push_row(tick, 1e-3 * tick as f64, &row(tick)).expect("taken"));
        assert!(sink.finish("after", true).is_err());
    }
}
