//! Names the numbers that the equations calculate with.

use num_dual::DualNum;

/// A number of the equations: `f64`, or a dual number that carries derivatives along.
pub trait Number: DualNum<Primitive = f64> + Copy {}

impl<T: DualNum<Primitive = f64> + Copy> Number for T {}
