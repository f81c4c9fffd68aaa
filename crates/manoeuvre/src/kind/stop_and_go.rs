//! Stop and go: standstill, start, stop, standstill, start again.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::bend::STANDS;
use super::{Kind, known};
use crate::action::lasted;
use crate::action::{Action, Drive, Now, Stage};
use crate::channel::Channel;
use crate::common::Common;
use crate::log::{Log, largest};
use crate::value::{Known, Values, Wrong};

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

impl Kind for StopAndGo {
    fn title(&self) -> &'static str {
        "stop and go"
    }

    fn needs(&self) -> Vec<Channel> {
        vec![Channel::ForwardSpeed, Channel::SideSpeed, Channel::YawRate]
    }

    fn stages(&self) -> &'static [&'static str] {
        &["standstill", "start", "stop", "standstill again", "start again"]
    }

    fn known(&self) -> &'static [Known] {
        const {
            &[
                known("drift", "m", "way that the car makes at both standstills"),
                known("creep_speed", "m/s", "largest speed at the first standstill"),
                known("start_time", "s", "time to 95 % of the entry speed"),
                known("stopping_distance", "m", "distance of the stop"),
                known("stopping_time", "s", "time of the stop"),
                known("restart_time", "s", "time of the second start"),
                known("yaw_rate_max", "rad/s", "largest yaw rate of all"),
            ]
        }
    }

    fn run_up(&self, _: &Common) -> f64 {
        STANDSTILL
    }

    fn check(&self, common: &Common) -> Result<(), Wrong> {
        Wrong::positive([("wait", self.wait, "s"), ("force", self.force, "N")])?;
        if common.entry_speed > 0.0 {
            return Ok(());
        }
        let message = format!(
            "expected the speed [m/s] that the car starts to, above 0, found {}",
            common.entry_speed
        );
        Err(Wrong::common("entry_speed", message))
    }

    fn act(&self, common: &Common, stage: &mut Stage, now: &Now) -> Action {
        let next = match stage.number {
            STANDS_FIRST | STANDS_AGAIN => lasted(stage, now, self.wait),
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
            STARTS | STARTS_AGAIN => Drive::Speed(common.entry_speed),
            STOPS => Drive::Force(-self.force),
            STANDS_AGAIN => Drive::Speed(STANDSTILL),
            _ => Drive::Force(0.0),
        };
        Action::angle(0.0, drive)
    }

    fn values(&self, _: &Common, log: &Log) -> Result<Values, String> {
        let distance = log.distance();
        let [first, start, stop, second, again] =
            [STANDS_FIRST, STARTS, STOPS, STANDS_AGAIN, STARTS_AGAIN]
                .map(|number| log.stage(number));
        let way = |stage: &std::ops::Range<usize>| distance[stage.end] - distance[stage.start];
        let time = |stage: &std::ops::Range<usize>| log.t[stage.end] - log.t[stage.start];
        let (first, second, stop) = (first?, second?, stop?);
        Ok(Values::default()
            .and("drift", way(&first) + way(&second))
            .and("creep_speed", largest(&log.v_x[first]))
            .and("start_time", time(&start?))
            .and("stopping_distance", way(&stop))
            .and("stopping_time", time(&stop))
            .and("restart_time", time(&again?))
            .and("yaw_rate_max", largest(&log.r)))
    }
}
