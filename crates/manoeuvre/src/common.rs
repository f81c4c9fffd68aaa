//! What all kinds of manoeuvres share.

use std::sync::Arc;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::kind::Kind;
use crate::law::{PathFollower, SpeedController};
use crate::value::Wrong;

/// The direction of the first steering.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Direction {
    /// Counter-clockwise.
    #[default]
    Left,
    /// Clockwise.
    Right,
}

impl Direction {
    /// 1 to the left, -1 to the right.
    #[must_use]
    pub fn sign(self) -> f64 {
        match self {
            Direction::Left => 1.0,
            Direction::Right => -1.0,
        }
    }
}

/// What all kinds of manoeuvres share.
#[derive(Debug, Clone, PartialEq)]
pub struct Common {
    /// The speed at which the test begins [m/s].
    pub entry_speed: f64,
    /// How far the speed may be off when the test begins [m/s].
    pub speed_tolerance: f64,
    /// How long the speed must be right before the test begins [s].
    pub settle: f64,
    /// The direction of the first steering.
    pub direction: Direction,
    /// The wheelbase [m].
    pub wheelbase: Option<f64>,
    /// The speed controller.
    pub speed_controller: SpeedController,
    /// The path follower.
    pub path_follower: PathFollower,
    /// The communication step [s].
    pub step: f64,
    /// The seed of what is random.
    pub seed: u64,
}

/// A kind of manoeuvre with what all kinds share.
#[derive(Debug, Clone)]
pub struct Manoeuvre {
    /// What all kinds share.
    pub common: Common,
    /// The kind.
    pub kind: Arc<dyn Kind>,
}

/// So many communication steps the shortest part of a manoeuvre must have.
const STEPS: f64 = 10.0;

impl Manoeuvre {
    /// Checks all numbers.
    ///
    /// # Errors
    /// With the first one that no test can be driven with.
    pub fn check(&self) -> Result<(), Wrong> {
        let Common { entry_speed, speed_tolerance, settle, wheelbase, step, .. } = self.common;
        let common = |it: Wrong| Wrong { of_kind: false, ..it };
        let run_up = self.kind.run_up(&self.common);
        if !(entry_speed.is_finite() && entry_speed >= 0.0) || (run_up > 0.0 && entry_speed == 0.0)
        {
            let message = format!("expected an entry speed above 0 m/s, found {entry_speed} m/s");
            return Err(Wrong::common("entry_speed", message));
        }
        let keys = [("speed_tolerance", speed_tolerance, "m/s"), ("settle", settle, "s")];
        Wrong::positive(keys).map_err(common)?;
        let wheelbase = wheelbase.unwrap_or(1.0);
        Wrong::positive([("wheelbase", wheelbase, "m")]).map_err(common)?;
        self.common.speed_controller.check()?;
        self.common.path_follower.check()?;
        self.kind.check(&self.common)?;
        match self.kind.shortest() {
            Some((key, part)) if step * STEPS > part * (1.0 + 1e-9) => Err(Wrong::at(
                key,
                format!(
                    "its shortest part lasts {part:.4} s, which needs a communication step of at most {:.4} s, found {step} s",
                    part / STEPS
                ),
            )),
            _ => Ok(()),
        }
    }
}
