//! Routes log messages of FMUs to a mailbox of their instance, until they are taken.

mod queue;

use std::borrow::Cow;
use std::cell::Cell;
use std::collections::BTreeMap;
use std::ffi::{CStr, c_char, c_int, c_void};
use std::ptr;
use std::sync::atomic::AtomicU64;
use std::sync::atomic::Ordering::{Acquire, Relaxed};
use std::sync::{Arc, PoisonError, RwLock};

use self::queue::MessageQueue;
use super::WARNING;
use super::call_monitor::CallMonitor;
use crate::{FmuMessage, MessageLevel};

/// The mailboxes of the living instances, and the number of the next one. An FMU may log with an environment that it
/// made up, or with that of an instance that is gone.
static MAILBOXES: RwLock<(usize, BTreeMap<usize, Arc<MessageQueue>>)> = RwLock::new((1, BTreeMap::new()));

/// How many messages came to any mailbox. Each step of each node asks, and this is one place for all of them.
static RECEIVED: AtomicU64 = AtomicU64::new(0);

thread_local! {
    /// The number of the mailbox whose instance this thread calls, 0 between calls.
    static CALLER: Cell<usize> = const { Cell::new(0) };
}

/// The number from before calls of an instance, which counts again after them.
pub(super) struct CurrentMailboxGuard(usize);

impl Drop for CurrentMailboxGuard {
    #[inline]
    fn drop(&mut self) {
        CALLER.set(self.0);
    }
}

impl CurrentMailboxGuard {
    /// The number that counts now, which counts again when this is dropped.
    #[inline]
    pub(super) fn take() -> Self {
        CurrentMailboxGuard(CALLER.get())
    }
}

/// The message about an FMU that logs with another environment than it was given.
pub const FOREIGN_ENVIRONMENT: &str = "it logs with an environment that is not its own: FMI 2.0.4, section 2.1.5, hands the logger the `componentEnvironment` of the callbacks, not the component";

/// The mailbox of an instance.
#[derive(Debug)]
pub(super) struct MessageMailbox {
    number: usize,
    /// So many messages had come to any mailbox when there was none in this one.
    seen: AtomicU64,
    queue: Arc<MessageQueue>,
}

impl MessageMailbox {
    /// The mailbox of an instance whose calls are noted here; `every` asks for each message, also of a kind that came before.
    pub(super) fn new(activity: Arc<CallMonitor>, every: bool) -> Self {
        let held = Arc::new(MessageQueue::new(activity, every));
        let mut living = MAILBOXES.write().unwrap_or_else(PoisonError::into_inner);
        let number = living.0;
        living.0 += 1;
        living.1.insert(number, Arc::clone(&held));
        MessageMailbox { number, seen: AtomicU64::new(0), queue: held }
    }

    /// The address that stands for the mailbox: there is nothing at it.
    pub(super) fn environment_pointer(&self) -> *mut c_void {
        ptr::without_provenance_mut(self.number)
    }

    /// Runs a call of the instance: a message that comes meanwhile on this thread is its own, whatever environment it names.
    #[inline]
    pub(super) fn receive_during_call<T>(&self, body: impl FnOnce() -> T) -> T {
        let outer = self.mark_as_current();
        let result = body();
        drop(outer);
        result
    }

    /// Calls of the instance go on, until the result is dropped.
    #[inline]
    pub(super) fn mark_as_current(&self) -> CurrentMailboxGuard {
        CurrentMailboxGuard(CALLER.replace(self.number))
    }

    /// The same until the next one, or until the number from before counts again.
    #[inline]
    pub(super) fn become_current(&self, _until: &CurrentMailboxGuard) {
        CALLER.set(self.number);
    }

    /// Warns of what the instance did, in sentences of this program.
    #[cold]
    pub(super) fn add_warnings(&self, sentences: impl Iterator<Item = String>) {
        sentences.for_each(|text| self.queue.push_message(MessageLevel::Warning, "", &text));
    }

