//! Calls an FMU's library: the one place of this crate where foreign code runs.
//!
//! What an FMU hands over is not trusted where that can be avoided: statuses and booleans come in as plain integers, texts
//! are copied at once, and the environment of a log message is looked up, never dereferenced.
#![expect(unsafe_code, reason = "calling a C library")]

mod activity;
mod derivative;
mod instance;
mod library;
mod mailbox;
mod state;
mod status;
mod values;

use std::ffi::{CString, c_char, c_int, c_void};

use crate::CallError;
pub use activity::watch;
pub use instance::Instance;
pub use library::Library;
pub use mailbox::STRANGER;
pub use state::FmuState;

type Component = *mut c_void;
type Status = c_int;
type Call = unsafe extern "C" fn(Component) -> Status;
type Get<T> = unsafe extern "C" fn(Component, *const u32, usize, *mut T) -> Status;
type Set<T> = unsafe extern "C" fn(Component, *const u32, usize, *const T) -> Status;
type Instantiate = unsafe extern "C" fn(
    *const c_char,
    c_int,
    *const c_char,
    *const c_char,
    *const CallbackFunctions,
    c_int,
    c_int,
) -> Component;

const OK: Status = 0;
const WARNING: Status = 1;
const DISCARD: Status = 2;
const ERROR: Status = 3;
const FATAL: Status = 4;
const PENDING: Status = 5;

#[repr(C)]
struct CallbackFunctions {
    logger:
        unsafe extern "C" fn(*mut c_void, *const c_char, c_int, *const c_char, *const c_char, ...),
    allocate_memory: unsafe extern "C" fn(usize, usize) -> *mut c_void,
    free_memory: unsafe extern "C" fn(*mut c_void),
    step_finished: Option<unsafe extern "C" fn(*mut c_void, Status)>,
    environment: *mut c_void,
}

unsafe extern "C" {
    /// Defined in `logger.c`.
    fn trackside_logger(
        environment: *mut c_void,
        instance: *const c_char,
        status: c_int,
        category: *const c_char,
        format: *const c_char,
        ...
    );
    fn calloc(count: usize, size: usize) -> *mut c_void;
    fn free(pointer: *mut c_void);
}

/// The text for C, which ends at the first NUL: a text with one in it would arrive cut.
fn c_text(call: &'static str, text: &str) -> Result<CString, CallError> {
    CString::new(text).map_err(|_| {
        CallError::new(call, format!("is not called: the text {text:?} contains the character NUL"))
    })
}
