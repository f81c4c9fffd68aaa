//! Reads and writes variables, and differentiates them.

use std::ffi::{CString, c_char, c_int};

use super::{ExportedComponent, with_component};
use crate::abi::{Component, Status, ValueReference};
use crate::co_simulation::CoSimulation;
use crate::error::{FmiResult, reject};
use crate::lifecycle::Call;
use crate::memory::{OutputArray, copy_c_text, read_array};
use crate::value::FmiValue;

/// `fmi2GetReal`, `fmi2GetInteger` and `fmi2GetBoolean`.
///
/// # Safety
/// `references` and `values` are valid for `length` values; as `with_component` demands of `component`.
pub unsafe fn get<S: CoSimulation, T: FmiValue>(
    component: Component,
    references: *const ValueReference,
    length: usize,
    values: *mut T,
) -> Status {
    // SAFETY: as the caller promises.
    unsafe { get_values_with::<S, T>(component, references, length, values, S::get) }
}

/// Reads variables one by one in the given way.
///
/// # Safety
/// As [`get`].
pub(super) unsafe fn get_values_with<S: CoSimulation, T: FmiValue>(
    component: Component,
    references: *const ValueReference,
    length: usize,
    values: *mut T,
    read_one: fn(&mut S, u32) -> FmiResult<T>,
) -> Status {
    let body = |ExportedComponent { instance, .. }: &mut ExportedComponent<S>| {
        // SAFETY: as the caller promises.
        let references = unsafe { read_array(references, length)? };
        // SAFETY: as the caller promises.
        let values = unsafe { OutputArray::new(values, length)? };
        instance.refresh_outputs()?;
        values.fill(references.iter().map(|reference| read_one(instance, *reference)))
    };
    // SAFETY: as the caller promises.
    unsafe { with_component::<S>(component, Call::Get, body) }
}

/// `fmi2GetString`: the texts stay valid until the next call of this function.
///
/// # Safety
/// As [`get`].
pub unsafe fn get_string<S: CoSimulation>(
    component: Component,
    references: *const ValueReference,
    length: usize,
    values: *mut *const c_char,
) -> Status {
    let body = |ExportedComponent { instance, texts, .. }: &mut ExportedComponent<S>| {
        // SAFETY: as the caller promises.
        let references = unsafe { read_array(references, length)? };
        // SAFETY: as the caller promises.
        let values = unsafe { OutputArray::new(values, length)? };
        instance.refresh_outputs()?;
        let found = references.iter().map(|reference| {
            CString::new(instance.get::<String>(*reference)?)
                .or_else(|_| reject(format!("the text of variable {reference} has a zero in it")))
        });
        *texts = found.collect::<FmiResult<_>>()?;
        // The texts are where they stay before their addresses are handed out.
        values.fill(texts.iter().map(|text| Ok(text.as_ptr())))
    };
    // SAFETY: as the caller promises.
    unsafe { with_component::<S>(component, Call::Get, body) }
}

/// `fmi2SetReal`, `fmi2SetInteger` and `fmi2SetBoolean`.
///
/// # Safety
/// As [`get`].
pub unsafe fn set<S: CoSimulation, T: FmiValue>(
    component: Component,
    references: *const ValueReference,
    length: usize,
    values: *const T,
) -> Status {
    let body = |ExportedComponent { instance, .. }: &mut ExportedComponent<S>| {
        // SAFETY: as the caller promises.
        let (references, values) = unsafe { (read_array(references, length)?, read_array(values, length)?) };
        instance.set(references, values)
    };
    // SAFETY: as the caller promises.
    unsafe { with_component::<S>(component, Call::Set, body) }
}

/// `fmi2SetString`: the texts are copied.
///
/// # Safety
/// As [`get`]; each of the values is null or points to a C string.
pub unsafe fn set_string<S: CoSimulation>(
    component: Component,
    references: *const ValueReference,
    length: usize,
    values: *const *const c_char,
) -> Status {
    let body = |ExportedComponent { instance, .. }: &mut ExportedComponent<S>| {
        // SAFETY: as the caller promises.
        let (references, values) = unsafe { (read_array(references, length)?, read_array(values, length)?) };
        // SAFETY: as the caller promises.
        let texts = values.iter().map(|value| unsafe { copy_c_text(*value) });
        instance.set(references, &texts.collect::<FmiResult<Vec<_>>>()?)
    };
    // SAFETY: as the caller promises.
    unsafe { with_component::<S>(component, Call::Set, body) }
}

/// `fmi2SetRealInputDerivatives`: for the next step, and until the input is set.
///
/// # Safety
/// `references`, `orders` and `values` are valid for `length` values; as `with` demands of
/// `component`.
pub unsafe fn set_input_derivatives<S: CoSimulation>(
    component: Component,
    references: *const ValueReference,
    length: usize,
    orders: *const c_int,
    values: *const f64,
) -> Status {
    let body = |ExportedComponent { instance, .. }: &mut ExportedComponent<S>| {
        // SAFETY: as the caller promises.
        let (references, orders, values) = unsafe {
            (read_array(references, length)?, read_array(orders, length)?, read_array(values, length)?)
        };
        instance.set_input_derivatives(references, orders, values)
    };
    // SAFETY: as the caller promises.
    unsafe { with_component::<S>(component, Call::SetRealInputDerivatives, body) }
}

/// `fmi2GetDirectionalDerivative`.
///
/// # Safety
/// `unknowns` and `responses` are valid for `rows` values, `knowns` and `changes` for `columns`; as
/// `with_component` demands of `component`.
pub unsafe fn directional_derivative<S: CoSimulation>(
    component: Component,
    unknowns: *const ValueReference,
    rows: usize,
    knowns: *const ValueReference,
    columns: usize,
    changes: *const f64,
    responses: *mut f64,
) -> Status {
    let body = |ExportedComponent { instance, .. }: &mut ExportedComponent<S>| -> FmiResult {
        // SAFETY: as the caller promises.
        let (unknowns, responses) =
            unsafe { (read_array(unknowns, rows)?, OutputArray::new(responses, rows)?) };
        // SAFETY: as the caller promises.
        let (knowns, changes) = unsafe { (read_array(knowns, columns)?, read_array(changes, columns)?) };
        let found = instance.directional_derivative(unknowns, knowns, changes)?;
        responses.fill(found.into_iter().map(Ok))
    };
    // SAFETY: as the caller promises.
    unsafe { with_component::<S>(component, Call::GetDirectionalDerivative, body) }
}
