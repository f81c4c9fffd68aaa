//! Implements the C functions of FMI 2.0 and 3.0 co-simulation for any model; `export!` only names them.
//!
//! The functions check the arguments of a C program as far as C allows. No panic leaves this file, and a
//! failed call leaves a message in the importer's log.

use std::any::Any;
use std::ffi::{CString, c_char, c_int, c_void};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::ptr;
use std::sync::Arc;

use crate::abi::{Boolean, CallbackFunctions, Component, Status};
use crate::co_simulation::CoSimulation;
use crate::description;
use crate::error::{FmiError, FmiResult, reject};
use crate::lifecycle::LifecycleState;
pub use crate::lifecycle::{Call, Lifecycle};
use crate::log::{self, take_messages};
use crate::memory::{copy_c_text, read_array, write_result};
use crate::model::Model;
pub use crate::value::FmiBoolean;

pub mod fmi3;
mod fmi3_functions;
mod functions;
mod logger;
mod state;
mod values;

use logger::{ALWAYS, ImporterLogger, Log, LoggerCallback};
pub use state::{deserialize, free_fmu_state, get_fmu_state, serialize, serialized_size, set_fmu_state};
pub use values::{directional_derivative, get, get_string, set, set_input_derivatives, set_string};

const CO_SIMULATION: c_int = 1;

/// What an `fmi2Component` points to.
struct ExportedComponent<S: CoSimulation> {
    instance: S,
    log: Log,
    /// What the last call for texts handed out; the importer holds their addresses.
    texts: Vec<CString>,
}

/// The message of a panic. A payload of an unknown type is leaked: its destructor might panic in turn.
fn panic_message(panic: Box<dyn Any + Send>) -> String {
    let text = panic.downcast::<&str>().map(|text| (*text).to_owned());
    let text = text.or_else(|panic| panic.downcast::<String>().map(|text| *text));
    let text = text.unwrap_or_else(|panic| {
        std::mem::forget(panic);
        "no message".to_owned()
    });
    format!("the model panicked: {text}")
}

/// Runs the body of a C function on the instance behind `component`: the one place where a component
/// becomes a reference, where the order of calls is checked, and where a panic ends.
///
/// Messages wait until the reference is gone. The importer's logger may therefore call any function of
/// this instance, `fmi2FreeInstance` included.
///
/// # Safety
/// `component` is null or comes from [`instantiate`] and has not been freed; no other call uses it.
unsafe fn with_component<S: CoSimulation>(
    component: Component,
    call: Call,
    body: impl FnOnce(&mut ExportedComponent<S>) -> FmiResult,
) -> Status {
    let (status, delivery) = {
        // SAFETY: as the caller promises. The reference ends with this block, before foreign code runs.
        let Some(exported) = (unsafe { component.cast::<ExportedComponent<S>>().as_mut() }) else {
            return Status::Error;
        };
        // What a model logged outside of a call, in `Drop` or `Default`, belongs to none.
        log::discard_messages();
        let run =
            AssertUnwindSafe(|| exported.instance.lifecycle().check_call(call).and_then(|()| body(exported)));
        let result = catch_unwind(run);
        let error = match result {
            // Nearly all calls are these, and steps are short.
            Ok(Ok(())) if !log::has_messages() => return Status::Ok,
            Ok(Ok(())) => None,
            // An importer may ask for a missing variable, or in the wrong order, and go on. Only a
            // model that failed is lost, and its state is set already.
            Ok(Err(error)) => Some(error),
            Err(panic) => {
                exported.instance.lifecycle().record_failure(Status::Fatal);
                Some(FmiError { status: Status::Fatal, message: panic_message(panic) })
            }
        };
        exported.log.collect_messages(error)
    };
    delivery.deliver();
    status
}

/// `fmi2Instantiate`: null when the GUID is not this library's or an argument is missing.
///
/// # Safety
/// The arguments are as FMI 2.0 demands of `fmi2Instantiate`.
pub unsafe fn instantiate<S: CoSimulation>(
    name: *const c_char,
    kind: c_int,
    found: *const c_char,
    resources: *const c_char,
    functions: *const CallbackFunctions,
    logging_on: Boolean,
) -> Component {
    if functions.is_null() || !functions.is_aligned() {
        return ptr::null_mut();
    }
    // SAFETY: as the caller promises. The other members are not read: importers may leave them unset.
    let (logger, environment) =
        unsafe { ((&raw const (*functions).logger).read(), (&raw const (*functions).environment).read()) };
    let Some(logger) = logger else { return ptr::null_mut() };
    // SAFETY: as the caller promises.
    let (name, found, resources) = unsafe { (copy_c_text(name), copy_c_text(found), copy_c_text(resources)) };
    let wrong = (kind != CO_SIMULATION).then_some("only co-simulation is supported");
    let logger = LoggerCallback::Two(logger);
    make_component::<S>(name, found, resources, wrong, logger, environment, logging_on != 0)
}

