//! Keeps the messages of each instance until they are taken.

use std::cell::Cell;
use std::collections::BTreeMap;
use std::ffi::{CStr, c_char, c_int, c_void};
use std::ptr;
use std::sync::atomic::Ordering::{AcqRel, Acquire, Relaxed, Release};
use std::sync::atomic::{AtomicBool, AtomicU64};
use std::sync::{Arc, Mutex, PoisonError, RwLock};

use super::WARNING;
use crate::{Message, MessageLevel};

/// The mailboxes of the living instances, and the number of the next one. An FMU may log with an environment that it
/// made up, or with that of an instance that is gone.
static LIVING: RwLock<(usize, BTreeMap<usize, Arc<Waiting>>)> = RwLock::new((1, BTreeMap::new()));

/// How many messages came to any mailbox. Each step of each node asks, and this is one place for all of them.
static CAME: AtomicU64 = AtomicU64::new(0);

thread_local! {
    /// The number of the mailbox whose instance this thread calls, 0 between calls.
    static CALLED: Cell<usize> = const { Cell::new(0) };
}

/// The number from before calls of an instance, which counts again after them.
pub(super) struct Called(usize);

impl Drop for Called {
    #[inline]
    fn drop(&mut self) {
        CALLED.set(self.0);
    }
}

/// The message about an FMU that logs with another environment than it was given.
pub const STRANGER: &str = "it logs with an environment that is not its own: FMI 2.0.4, section 2.1.5, hands the logger the `componentEnvironment` of the callbacks, not the component";

/// What waits for an instance; an FMU may log from a thread of its own.
#[derive(Debug, Default)]
struct Waiting {
    messages: Mutex<Vec<Message>>,
    /// Whether there may be some: a look at this costs less than the lock.
    some: AtomicBool,
    /// Whether a message came with another environment.
    strange: AtomicBool,
}

impl Waiting {
    fn put(&self, message: Message) {
        self.messages.lock().unwrap_or_else(PoisonError::into_inner).push(message);
        self.some.store(true, Release);
        CAME.fetch_add(1, Release);
    }
}

/// The mailbox of an instance.
#[derive(Debug)]
pub(super) struct Mailbox {
    number: usize,
    /// So many messages had come to any mailbox when there was none in this one.
    seen: AtomicU64,
    held: Arc<Waiting>,
}

impl Mailbox {
    pub(super) fn new() -> Self {
        let held = Arc::<Waiting>::default();
        let mut living = LIVING.write().unwrap_or_else(PoisonError::into_inner);
        let number = living.0;
        living.0 += 1;
        living.1.insert(number, Arc::clone(&held));
        Mailbox { number, seen: AtomicU64::new(0), held }
    }

    /// The address that stands for the mailbox: there is nothing at it.
    pub(super) fn environment(&self) -> *mut c_void {
        ptr::without_provenance_mut(self.number)
    }

    /// Runs a call of the instance: a message that comes meanwhile on this thread is its own, whatever environment it names.
    #[inline]
    pub(super) fn during<T>(&self, body: impl FnOnce() -> T) -> T {
        let outer = self.enter();
        let result = body();
        drop(outer);
        result
    }

    /// Calls of the instance go on, until the result is dropped.
    #[inline]
    pub(super) fn enter(&self) -> Called {
        Called(CALLED.replace(self.number))
    }

    /// Warns of what the instance did, in sentences of this program.
    #[cold]
    pub(super) fn warn(&self, sentences: Vec<String>) {
        for text in sentences {
            self.held.put(Message::new(MessageLevel::Warning, "", &text));
        }
    }

    /// Whether messages came since the last time.
    #[inline]
    pub(super) fn has_some(&self) -> bool {
        let came = CAME.load(Acquire);
        if came == self.seen.load(Relaxed) {
            return false;
        }
        let some = self.held.some.load(Relaxed);
        if !some {
            self.seen.store(came, Relaxed);
        }
        some
    }

