//! Slowly increasing steer: finds the road-wheel angle A at which the lateral acceleration is 0.3 g (FMVSS 126 S7.6, ISO 19365).

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{ManoeuvreKind, characteristic_value_info};
use crate::action::{CarState, DriveCommand, DriverAction, TestStage};
use crate::channel::Channel;
use crate::characteristic_value::{CharacteristicValueInfo, CharacteristicValues, ParameterError};
use crate::common::CommonParameters;
use crate::diagram::{DiagramLayerKind, DiagramScale, TestDiagram};
use crate::line_fit::LineFit;
use crate::log::{ManoeuvreLog, max_abs};
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

/// The straight line of the road-wheel angle over the lateral acceleration.
pub(super) struct SteerFit {
    /// The angle at 0.3 g [rad].
    pub A: f64,
    /// [rad.s2/m]
    pub gradient: f64,
}

/// The lateral acceleration that A belongs to [m/s2].
pub(super) const AT: f64 = 0.3 * STANDARD_GRAVITY;
/// The lateral accelerations of the straight line [m/s2].
const LINEAR: std::ops::RangeInclusive<f64> = 0.1 * STANDARD_GRAVITY..=0.375 * STANDARD_GRAVITY;

impl SlowlyIncreasingSteer {
    /// The steering at a moment of the stage, whose line takes the moment; none when the test is over.
    pub(super) fn ramp_steer_angle(&self, stage: &mut TestStage, now: &CarState) -> Option<f64> {
        // The angle of the last step has acted until now.
        if LINEAR.contains(&now.a_y) {
            stage.line.add_point(now.a_y, now.steer);
        }
        let steer = self.rate * (now.time - stage.since);
        (now.a_y < self.until && steer <= self.max_steer).then_some(steer)
    }

    /// Steering over lateral acceleration in a stage of a log, with the fitted line.
    pub(super) fn steer_diagram(&self, log: &ManoeuvreLog, number: i8) -> Option<TestDiagram> {
        let range = log.stage_index_range(number).ok()?;
        let SteerFit { A, gradient } = self.fit_steer_gradient(log, number).ok()?;
        let places = range.start + 1..=range.end.min(log.a_y.len() - 1);
        let curve = places.map(|k| [log.t[k], log.a_y[k], log.steer[k - 1].to_degrees()]);
        let line = |a_y: f64| [a_y, (A + gradient * (a_y - AT)).to_degrees()];
        let slope = format!("fitted: {:.2} deg/g", gradient.to_degrees() * STANDARD_GRAVITY);
        let axes = ["lateral acceleration a_y [m/s²]", "road-wheel angle [deg]"];
        let title = "Slowly increasing steer (FMVSS 126)";
        Some(
            TestDiagram::new(title, DiagramScale::Linear, axes)
                .with_timed_layer("delta", DiagramLayerKind::Curve, curve)
                .with_layer(slope, DiagramLayerKind::Fit, [line(*LINEAR.start()), line(*LINEAR.end())])
                .with_mark(format!("A = {:.3} deg at 0.3 g", A.to_degrees()), Some(line(AT))),
        )
    }

    /// Fits the straight line through road-wheel angle and lateral acceleration in a stage of a log.
    pub(super) fn fit_steer_gradient(&self, log: &ManoeuvreLog, number: i8) -> Result<SteerFit, String> {
        let range = log.stage_index_range(number)?;
        let reached = max_abs(&log.a_y[range.start..=range.end.min(log.a_y.len() - 1)]);
        if reached < *LINEAR.end() {
            return Err(format!(
                "the lateral acceleration came to {reached:.2} m/s2 by {} rad, and {:.2} m/s2 are needed to find A",
                self.max_steer,
                LINEAR.end()
            ));
        }
        let places =
            (range.start + 1..=range.end.min(log.a_y.len() - 1)).filter(|k| LINEAR.contains(&log.a_y[*k]));
        let line = LineFit::through_points(places.map(|k| (log.a_y[k], log.steer[k - 1])));
        line.value_at(AT).zip(line.slope()).map(|(A, gradient)| SteerFit { A, gradient }).ok_or_else(|| "the communication steps are too long for the lateral acceleration between 0.1 g and 0.375 g to be seen twice".to_owned())
    }
}

impl ManoeuvreKind for SlowlyIncreasingSteer {
    fn kind_title(&self) -> &'static str {
        "slowly increasing steer (FMVSS 126, ISO 19365)"
    }

    fn required_channels(&self) -> Vec<Channel> {
        vec![Channel::ForwardSpeed, Channel::LateralAcceleration]
    }

    fn stage_names(&self) -> &'static [&'static str] {
        &["slowly increasing steer"]
    }

    fn value_descriptions(&self) -> &'static [CharacteristicValueInfo] {
        const {
            &[
                characteristic_value_info("A", "rad", "road-wheel angle at 0.3 g"),
                characteristic_value_info(
                    "steer_gradient",
                    "rad.s2/m",
                    "slope of the road-wheel angle over the lateral acceleration",
                ),
                characteristic_value_info("lateral_acceleration_max", "m/s2", "largest lateral acceleration"),
            ]
        }
    }

    fn check_parameters(&self, _: &CommonParameters) -> Result<(), ParameterError> {
        ParameterError::check_positive([
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
        Err(ParameterError::at_kind_key("until", message))
    }

    fn next_action(&self, common: &CommonParameters, stage: &mut TestStage, now: &CarState) -> DriverAction {
        match self.ramp_steer_angle(stage, now) {
            Some(steer) => DriverAction::steer_by_angle(steer, DriveCommand::Speed(common.entry_speed)),
            None => stage.end_test(now.time),
        }
    }

    fn characteristic_values(
        &self,
        _: &CommonParameters,
        log: &ManoeuvreLog,
    ) -> Result<CharacteristicValues, String> {
        let SteerFit { A, gradient } = self.fit_steer_gradient(log, 1)?;
        let values =
            CharacteristicValues::default().with_number("A", A).with_number("steer_gradient", gradient);
        Ok(values.with_number("lateral_acceleration_max", max_abs(&log.a_y)))
    }

    fn diagrams(
        &self,
        _: &CommonParameters,
        log: &ManoeuvreLog,
        _: &CharacteristicValues,
    ) -> Vec<TestDiagram> {
        self.steer_diagram(log, 1).into_iter().collect()
    }
}
