//! Makes C functions of an `Analysis`: the plugin's side of the boundary, where its panics end.
#![allow(unsafe_code, reason = "pointers of the program become slices here")]

use std::any::Any;
use std::ffi::c_void;
use std::panic::{AssertUnwindSafe, catch_unwind};

use crate::abi::{
    BAD_CONFIG, CallOutcome, DONE, FAILED, HostCallbacks, InputSignal, SignalColumn, Text, VERSION, Vtable,
};
use crate::analysis::{Analysis, AnalysisRequest, AnalysisServices};
use crate::c_views::{to_c_column, with_c_diagram, with_signals};
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
    columns: *const SignalColumn,
    count: usize,
    callbacks: *const HostCallbacks,
) {
    let work = |request: &AnalysisRequest, _: &mut dyn AnalysisServices| {
        A::check_request(request).map(|()| String::new()).map_err(AnalysisError::from)
    };
    // SAFETY: the program lends all that it passes for the duration of the call.
    unsafe { run_and_report(config, columns, count, callbacks, work) }
}

unsafe extern "C" fn run<A: Analysis>(
    config: Text,
    columns: *const SignalColumn,
    count: usize,
    callbacks: *const HostCallbacks,
) {
    // SAFETY: the program lends all that it passes for the duration of the call.
    unsafe { run_and_report(config, columns, count, callbacks, A::run) }
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
unsafe fn run_and_report(
    config: Text,
    columns: *const SignalColumn,
    count: usize,
    callbacks: *const HostCallbacks,
    work: impl FnOnce(&AnalysisRequest, &mut dyn AnalysisServices) -> Result<String, AnalysisError>,
) {
    // SAFETY: as the caller promises.
    let (config, callbacks) = unsafe { (config.to_str_lossy(), callbacks.as_ref()) };
    let Some(callbacks) = callbacks else { return };
    // SAFETY: the same.
    let outcome = catch_unwind(AssertUnwindSafe(|| unsafe {
        with_signals(columns, count, |signals| {
            work(&AnalysisRequest { config: &config, signals }, &mut CallbackServices(callbacks))
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
    let outcome = CallOutcome { status, path: path.as_ptr(), depth: path.len(), text };
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
struct CallbackServices<'a>(&'a HostCallbacks);

impl AnalysisServices for CallbackServices<'_> {
    fn report_progress(&mut self, share: f64, task: &str) -> bool {
        // SAFETY: the context is the program's own, and the loan lives until the call is over; so below.
        unsafe { (self.0.progress)(self.0.context, share, Text::new(task)) != 0 }
    }

    fn record_signals(&mut self, group: &str, signals: &[Signal]) {
        let columns: Vec<_> = signals.iter().map(to_c_column).collect();
        // SAFETY: see above.
        unsafe { (self.0.record)(self.0.context, Text::new(group), columns.as_ptr(), columns.len()) }
    }

    fn add_diagram(&mut self, group: &str, diagram: &Diagram) {
        // SAFETY: see above.
        with_c_diagram(diagram, |diagram| unsafe {
            (self.0.diagram)(self.0.context, Text::new(group), diagram)
        });
    }

    fn write_file(&mut self, name: &str, text: &str) {
        // SAFETY: see above.
        unsafe { (self.0.file)(self.0.context, Text::new(name), Text::new(text)) }
    }
}
