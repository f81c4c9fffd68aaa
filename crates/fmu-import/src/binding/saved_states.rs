//! Keeps the addresses of the states that an instance saved until they are freed.

use std::collections::BTreeMap;
use std::ffi::c_void;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use super::phase::InstancePhase;

/// `fmi2FMUstate` or `fmi3FMUState`.
pub(super) type FmuStatePointer = *mut c_void;

/// A state that an instance saved. Only that instance can restore it. Dropping it forgets it: the FMU's copy is freed at
/// the next step, or with the instance at the latest.
#[derive(Debug)]
pub struct FmuState {
    number: u64,
    owner: Arc<SavedStateRegistry>,
}

impl Drop for FmuState {
    fn drop(&mut self) {
        let mut table = self.owner.lock_table();
        if let Some(state) = table.living.remove(&self.number) {
            table.dropped.push(state);
        }
    }
}

/// The states of an instance that are not freed yet.
#[derive(Debug, Default)]
pub(super) struct SavedStateRegistry {
    table: Mutex<StateTable>,
}

#[derive(Debug, Default)]
struct StateTable {
    next: u64,
    living: BTreeMap<u64, StateAndPhase>,
    dropped: Vec<StateAndPhase>,
}

/// A state's address in the FMU, of which it alone knows the meaning, and the phase that it was taken in.
#[derive(Debug, Clone, Copy)]
pub(super) struct StateAndPhase(pub FmuStatePointer, pub InstancePhase);

// SAFETY: the address is used in calls of the instance that it belongs to only, by the instance's owner.
unsafe impl Send for StateAndPhase {}

impl SavedStateRegistry {
    fn lock_table(&self) -> MutexGuard<'_, StateTable> {
        self.table.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Whether anybody holds a state that can be restored.
    pub(super) fn has_live_states(&self) -> bool {
        !self.lock_table().living.is_empty()
    }

    /// Adds a state.
    pub(super) fn add_state(self: &Arc<Self>, state: StateAndPhase) -> FmuState {
        let mut table = self.lock_table();
        let number = table.next;
        table.next += 1;
        table.living.insert(number, state);
        FmuState { number, owner: Arc::clone(self) }
    }

    /// Puts a state in the place of one that was saved before.
    pub(super) fn replace_state(&self, before: &FmuState, state: StateAndPhase) {
        self.lock_table().living.insert(before.number, state);
    }

    /// A state, unless it belongs to another instance.
    pub(super) fn find_state(self: &Arc<Self>, state: &FmuState) -> Option<StateAndPhase> {
        let is_own = Arc::ptr_eq(&state.owner, self);
        is_own.then(|| self.lock_table().living.get(&state.number).copied()).flatten()
    }

    /// Takes the states that were dropped since the last time.
    pub(super) fn take_dropped(&self) -> Vec<StateAndPhase> {
        std::mem::take(&mut self.lock_table().dropped)
    }

    /// Takes all states, those that were dropped last.
    pub(super) fn take_all(&self) -> Vec<StateAndPhase> {
        let mut table = self.lock_table();
        let living = std::mem::take(&mut table.living);
        let dropped = std::mem::take(&mut table.dropped);
        living.into_values().chain(dropped).collect()
    }
}
