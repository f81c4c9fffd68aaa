//! Step steer: how fast and how far the car answers a step of the steering (ISO 7401).

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{ManoeuvreKind, ShortestPhase, characteristic_value_info};
use crate::action::{CarState, DriveCommand, DriverAction, TestStage};
use crate::channel::Channel;
use crate::characteristic_value::{CharacteristicValueInfo, CharacteristicValues, ParameterError};
use crate::common::CommonParameters;
use crate::diagram::{DiagramLayerKind, TestDiagram};
use crate::log::{ManoeuvreLog, max_abs, mean, peak_index};

/// Step steer (ISO 7401) with the driving force held. Times count from the moment at which half of the step is steered.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct StepSteer {
    /// Height of the step: road-wheel angle [rad].
    #[schemars(example = 0.02)]
    pub amplitude: f64,
    /// Rate of the road-wheel angle during the step [rad/s].
    #[schemars(example = 0.5)]
    pub rate: f64,
    /// Time from the beginning of the step to the end of the test [s].
    #[schemars(example = 4.0)]
    pub hold: f64,
    /// Part of it at the end whose mean is the steady state [s].
    #[schemars(example = 1.0)]
    pub steady: f64,
}

impl Default for StepSteer {
    fn default() -> Self {
        StepSteer { amplitude: 0.0, rate: 0.5, hold: 4.0, steady: 1.0 }
    }
}

/// In the steady state a value may differ from its mean by this share.
const STEADY: f64 = 0.1;