/// Makes an instance, unless something is wrong, for an importer with its logger and environment.
fn make_component<S: CoSimulation>(
    name: FmiResult<String>,
    found: FmiResult<String>,
    resources: FmiResult<String>,
    wrong: Option<&str>,
    logger: LoggerCallback,
    environment: *mut c_void,
    logging_on: bool,
) -> Component {
    let own_name = name.as_deref().unwrap_or_default();
    let importer = ImporterLogger { name: CString::new(own_name).unwrap_or_default(), logger, environment };
    let log = Log {
        importer: Arc::new(importer),
        own: S::log_categories(),
        enabled: if logging_on { u64::MAX } else { ALWAYS },
    };
    let instance = catch_unwind(AssertUnwindSafe(|| {
        match (name.as_deref(), found) {
            (Err(_) | Ok(""), _) => reject("the instance has no name in UTF-8"),
            _ if wrong.is_some() => reject(wrong.unwrap_or_default()),
            // FMI 2.0 allows no resources: the pointer may be null.
            (_, Ok(found)) => S::instantiate(&found, resources.ok().as_deref()),
            (_, Err(_)) => reject("expected the GUID of the description, found none"),
        }
    }));
    let (instance, error) = match instance {
        Ok(Ok(instance)) => (Some(instance), None),
        Ok(Err(error)) => (None, Some(error)),
        Err(panic) => (None, Some(FmiError { status: Status::Fatal, message: panic_message(panic) })),
    };
    take_messages();
    if instance.is_some() {
        log::log_event("instantiated");
    }
    log.collect_messages(error).1.deliver();
    instance.map_or(ptr::null_mut(), |instance| {
        Box::into_raw(Box::new(ExportedComponent { instance, log, texts: Vec::new() })).cast()
    })
}

/// `fmi2FreeInstance` and `fmi3FreeInstance`.
///
/// # Safety
/// `component` is null or comes from [`instantiate`] and is not used again.
pub unsafe fn free_instance<S: CoSimulation>(component: Component) {
    if !component.is_null() {
        // SAFETY: `instantiate` made the box, and the caller gives it up.
        let exported = unsafe { Box::from_raw(component.cast::<ExportedComponent<S>>()) };
        // A model whose destructor panics must not take the importer with it.
        let freed = catch_unwind(AssertUnwindSafe(|| drop(exported)));
        let _ = freed.map_err(panic_message);
        // Nobody is left to read what the destructor logged.
        take_messages();
    }
}

/// `fmi2SetDebugLogging` and `fmi3SetDebugLogging`: no category means all of them.
///
/// # Safety
/// The arguments are as FMI 2.0 demands of `fmi2SetDebugLogging`.
pub unsafe fn set_debug_logging<S: CoSimulation>(
    component: Component,
    logging_on: Boolean,
    length: usize,
    categories: *const *const c_char,
) -> Status {
    let body = |ExportedComponent { log, .. }: &mut ExportedComponent<S>| {
        let mut chosen = 0;
        // SAFETY: as the caller promises.
        for category in unsafe { read_array(categories, length) }? {
            // SAFETY: as the caller promises.
            let category = unsafe { copy_c_text(*category) }?;
            let Some(bit) = log.category_bit(&category) else {
                return reject(format!("there is no log category {category:?}"));
            };
            chosen |= bit;
        }
        let chosen = if length == 0 { u64::MAX } else { chosen };
        log.enabled = if logging_on == 0 { log.enabled & !chosen | ALWAYS } else { chosen };
        Ok(())
    };
    // SAFETY: as the caller promises.
    unsafe { with_component::<S>(component, Call::SetDebugLogging, body) }
}

/// `fmi2SetupExperiment`, with the tolerance and the stop time if they are defined.
///
/// # Safety
/// As `with_component` demands of `component`.
pub unsafe fn setup_experiment<S: CoSimulation>(
    component: Component,
    tolerance: Option<f64>,
    start: f64,
    stop: Option<f64>,
) -> Status {
    // SAFETY: as the caller promises.
    unsafe {
        with_component::<S>(component, Call::SetupExperiment, |exported| {
            exported.instance.lifecycle().setup_experiment(start, stop, tolerance)
        })
    }
}

