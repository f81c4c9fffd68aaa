//! Implements the C functions that a plugin calls while it is called.
#![allow(unsafe_code, reason = "pointers of the plugin become references here")]

use std::ffi::c_void;

use super::guard::CallGuard;
use crate::abi::{self, BAD_CONFIG, Column, DONE, Outcome, Text, array};
use crate::analysis::Host;
use crate::c_views::{with_diagram, with_signals};
use crate::error::{AnalysisError, ConfigError};
use crate::signal::InputSignal;

/// The state of a call.
pub(super) struct State<'a> {
    pub host: &'a mut dyn Host,
    pub outcome: Option<Result<String, AnalysisError>>,
    /// The first breach of the rules of the boundary.
    pub breach: Option<String>,
}

/// Does the work of a callback during a call.
///
/// # Safety
/// `context` is the context of the call that is going on, or null.
unsafe fn visit<R>(context: *mut c_void, otherwise: R, work: impl FnOnce(&mut State) -> R) -> R {
    // SAFETY: as the caller promises.
    unsafe { CallGuard::<State>::visit(context, otherwise, work) }
}

pub(super) unsafe extern "C" fn progress(context: *mut c_void, share: f64, task: Text) -> u8 {
    // SAFETY: the plugin hands back the context of its call, and lends all that it passes; so below.
    unsafe { visit(context, 0, |state| state.host.progress(share, &task.lossy()).into()) }
}

pub(super) unsafe extern "C" fn record(
    context: *mut c_void,
    group: Text,
    columns: *const Column,
    count: usize,
) {
    // SAFETY: see above.
    unsafe {
        visit(context, (), |state| {
            let group = group.lossy();
            with_signals(columns, count, |signals| state.host.record(&group, &signals));
        });
    }
}

pub(super) unsafe extern "C" fn diagram(
    context: *mut c_void,
    group: Text,
    diagram: *const abi::Diagram,
) {
    // SAFETY: see above.
    unsafe {
        visit(context, (), |state| match array(diagram, 1) {
            [diagram] => {
                with_diagram(diagram, |diagram| state.host.diagram(&group.lossy(), diagram));
            }
            _ => state.breach = Some("handed over a diagram that is null".to_owned()),
        });
    }
}

pub(super) unsafe extern "C" fn file(context: *mut c_void, name: Text, text: Text) {
    // SAFETY: see above.
    unsafe {
        visit(context, (), |state| match (name.exact(), text.exact()) {
            (Some(name), Some(text)) => state.host.file(name, text),
            _ => state.breach = Some(format!("the file `{}` is not UTF-8", name.lossy())),
        });
    }
}

pub(super) unsafe extern "C" fn done(context: *mut c_void, outcome: *const Outcome) {
    // SAFETY: see above.
    unsafe {
        visit(context, (), |state| match array(outcome, 1) {
            [outcome] => state.outcome = Some(read(outcome)),
            _ => state.breach = Some("handed over an outcome that is null".to_owned()),
        });
    }
}

/// # Safety
/// What the outcome points to lives as long as the call.
unsafe fn read(outcome: &Outcome) -> Result<String, AnalysisError> {
    // SAFETY: as the caller promises; so below.
    let message = || unsafe { outcome.text.lossy() }.into_owned();
    match outcome.status {
        // SAFETY: see above.
        DONE => match unsafe { outcome.text.exact() } {
            Some(result) => Ok(result.to_owned()),
            None => Err(AnalysisError::Failed("the result is not UTF-8".to_owned())),
        },
        BAD_CONFIG => {
            // SAFETY: see above.
            let keys = unsafe { array(outcome.path, outcome.depth) }.iter();
            // SAFETY: see above.
            let path = keys.map(|key| unsafe { key.lossy() }.into_owned()).collect();
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
    // SAFETY: `Plugin::of` passed this guard, and the plugin lends its needs for the duration of the call.
    unsafe {
        CallGuard::<Vec<InputSignal<String>>>::visit(context, (), |all| {
            all.extend(array(needs, count).iter().map(|need| InputSignal {
                name: need.name.lossy().into_owned(),
                unit: need.unit.lossy().into_owned(),
                description: need.description.lossy().into_owned(),
                required: need.required != 0,
            }));
        });
    }
}

pub(super) unsafe extern "C" fn take_schema(context: *mut c_void, schema: Text) {
    // SAFETY: `Plugin::of` passed this guard, and the plugin lends the text for the duration of the call.
    unsafe {
        CallGuard::<Option<String>>::visit(context, (), |taken| {
            *taken = schema.exact().map(str::to_owned);
        });
    }
}
