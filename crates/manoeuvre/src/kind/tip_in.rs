//! Tip-in: power on or off in a bend (power off: ISO 9816).

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::Kind;
use super::bend::{Bend, KNOWN, STAGES};
use crate::action::{Action, Now, Stage};
use crate::channel::Channel;
use crate::common::Common;
use crate::log::Log;
use crate::path::Path;
use crate::value::{Known, Values, Wrong};

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
    fn bend(&self) -> Bend {
        Bend { circle: self.circle, force: self.force, observe: self.observe }
    }
}

impl Kind for TipIn {
    fn title(&self) -> &'static str {
        "power on or off in a bend (ISO 9816)"
    }

    fn needs(&self) -> Vec<Channel> {
        Bend::needs()
    }

    fn stages(&self) -> &'static [&'static str] {
        STAGES
    }

    fn known(&self) -> &'static [Known] {
        &KNOWN
    }

    fn path(&self) -> Option<Path> {
        Some(Path::Circle(self.radius))
    }

    fn shortest(&self) -> Option<(&'static str, f64)> {
        Some(("observe", self.observe))
    }

    fn check(&self, _: &Common) -> Result<(), Wrong> {
        Wrong::positive([
            ("radius", self.radius, "m"),
            ("circle", self.circle, "s"),
            ("observe", self.observe, "s"),
        ])?;
        if self.force.is_finite() {
            return Ok(());
        }
        Err(Wrong::at("force", format!("expected a finite force [N], found {}", self.force)))
    }

    fn act(&self, common: &Common, stage: &mut Stage, now: &Now) -> Action {
        self.bend().act(common, stage, now)
    }

    fn values(&self, _: &Common, log: &Log) -> Result<Values, String> {
        self.bend().values(log)
    }
}
