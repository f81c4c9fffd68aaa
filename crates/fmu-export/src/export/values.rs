//! Reads and writes variables, and differentiates them.

use std::ffi::{CString, c_char, c_int};

use super::{Log, read, text, with, write};
use crate::Model;
use crate::abi::{Component, Status, ValueReference};
use crate::instance::{Instance, Outcome, refuse};
use crate::lifecycle::Call;
use crate::value::Value;

/// `fmi2GetReal`, `fmi2GetInteger` and `fmi2GetBoolean`.
///
/// # Safety
/// `references` and `values` are valid for `length` values; as `with` demands of `component`.
pub unsafe fn get<M: Model, T: Value>(
    component: Component,
    references: *const ValueReference,
    length: usize,
    values: *mut T,
) -> Status {
    let body = |instance: &mut Instance<M>, _: &mut Log| {
        // SAFETY: as the caller promises.
        let (references, values) = unsafe { (read(references, length)?, write(values, length)?) };
        instance.refresh()?;
        for (reference, value) in references.iter().zip(values) {
            *value = instance.get(*reference)?;
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
        instance.refresh()?;
        instance.strings.clear();
        for (reference, value) in references.iter().zip(values) {
            let text = instance.get::<String>(*reference)?;
            let text = CString::new(text.replace('\0', "?")).unwrap_or_default();
            *value = text.as_ptr();
            instance.strings.push(text);
        }
        Ok(())
    };
    // SAFETY: as the caller promises.
    unsafe { with::<M>(component, Call::Get, body) }
}

/// `fmi2SetReal`, `fmi2SetInteger` and `fmi2SetBoolean`.
///
/// # Safety
/// As [`get`].
pub unsafe fn set<M: Model, T: Value>(
    component: Component,
    references: *const ValueReference,
    length: usize,
    values: *const T,
) -> Status {
    let body = |instance: &mut Instance<M>, _: &mut Log| {
        // SAFETY: as the caller promises.
        let (references, values) = unsafe { (read(references, length)?, read(values, length)?) };
        instance.set(references, values)
    };
    // SAFETY: as the caller promises.
    unsafe { with::<M>(component, Call::Set, body) }
}

/// `fmi2SetString`: the texts are copied.
///
/// # Safety
/// As [`get`]; each of the values is null or points to a C string.
pub unsafe fn set_string<M: Model>(
    component: Component,
    references: *const ValueReference,
    length: usize,
    values: *const *const c_char,
) -> Status {
    let body = |instance: &mut Instance<M>, _: &mut Log| {
        // SAFETY: as the caller promises.
        let (references, values) = unsafe { (read(references, length)?, read(values, length)?) };
        // SAFETY: as the caller promises.
        let texts = values.iter().map(|value| unsafe { text(*value) });
        match texts.collect::<Option<Vec<_>>>() {
            Some(texts) => instance.set(references, &texts),
            None => refuse("a null pointer stands for a text"),
        }
    };
    // SAFETY: as the caller promises.
    unsafe { with::<M>(component, Call::Set, body) }
}

/// `fmi2SetRealInputDerivatives`: for the next step, and until the input is set.
///
/// # Safety
/// `references`, `orders` and `values` are valid for `length` values; as `with` demands of
/// `component`.
pub unsafe fn set_input_derivatives<M: Model>(
    component: Component,
    references: *const ValueReference,
    length: usize,
    orders: *const c_int,
    values: *const f64,
) -> Status {
    let body = |instance: &mut Instance<M>, _: &mut Log| {
        // SAFETY: as the caller promises.
        let (references, orders, values) =
            unsafe { (read(references, length)?, read(orders, length)?, read(values, length)?) };
        instance.set_slopes(references, orders, values)
    };
    // SAFETY: as the caller promises.
    unsafe { with::<M>(component, Call::SetRealInputDerivatives, body) }
}

/// `fmi2GetDirectionalDerivative`.
///
/// # Safety
/// `unknowns` and `responses` are valid for `rows` values, `knowns` and `changes` for `columns`; as
/// `with` demands of `component`.
pub unsafe fn directional_derivative<M: Model>(
    component: Component,
    (unknowns, rows): (*const ValueReference, usize),
    (knowns, columns): (*const ValueReference, usize),
    changes: *const f64,
    responses: *mut f64,
) -> Status {
    let body = |instance: &mut Instance<M>, _: &mut Log| -> Outcome {
        // SAFETY: as the caller promises.
        let (unknowns, responses) = unsafe { (read(unknowns, rows)?, write(responses, rows)?) };
        // SAFETY: as the caller promises.
        let (knowns, changes) = unsafe { (read(knowns, columns)?, read(changes, columns)?) };
        let found = instance.directional_derivative(unknowns, knowns, changes)?;
        responses.copy_from_slice(&found);
        Ok(())
    };
    // SAFETY: as the caller promises.
    unsafe { with::<M>(component, Call::GetDirectionalDerivative, body) }
}
