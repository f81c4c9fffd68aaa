//! Couples nodes: FMUs, signals and tables step from communication point to communication point, and exchange their values by a coupling
//! algorithm. The row of each communication point goes to a sink.
#![forbid(unsafe_code)]

pub mod assembly;
pub mod builder;
pub mod checkpoint;
pub mod clock;
pub mod coupling;
pub mod effect;
pub mod exchange;
pub mod execution;
pub mod extrapolation;
pub mod fault;
pub mod fault_report;
pub mod master;
pub mod node;
pub mod order;
pub mod signal;
pub mod system;

#[cfg(test)]
mod testing;
