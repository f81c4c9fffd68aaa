//! Braking in a turn to standstill, with the steering held (ISO 7975).

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::ManoeuvreKind;
use super::bend::{BendForceChange, DESCRIPTIONS, STAGES};
use crate::action::{Action, CarState, Stage};
use crate::channel::Channel;
use crate::characteristic_value::{CharacteristicValues, ParameterError, ValueDescription};
use crate::common::CommonParameters;
use crate::log::Log;
use crate::path::Path;

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
    fn bend(&self) -> BendForceChange {
        BendForceChange { circle: self.circle, force: -self.force, observe: f64::INFINITY }
    }
}

impl ManoeuvreKind for BrakingInATurn {
    fn title(&self) -> &'static str {
        "braking in a turn (ISO 7975)"
    }

    fn required_channels(&self) -> Vec<Channel> {
        BendForceChange::required_channels()
    }

    fn stages(&self) -> &'static [&'static str] {
        STAGES
    }

    fn value_descriptions(&self) -> &'static [ValueDescription] {
        &DESCRIPTIONS
    }

    fn path(&self) -> Option<Path> {
        Some(Path::Circle(self.radius))
    }

    fn check(&self, _: &CommonParameters) -> Result<(), ParameterError> {
        ParameterError::positive([
            ("radius", self.radius, "m"),
            ("force", self.force, "N"),
            ("circle", self.circle, "s"),
        ])
    }

    fn next_action(&self, common: &CommonParameters, stage: &mut Stage, now: &CarState) -> Action {
        self.bend().next_action(common, stage, now)
    }

    fn evaluate(&self, _: &CommonParameters, log: &Log) -> Result<CharacteristicValues, String> {
        self.bend().evaluate(log)
    }
}
