//! The integration tests of this package, as one program.

mod real_logs;
mod simulated;
mod support;
