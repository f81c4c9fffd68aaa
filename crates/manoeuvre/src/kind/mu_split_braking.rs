//! Braking straight ahead, such as on a road with two frictions (ISO 14512).

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::bend::STANDS;
use super::{ManoeuvreKind, describe};
use crate::action::{Action, CarState, DriveCommand, Stage};
use crate::channel::Channel;
use crate::characteristic_value::{CharacteristicValues, ParameterError, ValueDescription};
use crate::common::CommonParameters;
use crate::log::{Log, largest};
use crate::path::Path;

/// What the driver does with the steering wheel while the car brakes.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Steering {
    /// Keeps the car on its straight way.
    #[default]
    Corrected,
    /// Holds it straight.
    Fixed,
}

/// Braking to standstill, straight ahead, on a road with two frictions (ISO 14512). The frictions are the road's: the scenario gives
/// them to the car.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct MuSplitBraking {
    /// Braking force [N], a positive number.
    #[schemars(example = 4000.0)]
    pub force: f64,
    /// What the driver does with the steering wheel.
    #[schemars(example = &"fixed")]
    pub steering: Steering,
}

impl Default for MuSplitBraking {
    fn default() -> Self {
        MuSplitBraking { force: 4000.0, steering: Steering::Corrected }
    }
}

/// The mean fully developed deceleration is that between these shares of the initial speed (UN R13-H).
const DEVELOPED: [f64; 2] = [0.8, 0.1];

impl ManoeuvreKind for MuSplitBraking {
    fn title(&self) -> &'static str {
        "braking straight ahead on a road with two frictions (ISO 14512)"
    }

    fn required_channels(&self) -> Vec<Channel> {
        let mut needs = vec![Channel::ForwardSpeed, Channel::SideSpeed, Channel::YawRate];
        needs.extend(Channel::POSE);
        needs
    }

    fn stages(&self) -> &'static [&'static str] {
        &["braking"]
    }

    fn value_descriptions(&self) -> &'static [ValueDescription] {
        const {
            &[
                describe("entry_speed", "m/s", "speed at which the braking begins"),
                describe("stopping_distance", "m", "distance to standstill"),
                describe("stopping_time", "s", "time to standstill"),
                describe(
                    "mean_deceleration",
                    "m/s2",
                    "mean fully developed deceleration, between 80 % and 10 % of the speed",
                ),
                describe("lateral_deviation_max", "m", "largest distance from the straight way"),
                describe("heading_max", "rad", "largest change of the heading"),
                describe("yaw_rate_max", "rad/s", "largest yaw rate"),
                describe("sideslip_max", "rad", "largest sideslip angle above 10 % of the speed"),
                describe("steer_max", "rad", "largest road-wheel angle of the driver"),
            ]
        }
    }

    fn path(&self) -> Option<Path> {
        Some(Path::Straight)
    }

    fn check(&self, _: &CommonParameters) -> Result<(), ParameterError> {
        ParameterError::positive([("force", self.force, "N")])
    }

    fn next_action(&self, _: &CommonParameters, stage: &mut Stage, now: &CarState) -> Action {
        if now.v_x < STANDS {
            return stage.end(now.time);
        }
        let drive = DriveCommand::Force(-self.force);
        match self.steering {
            Steering::Corrected => Action::path(drive),
            Steering::Fixed => Action::angle(0.0, drive),
        }
    }

    fn evaluate(&self, _: &CommonParameters, log: &Log) -> Result<CharacteristicValues, String> {
        let (last, entry, distance) = (log.t.len() - 1, log.v_x[0], log.distance());
        let [fast, slow] = DEVELOPED.map(|share| log.reaches(&log.v_x, share * entry, false, 0));
        let at = |time: Option<f64>| time.and_then(|time| log.at(&distance, time));
        let [fast_way, slow_way] = [fast, slow].map(at);
        let developed = fast_way.zip(slow_way).map(|(fast, slow)| {
            let [v1, v2] = DEVELOPED.map(|share| share * entry);
            (v1 * v1 - v2 * v2) / (2.0 * (slow - fast))
        });
        let moving = log.v_x.iter().position(|v| *v < DEVELOPED[1] * entry).unwrap_or(last);
        Ok(CharacteristicValues::default()
            .with("entry_speed", entry)
            .with("stopping_distance", distance[last])
            .with("stopping_time", log.t[last])
            .with("mean_deceleration", developed)
            .with("lateral_deviation_max", largest(&log.y))
            .with("heading_max", largest(&log.psi))
            .with("yaw_rate_max", largest(&log.r))
            .with("sideslip_max", largest(&log.sideslip()[..moving]))
            .with("steer_max", largest(&log.steer)))
    }
}
