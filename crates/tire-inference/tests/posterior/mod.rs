//! Compares draws from posteriors with brute force.

mod bimodal;
mod held;
mod judge;
mod judge_shifts;
mod moments;
mod needle;
mod robust;
mod shifts;
mod support;
mod svi;
