//! Stop and go: standstill, start, stop, standstill, start again.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::bend::STANDS;
use super::{ManoeuvreKind, characteristic_value_info};
use crate::action::stage_lasted;
use crate::action::{CarState, DriveCommand, DriverAction, TestStage};
use crate::channel::Channel;
use crate::characteristic_value::{CharacteristicValueInfo, CharacteristicValues, ParameterError};
use crate::common::CommonParameters;
use crate::log::{ManoeuvreLog, max_abs};

/// Stop and go: the car stands, starts to the entry speed, stops, stands, and starts again. Nobody drives or brakes it at the first
/// standstill; at the second one the driver keeps it there.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct StopAndGo {
    /// How long the car stands [s].
    #[schemars(example = 3.0)]
    pub wait: f64,
    /// Braking force of the stop [N], a positive number.
    #[schemars(example = 3000.0)]
    pub force: f64,
}

impl Default for StopAndGo {
    fn default() -> Self {
        StopAndGo { wait: 3.0, force: 3000.0 }
    }
}

const STANDS_FIRST: i8 = 1;
const STARTS: i8 = 2;
const STOPS: i8 = 3;
const STANDS_AGAIN: i8 = 4;
const STARTS_AGAIN: i8 = 5;
/// A start is over at this share of the entry speed.
const STARTED: f64 = 0.95;
/// Before the test the car stands; the speed controller keeps it there.
const STANDSTILL: f64 = 0.0;

impl ManoeuvreKind for StopAndGo {
    fn kind_title(&self) -> &'static str {
        "stop and go"
    }

    fn required_channels(&self) -> Vec<Channel> {
        vec![Channel::ForwardSpeed, Channel::SideSpeed, Channel::YawRate]
    }

    fn stage_names(&self) -> &'static [&'static str] {
        &["standstill", "start", "stop", "standstill again", "start again"]
    }

    fn value_descriptions(&self) -> &'static [CharacteristicValueInfo] {
        const {
            &[
                characteristic_value_info("drift", "m", "way that the car makes at both standstills"),
                characteristic_value_info("creep_speed", "m/s", "largest speed at the first standstill"),
                characteristic_value_info("start_time", "s", "time to 95 % of the entry speed"),
                characteristic_value_info("stopping_distance", "m", "distance of the stop"),
                characteristic_value_info("stopping_time", "s", "time of the stop"),
                characteristic_value_info("restart_time", "s", "time of the second start"),
                characteristic_value_info("yaw_rate_max", "rad/s", "largest yaw rate of all"),
            ]
        }
    }

    fn test_entry_speed(&self, _: &CommonParameters) -> f64 {
        STANDSTILL
    }

    fn check_parameters(&self, common: &CommonParameters) -> Result<(), ParameterError> {
        ParameterError::check_positive([("wait", self.wait, "s"), ("force", self.force, "N")])?;
        if common.entry_speed > 0.0 {
            return Ok(());
        }
        let message =
            format!("expected the speed [m/s] that the car starts to, above 0, found {}", common.entry_speed);
        Err(ParameterError::at_common_key("entry_speed", message))
    }

    fn next_action(&self, common: &CommonParameters, stage: &mut TestStage, now: &CarState) -> DriverAction {
        let next = match stage.number {
            STANDS_FIRST | STANDS_AGAIN => stage_lasted(stage, now, self.wait),
            STARTS | STARTS_AGAIN => now.v_x >= STARTED * common.entry_speed,
            _ => now.v_x < STANDS,
        };
        if next && stage.number == STARTS_AGAIN {
            return stage.end_test(now.time);
        }
        if next {
            stage.enter_stage(stage.number + 1, now.time);
        }
        let drive = match stage.number {
            STARTS | STARTS_AGAIN => DriveCommand::Speed(common.entry_speed),
            STOPS => DriveCommand::Force(-self.force),
            STANDS_AGAIN => DriveCommand::Speed(STANDSTILL),
            _ => DriveCommand::Force(0.0),
        };
        DriverAction::steer_by_angle(0.0, drive)
    }

    fn characteristic_values(
        &self,
        _: &CommonParameters,
        log: &ManoeuvreLog,
    ) -> Result<CharacteristicValues, String> {
        let distance = log.travelled_distances();
        let [first, start, stop, second, again] = [STANDS_FIRST, STARTS, STOPS, STANDS_AGAIN, STARTS_AGAIN]
            .map(|number| log.stage_index_range(number));
        let way = |stage: &std::ops::Range<usize>| distance[stage.end] - distance[stage.start];
        let time = |stage: &std::ops::Range<usize>| log.t[stage.end] - log.t[stage.start];
        let (first, second, stop) = (first?, second?, stop?);
        Ok(CharacteristicValues::default()
            .with_number("drift", way(&first) + way(&second))
            .with_number("creep_speed", max_abs(&log.v_x[first]))
            .with_number("start_time", time(&start?))
            .with_number("stopping_distance", way(&stop))
            .with_number("stopping_time", time(&stop))
            .with_number("restart_time", time(&again?))
            .with_number("yaw_rate_max", max_abs(&log.r)))
    }
}
