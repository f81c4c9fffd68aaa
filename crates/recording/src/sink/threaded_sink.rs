//! Lets a sink work on a thread of its own, so that a run and its recordings go on at the same time.

use std::panic::resume_unwind;
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::thread::JoinHandle;

use diagnostics::Error;

use super::{Derived, Event, Sink, StatusChange};
use crate::row::{Recorded, Row};

/// Rows that are handed over at once, at most.
const ROWS: usize = 128;
/// Simulated time that is [s], at most: what is lost when the program is killed.
const SPAN: f64 = 0.1;
/// Batches that may wait; then the run waits, instead of filling the memory.
const WAITING: usize = 8;

/// What is handed over, in its order.
enum Item {
    /// Its tick, its time and its texts; the numbers are in the batch.
    Row(u64, f64, Vec<String>),
    Event(Event),
    Status(StatusChange),
}

#[derive(Default)]
struct Batch {
    items: Vec<Item>,
    /// Of all rows, one after the other.
    numbers: Vec<f64>,
    rows: usize,
    since: f64,
}

type Done = (Box<dyn Sink + Send>, Result<(), Error>);

/// Where the sink is.
enum Place {
    Here(Box<dyn Sink + Send>),
    There(SyncSender<Batch>, JoinHandle<Done>),
    /// On the way from one to the other.
    Away,
}

/// A sink that works on a thread of its own from its first row until its last one. What it fails with is told by one of the
/// calls that follow, at the latest by [`Sink::finish`].
pub struct ThreadedSink {
    place: Place,
    batch: Batch,
    url: Option<String>,
}

impl ThreadedSink {
    /// Not yet on a thread.
    pub fn new(sink: Box<dyn Sink + Send>) -> Self {
        let url = sink.url().map(str::to_owned);
        Self { place: Place::Here(sink), batch: Batch::default(), url }
    }

    fn hand_over(&mut self) -> Result<(), Error> {
        let batch = std::mem::take(&mut self.batch);
        if batch.items.is_empty() {
            return Ok(());
        }
        self.place = match std::mem::replace(&mut self.place, Place::Away) {
            Place::Here(sink) => {
                let (sender, receiver) = sync_channel(WAITING);
                let thread = std::thread::spawn(move || work(sink, &receiver));
                Place::There(sender, thread)
            }
            other => other,
        };
        let Place::There(sender, _) = &self.place else { return Ok(()) };
        // Nobody takes it: the thread ended with an error.
        if sender.send(batch).is_err() { self.fetch().map(drop) } else { Ok(()) }
    }

    /// The sink, once it took all that was handed over.
    fn fetch(&mut self) -> Result<&mut Box<dyn Sink + Send>, Error> {
        let mut result = Ok(());
        self.place = match std::mem::replace(&mut self.place, Place::Away) {
            Place::There(sender, thread) => {
                drop(sender);
                let (sink, ended) = thread.join().unwrap_or_else(|panic| resume_unwind(panic));
                result = ended;
                Place::Here(sink)
            }
            other => other,
        };
        let Place::Here(sink) = &mut self.place else { unreachable!("it was fetched") };
        result.map(|()| sink)
    }

    /// The sink after all that came so far.
    fn caught_up(&mut self) -> Result<&mut Box<dyn Sink + Send>, Error> {
        self.hand_over()?;
        self.fetch()
    }
}

fn work(mut sink: Box<dyn Sink + Send>, batches: &Receiver<Batch>) -> Done {
    let mut row = Row::default();
    for batch in batches {
        let width = batch.numbers.len() / batch.rows.max(1);
        let mut numbers = batch.numbers.chunks(width.max(1));
        for item in batch.items {
            let result = match item {
                Item::Row(tick, time, texts) => {
                    row.assign(numbers.next().unwrap_or_default(), texts);
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
        batch.items.push(Item::Row(tick, time, row.texts().to_vec()));
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

    fn url(&self) -> Option<&str> {
        self.url.as_deref()
    }

    fn warning(&self) -> Option<&str> {
        match &self.place {
            Place::Here(sink) => sink.warning(),
            Place::There(..) | Place::Away => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::{Arc, Mutex};

    use super::*;
    use crate::sink::Level;

    /// Writes down what it takes, and fails at a tick.
    struct Notes {
        told: Arc<Mutex<Vec<String>>>,
        fails_at: u64,
    }

    impl Notes {
        fn note(&self, what: String) {
            self.told.lock().expect("no panic").push(what);
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

    fn beside(fails_at: u64) -> (ThreadedSink, Arc<Mutex<Vec<String>>>) {
        let told = Arc::default();
        let notes = Notes { told: Arc::clone(&told), fails_at };
        (ThreadedSink::new(Box::new(notes)), told)
    }

    fn row(tick: u64) -> Row<Recorded> {
        Row::from_values(vec![tick as f64, 0.5], vec![format!("t{tick}")])
    }

    #[test]
    fn all_arrives_in_its_order() {
        let (mut sink, told) = beside(u64::MAX);
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
        let told = told.lock().expect("no panic");
        assert_eq!(told.len(), 1003);
        assert_eq!((told[0].as_str(), told[1002].as_str()), ("before", "after"));
        assert_eq!(told[501], r#"500 0.5 [500.0, 0.5] ["t500"]"#);
        assert_eq!(told[502], "between");
    }

    #[test]
    fn what_it_fails_with_is_told_and_it_can_still_be_finished() {
        let (mut sink, told) = beside(300);
        let failed = (0..100_000).find_map(|tick| sink.row(tick, tick as f64, &row(tick)).err());
        assert!(failed.expect("an error").to_string().contains("the disk is full"));
        assert_eq!(told.lock().expect("no panic").len(), 300);
        sink.finish("after", false).expect("finished");
        let (mut sink, _) = beside(3);
        (0..5).for_each(|tick| sink.row(tick, 1e-3 * tick as f64, &row(tick)).expect("taken"));
        assert!(sink.finish("after", true).is_err());
    }
}
