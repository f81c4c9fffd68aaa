//! Implements the 34 C functions of FMI 2.0 co-simulation for any model; [`crate::export!`] only names them.
//!
//! Each function may be called with whatever a C program hands over. Pointers are looked at here and
//! nowhere else, no panic leaves this file, and what a call could not do goes to the importer's logger.

use std::any::Any;
use std::ffi::{CStr, CString, c_char, c_int, c_void};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::{ptr, slice};

use crate::Model;
use crate::abi::{Boolean, CallbackFunctions, Component, FmuState, Logger, Status, ValueReference};
use crate::description::{self, LOG_CATEGORIES, guid};
use crate::instance::{Instance, Outcome, Refusal, Snapshot};
pub use crate::lifecycle::Call;
use crate::variable::Access;

const CO_SIMULATION: c_int = 1;
const EVENTS: usize = 0;
/// Categories that are on before anyone asks: without them a failure would be silent.
const ALWAYS: u8 = 1 << Status::Discard as u8 | 1 << Status::Error as u8 | 1 << Status::Fatal as u8;
const ALL: u8 = (1 << LOG_CATEGORIES.len()) - 1;

/// What an `fmi2Component` points to.
struct Slave<M: Model> {
    instance: Instance<M>,
    log: Log,
}

struct Log {
    name: CString,
    logger: Logger,
    environment: *mut c_void,
    /// Bit `i` is set when category `i` of [`LOG_CATEGORIES`] is wanted.
    wanted: u8,
}

impl Log {
    /// The number of a status in [`LOG_CATEGORIES`] is the number of the status.
    fn send(&self, status: Status, category: usize, message: &str) {
        if self.wanted & 1 << category == 0 {
            return;
        }
        let text = CString::new(message.replace('\0', "?")).unwrap_or_default();
        let category = CString::new(LOG_CATEGORIES[category].0).unwrap_or_default();
        // SAFETY: the importer's logger takes these arguments. The message is an argument of a fixed
        // format, so that a percent sign in it means nothing.
        unsafe {
            (self.logger)(
                self.environment,
                self.name.as_ptr(),
                status,
                category.as_ptr(),
                c"%s".as_ptr(),
                text.as_ptr(),
            );
        }
    }

    fn status(&self, refusal: &Refusal) {
        self.send(refusal.status, refusal.status as usize, &refusal.message);
    }
}

fn panic_message(panic: &(dyn Any + Send)) -> String {
    let text = panic.downcast_ref::<&str>().copied();
    let text = text.or_else(|| panic.downcast_ref::<String>().map(String::as_str));
    format!("the model panicked: {}", text.unwrap_or("no message"))
}

fn error<T>(message: impl Into<String>) -> Outcome<T> {
    Err(Refusal { status: Status::Error, message: message.into() })
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
    match catch_unwind(run) {
        Ok(Ok(())) => Status::Ok,
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
        (_, true) => error("a null pointer stands for an array"),
        // SAFETY: as the caller promises.
        _ => Ok(unsafe { slice::from_raw_parts(pointer, length) }),
    }
}

/// # Safety
/// `pointer` is valid for `length` values of `T` that nobody else uses, or `length` is 0.
unsafe fn write<'a, T>(pointer: *mut T, length: usize) -> Outcome<&'a mut [T]> {
    match (length, pointer.is_null()) {
        (0, _) => Ok(&mut []),
        (_, true) => error("a null pointer stands for an array"),
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
        wanted: if logging_on == 0 { ALWAYS } else { ALL },
    };
    let instance = catch_unwind(|| {
        let expected = guid::<M>();
        match (name.as_deref(), found.as_deref()) {
            (None | Some(""), _) => error("the instance has no name"),
            _ if kind != CO_SIMULATION => error("only co-simulation is supported"),
            (_, Some(found)) if found == expected => Ok(Instance::<M>::new()),
            (_, found) => {
                error(format!("expected GUID {expected}, found {}", found.unwrap_or("none")))
            }
        }
    });
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
            let Some(bit) = LOG_CATEGORIES.iter().position(|(name, _)| *name == category) else {
                return error(format!("there is no log category {category:?}"));
            };
            chosen |= 1 << bit;
        }
        let chosen = if length == 0 { ALL } else { chosen };
        log.wanted = if logging_on == 0 { log.wanted & !chosen | ALWAYS } else { chosen };
        Ok(())
    };
    // SAFETY: as the caller promises.
    unsafe { with::<M>(component, Call::SetDebugLogging, body) }
}

