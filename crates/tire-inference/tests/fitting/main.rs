//! Asserts what fits promise: known answers, laws, and errors that tell what to do.
mod errors;
mod kernel;
mod laws;
mod optimum;
mod slip_noise;
mod support;
