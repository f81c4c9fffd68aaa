//! Tip-in: power on or off in a bend (power off: ISO 9816).

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::bend::{BendForceChange, DESCRIPTIONS, STAGES};
use super::{ManoeuvreKind, ShortestPhase};
use crate::action::{CarState, DriverAction, TestStage};
use crate::channel::Channel;
use crate::characteristic_value::{CharacteristicValueInfo, CharacteristicValues, ParameterError};
use crate::common::CommonParameters;
use crate::log::ManoeuvreLog;
use crate::path::GroundPath;

/// Power on or off in a bend (power off: ISO 9816): on a circle at the entry speed the steering is held and the driving force changes.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct TipIn {
    /// Radius of the circle [m].
    #[schemars(example = 100.0)]
    pub radius: f64,
    /// Driving force after the change [N]; 0 and negative forces are power off.
    #[schemars(example = 3000.0)]
    pub force: f64,
    /// Time to settle on the circle [s].
    #[schemars(example = 10.0)]
    pub circle: f64,
    /// How long the test goes on after the change [s].
    #[schemars(example = 3.0)]
    pub observe: f64,
}

impl Default for TipIn {
    fn default() -> Self {
        TipIn { radius: 100.0, force: 0.0, circle: 10.0, observe: 3.0 }
    }
}

impl TipIn {
    fn bend_force_change(&self) -> BendForceChange {
        BendForceChange { circle: self.circle, force: self.force, observe: self.observe }
    }
}

impl ManoeuvreKind for TipIn {
    fn kind_title(&self) -> &'static str {
        "power on or off in a bend (ISO 9816)"
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

    fn shortest_phase(&self) -> Option<ShortestPhase> {
        Some(ShortestPhase { key: "observe", duration: self.observe })
    }

    fn check_parameters(&self, _: &CommonParameters) -> Result<(), ParameterError> {
        ParameterError::check_positive([
            ("radius", self.radius, "m"),
            ("circle", self.circle, "s"),
            ("observe", self.observe, "s"),
        ])?;
        if self.force.is_finite() {
            return Ok(());
        }
        Err(ParameterError::at_kind_key(
            "force",
            format!("expected a finite force [N], found {}", self.force),
        ))
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
