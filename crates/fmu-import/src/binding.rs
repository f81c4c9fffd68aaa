//! Calls an FMU's library: the one place of this crate where foreign code runs.
//!
//! What an FMU hands over is not trusted where that can be avoided: statuses and booleans come in as plain integers, texts
//! are copied at once, and the environment of a log message is looked up, never dereferenced.
#![expect(unsafe_code, reason = "calling a C library")]

mod activity;
mod derivative;
mod ending;
mod events;
mod functions;
mod instance;
mod instantiation;
mod late;
mod lent;
mod library;
mod mailbox;
mod numbers;
mod phase;
mod state;
mod status;
mod step;
mod surroundings;
mod texts;
mod three;
mod values;
mod variables;
mod visit;

use std::ffi::{CString, c_int, c_void};

use crate::CallError;
pub use activity::{calls_going_on, during_plugin, leave_signals_alone, watch};
pub use ending::{
    LastNote, complete, completed, guard_exit, ignore_requests_to_end, leave, note_requests_to_end,
    requested_end, write_notes_to,
};
pub use instance::Instance;
pub use late::late_messages;
pub use library::Library;
pub(crate) use library::is_loaded;
pub use mailbox::STRANGER;
pub use state::FmuState;
pub use surroundings::changed_surroundings;
pub use three::Block;
pub use visit::Visit;

/// The name of a function in the version of an instance's library.
macro_rules! named {
    ($library:expr, $two:literal, $three:literal) => {
        match $library.description().version {
            $crate::Version::Two => $two,
            $crate::Version::Three => $three,
        }
    };
}
use named;

type Component = *mut c_void;
type Status = c_int;
type Call = unsafe extern "C" fn(Component) -> Status;
const OK: Status = 0;
const WARNING: Status = 1;
const DISCARD: Status = 2;
const ERROR: Status = 3;
const FATAL: Status = 4;
const PENDING: Status = 5;

/// The text for C, which ends at the first NUL: a text with one in it would arrive cut.
fn c_text(call: &'static str, text: &str) -> Result<CString, CallError> {
    CString::new(text).map_err(|_| {
        CallError::new(call, format!("is not called: the text {text:?} contains the character NUL"))
    })
}