/// `fmi2SetupExperiment`; the tolerance is for solvers, and there is none.
///
/// # Safety
/// As [`with`] demands of `component`.
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
/// As [`with`] demands of `component`.
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
            _ => return error(format!("{call:?} is not supported")),
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
/// As [`with`] demands of `component`.
pub unsafe fn do_step<M: Model>(component: Component, time: f64, step: f64) -> Status {
    // SAFETY: as the caller promises.
    unsafe { with::<M>(component, Call::DoStep, |instance, _| instance.do_step(time, step)) }
}

/// `fmi2GetReal`, `fmi2GetInteger` and `fmi2GetBoolean`: `read_one` picks the type.
///
/// # Safety
/// `references` and `values` are valid for `length` values; as [`with`] demands of `component`.
pub unsafe fn get<M: Model, T>(
    component: Component,
    references: *const ValueReference,
    length: usize,
    values: *mut T,
    read_one: fn(&Access<M>, &mut M) -> Option<T>,
) -> Status {
    let body = |instance: &mut Instance<M>, _: &mut Log| {
        // SAFETY: as the caller promises.
        let (references, values) = unsafe { (read(references, length)?, write(values, length)?) };
        instance.prepare_get()?;
        for (reference, value) in references.iter().zip(values) {
            *value = instance.get(*reference, read_one)?;
        }
        Ok(())
    };
    // SAFETY: as the caller promises.
    unsafe { with::<M>(component, Call::Get, body) }
}

/// `fmi2GetString`: the texts stay valid until the next call of this function.
///
/// # Safety
/// As [`get`].
pub unsafe fn get_string<M: Model>(
    component: Component,
    references: *const ValueReference,
    length: usize,
    values: *mut *const c_char,
) -> Status {
    let body = |instance: &mut Instance<M>, _: &mut Log| {
        // SAFETY: as the caller promises.
        let (references, values) = unsafe { (read(references, length)?, write(values, length)?) };
        instance.prepare_get()?;
        instance.strings.clear();
        for (reference, value) in references.iter().zip(values) {
            let text = instance.get(*reference, |access, model| match access {
                Access::String(at) => Some(at(model).clone()),
                _ => None,
            })?;
            let text = CString::new(text.replace('\0', "?")).unwrap_or_default();
            *value = text.as_ptr();
            instance.strings.push(text);
        }
        Ok(())
    };
    // SAFETY: as the caller promises.
    unsafe { with::<M>(component, Call::Get, body) }
}

/// `fmi2SetReal`, `fmi2SetInteger`, `fmi2SetBoolean` and `fmi2SetString`: `write_one` picks the type,
/// `number` gives the value that limits apply to.
///
/// # Safety
/// As [`get`]; texts among the values are C strings.
pub unsafe fn set<M: Model, T: Copy>(
    component: Component,
    references: *const ValueReference,
    length: usize,
    values: *const T,
    number: fn(T) -> Option<f64>,
    write_one: fn(&Access<M>, &mut M, T) -> bool,
) -> Status {
    let body = |instance: &mut Instance<M>, _: &mut Log| {
        // SAFETY: as the caller promises.
        let (references, values) = unsafe { (read(references, length)?, read(values, length)?) };
        for (&reference, &value) in references.iter().zip(values) {
            instance
                .set(reference, number(value), |access, model| write_one(access, model, value))?;
        }
        Ok(())
    };
    // SAFETY: as the caller promises.
    unsafe { with::<M>(component, Call::Set, body) }
}

/// Copies a C string into the model.
///
/// # Safety
/// `value` is null or points to a C string.
pub unsafe fn write_string<M>(access: &Access<M>, model: &mut M, value: *const c_char) -> bool {
    // SAFETY: as the caller promises.
    match (access, unsafe { text(value) }) {
        (Access::String(at), Some(value)) => {
            *at(model) = value;
            true
        }
        _ => false,
    }
}

/// `fmi2GetFMUstate`: an existing state is overwritten.
///
/// # Safety
/// `state` points to null or to a state of this model.
pub unsafe fn get_fmu_state<M: Model>(component: Component, state: *mut FmuState) -> Status {
    let body = |instance: &mut Instance<M>, _: &mut Log| {
        // SAFETY: as the caller promises.
        let Some(state) = (unsafe { state.as_mut() }) else {
            return error("a null pointer stands for an FMU state");
        };
        // SAFETY: as the caller promises.
        match unsafe { state.cast::<Snapshot<M>>().as_mut() } {
            Some(old) => *old = instance.snapshot(),
            None => *state = Box::into_raw(Box::new(instance.snapshot())).cast(),
        }
        Ok(())
    };
    // SAFETY: as the caller promises.
    unsafe { with::<M>(component, Call::FmuState, body) }
}

