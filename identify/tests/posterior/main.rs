//! Compares draws from posteriors with brute force.

mod bimodal;
mod held;
mod judge;
mod moments;
mod support;
mod svi;
