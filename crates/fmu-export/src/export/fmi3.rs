//! Implements the C functions whose arguments FMI 3.0 has changed.

use std::ffi::{c_char, c_void};

use super::logger::LoggerCallback;
use super::{
    Call, ExportedComponent, change_state, do_step, make_component, setup_experiment, values, with_component,
};
use crate::abi::{Component, LogMessage, Status, ValueReference};
use crate::co_simulation::CoSimulation;
use crate::error::{FmiResult, reject};
use crate::memory::{OutputArray, copy_c_text, read_array, write_result};
pub use crate::value::ByteBoolean;
use crate::value::FmiValue;
use crate::variable::VariableAccess;

/// What an importer wants of the instance besides steps.
#[derive(Debug, Clone, Copy)]
pub struct InstantiationOptions {
    /// Log all there is.
    pub logging_on: bool,
    /// Use event mode; the model has none.
    pub event_mode: bool,
    /// Variables of the intermediate update; the model has none.
    pub intermediate: usize,
}

/// `fmi3InstantiateCoSimulation`: null when the token is not this library's, an argument is missing, or the importer needs what the
/// description does not offer.
///
/// # Safety
/// The texts are null or C strings; `log` takes the arguments of `fmi3LogMessageCallback`.
pub unsafe fn instantiate<S: CoSimulation>(
    name: *const c_char,
    token: *const c_char,
    resources: *const c_char,
    environment: *mut c_void,
    log: Option<LogMessage>,
    options: InstantiationOptions,
) -> Component {
    let Some(log) = log else { return std::ptr::null_mut() };
    // SAFETY: as the caller promises.
    let (name, token, resources) = unsafe { (copy_c_text(name), copy_c_text(token), copy_c_text(resources)) };
    let wrong = match options {
        InstantiationOptions { event_mode: true, .. } => Some("the FMU has no event mode"),
        InstantiationOptions { intermediate: 1.., .. } => Some("the FMU has no intermediate update"),
        _ => None,
    };
    let logger = LoggerCallback::Three(log);
    make_component::<S>(name, token, resources, wrong, logger, environment, options.logging_on)
}

/// `fmi3EnterInitializationMode`.
///
/// # Safety
/// As `with_component` demands of `component`.
pub unsafe fn enter_initialization<S: CoSimulation>(
    component: Component,
    tolerance: Option<f64>,
    start: f64,
    stop: Option<f64>,
) -> Status {
    // SAFETY: as the caller promises.
    unsafe {
        match setup_experiment::<S>(component, tolerance, start, stop) {
            Status::Ok | Status::Warning => change_state::<S>(component, Call::EnterInitializationMode),
            status => status,
        }
    }
}

/// Where `fmi3DoStep` says how the step ended.
#[derive(Debug, Clone, Copy)]
pub struct StepOutputs {
    /// `eventHandlingNeeded`.
    pub event: *mut bool,
    /// `terminateSimulation`.
    pub terminate: *mut bool,
    /// `earlyReturn`.
    pub early: *mut bool,
    /// `lastSuccessfulTime` [s].
    pub reached: *mut f64,
}

/// `fmi3DoStep`. A model that ends the simulation does so before the step: the last successful time is its start.
///
/// # Safety
/// The members of `ended` are null or valid for a write; as `with_component` demands of `component`.
pub unsafe fn step<S: CoSimulation>(
    component: Component,
    time: f64,
    step: f64,
    outputs: StepOutputs,
) -> Status {
    // SAFETY: as the caller promises.
    let status = unsafe { do_step::<S>(component, time, step) };
    let (mut reached, mut terminate) = (time, false);
    let look = |ExportedComponent { instance, .. }: &mut ExportedComponent<S>| {
        let lifecycle = instance.lifecycle();
        (reached, terminate) = (lifecycle.now, lifecycle.terminated);
        Ok(())
    };
    if status != Status::Fatal {
        // SAFETY: as the caller promises. States may be asked for in every state but that.
        let _ = unsafe { with_component::<S>(component, Call::FmuState, look) };
    }
    // SAFETY: as the caller promises. An importer that does not want an answer may hand over null.
    unsafe {
        for (answer, value) in
            [(outputs.event, false), (outputs.terminate, terminate), (outputs.early, false)]
        {
            let _ = write_result(answer, value);
        }
        let _ = write_result(outputs.reached, reached);
    }
    if terminate && status == Status::Discard { Status::Ok } else { status }
}

/// Runs a call on the elements of variables, each with a reference of its own. Another number of values is refused.
///
/// # Safety
/// `references` is valid for `count` values; as `with_component` demands of `component`.
unsafe fn call_on_elements<S: CoSimulation>(
    component: Component,
    call: Call,
    references: *const ValueReference,
    count: usize,
    length: usize,
    body: impl FnOnce(*const ValueReference, usize) -> Status,
) -> Status {
    if !S::HAS_ARRAYS && count == length {
        return body(references, count);
    }
    let mut all = Vec::new();
    let look = |ExportedComponent { instance, .. }: &mut ExportedComponent<S>| {
        // SAFETY: as the caller promises.
        for reference in unsafe { read_array(references, count)? } {
            match instance.element_count(*reference) {
                0 => return reject(format!("no variable has the value reference {reference}")),
                // Of a reference that is none, also of the largest, there is one element, which cannot be read.
                elements => all.extend((0..elements as u32).map(|at| reference.wrapping_add(at))),
            }
        }
        let expected = all.len();
        if expected == length {
            return Ok(());
        }
        reject(format!("expected {expected} values for {count} variables, found {length}"))
    };
    // SAFETY: as the caller promises.
    match unsafe { with_component::<S>(component, call, look) } {
        Status::Ok => body(all.as_ptr(), length),
        status => status,
    }
}

