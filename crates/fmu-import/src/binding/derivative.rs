//! Gets directional derivatives and output derivatives, and sets input derivatives.

use super::Instance;
use crate::{CallError, FmiVersion};

impl Instance {
    /// `fmi2GetDirectionalDerivative` of one variable with respect to one other.
    ///
    /// # Errors
    /// See [`Instance`].
    pub fn directional_derivative(&mut self, unknown: u32, known: u32) -> Result<f64, CallError> {
        let (mut value, function) =
            (f64::NAN, self.library.fmi2_functions("fmi2GetDirectionalDerivative")?.directional_derivative);
        // SAFETY: the component is alive, and each array has one element.
        let found = std::slice::from_mut(&mut value);
        self.fill_array(c"fmi2GetDirectionalDerivative", found, |c, value| unsafe {
            function(c, &raw const unknown, 1, &raw const known, 1, &1.0, value)
        })?;
        Ok(value)
    }

    /// How variables change with others, whose changes are given: `fmi2GetDirectionalDerivative`, `fmi3GetDirectionalDerivative`. None
    /// of them is an array.
    ///
    /// # Errors
    /// See [`Instance`]; also when there are not as many values as references.
    pub fn directional_derivatives(
        &mut self,
        known: &[u32],
        changes: &[f64],
        unknown: &[u32],
        found: &mut [f64],
    ) -> Result<(), CallError> {
        let call = c"fmi2GetDirectionalDerivative";
        if known.len() != changes.len() || unknown.len() != found.len() {
            let what = "is not called: expected one value for each reference";
            return Err(CallError::new(super::instance::call_name(call), what));
        }
        if self.description().version == FmiVersion::Three {
            return self.fmi3_directional_derivatives(known, changes, unknown, found);
        }
        let function = self.library.fmi2_functions("fmi2GetDirectionalDerivative")?.directional_derivative;
        let (unknowns, knowns) = (unknown.len(), known.len());
        // SAFETY: the component is alive, and each array has the length that is stated.
        self.fill_array(call, found, |c, found| unsafe {
            function(c, unknown.as_ptr(), unknowns, known.as_ptr(), knowns, changes.as_ptr(), found)
        })
    }

    /// `fmi2SetRealInputDerivatives` of one input.
    ///
    /// # Errors
    /// See [`Instance`].
    pub fn set_input_derivative(&mut self, reference: u32, order: i32, value: f64) -> Result<(), CallError> {
        let function = self.library.fmi2_co_simulation("fmi2SetRealInputDerivatives")?.set_input_derivatives;
        // SAFETY: the component is alive, and each array has one element.
        self.run_checked(c"fmi2SetRealInputDerivatives", |c| unsafe {
            function(c, &raw const reference, 1, &raw const order, &raw const value)
        })
    }

    /// `fmi2GetRealOutputDerivatives` of one output.
    ///
    /// # Errors
    /// See [`Instance`].
    pub fn output_derivative(&mut self, reference: u32, order: i32) -> Result<f64, CallError> {
        let (mut value, function) = (
            f64::NAN,
            self.library.fmi2_co_simulation("fmi2GetRealOutputDerivatives")?.get_output_derivatives,
        );
        // SAFETY: the component is alive, and each array has one element.
        let found = std::slice::from_mut(&mut value);
        self.fill_array(c"fmi2GetRealOutputDerivatives", found, |c, value| unsafe {
            function(c, &raw const reference, 1, &raw const order, value)
        })?;
        Ok(value)
    }
}
