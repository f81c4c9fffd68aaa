//! Asserts the promises of fits: known answers, laws, and errors with a cure.
mod errors;
mod kernel;
mod laws;
mod optimum;
mod slip_noise;
mod support;
