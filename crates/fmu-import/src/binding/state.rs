//! Makes the calls that a plain simulation does not need: reset, FMU state, log categories, status.

use std::ffi::{CString, c_char};
use std::ptr;

use super::{Instance, LAST_SUCCESSFUL_TIME, TERMINATED};
use crate::CallError;

/// A state that an instance handed out; it goes back by [`Instance::free_state`].
#[derive(Debug)]
pub struct FmuState(super::library::State);

impl Instance {
    /// `fmi2Reset`.
    ///
    /// # Errors
    /// When the FMU refuses.
    pub fn reset(&mut self) -> Result<(), CallError> {
        self.call(c"fmi2Reset", self.library.reset)
    }

    /// `fmi2CancelStep`.
    ///
    /// # Errors
    /// When the FMU refuses, as it must unless it runs asynchronously.
    pub fn cancel_step(&mut self) -> Result<(), CallError> {
        self.call(c"fmi2CancelStep", self.library.cancel_step)
    }

    /// `fmi2SetDebugLogging` for these categories; none means all of them.
    ///
    /// # Errors
    /// When the FMU refuses.
    pub fn set_debug_logging(&mut self, on: bool, categories: &[&str]) -> Result<(), CallError> {
        let texts: Vec<_> =
            categories.iter().map(|text| CString::new(*text).unwrap_or_default()).collect();
        let pointers: Vec<*const c_char> = texts.iter().map(|text| text.as_ptr()).collect();
        let function = self.library.set_debug_logging;
        // SAFETY: the component is alive, and the texts live until the call returns.
        self.run(c"fmi2SetDebugLogging", |component| unsafe {
            function(component, on.into(), pointers.len(), pointers.as_ptr())
        })
    }

    /// `fmi2GetFMUstate`.
    ///
    /// # Errors
    /// When the FMU refuses.
    pub fn get_state(&mut self) -> Result<FmuState, CallError> {
        let mut state = ptr::null_mut();
        let function = self.library.get_state;
        // SAFETY: the component is alive, and null asks for a new state.
        self.run(c"fmi2GetFMUstate", |c| unsafe { function(c, &raw mut state) })?;
        Ok(FmuState(state))
    }

    /// `fmi2GetFMUstate` into a state that there is already.
    ///
    /// # Errors
    /// When the FMU refuses.
    pub fn refill_state(&mut self, state: &mut FmuState) -> Result<(), CallError> {
        let function = self.library.get_state;
        // SAFETY: the component is alive, and the state has not been freed.
        self.run(c"fmi2GetFMUstate", |c| unsafe { function(c, &raw mut state.0) })
    }

    /// `fmi2FreeFMUstate` of no state.
    ///
    /// # Errors
    /// When the FMU refuses.
    pub fn free_no_state(&mut self) -> Result<(), CallError> {
        self.free_state(FmuState(ptr::null_mut()))
    }

    /// `fmi2SetFMUstate`.
    ///
    /// # Errors
    /// When the FMU refuses.
    pub fn set_state(&mut self, state: &FmuState) -> Result<(), CallError> {
        let function = self.library.set_state;
        // SAFETY: the component is alive, and the state has not been freed.
        self.run(c"fmi2SetFMUstate", |c| unsafe { function(c, state.0) })
    }

    /// `fmi2FreeFMUstate`.
    ///
    /// # Errors
    /// When the FMU refuses.
    pub fn free_state(&mut self, mut state: FmuState) -> Result<(), CallError> {
        let function = self.library.free_state;
        // SAFETY: the component is alive, and nobody uses the state after this.
        self.run(c"fmi2FreeFMUstate", |c| unsafe { function(c, &raw mut state.0) })
    }

    /// `fmi2SerializedFMUstateSize` and `fmi2SerializeFMUstate`.
    ///
    /// # Errors
    /// When the FMU refuses.
    pub fn serialise(&mut self, state: &FmuState) -> Result<Vec<u8>, CallError> {
        let (mut size, function) = (0, self.library.serialised_size);
        // SAFETY: the component and the state are alive.
        self.run(c"fmi2SerializedFMUstateSize", |c| unsafe {
            function(c, state.0, &raw mut size)
        })?;
        let (mut bytes, function) = (vec![0; size], self.library.serialise);
        // SAFETY: as above, and the array has the length that is stated.
        self.run(c"fmi2SerializeFMUstate", |c| unsafe {
            function(c, state.0, bytes.as_mut_ptr(), bytes.len())
        })?;
        Ok(bytes)
    }

    /// `fmi2DeSerializeFMUstate`.
    ///
    /// # Errors
    /// When the FMU refuses.
    pub fn deserialise(&mut self, bytes: &[u8]) -> Result<FmuState, CallError> {
        let mut state = ptr::null_mut();
        let function = self.library.deserialise;
        // SAFETY: the component is alive, and the array has the length that is stated.
        self.run(c"fmi2DeSerializeFMUstate", |c| unsafe {
            function(c, bytes.as_ptr(), bytes.len(), &raw mut state)
        })?;
        Ok(FmuState(state))
    }

    /// `fmi2GetStatus` of the last step.
    ///
    /// # Errors
    /// When the FMU refuses, as it may unless a step was discarded.
    pub fn status(&mut self) -> Result<i32, CallError> {
        let (mut value, function) = (0, self.library.get_status);
        // SAFETY: the component is alive, and one value is written; kind 0 is `fmi2DoStepStatus`.
        self.run(c"fmi2GetStatus", |c| unsafe { function(c, 0, &raw mut value) })?;
        Ok(value)
    }

    /// `fmi2GetRealStatus`: the time that the last step came to [s].
    ///
    /// # Errors
    /// When the FMU refuses, as it may unless a step was discarded.
    pub fn last_successful_time(&mut self) -> Result<f64, CallError> {
        let mut value = 0.0;
        let function = self.library.get_real_status;
        // SAFETY: the component is alive, and one value is written.
        self.run(c"fmi2GetRealStatus", |c| unsafe {
            function(c, LAST_SUCCESSFUL_TIME, &raw mut value)
        })?;
        Ok(value)
    }

    /// `fmi2GetBooleanStatus`: whether the FMU ended the simulation.
    ///
    /// # Errors
    /// When the FMU refuses, as it may unless a step was discarded.
    pub fn ended(&mut self) -> Result<bool, CallError> {
        let mut value = 0;
        let function = self.library.get_boolean_status;
        // SAFETY: the component is alive, and one value is written.
        self.run(c"fmi2GetBooleanStatus", |c| unsafe { function(c, TERMINATED, &raw mut value) })?;
        Ok(value != 0)
    }
}
