//! Says why an effect of load or longitudinal force is not told, and what to drive.

use std::fmt;

use numerics::text::format_significant;
use serde::Serialize;

use super::HalfLogEffects;

/// Why the data do not tell an effect.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum LoadEffectObstacle {
    /// The load is constant, or there is no longitudinal force.
    Still,
    /// The change of stiffness with load looks alike.
    HiddenByStiffness,
    /// The change of friction with load looks alike.
    HiddenByFriction,
    /// The longitudinal force looks alike.
    HiddenByLongitudinalForce,
    /// A datum of the car is not known well enough.
    Car(&'static str),
    /// The halves of the log contradict each other.
    HalvesDiffer,
    /// Too few rows tell it.
    Wide,
}

impl LoadEffectObstacle {
    pub(super) fn hidden_by(effect: usize) -> Self {
        [Self::HiddenByStiffness, Self::HiddenByFriction, Self::HiddenByLongitudinalForce][effect]
    }
}

/// What shows each effect.
const SHOWN_BY: [&str; 3] = [
    "Drive bends with little slip to both sides, at other loads: while braking and accelerating, with downforce or with a payload.",
    "Corner at the limit to both sides, at other loads: while braking and accelerating, with downforce or with a payload.",
    "Brake and accelerate in bends, from gently to hard.",
];
const NAMES: [&str; 3] =
    ["change of stiffness with load", "change of friction with load", "longitudinal force"];

impl fmt::Display for LoadEffectObstacle {
    fn fmt(&self, to: &mut fmt::Formatter) -> fmt::Result {
        let hidden = |effect: usize| {
            format!(
                "It cannot be told from the {}: the data change both at once. A load that varies without it, by speed with downforce or by a payload, tells them apart.",
                NAMES[effect]
            )
        };
        to.write_str(&match self {
            Self::Still => "What it depends on hardly varies.".to_owned(),
            Self::HiddenByStiffness => hidden(0),
            Self::HiddenByFriction => hidden(1),
            Self::HiddenByLongitudinalForce => hidden(2),
            Self::Car(name) => format!("{name} of the car is not known well enough. Measure it."),
            Self::HalvesDiffer => {
                "Halves of the log contradict each other: something else changes.".to_owned()
            }
            Self::Wide => "Too few rows with other loads or forces tell it.".to_owned(),
        })
    }
}

/// The reason in a sentence, with what to drive.
pub fn describe_obstacle(
    effect: usize,
    obstacle: Option<LoadEffectObstacle>,
    halves: Option<HalfLogEffects>,
) -> String {
    match (obstacle, halves) {
        (None, Some(HalfLogEffects { apart, .. })) => format!(
            "The data tell it while the other effects are free; halves of the log are {} standard deviations apart.",
            format_significant(apart, 2)
        ),
        (Some(obstacle @ (LoadEffectObstacle::Still | LoadEffectObstacle::Wide)), _) => {
            format!("{obstacle} {}", SHOWN_BY[effect])
        }
        (Some(obstacle), _) => obstacle.to_string(),
        (None, None) => String::new(),
    }
}
