//! Copies, restores and serialises the state of an instance.

use std::ptr;

use super::{Log, with};
use crate::abi::{Component, FmuState, Status};
use crate::description::guid;
use crate::instance::{FmiResult, Instance, Snapshot, reject};
use crate::lifecycle::Call;
use crate::memory::{Destination, read, write};
use crate::model::Model;

/// `fmi2GetFMUstate`: an existing state is overwritten.
///
/// # Safety
/// `state` points to null or to a state of this model.
pub unsafe fn get_fmu_state<M: Model>(component: Component, state: *mut FmuState) -> Status {
    let body = |instance: &mut Instance<M>, _: &mut Log| {
        // SAFETY: as the caller promises.
        let Some(state) = (unsafe { state.as_mut() }) else {
            return reject("an FMU state is null");
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
            return reject("an FMU state is null");
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
unsafe fn bytes<M: Model>(state: FmuState) -> FmiResult<Vec<u8>> {
    // SAFETY: as the caller promises.
    let Some(state) = (unsafe { state.cast::<Snapshot<M>>().as_ref() }) else {
        return reject("an FMU state is null");
    };
    postcard::to_stdvec(&(guid::<M>(), state)).or_else(|cause| reject(cause.to_string()))
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
        unsafe { write(size, bytes::<M>(state)?.len()) }
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
        let (bytes, into) = unsafe { (bytes::<M>(state)?, Destination::new(into, length)?) };
        if bytes.len() > length {
            return reject(format!("expected room for {} bytes, found {length}", bytes.len()));
        }
        into.fill(bytes.into_iter().map(Ok))
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
        let (from, state) = unsafe { (read(from, length)?, Destination::new(state, 1)?) };
        let snapshot = match postcard::from_bytes::<(String, Snapshot<M>)>(from) {
            Ok((found, snapshot)) if found == guid::<M>() => snapshot,
            Ok((found, _)) => {
                return reject(format!(
                    "expected a state of {}, found one of {found}",
                    guid::<M>()
                ));
            }
            Err(cause) => return reject(format!("these bytes are no FMU state: {cause}")),
        };
        snapshot.check()?;
        state.fill([Ok(Box::into_raw(Box::new(snapshot)).cast())])
    };
    // SAFETY: as the caller promises.
    unsafe { with::<M>(component, Call::FmuState, body) }
}
