//! Makes the calls that a plain simulation does not need: reset, FMU state, log categories, status.

use std::ffi::{CString, c_char};
use std::ptr;

use super::{Instance, LAST_SUCCESSFUL_TIME, TERMINATED};
use crate::node::CallError;

/// A state that an instance handed out; it goes back by [`Instance::free_state`].
#[derive(Debug)]
pub struct FmuState(super::library::State);

impl Instance {
    /// `fmi2Reset`.
    ///
    /// # Errors
    /// When the FMU refuses.
    pub fn reset(&mut self) -> Result<(), CallError> {
        self.call("fmi2Reset", self.library.reset)
    }

    /// `fmi2CancelStep`.
    ///
    /// # Errors
    /// When the FMU refuses, as it must unless it runs asynchronously.
    pub fn cancel_step(&mut self) -> Result<(), CallError> {
        self.call("fmi2CancelStep", self.library.cancel_step)
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
        let status =
            unsafe { function(self.component, on.into(), pointers.len(), pointers.as_ptr()) };
        self.check("fmi2SetDebugLogging", status)
    }

    /// `fmi2GetFMUstate`.
    ///
    /// # Errors
    /// When the FMU refuses.
    pub fn get_state(&mut self) -> Result<FmuState, CallError> {
        let mut state = ptr::null_mut();
        // SAFETY: the component is alive, and null asks for a new state.
        let status = unsafe { (self.library.get_state)(self.component, &raw mut state) };
        self.check("fmi2GetFMUstate", status)?;
        Ok(FmuState(state))
    }

    /// `fmi2SetFMUstate`.
    ///
    /// # Errors
    /// When the FMU refuses.
    pub fn set_state(&mut self, state: &FmuState) -> Result<(), CallError> {
        // SAFETY: the component is alive, and the state has not been freed.
        let status = unsafe { (self.library.set_state)(self.component, state.0) };
        self.check("fmi2SetFMUstate", status)
    }

    /// `fmi2FreeFMUstate`.
    ///
    /// # Errors
    /// When the FMU refuses.
    pub fn free_state(&mut self, mut state: FmuState) -> Result<(), CallError> {
        // SAFETY: the component is alive, and nobody uses the state after this.
        let status = unsafe { (self.library.free_state)(self.component, &raw mut state.0) };
        self.check("fmi2FreeFMUstate", status)
    }

    /// `fmi2SerializedFMUstateSize` and `fmi2SerializeFMUstate`.
    ///
    /// # Errors
    /// When the FMU refuses.
    pub fn serialise(&mut self, state: &FmuState) -> Result<Vec<u8>, CallError> {
        let mut size = 0;
        // SAFETY: the component and the state are alive.
        let status =
            unsafe { (self.library.serialised_size)(self.component, state.0, &raw mut size) };
        self.check("fmi2SerializedFMUstateSize", status)?;
        let mut bytes = vec![0; size];
        // SAFETY: as above, and the array has the length that is stated.
        let status = unsafe {
            (self.library.serialise)(self.component, state.0, bytes.as_mut_ptr(), bytes.len())
        };
        self.check("fmi2SerializeFMUstate", status)?;
        Ok(bytes)
    }

    /// `fmi2DeSerializeFMUstate`.
    ///
    /// # Errors
    /// When the FMU refuses.
    pub fn deserialise(&mut self, bytes: &[u8]) -> Result<FmuState, CallError> {
        let mut state = ptr::null_mut();
        // SAFETY: the component is alive, and the array has the length that is stated.
        let status = unsafe {
            let function = self.library.deserialise;
            function(self.component, bytes.as_ptr(), bytes.len(), &raw mut state)
        };
        self.check("fmi2DeSerializeFMUstate", status)?;
        Ok(FmuState(state))
    }

    /// `fmi2GetStatus` of the last step.
    ///
    /// # Errors
    /// When the FMU refuses, as it may unless a step was discarded.
    pub fn status(&mut self) -> Result<i32, CallError> {
        let mut value = 0;
        // SAFETY: the component is alive, and one value is written; kind 0 is `fmi2DoStepStatus`.
        let status = unsafe { (self.library.get_status)(self.component, 0, &raw mut value) };
        self.check("fmi2GetStatus", status).map(|()| value)
    }

    /// `fmi2GetRealStatus`: the time that the last step came to [s].
    ///
    /// # Errors
    /// When the FMU refuses, as it may unless a step was discarded.
    pub fn last_successful_time(&mut self) -> Result<f64, CallError> {
        let mut value = 0.0;
        let function = self.library.get_real_status;
        // SAFETY: the component is alive, and one value is written.
        let status = unsafe { function(self.component, LAST_SUCCESSFUL_TIME, &raw mut value) };
        self.check("fmi2GetRealStatus", status).map(|()| value)
    }

    /// `fmi2GetBooleanStatus`: whether the FMU ended the simulation.
    ///
    /// # Errors
    /// When the FMU refuses, as it may unless a step was discarded.
    pub fn ended(&mut self) -> Result<bool, CallError> {
        let mut value = 0;
        let function = self.library.get_boolean_status;
        // SAFETY: the component is alive, and one value is written.
        let status = unsafe { function(self.component, TERMINATED, &raw mut value) };
        self.check("fmi2GetBooleanStatus", status).map(|()| value != 0)
    }
}
