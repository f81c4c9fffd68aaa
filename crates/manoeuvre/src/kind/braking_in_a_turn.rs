//! Braking in a turn to standstill, with the steering held (ISO 7975).

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::ManoeuvreKind;
use super::bend::{BendForceChange, DESCRIPTIONS, STAGES};
use crate::action::{CarState, DriverAction, TestStage};
use crate::channel::Channel;
use crate::characteristic_value::{CharacteristicValueInfo, CharacteristicValues, ParameterError};
use crate::common::CommonParameters;
use crate::log::ManoeuvreLog;
use crate::path::GroundPath;

/// Braking in a turn (ISO 7975): on a circle at the entry speed the steering is held, and the car brakes to standstill.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct BrakingInATurn {
    /// Radius of the circle [m].
    #[schemars(example = 100.0)]
    pub radius: f64,
    /// Braking force [N], a positive number.
    #[schemars(example = 4000.0)]
    pub force: f64,
    /// Time to settle on the circle [s].
    #[schemars(example = 10.0)]
    pub circle: f64,
}

impl Default for BrakingInATurn {
    fn default() -> Self {
        BrakingInATurn { radius: 100.0, force: 4000.0, circle: 10.0 }
    }
}

impl BrakingInATurn {
    fn bend_force_change(&self) -> BendForceChange {
        BendForceChange { circle: self.circle, force: -self.force, observe: f64::INFINITY }
    }
}

impl ManoeuvreKind for BrakingInATurn {
    fn kind_title(&self) -> &'static str {
        "braking in a turn (ISO 7975)"
    }

    fn required_channels(&self) -> Vec<Channel> {
        BendForceChange::required_channels()
    }

    fn stage_names(&self) -> &'static [&'static str] {
        STAGES
    }

    fn value_descriptions(&self) -> &'static [CharacteristicValueInfo] {
        &DESCRIPTIONS
    }

    fn reference_path(&self) -> Option<GroundPath> {
        Some(GroundPath::Circle(self.radius))
    }

    fn check_parameters(&self, _: &CommonParameters) -> Result<(), ParameterError> {
        ParameterError::check_positive([
            ("radius", self.radius, "m"),
            ("force", self.force, "N"),
            ("circle", self.circle, "s"),
        ])
    }

    fn next_action(&self, common: &CommonParameters, stage: &mut TestStage, now: &CarState) -> DriverAction {
        self.bend_force_change().next_action(common, stage, now)
    }

    fn characteristic_values(
        &self,
        _: &CommonParameters,
        log: &ManoeuvreLog,
    ) -> Result<CharacteristicValues, String> {
        self.bend_force_change().characteristic_values(log)
    }
}
