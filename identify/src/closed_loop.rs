//! Identifies the tires of both axles at once from drives under closed-loop control.
#![allow(non_snake_case, reason = "symbols as in vehicle dynamics and estimation")]

mod car;
mod error;
mod filter;
pub mod likelihood;
mod recording;
mod scalar;

pub use error::Error;
pub use likelihood::{Likelihood, Noise, Theta8};
pub use recording::Recording;

#[cfg(test)]
mod tests;
