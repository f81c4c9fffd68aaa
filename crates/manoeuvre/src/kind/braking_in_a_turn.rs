//! Braking in a turn to standstill, with the steering held (ISO 7975).

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
    fn bend(&self) -> Bend {
        Bend { circle: self.circle, force: -self.force, observe: f64::INFINITY }
    }
}

impl Kind for BrakingInATurn {
    fn title(&self) -> &'static str {
        "braking in a turn (ISO 7975)"
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

    fn check(&self, _: &Common) -> Result<(), Wrong> {
        Wrong::positive([
            ("radius", self.radius, "m"),
            ("force", self.force, "N"),
            ("circle", self.circle, "s"),
        ])
    }

    fn act(&self, common: &Common, stage: &mut Stage, now: &Now) -> Action {
        self.bend().act(common, stage, now)
    }

    fn values(&self, _: &Common, log: &Log) -> Result<Values, String> {
        self.bend().values(log)
    }
}
