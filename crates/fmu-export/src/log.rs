//! Takes the messages of a model until the call that it works for ends and hands them to the importer.

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

/// What a model had to say during a call.
pub(crate) struct Message {
    pub status: Status,
    pub category: &'static str,
    pub text: String,
}

thread_local! {
    /// A model runs on the thread of the call, so messages of several instances do not mix. It is empty
    /// between calls: never dropping it leaks nothing, while a destructor would keep the library of the
    /// model loaded for as long as the thread lives.
    static MESSAGES: ManuallyDrop<RefCell<Vec<Message>>> =
        const { ManuallyDrop::new(RefCell::new(Vec::new())) };
}

/// Sends a message to the importer's log, in a category of [`crate::Info::log_categories`].
pub fn log(category: &'static str, text: impl Into<String>) {
    push(Message { status: Status::Ok, category, text: text.into() });
}

/// Warns the importer: the call goes on, and returns `fmi2Warning` when nothing worse happens.
pub fn warn(text: impl Into<String>) {
    let category = LOG_CATEGORIES[Status::Warning as usize].0;
    push(Message { status: Status::Warning, category, text: text.into() });
}

fn push(message: Message) {
    MESSAGES.with(|messages| messages.borrow_mut().push(message));
}

pub(crate) fn take_messages() -> Vec<Message> {
    MESSAGES.with(|messages| take(&mut *messages.borrow_mut()))
}
