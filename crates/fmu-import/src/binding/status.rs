//! Makes the calls of the life of an instance that a plain simulation does not need: reset, log categories, status.

use std::ffi::{c_char, c_int};

use super::{Instance, c_text};
use crate::CallError;

/// `fmi2DoStepStatus`, `fmi2LastSuccessfulTime` and `fmi2Terminated` of `fmi2StatusKind`.
const DO_STEP_STATUS: c_int = 0;
const LAST_SUCCESSFUL_TIME: c_int = 2;
const TERMINATED: c_int = 3;

impl Instance {
    /// `fmi2Reset`.
    ///
    /// # Errors
    /// See [`Instance`].
    pub fn reset(&mut self) -> Result<(), CallError> {
        self.call(c"fmi2Reset", self.library.reset)
    }

    /// `fmi2CancelStep`, which succeeds for FMUs that run asynchronously only.
    ///
    /// # Errors
    /// See [`Instance`].
    pub fn cancel_step(&mut self) -> Result<(), CallError> {
        self.call(c"fmi2CancelStep", self.library.cancel_step)
    }

    /// `fmi2SetDebugLogging` for these categories; none means all of them.
    ///
    /// # Errors
    /// See [`Instance`]; also when the name of a category contains NUL.
    pub fn set_debug_logging(&mut self, on: bool, categories: &[&str]) -> Result<(), CallError> {
        let texts = categories.iter().map(|text| c_text("fmi2SetDebugLogging", text));
        let texts = texts.collect::<Result<Vec<_>, _>>()?;
        let pointers: Vec<*const c_char> = texts.iter().map(|text| text.as_ptr()).collect();
        let function = self.library.set_debug_logging;
        // SAFETY: the component is alive, and the texts live until the call returns.
        self.run(c"fmi2SetDebugLogging", |component| unsafe {
            function(component, on.into(), pointers.len(), pointers.as_ptr())
        })
    }

    /// `fmi2GetStatus` of the last step; an FMU may refuse unless a step was discarded.
    ///
    /// # Errors
    /// See [`Instance`].
    pub fn status(&mut self) -> Result<i32, CallError> {
        let (mut value, function) = (0, self.library.get_status);
        // SAFETY: the component is alive, and one value is written.
        self.run(c"fmi2GetStatus", |c| unsafe { function(c, DO_STEP_STATUS, &raw mut value) })?;
        Ok(value)
    }

    /// `fmi2GetRealStatus`: the time that the last step came to [s]; an FMU may refuse unless a step was discarded.
    ///
    /// # Errors
    /// See [`Instance`].
    pub fn last_successful_time(&mut self) -> Result<f64, CallError> {
        let mut value = 0.0;
        let function = self.library.get_real_status;
        // SAFETY: the component is alive, and one value is written.
        self.run(c"fmi2GetRealStatus", |c| unsafe {
            function(c, LAST_SUCCESSFUL_TIME, &raw mut value)
        })?;
        Ok(value)
    }

    /// `fmi2GetBooleanStatus`: whether the FMU ended the simulation; an FMU may refuse unless a step was discarded.
    ///
    /// # Errors
    /// See [`Instance`].
    pub fn ended(&mut self) -> Result<bool, CallError> {
        let mut value = 0;
        let function = self.library.get_boolean_status;
        // SAFETY: the component is alive, and one value is written.
        self.run(c"fmi2GetBooleanStatus", |c| unsafe { function(c, TERMINATED, &raw mut value) })?;
        Ok(value != 0)
    }
}