/// The calls without arguments, by their names in FMI 2.0: `fmi2EnterInitializationMode`, `fmi2ExitInitializationMode`,
/// `fmi2Terminate`, `fmi2Reset` and `fmi2CancelStep`.
///
/// # Safety
/// As `with_component` demands of `component`.
pub unsafe fn change_state<S: CoSimulation>(component: Component, call: Call) -> Status {
    let body = |ExportedComponent { instance, .. }: &mut ExportedComponent<S>| {
        match call {
            Call::EnterInitializationMode => {
                instance.enter_initialization()?;
                instance.lifecycle().state = LifecycleState::Initialization;
            }
            Call::ExitInitializationMode => {
                if let Err(error) = instance.exit_initialization() {
                    instance.lifecycle().record_failure(error.status);
                    return Err(error);
                }
                instance.lifecycle().state = LifecycleState::StepComplete;
            }
            Call::Terminate => {
                instance.terminate()?;
                instance.lifecycle().state = LifecycleState::Terminated;
            }
            Call::Reset => {
                instance.reset()?;
                *instance.lifecycle() = Lifecycle::default();
            }
            _ => return reject(format!("{call:?} is not supported")),
        }
        log::log_event(format!("{call:?}"));
        Ok(())
    };
    // SAFETY: as the caller promises.
    unsafe { with_component::<S>(component, call, body) }
}

/// `fmi2DoStep`.
///
/// # Safety
/// As `with_component` demands of `component`.
pub unsafe fn do_step<S: CoSimulation>(component: Component, time: f64, step: f64) -> Status {
    // SAFETY: as the caller promises.
    unsafe { with_component::<S>(component, Call::DoStep, |exported| exported.instance.do_step(time, step)) }
}

/// Rejects the functions whose capability flags are not set.
///
/// # Safety
/// As `with_component` demands of `component`.
pub unsafe fn unsupported<S: CoSimulation>(component: Component, call: Call, name: &str) -> Status {
    let body = |_: &mut ExportedComponent<S>| reject(format!("{name} is not supported"));
    // SAFETY: as the caller promises.
    unsafe { with_component::<S>(component, call, body) }
}

/// `fmi2GetStatus`, `fmi2GetRealStatus` and `fmi2GetBooleanStatus`: `answer` gives the
/// status of a kind, by its number in `fmi2StatusKind`.
///
/// # Safety
/// `value` is valid; as `with_component` demands of `component`.
pub unsafe fn get_status<S: CoSimulation, T>(
    component: Component,
    kind: c_int,
    value: *mut T,
    answer: fn(&Lifecycle, c_int) -> Option<T>,
) -> Status {
    let body = |ExportedComponent { instance, .. }: &mut ExportedComponent<S>| {
        let Some(found) = answer(instance.lifecycle(), kind) else {
            return Err(FmiError {
                status: Status::Discard,
                message: format!("there is no status of kind {kind} of this type"),
            });
        };
        // SAFETY: as the caller promises.
        unsafe { write_result(value, found) }
    };
    // SAFETY: as the caller promises.
    unsafe { with_component::<S>(component, Call::GetStatus, body) }
}

/// Gives the model's name, its `modelDescription.xml` of FMI 2.0, the mistakes in its table, its description of FMI 3.0 and its
/// terminals to a packer.
///
/// # Safety
/// `take` takes `context`, a number and a text, valid during the call.
pub unsafe fn pass_model_texts<M: Model>(
    context: *mut c_void,
    take: unsafe extern "C" fn(*mut c_void, u32, *const u8, usize),
) {
    let texts = catch_unwind(|| {
        let problems = description::model_problems::<M>().join("; ");
        let (xml, xml3) = (description::fmi2_model_xml::<M>(), description::fmi3_model_xml::<M>());
        [M::INFO.name.to_owned(), xml, problems, xml3, description::model_terminals_xml::<M>()]
    });
    // A packer reads why there is no description where it reads what is wrong with one.
    let texts = texts.unwrap_or_else(|panic| {
        let [name, xml, xml3, terminals] = [const { String::new() }; 4];
        [name, xml, panic_message(panic), xml3, terminals]
    });
    take_messages();
    for (what, text) in (0..).zip(&texts) {
        // SAFETY: as the caller promises.
        unsafe { take(context, what, text.as_ptr(), text.len()) };
    }
}
