//! Tests of messages: scenarios with mistakes are read and resolved in process against descriptions of FMUs, and what they say is
//! compared.

mod bad_input;
mod coupling;
mod extending;
mod fmus;
mod lab;
mod subsystems;
mod sweeps;
mod types;
mod units;
