//! Declares the C types of FMI that cross the boundary of the library.

use std::ffi::{c_char, c_int, c_void};

/// `fmi2Component` or `fmi3Instance`: an instance.
pub type Component = *mut c_void;
/// `fmi2FMUstate` or `fmi3FMUState`: a copy of an instance's state.
pub type FmuState = *mut c_void;
/// `fmi2ValueReference` or `fmi3ValueReference`: the row number of a variable.
pub type ValueReference = u32;
/// `fmi2Boolean`.
pub type Boolean = c_int;

/// `fmi2Status` or `fmi3Status`.
#[repr(i32)]
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Status {
    /// The call did its work.
    Ok = 0,
    /// The call did its work, and the log has a warning.
    Warning = 1,
    /// A step was not completed.
    Discard = 2,
    /// The instance is lost until it is reset.
    Error = 3,
    /// The instance is lost for ever.
    Fatal = 4,
}

/// `fmi2CallbackLogger`: a variadic function with a `printf` format.
#[cfg(not(miri))]
pub type Logger = unsafe extern "C" fn(*mut c_void, *const c_char, Status, *const c_char, *const c_char, ...);

/// The logger as it is called. Rust cannot define a variadic function, which Miri would need.
#[cfg(miri)]
pub type Logger =
    unsafe extern "C" fn(*mut c_void, *const c_char, Status, *const c_char, *const c_char, *const c_char);

/// `fmi3LogMessageCallback`.
pub type LogMessage = unsafe extern "C" fn(*mut c_void, Status, *const c_char, *const c_char);

/// `fmi2CallbackFunctions`; only the logger and its environment are used.
#[repr(C)]
#[derive(Debug)]
pub struct CallbackFunctions {
    /// Receives messages.
    pub logger: Option<Logger>,
    /// Allocates memory; not needed by Rust.
    pub allocate_memory: Option<unsafe extern "C" fn(usize, usize) -> *mut c_void>,
    /// Frees memory; not needed by Rust.
    pub free_memory: Option<unsafe extern "C" fn(*mut c_void)>,
    /// Ends an asynchronous step; there are none.
    pub step_finished: Option<unsafe extern "C" fn(*mut c_void, Status)>,
    /// Handed back to the logger.
    pub environment: *mut c_void,
}