    /// Notes that a call returned the status warning, with the name of both.
    #[cold]
    pub(super) fn record_warning_status(&self, status: &str) {
        self.queue.record_warning_status(status);
    }

    /// Whether messages of new kinds came since the last time, or any where each is wanted.
    #[inline]
    pub(super) fn has_new_messages(&self) -> bool {
        let came = RECEIVED.load(Acquire);
        if came == self.seen.load(Relaxed) {
            return false;
        }
        let some = self.queue.some.load(Relaxed);
        if !some {
            self.seen.store(came, Relaxed);
        }
        some
    }

    /// Takes the messages that came since the last time, and after them how often those came again that do not come one by one.
    pub(super) fn take_messages(&self) -> Vec<FmuMessage> {
        self.queue.take_messages()
    }

    /// What the last message of this moment says, to be appended to an error.
    pub(super) fn last_message(&self) -> String {
        self.queue.last_message()
    }
}

impl Drop for MessageMailbox {
    fn drop(&mut self) {
        MAILBOXES.write().unwrap_or_else(PoisonError::into_inner).1.remove(&self.number);
    }
}

/// Whether messages came to any instance since so many had been seen; all are seen then.
#[must_use]
#[inline]
pub fn has_new_messages(seen: &mut u64) -> bool {
    let came = RECEIVED.load(Acquire);
    std::mem::replace(seen, came) != came
}

/// The address that stands for the mailbox of the instance that this thread calls; none between calls.
pub(super) fn current_environment() -> Option<*mut c_void> {
    Some(CALLER.get()).filter(|number| *number != 0).map(ptr::without_provenance_mut)
}

/// Puts a message where its environment says, or else into the mailbox of the instance that this thread calls, with a warning
/// the first time.
fn deliver_message(environment: *mut c_void, level: MessageLevel, category: &str, text: &str) {
    let living = MAILBOXES.read().unwrap_or_else(PoisonError::into_inner);
    if let Some(own) = living.1.get(&environment.addr()) {
        own.push_message(level, category, text);
    } else if let Some(called) = living.1.get(&CALLER.get()) {
        if !called.strange.swap(true, Relaxed) {
            called.push_message(MessageLevel::Warning, "", FOREIGN_ENVIRONMENT);
        }
        called.push_message(level, category, text);
    }
}

/// The `logMessage` of FMI 3.0.
///
/// # Safety
/// Called by an FMU with C strings or null; the environment may be anything.
pub(super) unsafe extern "C" fn take_message(
    environment: *mut c_void,
    status: c_int,
    category: *const c_char,
    message: *const c_char,
) {
    // SAFETY: as for this function.
    unsafe { trackside_take_log(environment, status, category, message, 0) }
}

/// Takes a message; of a text that was cut before, `length` is that of the whole [B].
///
/// # Safety
/// Called by `logger.c` with C strings or null; the environment may be anything.
#[unsafe(no_mangle)]
pub(super) unsafe extern "C" fn trackside_take_log(
    environment: *mut c_void,
    status: c_int,
    category: *const c_char,
    text: *const c_char,
    length: usize,
) {
    let bytes = |pointer: *const c_char| match pointer.is_null() {
        true => &[][..],
        // SAFETY: the FMU and `logger.c` hand over C strings, which last until this function returns.
        false => unsafe { CStr::from_ptr(pointer) }.to_bytes(),
    };
    take_log_bytes(environment, status, bytes(category), bytes(text), length);
}

/// Takes a message; of a text that was cut before, `length` is that of the whole [B].
pub(super) fn take_log_bytes(
    environment: *mut c_void,
    status: c_int,
    category: &[u8],
    text: &[u8],
    length: usize,
) {
    let level = match status {
        ..WARNING => MessageLevel::Info,
        WARNING => MessageLevel::Warning,
        _ => MessageLevel::Error,
    };
    deliver_message(environment, level, &decode_log_text(category, 0), &decode_log_text(text, length));
}

