//! Runs a sink on a thread of its own, so that a run does not wait for its recordings.

use std::panic::resume_unwind;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use diagnostics::Error;

use super::{BoxedSink, Derived, Event, Notice, Sink, StatusChange};
use crate::row::{Recorded, Row};

/// As many rows or as much simulated time [s] wake the thread up.
const ROWS: usize = 128;
const SPAN: f64 = 0.1;
/// Waiting rows at most; then the run waits, which bounds the memory.
const WAITING: usize = 8 * ROWS;
/// What a killed program loses at most [s], of simulated time; then the run waits.
const LOST: f64 = 1.0;
/// The thread looks for rows at least as often, and lets the sink save them after twice as long: what a killed program loses
/// was made within a second.
const LOOK: Duration = Duration::from_millis(200);

/// An item of a batch.
enum Item {
    /// A row: its tick, its time, its texts and its integers of 64 bits; the batch holds its numbers.
    Row(u64, f64, Vec<String>, Vec<i128>),
    Event(Event),
    Status(StatusChange),
}

#[derive(Default)]
struct Batch {
    items: Vec<Item>,
    /// The numbers of all rows, one row after the other.
    numbers: Vec<f64>,
    rows: usize,
    since: f64,
}

/// What the run and the thread tell each other.
#[derive(Default)]
struct Desk {
    batch: Batch,
    /// The times of the first row and of the last one [s].
    times: Option<[f64; 2]>,
    /// The time up to which a killed program loses nothing [s].
    saved: f64,
    /// The run waits for room, or for rows to be saved.
    waits: bool,
    /// No item follows.
    closed: bool,
    /// The thread takes no more, because of an error.
    failed: bool,
}

#[derive(Default)]
struct Shared {
    desk: Mutex<Desk>,
    /// For the thread: there is work.
    work: Condvar,
    /// For the run: there is room.
    room: Condvar,
}

impl Shared {
    /// A panic of the other side does not matter here: joining the thread tells it.
    fn desk(&self) -> MutexGuard<'_, Desk> {
        self.desk.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Desk {
    fn wakes(&self) -> bool {
        let Desk { batch, times, .. } = self;
        let span = times.map_or(0.0, |[_, last]| last - batch.since);
        self.closed || self.waits || batch.rows >= ROWS || (batch.rows > 0 && span >= SPAN)
    }

    /// Whether the run waits before the step after the row at this time.
    fn is_behind(&self, [first, before, time]: [f64; 3]) -> bool {
        let (saved, next) = (self.saved, time + (time - before));
        let lost = next - saved > LOST && saved < time;
        // Of a run that was killed there is always something to be found.
        self.batch.rows >= WAITING || saved < first || lost
    }
}

type Done = (BoxedSink, Result<(), Error>);

/// The state of the sink.
enum State {
    /// Not on a thread: before the first item, and after the last row.
    Idle(BoxedSink),
    Working(Arc<Shared>, JoinHandle<Done>),
    /// Between the two.
    Changing,
}

/// A sink on a thread of its own, from its first item to its last row. Its errors come from a later call, at the latest from
/// [`Sink::finish`].
pub struct ThreadedSink {
    state: State,
    /// Rows are handed over up to the first one from this time on [s].
    until: f64,
    /// That one was handed over.
    is_done: bool,
}

impl ThreadedSink {
    /// Wraps a sink. Its thread starts with the first item.
    pub fn new(sink: BoxedSink) -> Self {
        // The first row shows that there is a run at all.
        let until = if sink.takes_rows() { f64::INFINITY } else { f64::NEG_INFINITY };
        ThreadedSink { state: State::Idle(sink), until, is_done: false }
    }

    /// The desk of the thread, which is started if it does not run.
    fn shared(&mut self) -> &Shared {
        if let State::Idle(_) = self.state
            && let State::Idle(sink) = std::mem::replace(&mut self.state, State::Changing)
        {
            let shared = Arc::<Shared>::default();
            shared.desk().saved = sink.saved();
            let of_thread = Arc::clone(&shared);
            let thread = std::thread::spawn(move || work(sink, &of_thread));
            self.state = State::Working(shared, thread);
        }
        let State::Working(shared, _) = &self.state else { unreachable!("it has just begun") };
        shared
    }

