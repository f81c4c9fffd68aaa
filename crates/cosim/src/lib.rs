//! Couples nodes: FMUs, signals and tables step from communication point to communication point, and exchange their values by a coupling
//! algorithm. The row of each communication point goes to a sink.
//!
//! A program that has FMUs and no scenario [builds](builder::SystemBuilder) a system by the names of their variables, and steps its
//! [execution](execution::Execution):
//!
//! ```no_run
//! use std::path::Path;
//! use std::sync::Arc;
//!
//! use cosim::builder::SystemBuilder;
//! use cosim::clock::CommunicationClock;
//! use cosim::system::Algorithm;
//! use fmu_import::Fmu;
//!
//! let clock = CommunicationClock { start: 0.0, step: 0.01, steps: 1000 };
//! let mut builder = SystemBuilder::new(clock, Algorithm::GaussSeidel);
//! builder.add_fmu("plant", &Arc::new(Fmu::open(Path::new("plant.fmu"))?), &[])?;
//! builder.add_fmu("controller", &Arc::new(Fmu::open(Path::new("controller.fmu"))?), &[])?;
//! builder.connect("plant.r", "controller.r")?.connect("controller.delta", "plant.delta")?;
//! let mut execution = builder.build()?;
//! execution.simulate_until(10.0)?;
//! println!("{:?}", execution.variable_value("plant.r"));
//! execution.terminate()?;
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
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
mod ode;
pub mod order;
pub mod quantity;
pub mod signal;
pub mod system;

#[cfg(test)]
mod testing;
