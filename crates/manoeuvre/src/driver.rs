//! Drives a manoeuvre: measured values go in, commands come out, one communication point after the other.

use std::sync::Arc;

use serde::{Deserialize, Serialize};

use crate::action::{CarState, DriveCommand, DriverAction, SteerCommand, TestStage};
use crate::channel::Channel;
use crate::controllers::PlanarMotion;
use crate::frame::rotate_into_frame;
use crate::manoeuvre::Manoeuvre;
use crate::path::GroundPath;

/// An output of a manoeuvre.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct DriverOutputInfo {
    /// Its name.
    pub name: &'static str,
    /// Its unit.
    pub unit: &'static str,
    /// What it is.
    pub about: &'static str,
}

const fn driver_output_info(name: &'static str, unit: &'static str, about: &'static str) -> DriverOutputInfo {
    DriverOutputInfo { name, unit, about }
}

/// The outputs of a manoeuvre, in the order of [`ManoeuvreDriver::step_commands`].
pub const OUTPUTS: [DriverOutputInfo; 5] = [
    driver_output_info("steer", "rad", "Road-wheel angle, positive to the left"),
    driver_output_info("drive", "N", "Driving force; braking when negative"),
    driver_output_info("phase", "1", "0 before the test, its stage from 1 on, -1 after it"),
    driver_output_info("speed", "m/s", "Wanted speed; the measured one when none is wanted"),
    driver_output_info("offset", "m", "How far the path is to the left of the car; 0 without a path"),
];

/// Stage of the test, frame, and integrals of the controllers.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
struct ManoeuvreDriverMemory {
    stage: TestStage,
    /// Origin of the frame: position [m] and heading [rad].
    origin: Option<[f64; 3]>,
    /// Integral of the missing speed [m].
    missing: f64,
    /// Integral of the offset from the path [m.s].
    offset: f64,
    /// The last commands: road-wheel angle of a test to the left [rad] and force [N].
    steer: f64,
    force: f64,
}

/// The driver of a manoeuvre.
#[derive(Debug, Clone)]
pub struct ManoeuvreDriver {
    manoeuvre: Arc<Manoeuvre>,
    channels: Vec<Channel>,
    path: Option<GroundPath>,
    memory: ManoeuvreDriverMemory,
}

/// The state of a driver, to save and restore.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct DriverState(ManoeuvreDriverMemory);

impl ManoeuvreDriver {
    /// A driver before the run.
    #[must_use]
    pub fn new(manoeuvre: Arc<Manoeuvre>) -> Self {
        let channels = manoeuvre.kind.required_channels();
        let path = manoeuvre.kind.reference_path();
        ManoeuvreDriver { manoeuvre, channels, path, memory: ManoeuvreDriverMemory::default() }
    }

    /// A copy of its state.
    #[must_use]
    pub fn saved_state(&self) -> DriverState {
        DriverState(self.memory)
    }

    /// Goes back to a state.
    pub fn restore_state(&mut self, state: DriverState) {
        self.memory = state.0;
    }

    /// The commands and what is told beside them, in the order of [`OUTPUTS`], at a time [s]; `inputs` are what the kind needs, in that
    /// order.
    pub fn step_commands(&mut self, time: f64, inputs: &[f64]) -> [f64; 5] {
        let manoeuvre = Arc::clone(&self.manoeuvre);
        let (common, kind) = (&manoeuvre.common, &manoeuvre.kind);
        let mut now = self.mirrored_car_state(time, inputs);
        if self.memory.stage.number == 0 {
            let wanted = kind.test_entry_speed(common);
            let right = (now.v_x - wanted).abs() <= common.speed_tolerance;
            if self.memory.stage.has_held_for(right, time, common.settle) {
                self.memory.stage.enter_stage(1, time);
                (self.memory.origin, self.memory.offset) = (None, 0.0);
                now = self.mirrored_car_state(time, inputs);
            }
        }
        let action = match self.memory.stage.number {
            0 => {
                let drive = DriveCommand::Speed(kind.test_entry_speed(common));
                if self.path.is_some() {
                    DriverAction::follow_path(drive)
                } else {
                    DriverAction::steer_by_angle(0.0, drive)
                }
            }
            TestStage::OVER => DriverAction::REST,
            _ => kind.next_action(common, &mut self.memory.stage, &now),
        };
        self.execute_action(action, now)
    }

    /// The car, mirrored and in the frame of the test.
    fn mirrored_car_state(&mut self, time: f64, inputs: &[f64]) -> CarState {
        let mut all = [0.0; Channel::ALL.len()];
        let right = self.manoeuvre.common.direction.left_positive_sign() < 0.0;
        for (channel, value) in self.channels.iter().zip(inputs) {
            all[channel.index()] = if right { channel.mirror_sign() * value } else { *value };
        }
        let [v_x, v_y, r, a_y, east, north, heading] = all;
        let [x0, y0, psi0] = *self.memory.origin.get_or_insert([east, north, heading]);
        let [x, y] = rotate_into_frame([east - x0, north - y0], psi0);
        CarState { time, v_x, v_y, r, a_y, x, y, psi: heading - psi0, steer: self.memory.steer }
    }

    fn execute_action(&mut self, action: DriverAction, now: CarState) -> [f64; 5] {
        let common = &self.manoeuvre.common;
        let memory = &mut self.memory;
        // Before the test the way is straight.
        let straight = GroundPath::Straight;
        let path = self.path.as_ref();
        let path = path.map(|path| if memory.stage.number == 0 { &straight } else { path });
        memory.steer = match (action.steer, path) {
            (SteerCommand::Angle(angle), _) => angle,
            (SteerCommand::Path, None) => 0.0,
            (SteerCommand::Path, Some(path)) => {
                let CarState { x, y, psi, v_x, r, .. } = now;
                let motion = PlanarMotion { x, y, psi, v_x, r };
                let integral = &mut memory.offset;
                common.path_follower.road_wheel_angle(path, motion, common.wheelbase, integral, common.step)
            }
        };
        let speed = if let DriveCommand::Speed(speed) = action.drive { speed } else { now.v_x };
        memory.force = match action.drive {
            DriveCommand::Hold => memory.force,
            // The integral belongs to a speed that nobody wants any more.
            DriveCommand::Force(force) => {
                memory.missing = 0.0;
                force
            }
            DriveCommand::Speed(speed) => {
                let missing = speed - now.v_x;
                common.speed_controller.driving_force(missing, &mut memory.missing, common.step)
            }
        };
        let sign = common.direction.left_positive_sign();
        let offset = path.map_or(0.0, |path| path.lateral_offset(now.x, now.y));
        let phase = f64::from(memory.stage.number);
        // Not -0, which looks like an answer.
        let [steer, offset] = [sign * memory.steer, sign * offset].map(|it| it + 0.0);
        [steer, memory.force, phase, speed, offset]
    }
}
