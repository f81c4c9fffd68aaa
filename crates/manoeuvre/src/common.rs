//! Parameters that all kinds of manoeuvres share: entry speed, direction, controllers, communication step.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::controllers::{PathFollower, SpeedController};

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
    pub fn left_positive_sign(self) -> f64 {
        match self {
            Direction::Left => 1.0,
            Direction::Right => -1.0,
        }
    }
}

/// Parameters that all kinds of manoeuvres share.
#[derive(Debug, Clone, PartialEq)]
pub struct CommonParameters {
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
