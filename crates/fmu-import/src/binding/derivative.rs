//! Asks an instance for derivatives of outputs, and gives it those of inputs.

use super::Instance;
use crate::CallError;

impl Instance {
    /// `fmi2GetDirectionalDerivative` of one variable with respect to one other.
    ///
    /// # Errors
    /// See [`Instance`].
    pub fn derivative(&mut self, unknown: u32, known: u32) -> Result<f64, CallError> {
        let (mut value, function) =
            (f64::NAN, self.library.two("fmi2GetDirectionalDerivative")?.directional_derivative);
        // SAFETY: the component is alive, and each array has one element.
        let found = std::slice::from_mut(&mut value);
        self.fill(c"fmi2GetDirectionalDerivative", found, |c, value| unsafe {
            function(c, &raw const unknown, 1, &raw const known, 1, &1.0, value)
        })?;
        Ok(value)
    }

    /// `fmi2SetRealInputDerivatives` of one input.
    ///
    /// # Errors
    /// See [`Instance`].
    pub fn set_input_derivative(
        &mut self,
        reference: u32,
        order: i32,
        value: f64,
    ) -> Result<(), CallError> {
        let function = self.library.two("fmi2SetRealInputDerivatives")?.set_input_derivatives;
        // SAFETY: the component is alive, and each array has one element.
        self.run(c"fmi2SetRealInputDerivatives", |c| unsafe {
            function(c, &raw const reference, 1, &raw const order, &raw const value)
        })
    }

    /// `fmi2GetRealOutputDerivatives` of one output.
    ///
    /// # Errors
    /// See [`Instance`].
    pub fn output_derivative(&mut self, reference: u32, order: i32) -> Result<f64, CallError> {
        let (mut value, function) =
            (f64::NAN, self.library.two("fmi2GetRealOutputDerivatives")?.get_output_derivatives);
        // SAFETY: the component is alive, and each array has one element.
        let found = std::slice::from_mut(&mut value);
        self.fill(c"fmi2GetRealOutputDerivatives", found, |c, value| unsafe {
            function(c, &raw const reference, 1, &raw const order, value)
        })?;
        Ok(value)
    }
}
