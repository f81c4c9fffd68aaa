//! Braking straight ahead, such as on a road with two frictions (ISO 14512).

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::bend::STANDS;
use super::{ManoeuvreKind, characteristic_value_info};
use crate::action::{CarState, DriveCommand, DriverAction, TestStage};
use crate::channel::Channel;
use crate::characteristic_value::{CharacteristicValueInfo, CharacteristicValues, ParameterError};
use crate::common::CommonParameters;
use crate::log::{ManoeuvreLog, max_abs};
use crate::path::GroundPath;

/// What the driver does with the steering wheel while the car brakes.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum SteeringDuringBraking {
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
    pub steering: SteeringDuringBraking,
}

impl Default for MuSplitBraking {
    fn default() -> Self {
        MuSplitBraking { force: 4000.0, steering: SteeringDuringBraking::Corrected }
    }
}

/// The mean fully developed deceleration is that between these shares of the initial speed (UN R13-H).
const DEVELOPED: [f64; 2] = [0.8, 0.1];

impl ManoeuvreKind for MuSplitBraking {
    fn kind_title(&self) -> &'static str {
        "braking straight ahead on a road with two frictions (ISO 14512)"
    }

    fn required_channels(&self) -> Vec<Channel> {
        let mut needs = vec![Channel::ForwardSpeed, Channel::SideSpeed, Channel::YawRate];
        needs.extend(Channel::POSE);
        needs
    }

    fn stage_names(&self) -> &'static [&'static str] {
        &["braking"]
    }

    fn value_descriptions(&self) -> &'static [CharacteristicValueInfo] {
        const {
            &[
                characteristic_value_info("entry_speed", "m/s", "speed at which the braking begins"),
                characteristic_value_info("stopping_distance", "m", "distance to standstill"),
                characteristic_value_info("stopping_time", "s", "time to standstill"),
                characteristic_value_info(
                    "mean_deceleration",
                    "m/s2",
                    "mean fully developed deceleration, between 80 % and 10 % of the speed",
                ),
                characteristic_value_info(
                    "lateral_deviation_max",
                    "m",
                    "largest distance from the straight way",
                ),
                characteristic_value_info("heading_max", "rad", "largest change of the heading"),
                characteristic_value_info("yaw_rate_max", "rad/s", "largest yaw rate"),
                characteristic_value_info(
                    "sideslip_max",
                    "rad",
                    "largest sideslip angle above 10 % of the speed",
                ),
                characteristic_value_info("steer_max", "rad", "largest road-wheel angle of the driver"),
            ]
        }
    }

    fn reference_path(&self) -> Option<GroundPath> {
        Some(GroundPath::Straight)
    }

    fn check_parameters(&self, _: &CommonParameters) -> Result<(), ParameterError> {
        ParameterError::check_positive([("force", self.force, "N")])
    }

    fn next_action(&self, _: &CommonParameters, stage: &mut TestStage, now: &CarState) -> DriverAction {
        if now.v_x < STANDS {
            return stage.end_test(now.time);
        }
        let drive = DriveCommand::Force(-self.force);
        match self.steering {
            SteeringDuringBraking::Corrected => DriverAction::follow_path(drive),
            SteeringDuringBraking::Fixed => DriverAction::steer_by_angle(0.0, drive),
        }
    }

    fn characteristic_values(
        &self,
        _: &CommonParameters,
        log: &ManoeuvreLog,
    ) -> Result<CharacteristicValues, String> {
        let (last, entry, distance) = (log.t.len() - 1, log.v_x[0], log.travelled_distances());
        let [fast, slow] = DEVELOPED.map(|share| log.level_crossing_time(&log.v_x, share * entry, false, 0));
        let at = |time: Option<f64>| time.and_then(|time| log.interpolate_at(&distance, time));
        let [fast_way, slow_way] = [fast, slow].map(at);
        let developed = fast_way.zip(slow_way).map(|(fast, slow)| {
            let [v1, v2] = DEVELOPED.map(|share| share * entry);
            (v1 * v1 - v2 * v2) / (2.0 * (slow - fast))
        });
        let moving = log.v_x.iter().position(|v| *v < DEVELOPED[1] * entry).unwrap_or(last);
        Ok(CharacteristicValues::default()
            .with_number("entry_speed", entry)
            .with_number("stopping_distance", distance[last])
            .with_number("stopping_time", log.t[last])
            .with_number("mean_deceleration", developed)
            .with_number("lateral_deviation_max", max_abs(&log.y))
            .with_number("heading_max", max_abs(&log.psi))
            .with_number("yaw_rate_max", max_abs(&log.r))
            .with_number("sideslip_max", max_abs(&log.sideslip_angles()[..moving]))
            .with_number("steer_max", max_abs(&log.steer)))
    }
}