/// `fmi2SetFMUstate`.
///
/// # Safety
/// `state` is null or a state of this model.
pub unsafe fn set_fmu_state<M: Model>(component: Component, state: FmuState) -> Status {
    let body = |instance: &mut Instance<M>, _: &mut Log| {
        // SAFETY: as the caller promises.
        let Some(state) = (unsafe { state.cast::<Snapshot<M>>().as_ref() }) else {
            return error("a null pointer stands for an FMU state");
        };
        instance.restore(state);
        Ok(())
    };
    // SAFETY: as the caller promises.
    unsafe { with::<M>(component, Call::FmuState, body) }
}

/// `fmi2FreeFMUstate`: null is left alone.
///
/// # Safety
/// `state` points to null or to a state of this model that is not used again.
pub unsafe fn free_fmu_state<M: Model>(component: Component, state: *mut FmuState) -> Status {
    let body = |_: &mut Instance<M>, _: &mut Log| {
        // SAFETY: as the caller promises.
        if let Some(state) = unsafe { state.as_mut() }
            && !state.is_null()
        {
            // SAFETY: `get_fmu_state` or `deserialize` made the box, and the caller gives it up.
            drop(unsafe { Box::from_raw(state.cast::<Snapshot<M>>()) });
            *state = ptr::null_mut();
        }
        Ok(())
    };
    // SAFETY: as the caller promises.
    unsafe { with::<M>(component, Call::FmuState, body) }
}

/// The bytes of a state, which begin with the GUID of the model that they belong to.
///
/// # Safety
/// `state` is null or a state of this model.
unsafe fn bytes<M: Model>(state: FmuState) -> Outcome<Vec<u8>> {
    // SAFETY: as the caller promises.
    let Some(state) = (unsafe { state.cast::<Snapshot<M>>().as_ref() }) else {
        return error("a null pointer stands for an FMU state");
    };
    postcard::to_stdvec(&(guid::<M>(), state)).or_else(|cause| error(cause.to_string()))
}

/// `fmi2SerializedFMUstateSize`.
///
/// # Safety
/// `state` is a state of this model, `size` is valid.
pub unsafe fn serialized_size<M: Model>(
    component: Component,
    state: FmuState,
    size: *mut usize,
) -> Status {
    let body = |_: &mut Instance<M>, _: &mut Log| {
        // SAFETY: as the caller promises.
        unsafe { write(size, 1)?[0] = bytes::<M>(state)?.len() };
        Ok(())
    };
    // SAFETY: as the caller promises.
    unsafe { with::<M>(component, Call::FmuState, body) }
}

/// `fmi2SerializeFMUstate`.
///
/// # Safety
/// `state` is a state of this model, `into` is valid for `length` bytes.
pub unsafe fn serialize<M: Model>(
    component: Component,
    state: FmuState,
    into: *mut u8,
    length: usize,
) -> Status {
    let body = |_: &mut Instance<M>, _: &mut Log| {
        // SAFETY: as the caller promises.
        let (bytes, into) = unsafe { (bytes::<M>(state)?, write(into, length)?) };
        match into.get_mut(..bytes.len()) {
            Some(into) => into.copy_from_slice(&bytes),
            None => {
                return error(format!("expected room for {} bytes, found {length}", bytes.len()));
            }
        }
        Ok(())
    };
    // SAFETY: as the caller promises.
    unsafe { with::<M>(component, Call::FmuState, body) }
}

/// `fmi2DeSerializeFMUstate`: a new state, to be freed like any other.
///
/// # Safety
/// `from` is valid for `length` bytes, `state` is valid.
pub unsafe fn deserialize<M: Model>(
    component: Component,
    from: *const u8,
    length: usize,
    state: *mut FmuState,
) -> Status {
    let body = |_: &mut Instance<M>, _: &mut Log| {
        // SAFETY: as the caller promises.
        let (from, state) = unsafe { (read(from, length)?, write(state, 1)?) };
        match postcard::from_bytes::<(String, Snapshot<M>)>(from) {
            Ok((found, snapshot)) if found == guid::<M>() => {
                state[0] = Box::into_raw(Box::new(snapshot)).cast();
                Ok(())
            }
            Ok((found, _)) => {
                error(format!("expected a state of {}, found one of {found}", guid::<M>()))
            }
            Err(cause) => error(format!("these bytes are no FMU state: {cause}")),
        }
    };
    // SAFETY: as the caller promises.
    unsafe { with::<M>(component, Call::FmuState, body) }
}

