//! Implements the C functions that a plugin calls while it is called.
#![allow(unsafe_code, reason = "pointers of the plugin become references here")]

use std::ffi::c_void;

use super::guard::CallGuard;
use crate::abi::{self, BAD_CONFIG, CallOutcome, DONE, SignalColumn, Text, borrow_array};
use crate::analysis::AnalysisServices;
use crate::c_views::{with_diagram, with_signals};
use crate::error::{AnalysisError, ConfigError};
use crate::signal::InputSignal;

/// The state of a call.
pub(super) struct CallState<'a> {
    pub host: &'a mut dyn AnalysisServices,
    pub outcome: Option<Result<String, AnalysisError>>,
    /// The first breach of the rules of the boundary.
    pub breach: Option<String>,
}

/// Does the work of a callback during a call.
///
/// # Safety
/// `context` is the context of the call that is going on, or null.
unsafe fn with_call_state<R>(
    context: *mut c_void,
    otherwise: R,
    work: impl FnOnce(&mut CallState) -> R,
) -> R {
    // SAFETY: as the caller promises.
    unsafe { CallGuard::<CallState>::with_state(context, otherwise, work) }
}

pub(super) unsafe extern "C" fn progress(context: *mut c_void, share: f64, task: Text) -> u8 {
    // SAFETY: the plugin hands back the context of its call, and lends all that it passes; so below.
    unsafe {
        with_call_state(context, 0, |state| state.host.report_progress(share, &task.to_str_lossy()).into())
    }
}

pub(super) unsafe extern "C" fn record(
    context: *mut c_void,
    group: Text,
    columns: *const SignalColumn,
    count: usize,
) {
    // SAFETY: see above.
    unsafe {
        with_call_state(context, (), |state| {
            let group = group.to_str_lossy();
            with_signals(columns, count, |signals| state.host.record_signals(&group, &signals));
        });
    }
}

pub(super) unsafe extern "C" fn diagram(context: *mut c_void, group: Text, diagram: *const abi::Diagram) {
    // SAFETY: see above.
    unsafe {
        with_call_state(context, (), |state| match borrow_array(diagram, 1) {
            [diagram] => {
                with_diagram(diagram, |diagram| state.host.add_diagram(&group.to_str_lossy(), diagram));
            }
            _ => state.breach = Some("handed over a diagram that is null".to_owned()),
        });
    }
}

pub(super) unsafe extern "C" fn file(context: *mut c_void, name: Text, text: Text) {
    // SAFETY: see above.
    unsafe {
        with_call_state(context, (), |state| match (name.to_utf8(), text.to_utf8()) {
            (Some(name), Some(text)) => state.host.write_file(name, text),
            _ => state.breach = Some(format!("the file `{}` is not UTF-8", name.to_str_lossy())),
        });
    }
}

pub(super) unsafe extern "C" fn done(context: *mut c_void, outcome: *const CallOutcome) {
    // SAFETY: see above.
    unsafe {
        with_call_state(context, (), |state| match borrow_array(outcome, 1) {
            [outcome] => state.outcome = Some(read_outcome(outcome)),
            _ => state.breach = Some("handed over an outcome that is null".to_owned()),
        });
    }
}

/// # Safety
/// What the outcome points to lives as long as the call.
unsafe fn read_outcome(outcome: &CallOutcome) -> Result<String, AnalysisError> {
    // SAFETY: as the caller promises; so below.
    let message = || unsafe { outcome.text.to_str_lossy() }.into_owned();
    match outcome.status {
        // SAFETY: see above.
        DONE => match unsafe { outcome.text.to_utf8() } {
            Some(result) => Ok(result.to_owned()),
            None => Err(AnalysisError::Failed("the result is not UTF-8".to_owned())),
        },
        BAD_CONFIG => {
            // SAFETY: see above.
            let keys = unsafe { borrow_array(outcome.path, outcome.depth) }.iter();
            // SAFETY: see above.
            let path = keys.map(|key| unsafe { key.to_str_lossy() }.into_owned()).collect();
            Err(AnalysisError::Config(ConfigError { path, message: message() }))
        }
        _ => Err(AnalysisError::Failed(message())),
    }
}

pub(super) unsafe extern "C" fn take_needs(
    context: *mut c_void,
    needs: *const abi::InputSignal,
    count: usize,
) {
    // SAFETY: `Plugin::from_vtable` passed this guard, and the plugin lends its needs for the duration of the call.
    unsafe {
        CallGuard::<Vec<InputSignal<String>>>::with_state(context, (), |all| {
            all.extend(borrow_array(needs, count).iter().map(|need| InputSignal {
                name: need.name.to_str_lossy().into_owned(),
                unit: need.unit.to_str_lossy().into_owned(),
                description: need.description.to_str_lossy().into_owned(),
                required: need.required != 0,
            }));
        });
    }
}

pub(super) unsafe extern "C" fn take_schema(context: *mut c_void, schema: Text) {
    // SAFETY: `Plugin::from_vtable` passed this guard, and the plugin lends the text for the duration of the call.
    unsafe {
        CallGuard::<Option<String>>::with_state(context, (), |taken| {
            *taken = schema.to_utf8().map(str::to_owned);
        });
    }
}
