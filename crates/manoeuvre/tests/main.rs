//! The integration tests of this package, as one program.

mod diagrams;
mod known_answers;
mod refusals;
mod support;
