//! Slowly increasing steer: finds the road-wheel angle A at which the lateral acceleration is 0.3 g (FMVSS 126 S7.6, ISO 19365).

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{Kind, known};
use crate::action::{Action, Drive, Now, Stage};
use crate::channel::Channel;
use crate::common::Common;
use crate::line::Line;
use crate::log::{Log, largest};
use crate::value::{Known, Values, Wrong};
use units::STANDARD_GRAVITY;

/// Slowly increasing steer (FMVSS 126, ISO 19365) at a constant speed, until the lateral acceleration is reached. A straight line
/// through the angles between 0.1 g and 0.375 g gives A, the angle at 0.3 g.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct SlowlyIncreasingSteer {
    /// Rate of the road-wheel angle [rad/s]. 13.5 deg/s of a steering wheel with the ratio 16 without it.
    #[schemars(example = 0.0147)]
    pub rate: f64,
    /// Lateral acceleration at which the test ends [m/s2]; 0.5 g without it.
    #[schemars(example = 4.9)]
    pub until: f64,
    /// Largest road-wheel angle [rad]; the test fails when the acceleration is not reached by then.
    #[schemars(example = 0.5)]
    pub max_steer: f64,
}

impl Default for SlowlyIncreasingSteer {
    fn default() -> Self {
        let rate = (13.5_f64 / 16.0).to_radians();
        SlowlyIncreasingSteer { rate, until: 0.5 * STANDARD_GRAVITY, max_steer: 0.5 }
    }
}

/// The lateral acceleration that A belongs to [m/s2].
pub(super) const AT: f64 = 0.3 * STANDARD_GRAVITY;
/// The lateral accelerations of the straight line [m/s2].
const LINEAR: std::ops::RangeInclusive<f64> = 0.1 * STANDARD_GRAVITY..=0.375 * STANDARD_GRAVITY;

impl SlowlyIncreasingSteer {
    /// The steering at a moment of the stage, whose line takes the moment; none when the test is over.
    pub(super) fn steer(&self, stage: &mut Stage, now: &Now) -> Option<f64> {
        // The angle of the last step has acted until now.
        if LINEAR.contains(&now.a_y) {
            stage.line.add(now.a_y, now.steer);
        }
        let steer = self.rate * (now.time - stage.since);
        (now.a_y < self.until && steer <= self.max_steer).then_some(steer)
    }

    /// A [rad], and the slope of the angle over the acceleration [rad.s2/m], in a stage of a log.
    pub(super) fn found(&self, log: &Log, number: i8) -> Result<(f64, f64), String> {
        let range = log.stage(number)?;
        let reached = largest(&log.a_y[range.start..=range.end.min(log.a_y.len() - 1)]);
        if reached < *LINEAR.end() {
            return Err(format!(
                "the lateral acceleration came to {reached:.2} m/s2 by {} rad, and {:.2} m/s2 are needed to find A",
                self.max_steer,
                LINEAR.end()
            ));
        }
        let places = (range.start + 1..=range.end.min(log.a_y.len() - 1))
            .filter(|k| LINEAR.contains(&log.a_y[*k]));
        let line = Line::through(places.map(|k| (log.a_y[k], log.steer[k - 1])));
        line.at(AT).zip(line.slope()).ok_or_else(|| "the communication steps are too long for the lateral acceleration between 0.1 g and 0.375 g to be seen twice".to_owned())
    }
}

impl Kind for SlowlyIncreasingSteer {
    fn title(&self) -> &'static str {
        "slowly increasing steer (FMVSS 126, ISO 19365)"
    }

    fn needs(&self) -> Vec<Channel> {
        vec![Channel::ForwardSpeed, Channel::LateralAcceleration]
    }

    fn stages(&self) -> &'static [&'static str] {
        &["slowly increasing steer"]
    }

    fn known(&self) -> &'static [Known] {
        const {
            &[
                known("A", "rad", "road-wheel angle at 0.3 g"),
                known(
                    "steer_gradient",
                    "rad.s2/m",
                    "slope of the road-wheel angle over the lateral acceleration",
                ),
                known("lateral_acceleration_max", "m/s2", "largest lateral acceleration"),
            ]
        }
    }

    fn check(&self, _: &Common) -> Result<(), Wrong> {
        Wrong::positive([
            ("rate", self.rate, "rad/s"),
            ("until", self.until, "m/s2"),
            ("max_steer", self.max_steer, "rad"),
        ])?;
        if self.until > *LINEAR.end() {
            return Ok(());
        }
        let message = format!(
            "expected more than the {:.2} m/s2 that A is found by, found {} m/s2",
            LINEAR.end(),
            self.until
        );
        Err(Wrong::at("until", message))
    }

    fn act(&self, common: &Common, stage: &mut Stage, now: &Now) -> Action {
        match self.steer(stage, now) {
            Some(steer) => Action::angle(steer, Drive::Speed(common.entry_speed)),
            None => stage.end(now.time),
        }
    }

    fn values(&self, _: &Common, log: &Log) -> Result<Values, String> {
        let (A, slope) = self.found(log, 1)?;
        let values = Values::default().and("A", A).and("steer_gradient", slope);
        Ok(values.and("lateral_acceleration_max", largest(&log.a_y)))
    }
}
