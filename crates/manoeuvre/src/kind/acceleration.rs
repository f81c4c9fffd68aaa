//! Acceleration from standstill to the speed that the drag allows.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{ManoeuvreKind, describe};
use crate::action::{Action, CarState, DriveCommand, EDGE, Stage};
use crate::channel::Channel;
use crate::characteristic_value::{CharacteristicValues, ParameterError, ValueDescription};
use crate::common::CommonParameters;
use crate::log::Log;

/// Acceleration from standstill, or from the entry speed, until the speed does not grow any more.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Acceleration {
    /// Driving force [N].
    #[schemars(example = 4000.0)]
    pub force: f64,
    /// Power that the driving force times the speed does not exceed [W]; no limit without it.
    #[schemars(example = 120000.0)]
    pub power: Option<f64>,
    /// Speed whose time is measured [m/s]; 100 km/h without it.
    #[schemars(example = 27.8)]
    pub to: f64,
    /// The top speed is reached when the speed grew by less than this in the last second [m/s2].
    #[schemars(example = 0.01)]
    pub steady: f64,
}

impl Default for Acceleration {
    fn default() -> Self {
        Acceleration { force: 4000.0, power: None, to: 100.0 / 3.6, steady: 0.01 }
    }
}

impl ManoeuvreKind for Acceleration {
    fn title(&self) -> &'static str {
        "acceleration to the drag limit"
    }

    fn required_channels(&self) -> Vec<Channel> {
        vec![Channel::ForwardSpeed]
    }

    fn stages(&self) -> &'static [&'static str] {
        &["acceleration"]
    }

    fn value_descriptions(&self) -> &'static [ValueDescription] {
        const {
            &[
                describe("time_to_speed", "s", "time to the speed `to`"),
                describe("distance_to_speed", "m", "distance to the speed `to`"),
                describe("top_speed", "m/s", "speed at the end"),
                describe("time_to_top_speed", "s", "time to 99 % of it"),
                describe(
                    "acceleration_max",
                    "m/s2",
                    "largest growth of the speed in half a second",
                ),
            ]
        }
    }

    fn check(&self, common: &CommonParameters) -> Result<(), ParameterError> {
        ParameterError::positive([
            ("force", self.force, "N"),
            ("power", self.power.unwrap_or(1.0), "W"),
            ("to", self.to, "m/s"),
            ("steady", self.steady, "m/s2"),
        ])?;
        if self.to > common.entry_speed {
            return Ok(());
        }
        let message = format!(
            "expected a speed above the entry speed of {} m/s, found {} m/s",
            common.entry_speed, self.to
        );
        Err(ParameterError::at("to", message))
    }

    fn run_up_speed(&self, common: &CommonParameters) -> f64 {
        // Standstill is an entry speed, too.
        common.entry_speed
    }

    fn next_action(&self, _: &CommonParameters, stage: &mut Stage, now: &CarState) -> Action {
        // Once a second the speed is compared with that of a second ago, which `angle` keeps.
        let due = stage.settled.is_none_or(|since| now.time - since >= 1.0 - EDGE);
        if due {
            let steady = stage.settled.is_some() && now.v_x - stage.angle < self.steady;
            if steady {
                return stage.end(now.time);
            }
            (stage.settled, stage.angle) = (Some(now.time), now.v_x);
        }
        let most = self.power.map_or(f64::INFINITY, |power| power / now.v_x.max(1e-3));
        Action::angle(0.0, DriveCommand::Force(self.force.min(most)))
    }

    fn evaluate(&self, _: &CommonParameters, log: &Log) -> Result<CharacteristicValues, String> {
        let last = log.t.len() - 1;
        let top = log.v_x[last];
        if top <= log.v_x[0] + self.steady {
            return Err(format!("the car does not move: {:.3} m/s at the end", top));
        }
        let distance = log.distance();
        let time = log.reaches(&log.v_x, self.to, true, 0);
        let grown =
            (0..=last).filter_map(|k| Some((log.at(&log.v_x, log.t[k] + 0.5)? - log.v_x[k]) / 0.5));
        Ok(CharacteristicValues::default()
            .with("time_to_speed", time)
            .with("distance_to_speed", time.and_then(|time| log.at(&distance, time)))
            .with("top_speed", top)
            .with("time_to_top_speed", log.reaches(&log.v_x, 0.99 * top, true, 0))
            .with("acceleration_max", grown.fold(0.0, f64::max)))
    }
}
