//! Implements the 34 C functions of FMI 2.0 co-simulation for any model; [`crate::export!`] only names them.
//!
//! Each function may be called with whatever a C program hands over. Pointers are looked at here and
//! nowhere else, no panic leaves this file, and what a call could not do goes to the importer's logger.

use std::any::Any;
use std::ffi::{CStr, CString, c_char, c_int, c_void};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::{ptr, slice};

use crate::Model;
use crate::abi::{Boolean, CallbackFunctions, Component, Status};
use crate::description::{self, guid};
use crate::instance::{Instance, Outcome, Refusal, refuse};
pub use crate::lifecycle::Call;
pub use crate::value::Truth;

mod functions;
mod logger;
mod state;
mod values;

use logger::{ALWAYS, EVENTS, Log};
pub use state::{
    deserialize, free_fmu_state, get_fmu_state, serialize, serialized_size, set_fmu_state,
};
pub use values::{directional_derivative, get, get_string, set, set_input_derivatives, set_string};

const CO_SIMULATION: c_int = 1;
/// What an `fmi2Component` points to.
struct Slave<M: Model> {
    instance: Instance<M>,
    log: Log,
}

fn panic_message(panic: &(dyn Any + Send)) -> String {
    let text = panic.downcast_ref::<&str>().copied();
    let text = text.or_else(|| panic.downcast_ref::<String>().map(String::as_str));
    format!("the model panicked: {}", text.unwrap_or("no message"))
}

/// Runs the body of a C function on the instance behind `component`: the one place where a component
/// becomes a reference, where the order of calls is checked, and where a panic ends.
///
/// # Safety
/// `component` is null or comes from [`instantiate`] and has not been freed; nobody else uses it.
unsafe fn with<M: Model>(
    component: Component,
    call: Call,
    body: impl FnOnce(&mut Instance<M>, &mut Log) -> Outcome,
) -> Status {
    // SAFETY: as the caller promises.
    let Some(slave) = (unsafe { component.cast::<Slave<M>>().as_mut() }) else {
        return Status::Error;
    };
    let Slave { instance, log } = slave;
    let run = AssertUnwindSafe(|| instance.check(call).and_then(|()| body(instance, log)));
    let result = catch_unwind(run);
    let worst = log.messages();
    match result {
        Ok(Ok(())) => worst,
        Ok(Err(refusal)) => {
            log.status(&refusal);
            // An importer may ask for what is not there, or in the wrong order, and go on: it is told.
            // Only a model that failed is lost, and its state says so already.
            refusal.status
        }
        Err(panic) => {
            instance.fail(Status::Fatal);
            log.status(&Refusal { status: Status::Fatal, message: panic_message(&*panic) });
            Status::Fatal
        }
    }
}

/// # Safety
/// `pointer` is valid for `length` values of `T`, or `length` is 0.
unsafe fn read<'a, T>(pointer: *const T, length: usize) -> Outcome<&'a [T]> {
    match (length, pointer.is_null()) {
        (0, _) => Ok(&[]),
        (_, true) => refuse("a null pointer stands for an array"),
        // SAFETY: as the caller promises.
        _ => Ok(unsafe { slice::from_raw_parts(pointer, length) }),
    }
}

/// # Safety
/// `pointer` is valid for `length` values of `T` that nobody else uses, or `length` is 0.
unsafe fn write<'a, T>(pointer: *mut T, length: usize) -> Outcome<&'a mut [T]> {
    match (length, pointer.is_null()) {
        (0, _) => Ok(&mut []),
        (_, true) => refuse("a null pointer stands for an array"),
        // SAFETY: as the caller promises.
        _ => Ok(unsafe { slice::from_raw_parts_mut(pointer, length) }),
    }
}

/// # Safety
/// `pointer` is null or points to a C string.
unsafe fn text(pointer: *const c_char) -> Option<String> {
    // SAFETY: as the caller promises.
    (!pointer.is_null()).then(|| unsafe { CStr::from_ptr(pointer) }.to_string_lossy().into_owned())
}