/// `fmi3GetFloat64`, `fmi3GetInt32` and `fmi3GetBoolean`.
///
/// # Safety
/// `references` is valid for `count` values, `values` for `length`; as `with_component` demands of `component`.
pub unsafe fn get<S: CoSimulation, T: FmiValue>(
    component: Component,
    references: *const ValueReference,
    count: usize,
    values: *mut T,
    length: usize,
) -> Status {
    // SAFETY: as the caller promises.
    let body = |references, count| unsafe {
        values::get_values_with::<S, T>(component, references, count, values, get_or_time)
    };
    // SAFETY: as the caller promises.
    unsafe { call_on_elements::<S>(component, Call::Get, references, count, length, body) }
}

/// Reads a variable, or the time that only this version has.
fn get_or_time<S: CoSimulation, T: FmiValue>(instance: &mut S, reference: u32) -> FmiResult<T> {
    if instance.time_reference() != Some(reference) {
        return instance.get(reference);
    }
    let mut now = instance.lifecycle().now;
    let time = T::read_from_model(&VariableAccess::Real(|now: &mut f64| now), &mut now);
    time.map_or_else(|| reject("the time is of type Real"), Ok)
}

/// `fmi3SetFloat64`, `fmi3SetInt32` and `fmi3SetBoolean`.
///
/// # Safety
/// As [`get`].
pub unsafe fn set<S: CoSimulation, T: FmiValue>(
    component: Component,
    references: *const ValueReference,
    count: usize,
    values: *const T,
    length: usize,
) -> Status {
    // SAFETY: as the caller promises.
    let body = |references, count| unsafe { values::set::<S, T>(component, references, count, values) };
    // SAFETY: as the caller promises.
    unsafe { call_on_elements::<S>(component, Call::Set, references, count, length, body) }
}

/// `fmi3GetString`: the texts stay valid until the next call of this function.
///
/// # Safety
/// As [`get`].
pub unsafe fn get_string<S: CoSimulation>(
    component: Component,
    references: *const ValueReference,
    count: usize,
    values: *mut *const c_char,
    length: usize,
) -> Status {
    // SAFETY: as the caller promises.
    let body = |references, count| unsafe { values::get_string::<S>(component, references, count, values) };
    // SAFETY: as the caller promises.
    unsafe { call_on_elements::<S>(component, Call::Get, references, count, length, body) }
}

/// `fmi3SetString`: the texts are copied.
///
/// # Safety
/// As [`get`]; each of the values is null or points to a C string.
pub unsafe fn set_string<S: CoSimulation>(
    component: Component,
    references: *const ValueReference,
    count: usize,
    values: *const *const c_char,
    length: usize,
) -> Status {
    // SAFETY: as the caller promises.
    let body = |references, count| unsafe { values::set_string::<S>(component, references, count, values) };
    // SAFETY: as the caller promises.
    unsafe { call_on_elements::<S>(component, Call::Set, references, count, length, body) }
}

/// Functions for types that no variable of a model has: nothing to read or write is no mistake.
///
/// # Safety
/// `references` is valid for `count` values; as `with_component` demands of `component`.
pub unsafe fn access_unsupported_type<S: CoSimulation>(
    component: Component,
    call: Call,
    references: *const ValueReference,
    count: usize,
    kind: &str,
) -> Status {
    let body = |_: &mut ExportedComponent<S>| {
        // SAFETY: as the caller promises.
        match unsafe { read_array(references, count)? } {
            [] => Ok(()),
            [first, ..] => reject(format!("variable {first} is no {kind}; the FMU has none")),
        }
    };
    // SAFETY: as the caller promises.
    unsafe { with_component::<S>(component, call, body) }
}

/// `fmi3GetDirectionalDerivative`.
///
/// # Safety
/// `unknowns` and `responses` are valid for their numbers of values, `knowns` and `changes` likewise; as `with` demands of
/// `component`.
#[allow(clippy::too_many_arguments, reason = "they are those of the C function")]
pub unsafe fn directional_derivative<S: CoSimulation>(
    component: Component,
    unknowns: *const ValueReference,
    rows: usize,
    knowns: *const ValueReference,
    columns: usize,
    changes: *const f64,
    seeds: usize,
    responses: *mut f64,
    room: usize,
) -> Status {
    let call = Call::GetDirectionalDerivative;
    // SAFETY: as the caller promises.
    unsafe {
        call_on_elements::<S>(component, call, knowns, columns, seeds, |knowns, columns| {
            call_on_elements::<S>(component, call, unknowns, rows, room, |unknowns, rows| {
                values::directional_derivative::<S>(
                    component, unknowns, rows, knowns, columns, changes, responses,
                )
            })
        })
    }
}

/// `fmi3GetNumberOfVariableDependencies` and `fmi3GetVariableDependencies` are not offered, and neither are functions of other modes.
/// What an importer would read is set to nothing.
///
/// # Safety
/// `count` is null or valid for a write; as `with_component` demands of `component`.
pub unsafe fn reject_unsupported_call<S: CoSimulation>(
    component: Component,
    count: *mut usize,
    name: &str,
) -> Status {
    // SAFETY: as the caller promises.
    let nothing = unsafe { OutputArray::new(count, usize::from(!count.is_null())) };
    let _ = nothing.and_then(|it| it.fill([Ok(0)]));
    // SAFETY: as the caller promises.
    unsafe { super::unsupported::<S>(component, Call::FmuState, name) }
}