/// The functions whose capability flags are not set: they say so.
///
/// # Safety
/// As [`with`] demands of `component`.
pub unsafe fn unsupported<M: Model>(component: Component, call: Call, name: &str) -> Status {
    let body = |_: &mut Instance<M>, _: &mut Log| error(format!("{name} is not supported"));
    // SAFETY: as the caller promises.
    unsafe { with::<M>(component, call, body) }
}

/// `fmi2GetStatus`, `fmi2GetRealStatus` and `fmi2GetBooleanStatus`: `answer` knows the kinds that the
/// function answers, by their numbers in `fmi2StatusKind`.
///
/// # Safety
/// `value` is valid; as [`with`] demands of `component`.
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

/// Exports a model as an FMI 2.0 co-simulation library: the 34 C functions, and the one by which a
/// packer asks the library for its description.
#[macro_export]
macro_rules! export {
    ($model:ty) => {
        type ExportedModel = $model;

        #[allow(non_snake_case, missing_docs, clippy::missing_safety_doc)]
        mod fmi2 {
            use std::ffi::{c_char, c_int, c_void};

            use $crate::Access;
            use $crate::abi::{Boolean, CallbackFunctions, Component, FmuState, Status, ValueReference};
            use $crate::export::{self, Call, LastStep};

            use super::ExportedModel as Model;

            $crate::c_functions! {
                fmi2SetDebugLogging(c: Component, on: Boolean, n: usize, categories: *const *const c_char)
                    => export::set_debug_logging::<Model>(c, on, n, categories);
                fmi2SetupExperiment(c: Component, _has_tolerance: Boolean, _tolerance: f64, start: f64, has_stop: Boolean, stop: f64)
                    => export::setup_experiment::<Model>(c, start, has_stop, stop);
                fmi2EnterInitializationMode(c: Component)
                    => export::proceed::<Model>(c, Call::EnterInitializationMode);
                fmi2ExitInitializationMode(c: Component)
                    => export::proceed::<Model>(c, Call::ExitInitializationMode);
                fmi2Terminate(c: Component) => export::proceed::<Model>(c, Call::Terminate);
                fmi2Reset(c: Component) => export::proceed::<Model>(c, Call::Reset);
                fmi2CancelStep(c: Component) => export::proceed::<Model>(c, Call::CancelStep);
                fmi2DoStep(c: Component, time: f64, step: f64, _no_set_state_prior: Boolean)
                    => export::do_step::<Model>(c, time, step);
                fmi2GetReal(c: Component, r: *const ValueReference, n: usize, v: *mut f64)
                    => export::get::<Model, f64>(c, r, n, v, |access, model| match access {
                        Access::Real(at) => Some(*at(model)),
                        _ => None,
                    });
                fmi2GetInteger(c: Component, r: *const ValueReference, n: usize, v: *mut c_int)
                    => export::get::<Model, c_int>(c, r, n, v, |access, model| match access {
                        Access::Integer(at) => Some(*at(model)),
                        _ => None,
                    });
                fmi2GetBoolean(c: Component, r: *const ValueReference, n: usize, v: *mut Boolean)
                    => export::get::<Model, Boolean>(c, r, n, v, |access, model| match access {
                        Access::Boolean(at) => Some(Boolean::from(*at(model))),
                        _ => None,
                    });
                fmi2GetString(c: Component, r: *const ValueReference, n: usize, v: *mut *const c_char)
                    => export::get_string::<Model>(c, r, n, v);
                fmi2SetReal(c: Component, r: *const ValueReference, n: usize, v: *const f64)
                    => export::set::<Model, f64>(c, r, n, v, Some, |access, model, value| match access {
                        Access::Real(at) => { *at(model) = value; true }
                        _ => false,
                    });
                fmi2SetInteger(c: Component, r: *const ValueReference, n: usize, v: *const c_int)
                    => export::set::<Model, c_int>(c, r, n, v, |value| Some(value.into()), |access, model, value| match access {
                        Access::Integer(at) => { *at(model) = value; true }
                        _ => false,
                    });
                fmi2SetBoolean(c: Component, r: *const ValueReference, n: usize, v: *const Boolean)
                    => export::set::<Model, Boolean>(c, r, n, v, |_| None, |access, model, value| match access {
                        Access::Boolean(at) => { *at(model) = value != 0; true }
                        _ => false,
                    });
                fmi2SetString(c: Component, r: *const ValueReference, n: usize, v: *const *const c_char)
                    => export::set::<Model, *const c_char>(c, r, n, v, |_| None, |access, model, value| {
                        unsafe { export::write_string(access, model, value) }
                    });
                fmi2GetFMUstate(c: Component, s: *mut FmuState) => export::get_fmu_state::<Model>(c, s);
                fmi2SetFMUstate(c: Component, s: FmuState) => export::set_fmu_state::<Model>(c, s);
                fmi2FreeFMUstate(c: Component, s: *mut FmuState) => export::free_fmu_state::<Model>(c, s);
                fmi2SerializedFMUstateSize(c: Component, s: FmuState, size: *mut usize)
                    => export::serialized_size::<Model>(c, s, size);
                fmi2SerializeFMUstate(c: Component, s: FmuState, bytes: *mut u8, n: usize)
                    => export::serialize::<Model>(c, s, bytes, n);
                fmi2DeSerializeFMUstate(c: Component, bytes: *const u8, n: usize, s: *mut FmuState)
                    => export::deserialize::<Model>(c, bytes, n, s);
                fmi2GetDirectionalDerivative(c: Component, _unknown: *const ValueReference, _n: usize, _known: *const ValueReference, _m: usize, _dv_known: *const f64, _dv_unknown: *mut f64)
                    => export::unsupported::<Model>(c, Call::GetDirectionalDerivative, "a directional derivative");
                fmi2SetRealInputDerivatives(c: Component, _r: *const ValueReference, _n: usize, _order: *const c_int, _v: *const f64)
                    => export::unsupported::<Model>(c, Call::SetRealInputDerivatives, "an input derivative");
                fmi2GetRealOutputDerivatives(c: Component, _r: *const ValueReference, _n: usize, _order: *const c_int, _v: *mut f64)
                    => export::unsupported::<Model>(c, Call::GetRealOutputDerivatives, "an output derivative");
                fmi2GetStatus(c: Component, kind: c_int, v: *mut Status)
                    => export::get_status::<Model, Status>(c, kind, v, |last, kind| (kind == 0).then(|| last.status()));
                fmi2GetRealStatus(c: Component, kind: c_int, v: *mut f64)
                    => export::get_status::<Model, f64>(c, kind, v, |last, kind| (kind == 2).then(|| last.last_successful_time()));
                fmi2GetIntegerStatus(c: Component, kind: c_int, v: *mut c_int)
                    => export::get_status::<Model, c_int>(c, kind, v, |_, _| None);
                fmi2GetBooleanStatus(c: Component, kind: c_int, v: *mut Boolean)
                    => export::get_status::<Model, Boolean>(c, kind, v, |last, kind| (kind == 3).then(|| last.terminated().into()));
                fmi2GetStringStatus(c: Component, kind: c_int, v: *mut *const c_char)
                    => export::get_status::<Model, *const c_char>(c, kind, v, |_, _| None);
            }

            #[unsafe(no_mangle)]
            pub extern "C" fn fmi2GetTypesPlatform() -> *const c_char {
                c"default".as_ptr()
            }

            #[unsafe(no_mangle)]
            pub extern "C" fn fmi2GetVersion() -> *const c_char {
                c"2.0".as_ptr()
            }

            #[unsafe(no_mangle)]
            pub unsafe extern "C" fn fmi2Instantiate(
                name: *const c_char,
                kind: c_int,
                guid: *const c_char,
                _resources: *const c_char,
                functions: *const CallbackFunctions,
                _visible: Boolean,
                logging_on: Boolean,
            ) -> Component {
                unsafe { export::instantiate::<Model>(name, kind, guid, functions, logging_on) }
            }

            #[unsafe(no_mangle)]
            pub unsafe extern "C" fn fmi2FreeInstance(c: Component) {
                unsafe { export::free_instance::<Model>(c) }
            }

            #[unsafe(no_mangle)]
            pub unsafe extern "C" fn fmu_export_describe(
                context: *mut c_void,
                take: unsafe extern "C" fn(*mut c_void, u32, *const u8, usize),
            ) {
                unsafe { export::describe::<Model>(context, take) }
            }
        }
    };
}

/// Defines C functions that return an `fmi2Status`.
#[doc(hidden)]
#[macro_export]
macro_rules! c_functions {
    ($($name:ident($($argument:ident: $type:ty),*) => $body:expr;)*) => {
        $(
            #[unsafe(no_mangle)]
            pub unsafe extern "C" fn $name($($argument: $type),*) -> Status {
                unsafe { $body }
            }
        )*
    };
}
