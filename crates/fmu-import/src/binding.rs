//! Calls an FMU's library: the one place of this program where foreign code runs.
//!
//! Statuses come in as plain integers, since a foreign library may return anything; the callbacks live
//! as long as the instance, since a library may keep the pointer to them; and an instance has one owner.
#![expect(unsafe_code, reason = "calling a C library")]

mod activity;
mod derivative;
mod instance;
mod library;
mod state;
mod values;

use std::ffi::{CStr, c_char, c_int, c_void};
use std::sync::{Mutex, PoisonError};

use crate::Message;
pub use activity::watch;
pub use instance::Instance;
pub use library::Library;
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
/// `fmi2LastSuccessfulTime` and `fmi2Terminated` of `fmi2StatusKind`.
const LAST_SUCCESSFUL_TIME: c_int = 2;
const TERMINATED: c_int = 3;

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

/// Where an instance's messages wait; an FMU may log from a thread of its own.
type Mailbox = Mutex<Vec<Message>>;

/// # Safety
/// Called by `logger.c` with the environment of an instance and C strings.
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
    // SAFETY: the environment is the mailbox of a living instance.
    if let Some(mailbox) = unsafe { environment.cast::<Mailbox>().as_ref() } {
        let message = Message { status, category: string(category), text: string(text) };
        mailbox.lock().unwrap_or_else(PoisonError::into_inner).push(message);
    }
}
