//! Hands messages to the importer's logger, in the categories that it wants.

use std::ffi::{CString, c_void};

use crate::abi::{Logger, Status};
use crate::instance::Refusal;
use crate::log::{LOG_CATEGORIES, Message, take_messages};

/// The category of what is worth telling of any run.
pub(super) const EVENTS: &str = LOG_CATEGORIES[Status::Ok as usize].0;
/// Categories that are on before anyone asks: without them a failure would be silent.
pub(super) const ALWAYS: u64 =
    1 << Status::Discard as u64 | 1 << Status::Error as u64 | 1 << Status::Fatal as u64;

/// The importer's logger.
pub(super) struct Log {
    pub name: CString,
    pub logger: Logger,
    pub environment: *mut c_void,
    /// The model's own categories, numbered after [`LOG_CATEGORIES`].
    pub own: &'static [(&'static str, &'static str)],
    /// Bit `i` is set when category `i` is wanted.
    pub wanted: u64,
}

impl Log {
    /// The bit of a category.
    pub fn bit(&self, category: &str) -> Option<u64> {
        let place =
            LOG_CATEGORIES.iter().chain(self.own).position(|(name, _)| *name == category)?;
        1_u64.checked_shl(place as u32)
    }

    pub fn send(&self, status: Status, category: &str, message: &str) {
        if self.bit(category).is_none_or(|bit| self.wanted & bit == 0) {
            return;
        }
        let text = CString::new(message.replace('\0', "?")).unwrap_or_default();
        let category = CString::new(category).unwrap_or_default();
        // SAFETY: the importer's logger takes these arguments. The message is an argument of a fixed
        // format, so that a percent sign in it means nothing.
        unsafe {
            (self.logger)(
                self.environment,
                self.name.as_ptr(),
                status,
                category.as_ptr(),
                c"%s".as_ptr(),
                text.as_ptr(),
            );
        }
    }

    pub fn status(&self, refusal: &Refusal) {
        self.send(refusal.status, LOG_CATEGORIES[refusal.status as usize].0, &refusal.message);
    }

    /// Hands over what the model said during a call, and gives the worst status of it.
    pub fn messages(&self) -> Status {
        let mut worst = Status::Ok;
        for Message { status, category, text } in take_messages() {
            self.send(status, category, &text);
            worst = worst.max(status);
        }
        worst
    }
}
