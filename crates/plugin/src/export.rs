//! Makes C functions of an `Analysis`: the plugin's side of the boundary, where its panics end.
#![allow(unsafe_code, reason = "pointers of the program become slices here")]

use std::any::Any;
use std::ffi::c_void;
use std::panic::{AssertUnwindSafe, catch_unwind};

use crate::abi::{
    BAD_CONFIG, Callbacks, Column, DONE, FAILED, InputSignal, Outcome, Text, VERSION, Vtable,
};
use crate::analysis::{Analysis, Host, Request};
use crate::c_views::{column, with_lent_diagram, with_signals};
use crate::diagram::Diagram;
use crate::error::AnalysisError;
use crate::signal::Signal;

/// The table of an analysis.
#[must_use]
pub fn vtable<A: Analysis>() -> *const Vtable {
    const {
        &Vtable {
            version: VERSION,
            check: Some(check::<A>),
            run: Some(run::<A>),
            needs: Some(needs::<A>),
            schema: Some(schema::<A>),
        }
    }
}

unsafe extern "C" fn check<A: Analysis>(
    config: Text,
    columns: *const Column,
    count: usize,
    callbacks: *const Callbacks,
) {
    let work = |request: &Request, _: &mut dyn Host| {
        A::check(request).map(|()| String::new()).map_err(AnalysisError::from)
    };
    // SAFETY: the program lends all that it passes for the duration of the call.
    unsafe { answer(config, columns, count, callbacks, work) }
}

unsafe extern "C" fn run<A: Analysis>(
    config: Text,
    columns: *const Column,
    count: usize,
    callbacks: *const Callbacks,
) {
    // SAFETY: the program lends all that it passes for the duration of the call.
    unsafe { answer(config, columns, count, callbacks, A::run) }
}

unsafe extern "C" fn needs<A: Analysis>(
    context: *mut c_void,
    take: unsafe extern "C" fn(*mut c_void, *const InputSignal, usize),
) {
    let lend = |need: &crate::signal::InputSignal| InputSignal {
        name: Text::new(need.name),
        unit: Text::new(need.unit),
        description: Text::new(need.description),
        required: need.required.into(),
    };
    let needs: Vec<_> = A::INPUTS.iter().map(lend).collect();
    // SAFETY: `context` goes back to its owner, and `needs` lives until the call is over.
    unsafe { take(context, needs.as_ptr(), needs.len()) }
}

unsafe extern "C" fn schema<A: Analysis>(
    context: *mut c_void,
    take: unsafe extern "C" fn(*mut c_void, Text),
) {
    // A panic has no way to be reported here. Without a schema the program lacks suggestions, no more.
    let schema = catch_unwind(A::config_schema).map_err(panic_message);
    if let Ok(Some(schema)) = schema {
        // SAFETY: `context` goes back to its owner, and the text lives until the call is over.
        unsafe { take(context, Text::new(&schema)) }
    }
}

/// Does `work` and reports its outcome to the program.
///
/// # Safety
/// `callbacks` is null or points to callbacks. Everything that is pointed to lives as long as the call.
unsafe fn answer(
    config: Text,
    columns: *const Column,
    count: usize,
    callbacks: *const Callbacks,
    work: impl FnOnce(&Request, &mut dyn Host) -> Result<String, AnalysisError>,
) {
    // SAFETY: as the caller promises.
    let (config, callbacks) = unsafe { (config.lossy(), callbacks.as_ref()) };
    let Some(callbacks) = callbacks else { return };
    // SAFETY: the same.
    let outcome = catch_unwind(AssertUnwindSafe(|| unsafe {
        with_signals(columns, count, |signals| {
            work(&Request { config: &config, signals }, &mut CallbackHost(callbacks))
        })
    }));
    let outcome = outcome.unwrap_or_else(|panic| Err(AnalysisError::Failed(panic_message(panic))));
    let (status, path, text): (_, &[String], _) = match &outcome {
        Ok(result) => (DONE, &[], result),
        Err(AnalysisError::Config(error)) => (BAD_CONFIG, &error.path, &error.message),
        Err(AnalysisError::Failed(message)) => (FAILED, &[], message),
    };
    let path: Vec<_> = path.iter().map(|key| Text::new(key)).collect();
    let text = Text::new(text);
    let outcome = Outcome { status, path: path.as_ptr(), depth: path.len(), text };
    // SAFETY: the context is the program's own, and the outcome lives until the call is over.
    unsafe { (callbacks.done)(callbacks.context, &raw const outcome) }
}

/// The message of a panic. A payload of an unknown type is leaked: its destructor might panic in turn.
fn panic_message(panic: Box<dyn Any + Send>) -> String {
    let text = panic.downcast::<&str>().map(|text| (*text).to_owned());
    let text = text.or_else(|panic| panic.downcast::<String>().map(|text| *text));
    let text = text.unwrap_or_else(|panic| {
        std::mem::forget(panic);
        "without a message".to_owned()
    });
    format!("panicked: {text}")
}

/// The program, as the plugin sees it.
struct CallbackHost<'a>(&'a Callbacks);

impl Host for CallbackHost<'_> {
    fn progress(&mut self, share: f64, task: &str) -> bool {
        // SAFETY: the context is the program's own, and the loan lives until the call is over; so below.
        unsafe { (self.0.progress)(self.0.context, share, Text::new(task)) != 0 }
    }

    fn record(&mut self, group: &str, signals: &[Signal]) {
        let columns: Vec<_> = signals.iter().map(column).collect();
        // SAFETY: see above.
        unsafe {
            (self.0.record)(self.0.context, Text::new(group), columns.as_ptr(), columns.len())
        }
    }

    fn diagram(&mut self, group: &str, diagram: &Diagram) {
        // SAFETY: see above.
        with_lent_diagram(diagram, |diagram| unsafe {
            (self.0.diagram)(self.0.context, Text::new(group), diagram)
        });
    }

    fn file(&mut self, name: &str, text: &str) {
        // SAFETY: see above.
        unsafe { (self.0.file)(self.0.context, Text::new(name), Text::new(text)) }
    }
}
