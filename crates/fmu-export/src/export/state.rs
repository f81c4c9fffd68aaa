//! Copies, restores and serialises the state of an instance.

use std::ptr;

use super::{ExportedComponent, with_component};
use crate::abi::{Component, FmuState, Status};
use crate::co_simulation::CoSimulation;
use crate::error::{FmiResult, reject};
use crate::lifecycle::Call;
use crate::memory::{OutputArray, read_array, write_result};

/// `fmi2GetFMUstate`: an existing state is overwritten.
///
/// # Safety
/// `state` points to null or to a state of this model.
pub unsafe fn get_fmu_state<S: CoSimulation>(component: Component, state: *mut FmuState) -> Status {
    let body = |ExportedComponent { instance, .. }: &mut ExportedComponent<S>| {
        // SAFETY: as the caller promises.
        let Some(state) = (unsafe { state.as_mut() }) else {
            return reject("an FMU state is null");
        };
        // SAFETY: as the caller promises.
        match unsafe { state.cast::<S::State>().as_mut() } {
            Some(old) => *old = instance.save()?,
            None => *state = Box::into_raw(Box::new(instance.save()?)).cast(),
        }
        Ok(())
    };
    // SAFETY: as the caller promises.
    unsafe { with_component::<S>(component, Call::FmuState, body) }
}

/// `fmi2SetFMUstate`. The stop time is that of the instance, which its importer was not told by the state: a run may go on longer than
/// the one that it comes from.
///
/// # Safety
/// `state` is null or a state of this model.
pub unsafe fn set_fmu_state<S: CoSimulation>(component: Component, state: FmuState) -> Status {
    let body = |ExportedComponent { instance, .. }: &mut ExportedComponent<S>| {
        let own = instance.lifecycle().clone();
        // SAFETY: as the caller promises.
        instance.restore(unsafe { state_from_pointer(state) }?)?;
        instance.lifecycle().copy_stop_time(&own);
        Ok(())
    };
    // SAFETY: as the caller promises.
    unsafe { with_component::<S>(component, Call::FmuState, body) }
}

/// `fmi2FreeFMUstate`: null is left alone.
///
/// # Safety
/// `state` points to null or to a state of this model that is not used again.
pub unsafe fn free_fmu_state<S: CoSimulation>(component: Component, state: *mut FmuState) -> Status {
    let body = |_: &mut ExportedComponent<S>| {
        // SAFETY: as the caller promises.
        if let Some(state) = unsafe { state.as_mut() }
            && !state.is_null()
        {
            // SAFETY: `get_fmu_state` or `deserialize` made the box, and the caller gives it up.
            drop(unsafe { Box::from_raw(state.cast::<S::State>()) });
            *state = ptr::null_mut();
        }
        Ok(())
    };
    // SAFETY: as the caller promises.
    unsafe { with_component::<S>(component, Call::FmuState, body) }
}

/// A state that the importer holds.
///
/// # Safety
/// `state` is null or a state of this model, which nobody frees meanwhile.
unsafe fn state_from_pointer<'a, T>(state: FmuState) -> FmiResult<&'a T> {
    // SAFETY: as the caller promises.
    unsafe { state.cast::<T>().as_ref() }.map_or_else(|| reject("an FMU state is null"), Ok)
}

/// `fmi2SerializedFMUstateSize`.
///
/// # Safety
/// `state` is a state of this model, `size` is valid.
pub unsafe fn serialized_size<S: CoSimulation>(
    component: Component,
    state: FmuState,
    size: *mut usize,
) -> Status {
    let body = |ExportedComponent { instance, .. }: &mut ExportedComponent<S>| {
        // SAFETY: as the caller promises.
        unsafe { write_result(size, instance.serialize(state_from_pointer(state)?)?.len()) }
    };
    // SAFETY: as the caller promises.
    unsafe { with_component::<S>(component, Call::FmuState, body) }
}

/// `fmi2SerializeFMUstate`.
///
/// # Safety
/// `state` is a state of this model, `into` is valid for `length` bytes.
pub unsafe fn serialize<S: CoSimulation>(
    component: Component,
    state: FmuState,
    into: *mut u8,
    length: usize,
) -> Status {
    let body = |ExportedComponent { instance, .. }: &mut ExportedComponent<S>| {
        // SAFETY: as the caller promises.
        let (state, into) = unsafe { (state_from_pointer(state)?, OutputArray::new(into, length)?) };
        let bytes = instance.serialize(state)?;
        if bytes.len() > length {
            return reject(format!("expected room for {} bytes, found {length}", bytes.len()));
        }
        into.fill(bytes.into_iter().map(Ok))
    };
    // SAFETY: as the caller promises.
    unsafe { with_component::<S>(component, Call::FmuState, body) }
}

/// `fmi2DeSerializeFMUstate`: a new state, to be freed like any other.
///
/// # Safety
/// `from` is valid for `length` bytes, `state` is valid.
pub unsafe fn deserialize<S: CoSimulation>(
    component: Component,
    from: *const u8,
    length: usize,
    state: *mut FmuState,
) -> Status {
    let body = |ExportedComponent { instance, .. }: &mut ExportedComponent<S>| {
        // SAFETY: as the caller promises.
        let (from, state) = unsafe { (read_array(from, length)?, OutputArray::new(state, 1)?) };
        let found = instance.deserialize(from)?;
        state.fill([Ok(Box::into_raw(Box::new(found)).cast())])
    };
    // SAFETY: as the caller promises.
    unsafe { with_component::<S>(component, Call::FmuState, body) }
}