/// Takes a sentence of this program about the call that this thread makes.
pub(super) fn report_refused_call(why: &str) {
    let living = MAILBOXES.read().unwrap_or_else(PoisonError::into_inner);
    if let Some(called) = living.1.get(&CALLER.get()) {
        called.push_message(MessageLevel::Error, "", why);
    }
}

/// Longer texts are cut [B]; `logger.c` cuts there, too.
const LONGEST: usize = 4096;

/// The text of these bytes, at most [`LONGEST`] of them, without blanks and ends of lines behind it. `length` is that of the whole text,
/// if the bytes are not all of it. FMI wants UTF-8; what is none counts as Latin-1, which tools of Western Europe write.
fn decode_log_text(bytes: &[u8], length: usize) -> Cow<'_, str> {
    let (bytes, length) = (&bytes[..bytes.len().min(LONGEST)], length.max(bytes.len()));
    let text = match std::str::from_utf8(bytes) {
        Ok(text) => Cow::Borrowed(text.trim_end()),
        Err(_) => {
            let mut text = String::new();
            for chunk in bytes.utf8_chunks() {
                text += chunk.valid();
                text.extend(chunk.invalid().iter().map(|byte| char::from(*byte)));
            }
            Cow::Owned(text.trim_end().to_owned())
        }
    };
    match length > bytes.len() {
        true => Cow::Owned(format!("{text} ... ({length} bytes in all)")),
        false => text,
    }
}

#[cfg(test)]
mod tests {
    use super::queue::MOST_WAITING;
    use super::*;

    fn mailbox(every: bool) -> MessageMailbox {
        MessageMailbox::new(CallMonitor::new("node `x`"), every)
    }

    fn hello() -> FmuMessage {
        FmuMessage::new(MessageLevel::Info, "logAll", "hello")
    }

    fn put_hello(environment: *mut c_void) {
        deliver_message(environment, MessageLevel::Info, "logAll", "hello");
    }

    #[test]
    fn messages_go_to_the_living_instance_that_they_are_for_and_to_no_other() {
        let (one, two) = (mailbox(false), mailbox(false));
        put_hello(one.environment_pointer());
        assert_eq!((one.take_messages(), two.take_messages()), (vec![hello()], Vec::new()));
        let gone = two.environment_pointer();
        drop(two);
        let three = mailbox(false);
        for stranger in [gone, ptr::null_mut(), ptr::without_provenance_mut(usize::MAX)] {
            put_hello(stranger);
        }
        assert_eq!((one.take_messages(), three.take_messages()), (Vec::new(), Vec::new()));
    }

    #[test]
    fn a_message_with_a_strange_environment_goes_to_the_instance_that_is_called_and_is_told_once() {
        let (one, two) = (mailbox(true), mailbox(true));
        let component = ptr::without_provenance_mut(usize::MAX - 7);
        one.receive_during_call(|| {
            put_hello(component);
            two.receive_during_call(|| put_hello(component));
            put_hello(component);
        });
        put_hello(component);
        let warning = FmuMessage::new(MessageLevel::Warning, "", FOREIGN_ENVIRONMENT);
        assert_eq!(one.take_messages(), [warning.clone(), hello(), hello()]);
        assert_eq!(two.take_messages(), [warning, hello()]);
    }

    #[test]
    fn a_message_may_come_from_another_thread() {
        let mailbox = mailbox(false);
        let environment = mailbox.environment_pointer().addr();
        let say = move || {
            let at = ptr::without_provenance_mut(environment);
            deliver_message(at, MessageLevel::Error, "", "from elsewhere");
        };
        std::thread::spawn(say).join().expect("it ends");
        assert_eq!(mailbox.last_message(), "; it says: from elsewhere");
        assert_eq!(mailbox.take_messages()[0].level(), MessageLevel::Error);
    }

