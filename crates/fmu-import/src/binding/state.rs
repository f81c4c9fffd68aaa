//! Gets, sets, frees and serialises FMU states (`fmi2GetFMUstate` and its like).
//!
//! A call that the FMU does not claim to support is not made: it fails with a reason.

use std::ptr;

use super::phase::InstancePhase;
use super::saved_states::{FmuState, FmuStatePointer, StateAndPhase};
use super::{Instance, named};
use crate::CallError;

impl Instance {
    /// Whether the FMU can save and restore its state.
    #[must_use]
    pub fn can_save(&self) -> bool {
        let about = self.library.description();
        // Serialising needs a state (FMI 2.0, section 4.3.1).
        about.state || about.serialised_state
    }

    /// Tells the FMU at the following steps that the simulation may go back to an earlier time. Nobody needs to call this
    /// while an [`FmuState`] is alive, which says the same; a state that is kept as bytes only does not.
    pub fn set_keeps_earlier_states(&mut self, keep: bool) {
        self.keeps_history = keep;
    }

    /// Saves the state: `fmi2GetFMUstate`.
    ///
    /// # Errors
    /// See [`Instance`]; also without `canGetAndSetFMUstate`.
    pub fn save_state(&mut self) -> Result<FmuState, CallError> {
        self.check_state_capability(
            named!(self.library, "fmi2GetFMUstate", "fmi3GetFMUState"),
            self.can_save(),
        )?;
        let pointer = self.get_state(ptr::null_mut())?;
        Ok(self.register_state(StateAndPhase(pointer, self.phase)))
    }

    /// Saves the state in the place of one that was saved before.
    ///
    /// # Errors
    /// As of [`save_state`](Self::save_state); also when the state is not this instance's.
    pub fn save_into(&mut self, state: &mut FmuState) -> Result<(), CallError> {
        let pointer =
            self.state_pointer(named!(self.library, "fmi2GetFMUstate", "fmi3GetFMUState"), state)?;
        let pointer = self.get_state(pointer)?;
        self.states.replace_state(state, StateAndPhase(pointer, self.phase));
        Ok(())
    }

    /// Goes back to a state: `fmi2SetFMUstate`.
    ///
    /// # Errors
    /// See [`Instance`]; also when the state is not this instance's.
    pub fn restore_state(&mut self, state: &FmuState) -> Result<(), CallError> {
        let pointer =
            self.state_pointer(named!(self.library, "fmi2SetFMUstate", "fmi3SetFMUState"), state)?;
        let function = self.library.common.set_state;
        // SAFETY: the component is alive, and the state is its own and has not been freed.
        self.run_checked(named!(self.library, c"fmi2SetFMUstate", c"fmi3SetFMUState"), |c| unsafe {
            function(c, pointer)
        })?;
        self.phase = self.states.find_state(state).map_or(InstancePhase::Restored, |state| state.1);
        Ok(())
    }

    /// Forgets a state now, unlike dropping it: `fmi2FreeFMUstate`.
    ///
    /// # Errors
    /// See [`Instance`]; also when the state is not this instance's.
    pub fn free_saved_state(&mut self, state: FmuState) -> Result<(), CallError> {
        self.state_pointer(named!(self.library, "fmi2FreeFMUstate", "fmi3FreeFMUState"), &state)?;
        drop(state);
        self.free_dropped_states()
    }

    /// `fmi2FreeFMUstate` of no state.
    ///
    /// # Errors
    /// See [`Instance`]; also without `canGetAndSetFMUstate`.
    pub fn free_null_state(&mut self) -> Result<(), CallError> {
        self.check_state_capability(
            named!(self.library, "fmi2FreeFMUstate", "fmi3FreeFMUState"),
            self.can_save(),
        )?;
        self.free_state(ptr::null_mut())
    }

