//! Names the scalar of equations that are differentiated by evaluating them.

use num_dual::DualNum;

/// A scalar of model equations: `f64`, or a dual number that carries derivatives along. Its functions are those of the standard library.
pub trait Number: DualNum<Primitive = f64> + Copy {}

impl<T: DualNum<Primitive = f64> + Copy> Number for T {}
