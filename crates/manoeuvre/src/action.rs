//! Inputs, state and output of a manoeuvre kind at one communication point: motion of the car, stage of the test, action of the driver.

use serde::{Deserialize, Serialize};

use crate::line_fit::LineFit;

/// The car at one moment, mirrored for a test to the right, with its position in the frame of the test: the car was at its origin when
/// the test began, and pointed along x.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct CarState {
    /// Time [s].
    pub time: f64,
    /// Forward speed [m/s].
    pub v_x: f64,
    /// Speed to the left [m/s].
    pub v_y: f64,
    /// Yaw rate [rad/s].
    pub r: f64,
    /// Acceleration to the left [m/s2].
    pub a_y: f64,
    /// Position along the path at the beginning of the test [m].
    pub x: f64,
    /// Position to the left of it [m].
    pub y: f64,
    /// Heading against it [rad].
    pub psi: f64,
    /// The last road-wheel angle that was commanded [rad].
    pub steer: f64,
}

/// The command to the steering.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum SteerCommand {
    /// By this road-wheel angle [rad].
    Angle(f64),
    /// Along the path of the kind.
    Path,
}

/// The command to the pedals.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum DriveCommand {
    /// Keeps this speed [m/s].
    Speed(f64),
    /// Keeps the force of the last moment.
    Hold,
    /// Gives this force [N]; braking when negative.
    Force(f64),
}

/// The commands of the driver.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DriverAction {
    /// With the steering wheel.
    pub steer: SteerCommand,
    /// With the pedals.
    pub drive: DriveCommand,
}

impl DriverAction {
    /// Straight ahead and off the pedals.
    pub const REST: DriverAction =
        DriverAction { steer: SteerCommand::Angle(0.0), drive: DriveCommand::Force(0.0) };

    /// Steers by an angle [rad].
    #[must_use]
    pub fn steer_by_angle(steer: f64, drive: DriveCommand) -> Self {
        DriverAction { steer: SteerCommand::Angle(steer), drive }
    }

    /// Follows the path.
    #[must_use]
    pub fn follow_path(drive: DriveCommand) -> Self {
        DriverAction { steer: SteerCommand::Path, drive }
    }
}

/// The stage of a test, and values that the kind keeps between communication points.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct TestStage {
    /// The stage that the test is in, from 1 on; 0 before the test, [`OVER`](Self::OVER) after it.
    pub number: i8,
    /// The time at which the stage began [s].
    pub since: f64,
    /// Since when what the stage waits for has held [s], if it does.
    pub settled: Option<f64>,
    /// A road-wheel angle that the kind goes on with [rad].
    pub angle: f64,
    /// A line through what was measured.
    pub line: LineFit,
}

impl TestStage {
    /// The number after the test.
    pub const OVER: i8 = -1;

    /// Goes on to another stage.
    pub fn enter_stage(&mut self, number: i8, time: f64) {
        (self.number, self.since, self.settled) = (number, time, None);
    }

    /// Ends the test.
    pub fn end_test(&mut self, time: f64) -> DriverAction {
        self.enter_stage(TestStage::OVER, time);
        DriverAction::REST
    }

    /// Whether something has held for this long [s], given whether it holds now.
    pub fn has_held_for(&mut self, now: bool, time: f64, duration: f64) -> bool {
        self.settled = now.then(|| self.settled.unwrap_or(time));
        self.settled.is_some_and(|since| time - since >= duration - EDGE)
    }
}

/// Rounding puts a communication point just before the moment that it should meet [s].
pub(crate) const EDGE: f64 = 1e-9;

/// Whether so much time [s] of a stage is over.
pub(crate) fn stage_lasted(stage: &TestStage, now: &CarState, duration: f64) -> bool {
    now.time - stage.since >= duration - EDGE
}