    /// A state as bytes: `fmi2SerializedFMUstateSize` and `fmi2SerializeFMUstate`.
    ///
    /// # Errors
    /// See [`Instance`]; also without `canSerializeFMUstate`, and when the state is not this instance's.
    pub fn serialise_state(&mut self, state: &FmuState) -> Result<Vec<u8>, CallError> {
        let able = self.library.description().serialised_state;
        self.check_state_capability(
            named!(self.library, "fmi2SerializedFMUstateSize", "fmi3SerializedFMUStateSize"),
            able,
        )?;
        let pointer = self.state_pointer(
            named!(self.library, "fmi2SerializedFMUstateSize", "fmi3SerializedFMUStateSize"),
            state,
        )?;
        let (mut size, function) = (0, self.library.common.serialised_size);
        // SAFETY: the component is alive, the state is its own, and one number is written.
        self.run_checked(
            named!(self.library, c"fmi2SerializedFMUstateSize", c"fmi3SerializedFMUStateSize"),
            |c| unsafe { function(c, pointer, &raw mut size) },
        )?;
        let mut bytes = Vec::new();
        bytes.try_reserve_exact(size).map_err(|_| {
            let what = format!("asks for {size} bytes, more than there are");
            CallError::new(
                named!(self.library, "fmi2SerializedFMUstateSize", "fmi3SerializedFMUStateSize"),
                what,
            )
        })?;
        bytes.resize(size, 0);
        let function = self.library.common.serialise;
        // SAFETY: as above, and the array has the length that is stated.
        let call = named!(self.library, c"fmi2SerializeFMUstate", c"fmi3SerializeFMUState");
        self.fill_array(call, &mut bytes, |c, bytes| unsafe { function(c, pointer, bytes, size) })?;
        Ok(bytes)
    }

    /// The state that [`serialise_state`](Self::serialise_state) gave as bytes: `fmi2DeSerializeFMUstate`.
    ///
    /// # Errors
    /// See [`Instance`]; also without `canSerializeFMUstate`.
    pub fn deserialise_state(&mut self, bytes: &[u8]) -> Result<FmuState, CallError> {
        let able = self.library.description().serialised_state;
        self.check_state_capability(
            named!(self.library, "fmi2DeSerializeFMUstate", "fmi3DeserializeFMUState"),
            able,
        )?;
        let (mut pointer, function) = (ptr::null_mut(), self.library.common.deserialise);
        // SAFETY: the component is alive, and the array has the length that is stated.
        self.run_checked(
            named!(self.library, c"fmi2DeSerializeFMUstate", c"fmi3DeserializeFMUState"),
            |c| unsafe { function(c, bytes.as_ptr(), bytes.len(), &raw mut pointer) },
        )?;
        Ok(self.register_state(StateAndPhase(pointer, InstancePhase::Restored)))
    }

    /// Frees the states that were dropped since the last time.
    pub(super) fn free_dropped_states(&mut self) -> Result<(), CallError> {
        if !self.saved {
            return Ok(());
        }
        let dropped = self.states.take_dropped();
        dropped.into_iter().try_for_each(|StateAndPhase(pointer, _)| self.free_state(pointer))
    }

    /// Frees all states, before the instance itself is freed.
    pub(super) fn free_all_states(&mut self) {
        for StateAndPhase(pointer, _) in self.states.take_all() {
            // A failure has no receiver left.
            let _ = self.free_state(pointer);
        }
    }

    fn get_state(&mut self, mut pointer: FmuStatePointer) -> Result<FmuStatePointer, CallError> {
        let function = self.library.common.get_state;
        // SAFETY: the component is alive; null asks for a new state, and any other is its own.
        self.run_checked(named!(self.library, c"fmi2GetFMUstate", c"fmi3GetFMUState"), |c| unsafe {
            function(c, &raw mut pointer)
        })?;
        Ok(pointer)
    }

    fn free_state(&mut self, mut pointer: FmuStatePointer) -> Result<(), CallError> {
        let function = self.library.common.free_state;
        // SAFETY: the component is alive, the state is its own, and nobody uses it after this.
        self.run_checked(named!(self.library, c"fmi2FreeFMUstate", c"fmi3FreeFMUState"), |c| unsafe {
            function(c, &raw mut pointer)
        })
    }

    fn register_state(&mut self, state: StateAndPhase) -> FmuState {
        self.saved = true;
        self.states.add_state(state)
    }

    /// The address of a state of this instance.
    fn state_pointer(&self, call: &'static str, state: &FmuState) -> Result<FmuStatePointer, CallError> {
        let state = self.states.find_state(state).map(|state| state.0);
        state.ok_or_else(|| CallError::new(call, "is not called: the state belongs to another instance"))
    }

    fn check_state_capability(&self, call: &'static str, able: bool) -> Result<(), CallError> {
        match able {
            true => Ok(()),
            false => Err(CallError::new(call, "is not called: the FMU does not claim to support it")),
        }
    }
}
