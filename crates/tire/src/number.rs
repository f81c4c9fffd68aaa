//! Names the numbers that the equations calculate with.

use num_dual::DualNum;

/// A number of the equations: `f64`, or a dual number that carries derivatives along.
pub trait Number: DualNum<Primitive = f64> + Copy {}

impl<T: DualNum<Primitive = f64> + Copy> Number for T {}

/// Absolute value, where another trait has a method of this name too.
#[inline(always)]
pub(crate) fn magnitude<T: Number>(x: T) -> T {
    x.abs()
}