    /// Hands over an item of this time [s], and sees to the rows that save it: those of a second.
    fn push(&mut self, time: f64, item: Item) -> Result<(), Error> {
        self.until = self.until.max(time + LOST);
        self.is_done = false;
        let mut desk = self.shared().desk();
        if desk.failed {
            drop(desk);
            return self.caught_up().map(drop);
        }
        desk.batch.items.push(item);
        Ok(())
    }

    /// The sink, after it took all items so far.
    fn caught_up(&mut self) -> Result<&mut BoxedSink, Error> {
        let mut result = Ok(());
        self.state = match std::mem::replace(&mut self.state, State::Changing) {
            State::Working(shared, thread) => {
                shared.desk().closed = true;
                shared.work.notify_one();
                let (sink, ended) = thread.join().unwrap_or_else(|panic| resume_unwind(panic));
                result = ended;
                State::Idle(sink)
            }
            other => other,
        };
        let State::Idle(sink) = &mut self.state else { unreachable!("the thread has ended") };
        result.map(|()| sink)
    }
}

impl Drop for ThreadedSink {
    /// The thread of a sink that is not finished ends, too.
    fn drop(&mut self) {
        if let State::Working(shared, _) = &self.state {
            shared.desk().closed = true;
            shared.work.notify_one();
        }
    }
}

fn work(mut sink: BoxedSink, shared: &Shared) -> Done {
    let mut last_saved = Instant::now();
    loop {
        let waiting = |desk: &mut Desk| !desk.wakes();
        let waited = shared.work.wait_timeout_while(shared.desk(), LOOK, waiting);
        let (mut desk, _) = waited.unwrap_or_else(PoisonError::into_inner);
        let batch = std::mem::take(&mut desk.batch);
        let closed = desk.closed;
        drop(desk);
        shared.room.notify_one();
        let mut result = write(&mut sink, batch);
        if result.is_ok() && last_saved.elapsed() >= 2 * LOOK {
            result = sink.save();
            last_saved = Instant::now();
        }
        let mut desk = shared.desk();
        desk.saved = sink.saved();
        desk.failed = result.is_err();
        drop(desk);
        shared.room.notify_one();
        if closed || result.is_err() {
            return (sink, result);
        }
    }
}

fn write(sink: &mut BoxedSink, batch: Batch) -> Result<(), Error> {
    let mut row = Row::default();
    let width = batch.numbers.len() / batch.rows.max(1);
    let mut numbers = batch.numbers.chunks(width.max(1));
    for item in batch.items {
        match item {
            Item::Row(tick, time, texts, integers) => {
                row.assign(numbers.next().unwrap_or_default(), texts, integers);
                sink.row(tick, time, &row)?;
            }
            Item::Event(event) => sink.event(&event)?,
            Item::Status(change) => sink.status(&change)?,
        }
    }
    Ok(())
}

impl Sink for ThreadedSink {
    fn row(&mut self, tick: u64, time: f64, row: &Row<Recorded>) -> Result<(), Error> {
        if self.is_done {
            return Ok(());
        }
        self.is_done = time >= self.until;
        // Everything up to here is saved when nothing more is handed over.
        let before_end = if self.is_done { self.until - LOST } else { f64::NEG_INFINITY };
        let shared = self.shared();
        let mut desk = shared.desk();
        let [first, before] = desk.times.unwrap_or([time; 2]);
        desk.times = Some([first, time]);
        let batch = &mut desk.batch;
        if batch.rows == 0 {
            batch.since = time;
            batch.numbers.reserve(ROWS * row.numbers().len());
        }
        batch.numbers.extend_from_slice(row.numbers());
        let (texts, integers) = (row.texts().to_vec(), row.integers().to_vec());
        batch.items.push(Item::Row(tick, time, texts, integers));
        batch.rows += 1;
        if desk.wakes() {
            shared.work.notify_one();
        }
        while !desk.failed && (desk.is_behind([first, before, time]) || desk.saved <= before_end) {
            desk.waits = true;
            shared.work.notify_one();
            desk = shared.room.wait(desk).unwrap_or_else(PoisonError::into_inner);
        }
        desk.waits = false;
        if desk.failed {
            drop(desk);
            return self.caught_up().map(drop);
        }
        Ok(())
    }

