//! Stop and go: standstill, start, stop, standstill, start again.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::bend::STANDS;
use super::{ManoeuvreKind, describe};
use crate::action::stage_lasted;
use crate::action::{Action, CarState, DriveCommand, Stage};
use crate::channel::Channel;
use crate::characteristic_value::{CharacteristicValues, ParameterError, ValueDescription};
use crate::common::CommonParameters;
use crate::log::{Log, largest};

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
    fn title(&self) -> &'static str {
        "stop and go"
    }

    fn required_channels(&self) -> Vec<Channel> {
        vec![Channel::ForwardSpeed, Channel::SideSpeed, Channel::YawRate]
    }

    fn stages(&self) -> &'static [&'static str] {
        &["standstill", "start", "stop", "standstill again", "start again"]
    }

    fn value_descriptions(&self) -> &'static [ValueDescription] {
        const {
            &[
                describe("drift", "m", "way that the car makes at both standstills"),
                describe("creep_speed", "m/s", "largest speed at the first standstill"),
                describe("start_time", "s", "time to 95 % of the entry speed"),
                describe("stopping_distance", "m", "distance of the stop"),
                describe("stopping_time", "s", "time of the stop"),
                describe("restart_time", "s", "time of the second start"),
                describe("yaw_rate_max", "rad/s", "largest yaw rate of all"),
            ]
        }
    }

    fn run_up_speed(&self, _: &CommonParameters) -> f64 {
        STANDSTILL
    }

    fn check(&self, common: &CommonParameters) -> Result<(), ParameterError> {
        ParameterError::positive([("wait", self.wait, "s"), ("force", self.force, "N")])?;
        if common.entry_speed > 0.0 {
            return Ok(());
        }
        let message = format!(
            "expected the speed [m/s] that the car starts to, above 0, found {}",
            common.entry_speed
        );
        Err(ParameterError::common("entry_speed", message))
    }

    fn next_action(&self, common: &CommonParameters, stage: &mut Stage, now: &CarState) -> Action {
        let next = match stage.number {
            STANDS_FIRST | STANDS_AGAIN => stage_lasted(stage, now, self.wait),
            STARTS | STARTS_AGAIN => now.v_x >= STARTED * common.entry_speed,
            _ => now.v_x < STANDS,
        };
        if next && stage.number == STARTS_AGAIN {
            return stage.end(now.time);
        }
        if next {
            stage.enter(stage.number + 1, now.time);
        }
        let drive = match stage.number {
            STARTS | STARTS_AGAIN => DriveCommand::Speed(common.entry_speed),
            STOPS => DriveCommand::Force(-self.force),
            STANDS_AGAIN => DriveCommand::Speed(STANDSTILL),
            _ => DriveCommand::Force(0.0),
        };
        Action::angle(0.0, drive)
    }

    fn evaluate(&self, _: &CommonParameters, log: &Log) -> Result<CharacteristicValues, String> {
        let distance = log.distance();
        let [first, start, stop, second, again] =
            [STANDS_FIRST, STARTS, STOPS, STANDS_AGAIN, STARTS_AGAIN]
                .map(|number| log.stage(number));
        let way = |stage: &std::ops::Range<usize>| distance[stage.end] - distance[stage.start];
        let time = |stage: &std::ops::Range<usize>| log.t[stage.end] - log.t[stage.start];
        let (first, second, stop) = (first?, second?, stop?);
        Ok(CharacteristicValues::default()
            .with("drift", way(&first) + way(&second))
            .with("creep_speed", largest(&log.v_x[first]))
            .with("start_time", time(&start?))
            .with("stopping_distance", way(&stop))
            .with("stopping_time", time(&stop))
            .with("restart_time", time(&again?))
            .with("yaw_rate_max", largest(&log.r)))
    }
}
