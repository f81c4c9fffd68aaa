//! Hands messages to the importer's logger, in the categories that it enabled.

use std::ffi::{CString, c_void};
use std::sync::Arc;

use crate::abi::{LogMessage, Logger, Status};
use crate::error::FmiError;
use crate::log::{LOG_CATEGORIES, PendingLogMessage, SUMMARY, take_messages};

/// Categories that are on by default: without them a warning or a failure would be silent.
pub(super) const ALWAYS: u64 = 1 << Status::Warning as u64
    | 1 << Status::Discard as u64
    | 1 << Status::Error as u64
    | 1 << Status::Fatal as u64;

/// The logger of an importer, as its version of FMI has it.
#[derive(Clone, Copy)]
pub(super) enum LoggerCallback {
    Two(Logger),
    Three(LogMessage),
}

/// The importer, as it introduced itself when it made the instance.
pub(super) struct ImporterLogger {
    /// The importer's name of the instance.
    pub name: CString,
    pub logger: LoggerCallback,
    pub environment: *mut c_void,
}

// SAFETY: the importer calls and frees an instance on any of its threads, and expects its environment back on
// each of them; nothing else is done with the pointer.
unsafe impl Send for ImporterLogger {}
// SAFETY: nothing in it changes.
unsafe impl Sync for ImporterLogger {}

/// The log of an instance.
pub(super) struct Log {
    /// Shared with the delivery that is under way: the logger may free the instance.
    pub importer: Arc<ImporterLogger>,
    /// The model's own categories, numbered after [`LOG_CATEGORIES`].
    pub own: &'static [(&'static str, &'static str)],
    /// Bit `i` is set when category `i` is enabled.
    pub enabled: u64,
}

impl Log {
    /// The bit of a category.
    pub fn category_bit(&self, category: &str) -> Option<u64> {
        let index = LOG_CATEGORIES.iter().chain(self.own).position(|(name, _)| *name == category)?;
        1_u64.checked_shl(index as u32)
    }

    /// Takes the messages of a call, its error last, and gives the status that the call returns.
    pub fn collect_messages(&self, error: Option<FmiError>) -> (Status, MessageDelivery) {
        let mut messages = take_messages();
        let worst = messages.iter().map(|message| message.status).max().unwrap_or(Status::Ok);
        let status = error.as_ref().map_or(worst, |error| error.status);
        messages.extend(error.map(|FmiError { status, message }| PendingLogMessage {
            status,
            category: LOG_CATEGORIES[status as usize].0,
            text: message,
        }));
        let enabled = |message: &PendingLogMessage| {
            message.category == SUMMARY
                || self.category_bit(message.category).is_some_and(|bit| self.enabled & bit != 0)
        };
        messages.retain(enabled);
        (status, MessageDelivery { importer: Arc::clone(&self.importer), messages })
    }
}

/// Messages on their way to the importer. It borrows nothing of the instance.
#[must_use]
pub(super) struct MessageDelivery {
    importer: Arc<ImporterLogger>,
    messages: Vec<PendingLogMessage>,
}

impl MessageDelivery {
    /// Calls the logger with each message, in their order.
    pub fn deliver(self) {
        let ImporterLogger { name, logger, environment } = &*self.importer;
        for PendingLogMessage { status, category, text } in self.messages {
            let text = CString::new(text.replace('\0', "?")).unwrap_or_default();
            let category = CString::new(category).unwrap_or_default();
            let (category, text) = (category.as_ptr(), text.as_ptr());
            // SAFETY: the importer's logger takes these arguments. In FMI 2.0 the message is an argument of a fixed
            // format, so that a percent sign in it means nothing.
            match *logger {
                LoggerCallback::Two(logger) => unsafe {
                    logger(*environment, name.as_ptr(), status, category, c"%s".as_ptr(), text);
                },
                LoggerCallback::Three(logger) => unsafe {
                    logger(*environment, status, category, text);
                },
            }
        }
    }
}
