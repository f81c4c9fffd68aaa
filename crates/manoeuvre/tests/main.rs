//! The integration tests of this package, as one program.

mod known_answers;
mod refusals;
mod support;
