//! Couples nodes: FMUs, signals and tables step from communication point to communication point, and exchange their values by a coupling
//! algorithm. The row of each communication point goes to a sink.
//!
//! # A master
//!
//! A program [builds](builder::SystemBuilder) a system by the names of variables and steps its [execution](execution::Execution). Here a heater
//! keeps a room warm; both are nodes of the program:
//!
//! ```
//! use cosim::{builder::SystemBuilder, clock::CommunicationClock, node::Node, system::Algorithm};
//! use fmu_import::CallError;
//!
//! /// A room of 360 kJ/K, which loses 100 W/K to the frost outside.
//! struct ThermalMass { power: f64, temperature: f64 }
//!
//! impl Node for ThermalMass {
//!     fn set_inputs(&mut self, inputs: &[f64]) -> Result<(), CallError> {
//!         self.power = inputs[0];
//!         Ok(())
//!     }
//!     fn get_outputs(&mut self, outputs: &mut [f64]) -> Result<(), CallError> {
//!         outputs[0] = self.temperature;
//!         Ok(())
//!     }
//!     fn do_step(&mut self, clock: &CommunicationClock, _tick: u64) -> Result<(), CallError> {
//!         self.temperature += clock.step * (self.power - 100.0 * self.temperature) / 360e3;
//!         Ok(())
//!     }
//! }
//!
//! /// A heater of 1 kW for each kelvin below 21 degC.
//! struct ProportionalHeater { temperature: f64 }
//!
//! impl Node for ProportionalHeater {
//!     fn set_inputs(&mut self, inputs: &[f64]) -> Result<(), CallError> {
//!         self.temperature = inputs[0];
//!         Ok(())
//!     }
//!     fn get_outputs(&mut self, outputs: &mut [f64]) -> Result<(), CallError> {
//!         outputs[0] = 1e3 * (21.0 - self.temperature);
//!         Ok(())
//!     }
//!     fn do_step(&mut self, _: &CommunicationClock, _tick: u64) -> Result<(), CallError> {
//!         Ok(())
//!     }
//! }
//!
//! let clock = CommunicationClock { start: 0.0, step: 10.0, steps: 720 };
//! let mut builder = SystemBuilder::new(clock, Algorithm::GaussSeidel);
//! builder.add_node("room", Box::new(ThermalMass { power: 0.0, temperature: 5.0 }), &["power"], &["temperature"])?;
//! builder.add_node("heater", Box::new(ProportionalHeater { temperature: 5.0 }), &["temperature"], &["power"])?;
//! builder.declare_feedthrough("heater.power", "heater.temperature")?;
//! builder.connect("room.temperature", "heater.temperature")?.connect("heater.power", "room.power")?;
//! let mut execution = builder.build()?;
//! execution.simulate_until(7200.0)?;
//! let reached = execution.variable_value("room.temperature").ok_or("no such variable")?;
//! assert!((reached - 21.0 / 1.1).abs() < 1e-6, "{reached}");
//! execution.terminate()?;
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # FMUs
//!
//! An FMU is a node whose inputs, outputs and dependencies its description names, so a line adds it, with start values. A whole master of
//! two FMUs with connections from the command line is `examples/two_fmus.rs`, 38 lines.
//!
//! ```no_run
//! # use std::{path::Path, sync::Arc};
//! # use cosim::{builder::SystemBuilder, clock::CommunicationClock, system::Algorithm};
//! use fmu_import::{Fmu, Value};
//!
//! # let clock = CommunicationClock { start: 0.0, step: 0.01, steps: 1000 };
//! # let mut builder = SystemBuilder::new(clock, Algorithm::GaussSeidel);
//! builder.add_fmu("plant", &Arc::new(Fmu::open(Path::new("plant.fmu"))?), &[("m", Value::Real(1500.0))])?;
//! builder.add_fmu("controller", &Arc::new(Fmu::open(Path::new("controller.fmu"))?), &[])?;
//! builder.connect("plant.r", "controller.r")?.connect("controller.delta", "plant.delta")?;
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! In the registry this crate is `trackside-cosim`, and `fmu_import` is `trackside-fmu-import`; the names in code stay.
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
