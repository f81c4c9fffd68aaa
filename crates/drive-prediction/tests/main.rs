//! The integration tests of this package, as one program.

mod baselines;
mod following_car;
mod hidden;
mod support;
