//! Collects the log messages of a call until it ends, when the importer gets them.

use std::cell::RefCell;
use std::mem::{ManuallyDrop, take};

use crate::abi::Status;

/// The log categories of every unit, with what they carry. The number of a status is the number of its
/// category.
pub const LOG_CATEGORIES: [(&str, &str); 5] = [
    ("logEvents", "Instantiation, initialisation, reset and termination"),
    ("logStatusWarning", "Results to look at"),
    ("logStatusDiscard", "Steps that were not completed"),
    ("logStatusError", "Calls that failed"),
    ("logStatusFatal", "Failures that no call recovers from"),
];

/// The category of what a model is, in one line for each of its parts that an engineer wants to see before a run: [`log()`](log) it in
/// `initialise`. Importers get it whether or not they turned debug logging on.
pub const SUMMARY: &str = "summary";

/// A message of a call.
pub(crate) struct PendingLogMessage {
    pub status: Status,
    pub category: &'static str,
    pub text: String,
}

thread_local! {
    /// A model runs on the thread of the call, so messages of several instances do not mix. It is empty
    /// between calls, so nothing leaks without a destructor; one would keep the model's library loaded
    /// for as long as the thread lives.
    static MESSAGES: ManuallyDrop<RefCell<Vec<PendingLogMessage>>> =
        const { ManuallyDrop::new(RefCell::new(Vec::new())) };
}

/// Sends a message to the importer's log, in a category of `Info::log_categories`.
///
/// The importer gets the messages of a call, in their order, when the call ends, if it turned the category on; [`SUMMARY`] is on by
/// itself. Messages from other threads, and from outside of a call, are lost.
pub fn log(category: &'static str, text: impl Into<String>) {
    push_message(PendingLogMessage { status: Status::Ok, category, text: text.into() });
}

/// Warns the importer: the call goes on, and returns `fmi2Warning` unless something worse happens. Warnings are on by themselves, as
/// errors are.
pub fn warn(text: impl Into<String>) {
    let category = LOG_CATEGORIES[Status::Warning as usize].0;
    push_message(PendingLogMessage { status: Status::Warning, category, text: text.into() });
}

/// Logs a change of the instance's state.
pub(crate) fn log_event(text: impl Into<String>) {
    push_message(PendingLogMessage {
        status: Status::Ok,
        category: LOG_CATEGORIES[Status::Ok as usize].0,
        text: text.into(),
    });
}

fn push_message(message: PendingLogMessage) {
    MESSAGES.with(|messages| messages.borrow_mut().push(message));
}

/// The messages of this thread since they were last taken.
pub(crate) fn take_messages() -> Vec<PendingLogMessage> {
    MESSAGES.with(|messages| take(&mut *messages.borrow_mut()))
}

/// Whether this thread has messages.
#[inline]
pub(crate) fn has_messages() -> bool {
    MESSAGES.with(|messages| !messages.borrow().is_empty())
}

/// Forgets the messages of this thread.
#[inline]
pub(crate) fn discard_messages() {
    if has_messages() {
        take_messages();
    }
}
