//! Makes a tire of the coefficients of the Magic Formula 5.2, 6.1 or 6.2.

use crate::coefficients::Coefficients;
use crate::number::Number;

mod check;

pub use check::BadCoefficient;

/// A tire by the Magic Formula 5.2, 6.1 or 6.2.
#[derive(Clone, Copy, Debug)]
pub struct MfTire<T = f64> {
    coefficients: Coefficients<T>,
}

impl<T: Number> MfTire<T> {
    /// A tire of these coefficients.
    ///
    /// # Errors
    ///
    /// Names the first coefficient that no tire can have: not finite, or outside of the bound that the formula needs.
    pub fn new(coefficients: Coefficients<T>) -> Result<Self, BadCoefficient> {
        check::check(&coefficients)?;
        Ok(Self { coefficients })
    }

    /// The coefficients that it was made of.
    pub fn coefficients(&self) -> &Coefficients<T> {
        &self.coefficients
    }
}
