//! Acceleration from standstill to the speed that the drag allows.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{ManoeuvreKind, characteristic_value_info};
use crate::action::{CarState, DriveCommand, DriverAction, EDGE, TestStage};
use crate::channel::Channel;
use crate::characteristic_value::{CharacteristicValueInfo, CharacteristicValues, ParameterError};
use crate::common::CommonParameters;
use crate::log::ManoeuvreLog;

/// Acceleration from standstill, or from the entry speed, until the speed does not grow any more.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct AccelerationTest {
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

impl Default for AccelerationTest {
    fn default() -> Self {
        AccelerationTest { force: 4000.0, power: None, to: 100.0 / 3.6, steady: 0.01 }
    }
}

impl ManoeuvreKind for AccelerationTest {
    fn kind_title(&self) -> &'static str {
        "acceleration to the drag limit"
    }

    fn required_channels(&self) -> Vec<Channel> {
        vec![Channel::ForwardSpeed]
    }

    fn stage_names(&self) -> &'static [&'static str] {
        &["acceleration"]
    }

    fn value_descriptions(&self) -> &'static [CharacteristicValueInfo] {
        const {
            &[
                characteristic_value_info("time_to_speed", "s", "time to the speed `to`"),
                characteristic_value_info("distance_to_speed", "m", "distance to the speed `to`"),
                characteristic_value_info("top_speed", "m/s", "speed at the end"),
                characteristic_value_info("time_to_top_speed", "s", "time to 99 % of it"),
                characteristic_value_info(
                    "acceleration_max",
                    "m/s2",
                    "largest growth of the speed in half a second",
                ),
            ]
        }
    }

    fn check_parameters(&self, common: &CommonParameters) -> Result<(), ParameterError> {
        ParameterError::check_positive([
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
        Err(ParameterError::at_kind_key("to", message))
    }

    fn test_entry_speed(&self, common: &CommonParameters) -> f64 {
        // Standstill is an entry speed, too.
        common.entry_speed
    }

    fn next_action(&self, _: &CommonParameters, stage: &mut TestStage, now: &CarState) -> DriverAction {
        // Once a second the speed is compared with that of a second ago, which `angle` keeps.
        let due = stage.settled.is_none_or(|since| now.time - since >= 1.0 - EDGE);
        if due {
            let steady = stage.settled.is_some() && now.v_x - stage.angle < self.steady;
            if steady {
                return stage.end_test(now.time);
            }
            (stage.settled, stage.angle) = (Some(now.time), now.v_x);
        }
        let most = self.power.map_or(f64::INFINITY, |power| power / now.v_x.max(1e-3));
        DriverAction::steer_by_angle(0.0, DriveCommand::Force(self.force.min(most)))
    }

    fn characteristic_values(
        &self,
        _: &CommonParameters,
        log: &ManoeuvreLog,
    ) -> Result<CharacteristicValues, String> {
        let last = log.t.len() - 1;
        let top = log.v_x[last];
        if top <= log.v_x[0] + self.steady {
            return Err(format!("the car does not move: {:.3} m/s at the end", top));
        }
        let distance = log.travelled_distances();
        let time = log.level_crossing_time(&log.v_x, self.to, true, 0);
        let grown = (0..=last)
            .filter_map(|k| Some((log.interpolate_at(&log.v_x, log.t[k] + 0.5)? - log.v_x[k]) / 0.5));
        Ok(CharacteristicValues::default()
            .with_number("time_to_speed", time)
            .with_number("distance_to_speed", time.and_then(|time| log.interpolate_at(&distance, time)))
            .with_number("top_speed", top)
            .with_number("time_to_top_speed", log.level_crossing_time(&log.v_x, 0.99 * top, true, 0))
            .with_number("acceleration_max", grown.fold(0.0, f64::max)))
    }
}