impl ManoeuvreKind for StepSteer {
    fn kind_title(&self) -> &'static str {
        "step steer (ISO 7401)"
    }

    fn required_channels(&self) -> Vec<Channel> {
        vec![Channel::ForwardSpeed, Channel::SideSpeed, Channel::YawRate, Channel::LateralAcceleration]
    }

    fn stage_names(&self) -> &'static [&'static str] {
        &["step"]
    }

    fn value_descriptions(&self) -> &'static [CharacteristicValueInfo] {
        const {
            &[
                characteristic_value_info("steady_yaw_rate", "rad/s", "yaw rate in the steady state"),
                characteristic_value_info(
                    "steady_lateral_acceleration",
                    "m/s2",
                    "lateral acceleration in the steady state",
                ),
                characteristic_value_info("steady_sideslip", "rad", "sideslip angle in the steady state"),
                characteristic_value_info(
                    "yaw_rate_gain",
                    "1/s",
                    "steady yaw rate over the road-wheel angle",
                ),
                characteristic_value_info(
                    "yaw_rate_response_time",
                    "s",
                    "until the yaw rate has 90 % of its steady state",
                ),
                characteristic_value_info("yaw_rate_peak_time", "s", "until the peak of the yaw rate"),
                characteristic_value_info(
                    "yaw_rate_overshoot",
                    "1",
                    "by which share the peak exceeds the steady state",
                ),
                characteristic_value_info(
                    "lateral_acceleration_response_time",
                    "s",
                    "until the lateral acceleration has 90 % of its steady state",
                ),
                characteristic_value_info(
                    "lateral_acceleration_peak_time",
                    "s",
                    "until the peak of the lateral acceleration",
                ),
                characteristic_value_info(
                    "lateral_acceleration_overshoot",
                    "1",
                    "by which share the peak exceeds the steady state",
                ),
                characteristic_value_info(
                    "TB",
                    "s.rad",
                    "TB factor: time of the peak of the yaw rate times the steady sideslip angle",
                ),
            ]
        }
    }

    fn shortest_phase(&self) -> Option<ShortestPhase> {
        Some(ShortestPhase { key: "steady", duration: self.steady })
    }

    fn check_parameters(&self, _: &CommonParameters) -> Result<(), ParameterError> {
        ParameterError::check_positive([
            ("amplitude", self.amplitude, "rad"),
            ("rate", self.rate, "rad/s"),
            ("hold", self.hold, "s"),
            ("steady", self.steady, "s"),
        ])?;
        let left = self.hold - self.amplitude / self.rate;
        if self.steady < left {
            return Ok(());
        }
        let message = format!(
            "expected less than the {left:.3} s between the step and the end of the test, found {} s",
            self.steady
        );
        Err(ParameterError::at_kind_key("steady", message))
    }

    fn next_action(&self, _: &CommonParameters, stage: &mut TestStage, now: &CarState) -> DriverAction {
        let time = now.time - stage.since;
        if time > self.hold {
            return stage.end_test(now.time);
        }
        DriverAction::steer_by_angle(self.amplitude.min(self.rate * time), DriveCommand::Hold)
    }

    fn characteristic_values(
        &self,
        _: &CommonParameters,
        log: &ManoeuvreLog,
    ) -> Result<CharacteristicValues, String> {
        let half = 0.5 * self.amplitude / self.rate;
        let last = log.t.len() - 1;
        let steady = log.t.iter().position(|t| *t >= self.hold - self.steady).unwrap_or(0);
        let response = |values: &[f64], name: &str| -> Result<[Option<f64>; 4], String> {
            let end = mean(&values[steady..last]);
            if end.abs() < 1e-9 {
                return Err(format!(
                    "the {name} is {end:.1e} in the end: the car does not answer the steering"
                ));
            }
            let scaled: Vec<f64> = values.iter().map(|value| value / end).collect();
            let rest = max_abs(&scaled[steady..last].iter().map(|value| value - 1.0).collect::<Vec<_>>());
            if rest > STEADY {
                return Err(format!(
                    "the {name} has no steady state: in the last {} s it differs from its mean by {:.0} %",
                    self.steady,
                    100.0 * rest
                ));
            }
            let time = log.level_crossing_time(&scaled, 0.9, true, 0).map(|t| t - half);
            let top = peak_index(&scaled).filter(|place| scaled[*place] > 1.0 && *place < steady);
            let overshoot = top.map_or(0.0, |place| scaled[place] - 1.0);
            Ok([Some(end), time, top.map(|place| log.t[place] - half), Some(overshoot)])
        };
        let [r, r_time, r_peak, r_over] = response(&log.r, "yaw rate")?;
        let [a_y, a_time, a_peak, a_over] = response(&log.a_y, "lateral acceleration")?;
        let sideslip = mean(&log.sideslip_angles()[steady..last]);
        Ok(CharacteristicValues::default()
            .with_number("steady_yaw_rate", r)
            .with_number("steady_lateral_acceleration", a_y)
            .with_number("steady_sideslip", sideslip)
            .with_number("yaw_rate_gain", r.map(|r| r / self.amplitude))
            .with_number("yaw_rate_response_time", r_time)
            .with_number("yaw_rate_peak_time", r_peak)
            .with_number("yaw_rate_overshoot", r_over)
            .with_number("lateral_acceleration_response_time", a_time)
            .with_number("lateral_acceleration_peak_time", a_peak)
            .with_number("lateral_acceleration_overshoot", a_over)
            .with_number("TB", r_peak.map(|time| time * sideslip)))
    }

    fn diagrams(
        &self,
        _: &CommonParameters,
        log: &ManoeuvreLog,
        values: &CharacteristicValues,
    ) -> Vec<TestDiagram> {
        let half = 0.5 * self.amplitude / self.rate;
        let last = log.t[log.t.len() - 1];
        let response = |title, y_label, of: &[f64], factor: f64, name: &str| {
            let value = |key: &str| values.get_number(&format!("{name}_{key}"));
            let steady = factor * values.get_number(&format!("steady_{name}")).unwrap_or(f64::NAN);
            let overshoot = value("overshoot").unwrap_or(0.0);
            let response = value("response_time");
            let peak = value("peak_time");
            let curve = log.t.iter().zip(of).map(|(t, value)| [*t, *t, factor * value]);
            let share = format!("90 %, after {:.3} s", response.unwrap_or(f64::NAN));
            let highest = format!("peak, {:.1} % above", 100.0 * overshoot);
            TestDiagram::over_time(title, y_label)
                .with_layer("steady state", DiagramLayerKind::Fit, [[0.0, steady], [last, steady]])
                .with_layer("half of the step", DiagramLayerKind::Reference, [[half, 0.0], [half, steady]])
                .with_timed_layer("response", DiagramLayerKind::Curve, curve)
                .with_mark(share, response.map(|time| [half + time, 0.9 * steady]))
                .with_mark(highest, peak.map(|time| [half + time, (1.0 + overshoot) * steady]))
        };
        let degrees = 1_f64.to_degrees();
        vec![
            response("Yaw rate (ISO 7401)", "yaw rate [deg/s]", &log.r, degrees, "yaw_rate"),
            response("Lateral acceleration (ISO 7401)", "a_y [m/s²]", &log.a_y, 1.0, "lateral_acceleration"),
        ]
    }
}