    /// Takes the messages that came since the last time.
    pub(super) fn take(&self) -> Vec<Message> {
        let Waiting { messages, some, .. } = &*self.held;
        // Whoever logs on another thread meanwhile says so after this, or its message is taken.
        match some.load(Relaxed) && some.swap(false, AcqRel) {
            true => std::mem::take(&mut messages.lock().unwrap_or_else(PoisonError::into_inner)),
            false => Vec::new(),
        }
    }

    /// What the last message says, to be appended to an error.
    pub(super) fn said(&self) -> String {
        let messages = self.held.messages.lock().unwrap_or_else(PoisonError::into_inner);
        messages.last().map(|last| format!("; it says: {}", last.text)).unwrap_or_default()
    }
}

impl Drop for Mailbox {
    fn drop(&mut self) {
        LIVING.write().unwrap_or_else(PoisonError::into_inner).1.remove(&self.number);
    }
}

/// Puts a message where its environment says, or else into the mailbox of the instance that this thread calls, with a warning
/// the first time.
fn put(environment: *mut c_void, message: Message) {
    let living = LIVING.read().unwrap_or_else(PoisonError::into_inner);
    if let Some(own) = living.1.get(&environment.addr()) {
        own.put(message);
    } else if let Some(called) = living.1.get(&CALLED.get()) {
        if !called.strange.swap(true, Relaxed) {
            called.put(Message::new(MessageLevel::Warning, "", STRANGER));
        }
        called.put(message);
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
    unsafe { trackside_take_log(environment, status, category, message) }
}

/// # Safety
/// Called by `logger.c` with C strings or null; the environment may be anything.
#[unsafe(no_mangle)]
unsafe extern "C" fn trackside_take_log(
    environment: *mut c_void,
    status: c_int,
    category: *const c_char,
    text: *const c_char,
) {
    let string = |pointer: *const c_char| match pointer.is_null() {
        true => String::new(),
        // SAFETY: the FMU and `logger.c` hand over C strings.
        false => unsafe { CStr::from_ptr(pointer) }.to_string_lossy().into_owned(),
    };
    let level = match status {
        ..WARNING => MessageLevel::Info,
        WARNING => MessageLevel::Warning,
        _ => MessageLevel::Error,
    };
    put(environment, Message::new(level, &string(category), &string(text)));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn messages_go_to_the_living_instance_that_they_are_for_and_to_no_other() {
        let message = || Message::new(MessageLevel::Info, "logAll", "hello");
        let (one, two) = (Mailbox::new(), Mailbox::new());
        put(one.environment(), message());
        assert_eq!((one.take(), two.take()), (vec![message()], Vec::new()));
        let gone = two.environment();
        drop(two);
        let three = Mailbox::new();
        for stranger in [gone, ptr::null_mut(), ptr::without_provenance_mut(usize::MAX)] {
            put(stranger, message());
        }
        assert_eq!((one.take(), three.take()), (Vec::new(), Vec::new()));
    }

    #[test]
    fn a_message_with_a_strange_environment_goes_to_the_instance_that_is_called_and_is_told_once() {
        let message = || Message::new(MessageLevel::Info, "logAll", "hello");
        let (one, two) = (Mailbox::new(), Mailbox::new());
        let component = ptr::without_provenance_mut(usize::MAX - 7);
        one.during(|| {
            put(component, message());
            two.during(|| put(component, message()));
            put(component, message());
        });
        put(component, message());
        let warning = Message::new(MessageLevel::Warning, "", STRANGER);
        assert_eq!(one.take(), [warning.clone(), message(), message()]);
        assert_eq!(two.take(), [warning, message()]);
    }

    #[test]
    fn a_message_may_come_from_another_thread() {
        let mailbox = Mailbox::new();
        let environment = mailbox.environment().addr();
        let say = move || {
            let at = ptr::without_provenance_mut(environment);
            put(at, Message::new(MessageLevel::Error, "", "from elsewhere"));
        };
        std::thread::spawn(say).join().expect("it ends");
        assert_eq!(mailbox.said(), "; it says: from elsewhere");
        assert_eq!(mailbox.take()[0].level(), MessageLevel::Error);
    }
}
