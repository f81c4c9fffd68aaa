//! Keeps the addresses of the states that an instance saved until they are freed.

use std::collections::BTreeMap;
use std::ffi::c_void;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use super::phase::Phase;

/// `fmi2FMUstate` or `fmi3FMUState`.
pub(super) type Pointer = *mut c_void;

/// A state that an instance saved. Only that instance can restore it. Dropping it forgets it: the FMU's copy is freed at
/// the next step, or with the instance at the latest.
#[derive(Debug)]
pub struct FmuState {
    number: u64,
    owner: Arc<FmuStates>,
}

impl Drop for FmuState {
    fn drop(&mut self) {
        let mut table = self.owner.lock();
        if let Some(state) = table.living.remove(&self.number) {
            table.dropped.push(state);
        }
    }
}

/// The states of an instance that are not freed yet.
#[derive(Debug, Default)]
pub(super) struct FmuStates {
    table: Mutex<StateTable>,
}

#[derive(Debug, Default)]
struct StateTable {
    next: u64,
    living: BTreeMap<u64, State>,
    dropped: Vec<State>,
}

/// A state's address in the FMU, of which it alone knows the meaning, and the phase that it was taken in.
#[derive(Debug, Clone, Copy)]
pub(super) struct State(pub Pointer, pub Phase);

// SAFETY: the address is used in calls of the instance that it belongs to only, by the instance's owner.
unsafe impl Send for State {}

impl FmuStates {
    fn lock(&self) -> MutexGuard<'_, StateTable> {
        self.table.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Whether anybody holds a state that can be restored.
    pub(super) fn any(&self) -> bool {
        !self.lock().living.is_empty()
    }

    /// Adds a state.
    pub(super) fn add(self: &Arc<Self>, state: State) -> FmuState {
        let mut table = self.lock();
        let number = table.next;
        table.next += 1;
        table.living.insert(number, state);
        FmuState { number, owner: Arc::clone(self) }
    }

    /// Puts a state in the place of one that was saved before.
    pub(super) fn replace(&self, before: &FmuState, state: State) {
        self.lock().living.insert(before.number, state);
    }

    /// A state, unless it belongs to another instance.
    pub(super) fn get(self: &Arc<Self>, state: &FmuState) -> Option<State> {
        let is_own = Arc::ptr_eq(&state.owner, self);
        is_own.then(|| self.lock().living.get(&state.number).copied()).flatten()
    }

    /// Takes the states that were dropped since the last time.
    pub(super) fn take_dropped(&self) -> Vec<State> {
        std::mem::take(&mut self.lock().dropped)
    }

    /// Takes all states, those that were dropped last.
    pub(super) fn take_all(&self) -> Vec<State> {
        let mut table = self.lock();
        let living = std::mem::take(&mut table.living);
        let dropped = std::mem::take(&mut table.dropped);
        living.into_values().chain(dropped).collect()
    }
}
