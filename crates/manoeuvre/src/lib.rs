//! Manoeuvres of standards: what the driver does at each moment, and the characteristic values afterwards. They know the usual inputs
//! and outputs of a car, and no car: no masses, no tires, no FMI.
//!
//! A [`Manoeuvre`] is a [`Kind`](kind::Kind) with what all kinds share. A [`Driver`] drives it: measured values go in, steering and
//! driving force come out. Afterwards its [`Log`] of both gives the [`Values`]. Angles are those of the front wheels [rad]; axes are those
//! of ISO 8855, x forward, y left, z up. Each kind is written for a test to the left: for one to the right the driver mirrors both
//! what it measures and what it commands.
#![forbid(unsafe_code)]
#![allow(non_snake_case, reason = "symbols as in the standards")]

mod action;
mod channel;
mod common;
mod driver;
mod frame;
pub mod kind;
mod law;
mod line;
mod log;
mod manoeuvre;
mod path;
mod value;

pub use action::{Action, Drive, Now, Stage, Steer};
pub use channel::Channel;
pub use common::{Common, Direction};
pub use driver::{Driver, OUTPUTS, Output, Remembered};
pub use law::{PathFollower, SpeedController};
pub use line::Line;
pub use log::Log;
pub use manoeuvre::Manoeuvre;
pub use path::Path;
pub use value::{Found, Known, Values, Wrong};
