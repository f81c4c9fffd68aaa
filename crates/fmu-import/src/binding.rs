//! Calls an FMU's library: the one place of this crate where foreign code runs.
//!
//! What an FMU hands over is not trusted where that can be avoided: statuses and booleans come in as plain integers, texts
//! are copied at once, and the environment of a log message is looked up, never dereferenced.
#![expect(unsafe_code, reason = "calling a C library")]

mod absent_function;
mod array_calls;
mod batch;
mod call_monitor;
mod derivative;
mod events;
mod floating_point;
mod fmi1;
mod fmi3_calls;
mod functions;
mod guarded_buffer;
mod handle;
mod instance;
mod instantiation;
mod interrupted_call;
mod library;
mod mailbox;
mod messages_while_freed;
mod model_exchange;
mod numbers;
mod phase;
mod process_end;
mod process_state;
mod python_runtime;
mod saved_states;
mod state;
mod status;
mod step;
mod step_calls;
mod texts;
mod values;
mod variables;
#[cfg_attr(not(target_os = "linux"), path = "binding/windows/elsewhere.rs")]
mod windows;

use std::ffi::{CString, c_int, c_void};

use crate::CallError;
pub use batch::CallBatch;
pub use call_monitor::{active_calls, call_plugin, disable_crash_handlers, start_watchdog};
pub use fmi3_calls::ArrayVariable;
pub use instance::Instance;
pub use library::FmuLibrary;
pub(crate) use library::is_loaded;
pub use mailbox::{FOREIGN_ENVIRONMENT, has_new_messages};
pub use messages_while_freed::messages_while_freed;
pub use process_end::{
    CrashNote, adopt_forked_process, catch_termination_signals, exit_without_destructors, final_exit_code,
    guard_exit, ignore_termination_signals, set_final_exit_code, share_call_notes, termination_signal,
};
pub use process_state::{restore_folder_and_permissions, take_process_change_reports};
pub use saved_states::FmuState;
pub use step_calls::{StepCalls, StepMemory, StepRound, ValueCall};
pub use windows::cancel_wine_calls_when;

/// The name of a function in the version of an instance's library.
macro_rules! named {
    ($library:expr, $two:literal, $three:literal) => {
        match $library.description() {
            about => match about.version {
                $crate::FmiVersion::One => about.fmi1_name($two),
                $crate::FmiVersion::Two => $two,
                $crate::FmiVersion::Three => $three,
            },
        }
    };
}
use named;

type InstancePointer = *mut c_void;
type FmiStatus = c_int;
type ComponentFn = unsafe extern "C" fn(InstancePointer) -> FmiStatus;
const OK: FmiStatus = 0;
const WARNING: FmiStatus = 1;
const DISCARD: FmiStatus = 2;
const ERROR: FmiStatus = 3;
const FATAL: FmiStatus = 4;
const PENDING: FmiStatus = 5;

/// Whether what a call gives may be used.
const fn is_success(status: FmiStatus) -> bool {
    matches!(status, OK | WARNING)
}

/// The text for C, which ends at the first NUL: a text with one in it would arrive cut.
fn to_c_string(call: &'static str, text: &str) -> Result<CString, CallError> {
    CString::new(text).map_err(|_| {
        CallError::new(call, format!("is not called: the text {text:?} contains the character NUL"))
    })
}
