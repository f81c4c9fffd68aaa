//! Says why an effect of load or longitudinal force is not told, and what to drive.

use std::fmt;

use numerics::text::significant;
use serde::Serialize;

use super::Halves;

/// Why the data do not tell an effect.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Obstacle {
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

impl Obstacle {
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

impl fmt::Display for Obstacle {
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
pub fn sentence(effect: usize, obstacle: Option<Obstacle>, halves: Option<Halves>) -> String {
    match (obstacle, halves) {
        (None, Some(Halves { apart, .. })) => format!(
            "The data tell it while the other effects are free; halves of the log are {} standard deviations apart.",
            significant(apart, 2)
        ),
        (Some(obstacle @ (Obstacle::Still | Obstacle::Wide)), _) => {
            format!("{obstacle} {}", SHOWN_BY[effect])
        }
        (Some(obstacle), _) => obstacle.to_string(),
        (None, None) => String::new(),
    }
}
