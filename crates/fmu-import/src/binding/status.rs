//! Makes reset, cancel, debug logging and status calls of an instance.

use std::ffi::{c_char, c_int};
use std::slice;

use super::functions::{InterfaceFunctions, VersionFunctions};
use super::phase::InstancePhase;
use super::{Instance, named, to_c_string};
use crate::CallError;

/// `fmi2DoStepStatus`, `fmi2LastSuccessfulTime` and `fmi2Terminated` of `fmi2StatusKind`.
const DO_STEP_STATUS: c_int = 0;
const LAST_SUCCESSFUL_TIME: c_int = 2;
const TERMINATED: c_int = 3;

impl Instance {
    /// Makes the instance as good as new.
    ///
    /// # Errors
    /// See [`Instance`]; the error names the state in which the instance was.
    pub fn reset(&mut self) -> Result<(), CallError> {
        let call = named!(self.library, c"fmi2Reset", c"fmi3Reset");
        if let (Some(_), InterfaceFunctions::ModelExchange2(_)) =
            (&self.library.fmi1, &self.library.interface)
        {
            let what = "is not called: FMI 1.0 has no such function for model exchange";
            return Err(CallError::new("fmiReset", what));
        }
        let before = self.phase;
        self.call_without_arguments(call, self.library.common.reset).map_err(|mut error| {
            error.what = format!("{before} {}", error.what);
            error
        })?;
        self.phase = InstancePhase::Instantiated;
        Ok(())
    }

    /// `fmi2CancelStep`, which succeeds for FMUs that run asynchronously only.
    ///
    /// # Errors
    /// See [`Instance`].
    pub fn cancel_step(&mut self) -> Result<(), CallError> {
        let function = self.library.fmi2_co_simulation("fmi2CancelStep")?.cancel_step;
        self.call_without_arguments(c"fmi2CancelStep", function)
    }

    /// Logs messages of these categories; none means all of them.
    ///
    /// # Errors
    /// See [`Instance`]; also when the name of a category contains NUL.
    pub fn set_debug_logging(&mut self, on: bool, categories: &[&str]) -> Result<(), CallError> {
        let call = named!(self.library, c"fmi2SetDebugLogging", c"fmi3SetDebugLogging");
        let texts = categories.iter().map(|text| to_c_string("the name of a log category", text));
        let texts = texts.collect::<Result<Vec<_>, _>>()?;
        let pointers: Vec<*const c_char> = texts.iter().map(|text| text.as_ptr()).collect();
        let (count, pointers) = (pointers.len(), pointers.as_ptr());
        // SAFETY: in both cases the component is alive, and the texts live until the call returns.
        match &self.library.own {
            VersionFunctions::Fmi2(own) => {
                let function = own.set_debug_logging;
                self.run_checked(call, |c| unsafe { function(c, on.into(), count, pointers) })
            }
            VersionFunctions::Fmi3(own) => {
                let function = own.set_debug_logging;
                self.run_checked(call, |c| unsafe { function(c, on, count, pointers) })
            }
        }
    }

    /// `fmi2GetStatus` of the last step; an FMU may refuse unless a step was discarded.
    ///
    /// # Errors
    /// See [`Instance`].
    pub fn last_step_status(&mut self) -> Result<i32, CallError> {
        let (mut value, function) = (0, self.library.fmi2_co_simulation("fmi2GetStatus")?.get_status);
        // SAFETY: the component is alive, and one value is written.
        let found = slice::from_mut(&mut value);
        self.fill_array(c"fmi2GetStatus", found, |c, it| unsafe { function(c, DO_STEP_STATUS, it) })?;
        Ok(value)
    }

    /// `fmi2GetRealStatus`: the time that the last step came to [s]; an FMU may refuse unless a step was discarded.
    ///
    /// # Errors
    /// See [`Instance`].
    pub fn last_successful_time(&mut self) -> Result<f64, CallError> {
        let mut value = 0.0;
        let function = self.library.fmi2_co_simulation("fmi2GetRealStatus")?.get_real_status;
        // SAFETY: the component is alive, and one value is written.
        let found = slice::from_mut(&mut value);
        self.fill_array(c"fmi2GetRealStatus", found, |c, it| unsafe {
            function(c, LAST_SUCCESSFUL_TIME, it)
        })?;
        Ok(value)
    }

    /// `fmi2GetBooleanStatus`: whether the FMU ended the simulation; an FMU may refuse unless a step was discarded.
    ///
    /// # Errors
    /// See [`Instance`].
    pub fn has_ended_simulation(&mut self) -> Result<bool, CallError> {
        let mut value = 0;
        let function = self.library.fmi2_co_simulation("fmi2GetBooleanStatus")?.get_boolean_status;
        // SAFETY: the component is alive, and one value is written.
        let found = slice::from_mut(&mut value);
        self.fill_array(c"fmi2GetBooleanStatus", found, |c, it| unsafe { function(c, TERMINATED, it) })?;
        Ok(value != 0)
    }
}
