//! Makes C functions of an `Analysis`: the plugin's side of the boundary, where panics end.
#![allow(unsafe_code, reason = "pointers of the program become slices here")]

use std::any::Any;
use std::borrow::Cow;
use std::ffi::c_void;
use std::panic::{AssertUnwindSafe, catch_unwind};

use crate::abi::{Callbacks, Column, Need, Text, VERSION, Vtable, with_signals};
use crate::diagram::lend;
use crate::{Analysis, Diagram, Host, Request, Signal};

/// The table of an analysis.
#[must_use]
pub fn vtable<A: Analysis>() -> *const Vtable {
    const { &Vtable { version: VERSION, check: check::<A>, run: run::<A>, needs: needs::<A> } }
}

unsafe extern "C" fn check<A: Analysis>(
    config: Text,
    columns: *const Column,
    count: usize,
    callbacks: *const Callbacks,
) {
    // SAFETY: the program lends all that it passes for the duration of the call.
    unsafe {
        answer(config, (columns, count), callbacks, |request, _| {
            A::check(request).map(|()| String::new())
        })
    }
}

unsafe extern "C" fn run<A: Analysis>(
    config: Text,
    columns: *const Column,
    count: usize,
    callbacks: *const Callbacks,
) {
    // SAFETY: the program lends all that it passes for the duration of the call.
    unsafe { answer(config, (columns, count), callbacks, A::run) }
}

/// Does `work` and tells the program how it ended.
///
/// # Safety
/// Everything that is pointed to lives as long as the call.
unsafe fn answer(
    config: Text,
    (columns, count): (*const Column, usize),
    callbacks: *const Callbacks,
    work: impl FnOnce(&Request, &mut dyn Host) -> Result<String, String>,
) {
    // SAFETY: as the caller promises.
    let (config, callbacks) = unsafe { (config.get(), &*callbacks) };
    // SAFETY: the same.
    conclude(callbacks, || unsafe {
        with_signals(columns, count, |signals| {
            work(&Request { config: &config, signals }, &mut Remote(callbacks))
        })
    });
}

unsafe extern "C" fn needs<A: Analysis>(
    context: *mut c_void,
    take: unsafe extern "C" fn(*mut c_void, *const Need, usize),
) {
    let lend = |need: &crate::Need| Need {
        name: Text::new(need.name),
        unit: Text::new(need.unit),
        description: Text::new(need.description),
        required: need.required,
    };
    let needs: Vec<_> = A::NEEDS.iter().map(lend).collect();
    // SAFETY: `context` goes back to the one who gave it, and `needs` lives until the call is over.
    unsafe { take(context, needs.as_ptr(), needs.len()) }
}

/// Calls `work` and tells the program how it ended.
fn conclude(callbacks: &Callbacks, work: impl FnOnce() -> Result<String, String>) {
    let outcome = catch_unwind(AssertUnwindSafe(work));
    let outcome =
        outcome.unwrap_or_else(|payload| Err(format!("panicked: {}", reason(payload.as_ref()))));
    let (well, text) = match &outcome {
        Ok(text) => (true, text),
        Err(text) => (false, text),
    };
    // SAFETY: the context is the program's own, and the text lives until the call is over.
    unsafe { (callbacks.done)(callbacks.context, well, Text::new(text)) }
}

fn reason(payload: &(dyn Any + Send)) -> Cow<'_, str> {
    match (payload.downcast_ref::<&str>(), payload.downcast_ref::<String>()) {
        (Some(text), _) => Cow::Borrowed(text),
        (_, Some(text)) => Cow::Borrowed(text),
        _ => Cow::Borrowed("without a message"),
    }
}

/// The program, as the plugin sees it.
struct Remote<'a>(&'a Callbacks);

impl Host for Remote<'_> {
    fn progress(&mut self, share: f64, what: &str) -> bool {
        // SAFETY: the context is the program's own, and what is lent lives until the call is over; so below.
        unsafe { (self.0.progress)(self.0.context, share, Text::new(what)) }
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
        lend(diagram, |diagram| unsafe {
            (self.0.diagram)(self.0.context, Text::new(group), diagram)
        });
    }

    fn file(&mut self, name: &str, text: &str) {
        // SAFETY: see above.
        unsafe { (self.0.file)(self.0.context, Text::new(name), Text::new(text)) }
    }
}

/// Lends a signal; its columns may differ in length only by a mistake, and then the rest is left out.
pub(crate) fn column(signal: &Signal) -> Column {
    Column {
        name: Text::new(signal.name),
        unit: Text::new(signal.unit),
        time: signal.time.as_ptr(),
        values: signal.values.as_ptr(),
        len: signal.time.len().min(signal.values.len()),
    }
}