    #[test]
    fn messages_of_a_known_kind_are_counted() {
        let mailbox = mailbox(false);
        let log =
            |text: &str| deliver_message(mailbox.environment_pointer(), MessageLevel::Warning, "", text);
        log("late at 1 s");
        assert!(mailbox.has_new_messages());
        assert_eq!(mailbox.take_messages()[0].text, "late at 1 s");
        (2..=1000).for_each(|time| log(&format!("late at {time} s")));
        assert!(!mailbox.has_new_messages());
        assert_eq!(mailbox.last_message(), "; it says: late at 1000 s");
        let mut again = FmuMessage::new(MessageLevel::Warning, "", "late at 1 s");
        again.again = 999;
        assert_eq!((mailbox.take_messages(), mailbox.take_messages()), (vec![again], Vec::new()));
        for number in 0..100_000 {
            log(&format!("another text{number}"));
        }
        let taken = mailbox.take_messages();
        assert_eq!(taken.len(), crate::MOST_KINDS + 1);
        let last = taken.last().expect("a message");
        assert_eq!(last.again, 100_000 - crate::MOST_KINDS as u64);
        assert!(last.text.ends_with("the first of which says: another text99"), "{}", last.text);
    }

    #[test]
    fn each_message_is_handed_over_where_that_is_asked_for_and_not_beyond_all_bounds() {
        let mailbox = mailbox(true);
        (0..2 * MOST_WAITING).for_each(|_| put_hello(mailbox.environment_pointer()));
        let taken = mailbox.take_messages();
        assert_eq!(taken.len(), MOST_WAITING + 1);
        assert_eq!(taken[MOST_WAITING].again, MOST_WAITING as u64);
    }

    #[test]
    fn a_warning_of_a_call_has_the_words_that_came_in_it() {
        for every in [false, true] {
            let mailbox = mailbox(every);
            let call = |text: &str| {
                mailbox.queue.activity.begin_call(c"fmi2DoStep");
                if !text.is_empty() {
                    deliver_message(mailbox.environment_pointer(), MessageLevel::Info, "", text);
                }
                mailbox.record_warning_status("fmi2DoStep returned fmi2Warning");
            };
            let expected = "fmi2DoStep returned fmi2Warning: 3 turns";
            call("3 turns");
            call("4 turns");
            let taken = mailbox.take_messages();
            assert_eq!((taken[0].text.as_str(), taken[0].level()), (expected, MessageLevel::Warning));
            let count = |taken: &[FmuMessage]| taken.iter().map(|it| it.again.max(1)).sum::<u64>();
            assert_eq!((taken.len(), count(&taken)), (2, 2));
            call("");
            call("5 turns");
            let taken = mailbox.take_messages();
            assert!(taken[0].text.contains("logs nothing about it"), "{taken:?}");
            assert_eq!((taken.len(), count(&taken)), (2, 2));
        }
        // A kind that came before in a call without a warning.
        let mailbox = mailbox(false);
        deliver_message(mailbox.environment_pointer(), MessageLevel::Error, "", "odd");
        mailbox.take_messages();
        mailbox.queue.activity.begin_call(c"fmi2SetReal");
        deliver_message(mailbox.environment_pointer(), MessageLevel::Error, "", "odd");
        mailbox.record_warning_status("fmi2SetReal returned fmi2Warning");
        let taken = mailbox.take_messages();
        assert_eq!((taken.len(), taken[0].level()), (1, MessageLevel::Error));
        assert_eq!(taken[0].text, "fmi2SetReal returned fmi2Warning: odd");
    }

    #[test]
    fn texts_are_bounded_and_of_any_bytes() {
        assert_eq!(decode_log_text(b"one\ntwo \r\n", 0), "one\ntwo");
        assert_eq!(decode_log_text(b"Gr\xf6\xdfe \xc3\xa4", 0), "Gr\u{f6}\u{df}e \u{e4}");
        let long = decode_log_text(&[b'x'; 1_000_000], 0).into_owned();
        assert!(long.len() < LONGEST + 40 && long.ends_with("x ... (1000000 bytes in all)"));
        assert_eq!(decode_log_text(b"xy", 3), "xy ... (3 bytes in all)");
    }
}