    fn event(&mut self, event: &Event) -> Result<(), Error> {
        self.push(event.time, Item::Event(event.clone()))
    }

    fn status(&mut self, change: &StatusChange) -> Result<(), Error> {
        self.push(change.time, Item::Status(change.clone()))
    }

    fn derived(&mut self, derived: &Derived) -> Result<(), Error> {
        self.caught_up()?.derived(derived)
    }

    fn diagram(&mut self, belongs: (&str, &str), diagram: &plugin::Diagram) -> Result<(), Error> {
        self.caught_up()?.diagram(belongs, diagram)
    }

    fn finish(&mut self, summary: &str, completed: bool) -> Result<(), Error> {
        self.caught_up()?.finish(summary, completed)
    }

    /// The notices of the sink; none while it works on its thread.
    fn notices(&mut self) -> Vec<Notice> {
        match &mut self.state {
            State::Idle(sink) => sink.notices(),
            State::Working(..) | State::Changing => Vec::new(),
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::{Arc, Mutex};

    use super::*;
    use crate::sink::Level;

    /// Notes each call, and fails at a tick.
    struct Notes {
        notes: Arc<Mutex<Vec<String>>>,
        fails_at: u64,
        rows: bool,
    }

    impl Notes {
        fn note(&self, what: String) {
            self.notes.lock().expect("no panic").push(what);
        }
    }

    impl Sink for Notes {
        fn row(&mut self, tick: u64, time: f64, row: &Row<Recorded>) -> Result<(), Error> {
            if tick == self.fails_at {
                return Err(Error::input("the disk is full"));
            }
            self.note(format!("{tick} {time} {:?} {:?}", row.numbers(), row.texts()));
            Ok(())
        }

        fn takes_rows(&self) -> bool {
            self.rows
        }

        fn event(&mut self, event: &Event) -> Result<(), Error> {
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
        let sink = Notes { notes: Arc::clone(&notes), fails_at, rows: true };
        (ThreadedSink::new(Box::new(sink)), notes)
    }

    fn row(tick: u64) -> Row<Recorded> {
        Row::from_values(vec![tick as f64, 0.5], vec![format!("t{tick}")])
    }

    fn event(time: f64, message: &str) -> Event {
        let message = message.to_owned();
        Event { time, level: Level::Info, source: String::new(), message }
    }

    #[test]
    fn items_arrive_in_their_order() {
        let (mut sink, notes) = threaded(u64::MAX);
        sink.event(&event(0.0, "before")).expect("taken");
        for tick in 0..1000 {
            sink.row(tick, 1e-3 * tick as f64, &row(tick)).expect("taken");
            if tick == 500 {
                sink.event(&event(0.5, "between")).expect("taken");
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
    fn a_sink_that_takes_no_rows_gets_the_first_one_and_those_of_a_second_after_an_event() {
        let notes = Arc::<Mutex<Vec<String>>>::default();
        let inner = Notes { notes: Arc::clone(&notes), fails_at: u64::MAX, rows: false };
        let mut sink = ThreadedSink::new(Box::new(inner));
        for tick in 0..100_000 {
            if tick == 50_000 {
                sink.event(&event(25_000.0, "between")).expect("taken");
            }
            sink.row(tick, 0.5 * tick as f64, &row(tick)).expect("taken");
        }
        sink.finish("after", true).expect("finished");
        let notes = notes.lock().expect("no panic");
        let begins: Vec<_> = notes.iter().filter_map(|note| note.split(' ').next()).collect();
        assert_eq!(begins, ["0", "between", "50000", "50001", "50002", "after"]);
    }

    #[test]
    fn a_later_call_returns_the_error_of_the_thread_and_the_sink_can_still_be_finished() {
        let (mut sink, notes) = threaded(300);
        let failed = (0..100_000).find_map(|tick| sink.row(tick, tick as f64, &row(tick)).err());
        assert!(failed.expect("an error").to_string().contains("the disk is full"));
        assert_eq!(notes.lock().expect("no panic").len(), 300);
        sink.finish("after", false).expect("finished");
        let (mut sink, _) = threaded(3);
        (0..5).for_each(|tick| sink.row(tick, 1e-3 * tick as f64, &row(tick)).expect("taken"));
        assert!(sink.finish("after", true).is_err());
    }
}