/// `fmi2Instantiate`: null when the GUID is not this library's or something is missing.
///
/// # Safety
/// As FMI 2.0 says of the arguments of `fmi2Instantiate`.
pub unsafe fn instantiate<M: Model>(
    name: *const c_char,
    kind: c_int,
    found: *const c_char,
    functions: *const CallbackFunctions,
    logging_on: Boolean,
) -> Component {
    // SAFETY: as the caller promises.
    let (name, found, functions) = unsafe { (text(name), text(found), functions.as_ref()) };
    let Some(CallbackFunctions { logger: Some(logger), environment, .. }) = functions else {
        return ptr::null_mut();
    };
    let log = Log {
        name: CString::new(name.clone().unwrap_or_default()).unwrap_or_default(),
        logger: *logger,
        environment: *environment,
        own: M::INFO.log_categories,
        wanted: if logging_on == 0 { ALWAYS } else { u64::MAX },
    };
    let instance = catch_unwind(|| {
        let expected = guid::<M>();
        match (name.as_deref(), found.as_deref()) {
            (None | Some(""), _) => refuse("the instance has no name"),
            _ if kind != CO_SIMULATION => refuse("only co-simulation is supported"),
            (_, Some(found)) if found == expected => Ok(Instance::<M>::new()),
            (_, found) => {
                refuse(format!("expected GUID {expected}, found {}", found.unwrap_or("none")))
            }
        }
    });
    log.messages();
    match instance {
        Ok(Ok(instance)) => {
            log.send(Status::Ok, EVENTS, "instantiated");
            Box::into_raw(Box::new(Slave { instance, log })).cast()
        }
        Ok(Err(refusal)) => {
            log.status(&refusal);
            ptr::null_mut()
        }
        Err(panic) => {
            log.status(&Refusal { status: Status::Fatal, message: panic_message(&*panic) });
            ptr::null_mut()
        }
    }
}

/// `fmi2FreeInstance`.
///
/// # Safety
/// `component` is null or comes from [`instantiate`] and is not used again.
pub unsafe fn free_instance<M: Model>(component: Component) {
    if !component.is_null() {
        // SAFETY: `instantiate` made the box, and the caller gives it up.
        let slave = unsafe { Box::from_raw(component.cast::<Slave<M>>()) };
        // A model whose destructor panics must not take the importer with it.
        let _ = catch_unwind(AssertUnwindSafe(|| drop(slave)));
    }
}

/// `fmi2SetDebugLogging`: no category means all of them.
///
/// # Safety
/// As FMI 2.0 says of the arguments of `fmi2SetDebugLogging`.
pub unsafe fn set_debug_logging<M: Model>(
    component: Component,
    logging_on: Boolean,
    length: usize,
    categories: *const *const c_char,
) -> Status {
    let body = |_: &mut Instance<M>, log: &mut Log| {
        let mut chosen = 0;
        // SAFETY: as the caller promises.
        for category in unsafe { read(categories, length) }? {
            // SAFETY: as the caller promises.
            let category = unsafe { text(*category) }.unwrap_or_default();
            let Some(bit) = log.bit(&category) else {
                return refuse(format!("there is no log category {category:?}"));
            };
            chosen |= bit;
        }
        let chosen = if length == 0 { u64::MAX } else { chosen };
        log.wanted = if logging_on == 0 { log.wanted & !chosen | ALWAYS } else { chosen };
        Ok(())
    };
    // SAFETY: as the caller promises.
    unsafe { with::<M>(component, Call::SetDebugLogging, body) }
}

/// `fmi2SetupExperiment`; the tolerance is for solvers, and there is none.
///
/// # Safety
/// As `with` demands of `component`.
pub unsafe fn setup_experiment<M: Model>(
    component: Component,
    start: f64,
    stop_defined: Boolean,
    stop: f64,
) -> Status {
    let stop = (stop_defined != 0).then_some(stop);
    // SAFETY: as the caller promises.
    unsafe {
        with::<M>(component, Call::SetupExperiment, |instance, _| {
            instance.setup_experiment(start, stop)
        })
    }
}

