//! Manoeuvres of standards: what the driver does at each moment, and the characteristic values afterwards. They know the usual inputs
//! and outputs of a car, and no car: no masses, no tires, no FMI.
//!
//! A [`Manoeuvre`] is a [`ManoeuvreKind`](kind::ManoeuvreKind) with what all kinds share. A [`ManoeuvreDriver`] drives it: measured values go in, steering and
//! driving force come out. Afterwards its [`ManoeuvreLog`] of both gives the [`CharacteristicValues`]. Angles are those of the front wheels [rad]; axes are those
//! of ISO 8855, x forward, y left, z up. Each kind is written for a test to the left: for one to the right the driver mirrors both
//! what it measures and what it commands.
#![forbid(unsafe_code)]
#![allow(non_snake_case, reason = "symbols as in the standards")]

mod action;
mod channel;
mod characteristic_value;
mod common;
mod controllers;
mod diagram;
mod driver;
mod frame;
pub mod kind;
mod line_fit;
mod log;
mod manoeuvre;
mod path;
mod test_track;

pub use action::{CarState, DriveCommand, DriverAction, SteerCommand, TestStage};
pub use channel::Channel;
pub use characteristic_value::{
    CharacteristicValue, CharacteristicValueInfo, CharacteristicValues, ParameterError,
};
pub use common::{CommonParameters, Direction};
pub use controllers::{PathFollower, SpeedController};
pub use diagram::{DiagramLayerKind, DiagramScale, TestDiagram, TestDiagramLayer};
pub use driver::{DriverOutputInfo, DriverState, ManoeuvreDriver, OUTPUTS};
pub use line_fit::LineFit;
pub use log::ManoeuvreLog;
pub use manoeuvre::Manoeuvre;
pub use path::GroundPath;
pub use test_track::TestTrack;
