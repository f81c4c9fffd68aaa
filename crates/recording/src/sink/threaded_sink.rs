//! Runs a sink on a thread of its own, so that a run does not wait for its recordings.

use std::panic::resume_unwind;
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::thread::JoinHandle;

use diagnostics::Error;

use super::{BoxedSink, Derived, Event, Notice, Sink, StatusChange};
use crate::row::{Recorded, Row};

/// Rows of a batch at most.
const ROWS: usize = 128;
/// Simulated time of a batch at most [s]: a killed program loses as much.
const SPAN: f64 = 0.1;
/// Waiting batches at most; then the run waits, which bounds the memory.
const WAITING: usize = 8;

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

type Done = (BoxedSink, Result<(), Error>);

/// The state of the sink.
enum State {
    /// Not on a thread: before the first row, and after the last one.
    Idle(BoxedSink),
    Working(SyncSender<Batch>, JoinHandle<Done>),
    /// Between the two.
    Changing,
}

/// A sink on a thread of its own, from its first row to its last one. Its errors come from a later call, at the latest from
/// [`Sink::finish`].
pub struct ThreadedSink {
    state: State,
    batch: Batch,
}

impl ThreadedSink {
    /// Wraps a sink. Its thread starts with the first batch.
    pub fn new(sink: BoxedSink) -> Self {
        Self { state: State::Idle(sink), batch: Batch::default() }
    }

    fn hand_over(&mut self) -> Result<(), Error> {
        let batch = std::mem::take(&mut self.batch);
        if batch.items.is_empty() {
            return Ok(());
        }
        self.state = match std::mem::replace(&mut self.state, State::Changing) {
            State::Idle(sink) => {
                let (sender, receiver) = sync_channel(WAITING);
                let thread = std::thread::spawn(move || work(sink, &receiver));
                State::Working(sender, thread)
            }
            other => other,
        };
        let State::Working(sender, _) = &self.state else { return Ok(()) };
        // The channel is closed: the thread ended with an error.
        if sender.send(batch).is_err() { self.fetch().map(drop) } else { Ok(()) }
    }

    /// Ends the thread and returns the sink.
    fn fetch(&mut self) -> Result<&mut BoxedSink, Error> {
        let mut result = Ok(());
        self.state = match std::mem::replace(&mut self.state, State::Changing) {
            State::Working(sender, thread) => {
                drop(sender);
                let (sink, ended) = thread.join().unwrap_or_else(|panic| resume_unwind(panic));
                result = ended;
                State::Idle(sink)
            }
            other => other,
        };
        let State::Idle(sink) = &mut self.state else { unreachable!("the thread has ended") };
        result.map(|()| sink)
    }

    /// The sink, after it took all items so far.
    fn caught_up(&mut self) -> Result<&mut BoxedSink, Error> {
        self.hand_over()?;
        self.fetch()
    }
}

fn work(mut sink: BoxedSink, batches: &Receiver<Batch>) -> Done {
    let mut row = Row::default();
    for batch in batches {
        let width = batch.numbers.len() / batch.rows.max(1);
        let mut numbers = batch.numbers.chunks(width.max(1));
        for item in batch.items {
            let result = match item {
                Item::Row(tick, time, texts, integers) => {
                    row.assign(numbers.next().unwrap_or_default(), texts, integers);
                    sink.row(tick, time, &row)
                }
                Item::Event(event) => sink.event(&event),
                Item::Status(change) => sink.status(&change),
            };
            if result.is_err() {
                return (sink, result);
            }
        }
    }
    (sink, Ok(()))
}

impl Sink for ThreadedSink {
    fn row(&mut self, tick: u64, time: f64, row: &Row<Recorded>) -> Result<(), Error> {
        let batch = &mut self.batch;
        if batch.rows == 0 {
            batch.since = time;
            batch.numbers.reserve(ROWS * row.numbers().len());
        }
        batch.numbers.extend_from_slice(row.numbers());
        let (texts, integers) = (row.texts().to_vec(), row.integers().to_vec());
        batch.items.push(Item::Row(tick, time, texts, integers));
        batch.rows += 1;
        let full = batch.rows >= ROWS || time - batch.since >= SPAN;
        if full { self.hand_over() } else { Ok(()) }
    }

    fn event(&mut self, event: &Event) -> Result<(), Error> {
        self.batch.items.push(Item::Event(event.clone()));
        Ok(())
    }

    fn status(&mut self, change: &StatusChange) -> Result<(), Error> {
        self.batch.items.push(Item::Status(change.clone()));
        Ok(())
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
        let sink = Notes { notes: Arc::clone(&notes), fails_at };
        (ThreadedSink::new(Box::new(sink)), notes)
    }

    fn row(tick: u64) -> Row<Recorded> {
        Row::from_values(vec![tick as f64, 0.5], vec![format!("t{tick}")])
    }

    #[test]
    fn items_arrive_in_their_order() {
        let (mut sink, notes) = threaded(u64::MAX);
        let event = |message: &str| Event {
            time: 0.0,
            level: Level::Info,
            source: String::new(),
            message: message.to_owned(),
        };
        sink.event(&event("before")).expect("taken");
        for tick in 0..1000 {
            sink.row(tick, 1e-3 * tick as f64, &row(tick)).expect("taken");
            if tick == 500 {
                sink.event(&event("between")).expect("taken");
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