/// The calls without arguments: `fmi2EnterInitializationMode`, `fmi2ExitInitializationMode`,
/// `fmi2Terminate`, `fmi2Reset` and `fmi2CancelStep`.
///
/// # Safety
/// As `with` demands of `component`.
pub unsafe fn proceed<M: Model>(component: Component, call: Call) -> Status {
    let body = |instance: &mut Instance<M>, log: &mut Log| {
        match call {
            Call::EnterInitializationMode => instance.enter_initialization(),
            Call::ExitInitializationMode => {
                if let Err(refusal) = instance.exit_initialization() {
                    instance.fail(refusal.status);
                    return Err(refusal);
                }
            }
            Call::Terminate => instance.terminate(),
            Call::Reset => instance.reset(),
            _ => return refuse(format!("{call:?} is not supported")),
        }
        log.send(Status::Ok, EVENTS, &format!("{call:?}"));
        Ok(())
    };
    // SAFETY: as the caller promises.
    unsafe { with::<M>(component, call, body) }
}

/// `fmi2DoStep`.
///
/// # Safety
/// As `with` demands of `component`.
pub unsafe fn do_step<M: Model>(component: Component, time: f64, step: f64) -> Status {
    // SAFETY: as the caller promises.
    unsafe { with::<M>(component, Call::DoStep, |instance, _| instance.do_step(time, step)) }
}

/// The functions whose capability flags are not set: they say so.
///
/// # Safety
/// As `with` demands of `component`.
pub unsafe fn unsupported<M: Model>(component: Component, call: Call, name: &str) -> Status {
    let body = |_: &mut Instance<M>, _: &mut Log| refuse(format!("{name} is not supported"));
    // SAFETY: as the caller promises.
    unsafe { with::<M>(component, call, body) }
}

/// `fmi2GetStatus`, `fmi2GetRealStatus` and `fmi2GetBooleanStatus`: `answer` knows the kinds that the
/// function answers, by their numbers in `fmi2StatusKind`.
///
/// # Safety
/// `value` is valid; as `with` demands of `component`.
pub unsafe fn get_status<M: Model, T>(
    component: Component,
    kind: c_int,
    value: *mut T,
    answer: fn(&dyn LastStep, c_int) -> Option<T>,
) -> Status {
    let body = |instance: &mut Instance<M>, _: &mut Log| {
        let Some(found) = answer(instance, kind) else {
            return Err(Refusal {
                status: Status::Discard,
                message: format!("there is no status of kind {kind} of this type"),
            });
        };
        // SAFETY: as the caller promises.
        unsafe { write(value, 1)?[0] = found };
        Ok(())
    };
    // SAFETY: as the caller promises.
    unsafe { with::<M>(component, Call::GetStatus, body) }
}

/// What can be asked about the last step.
pub trait LastStep {
    /// `fmi2DoStepStatus`.
    fn status(&self) -> Status;
    /// `fmi2LastSuccessfulTime` [s].
    fn last_successful_time(&self) -> f64;
    /// `fmi2Terminated`.
    fn terminated(&self) -> bool;
}

impl<M: Model> LastStep for Instance<M> {
    fn status(&self) -> Status {
        self.last_step()
    }
    fn last_successful_time(&self) -> f64 {
        Instance::last_successful_time(self)
    }
    fn terminated(&self) -> bool {
        Instance::terminated(self)
    }
}

/// Gives the model's name, `modelDescription.xml` and what is wrong with the table to a packer.
///
/// # Safety
/// `take` takes `context`, a number and a text, as [`crate::pack`] says.
pub unsafe fn describe<M: Model>(
    context: *mut c_void,
    take: unsafe extern "C" fn(*mut c_void, u32, *const u8, usize),
) {
    let texts = catch_unwind(|| {
        let problems = description::problems::<M>().join("; ");
        [M::INFO.name.to_owned(), description::xml::<M>(), problems]
    });
    for (what, text) in (0..).zip(texts.iter().flatten()) {
        // SAFETY: as the caller promises.
        unsafe { take(context, what, text.as_ptr(), text.len()) };
    }
}
