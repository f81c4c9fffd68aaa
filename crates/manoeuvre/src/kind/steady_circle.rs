//! Steady circle: how much more the car must be steered the faster it corners (ISO 4138).

use std::ops::Range;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{ManoeuvreKind, characteristic_value_info};
use crate::action::stage_lasted;
use crate::action::{CarState, DriveCommand, DriverAction, TestStage};
use crate::channel::Channel;
use crate::characteristic_value::{CharacteristicValueInfo, CharacteristicValues, ParameterError};
use crate::common::CommonParameters;
use crate::diagram::{DiagramLayerKind, DiagramScale, TestDiagram};
use crate::line_fit::LineFit;
use crate::log::{ManoeuvreLog, max_abs};
use crate::path::GroundPath;
use units::STANDARD_GRAVITY;

/// What a steady circle keeps.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ConstantQuantity {
    /// The radius: the speed grows, and the path follower steers.
    #[default]
    Radius,
    /// The speed: the road-wheel angle grows.
    Speed,
    /// The road-wheel angle: the speed grows.
    Steer,
}

/// Steady circle (ISO 4138). From the entry speed on, one of radius, speed and road-wheel angle stays, and the lateral acceleration
/// grows slowly. A straight line through the road-wheel angle less that of a car without slip angles gives the understeer gradient.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct SteadyCircle {
    /// What stays.
    #[schemars(example = &"radius")]
    pub constant: ConstantQuantity,
    /// Radius that stays [m].
    #[schemars(example = 40.0)]
    pub radius: f64,
    /// Road-wheel angle that stays [rad].
    #[schemars(example = 0.05)]
    pub steer: f64,
    /// Rate of a growing speed [m/s2].
    #[schemars(example = 0.2)]
    pub speed_rate: f64,
    /// Rate of a growing road-wheel angle [rad/s].
    #[schemars(example = 0.002)]
    pub steer_rate: f64,
    /// Time to settle on the circle before anything grows [s].
    #[schemars(example = 8.0)]
    pub circle: f64,
    /// Lateral acceleration at which the test ends [m/s2]. It ends before, too, when the car leaves its circle by 2 m.
    #[schemars(example = 4.0)]
    pub until: f64,
    /// Lateral accelerations of the straight line [m/s2].
    #[schemars(example = LINEAR)]
    pub linear: [f64; 2],
}

impl Default for SteadyCircle {
    fn default() -> Self {
        SteadyCircle {
            constant: ConstantQuantity::Radius,
            radius: 40.0,
            steer: 0.05,
            speed_rate: 0.2,
            steer_rate: 0.002,
            circle: 8.0,
            until: 4.0,
            linear: LINEAR,
        }
    }
}

/// The usual lateral accelerations of the straight line [m/s2].
const LINEAR: [f64; 2] = [1.0, 3.0];
/// Stages: onto the circle, faster and faster.
const CIRCLE: i8 = 1;
const FASTER: i8 = 2;
/// A car that is farther from its circle has left it [m].
const LEFT: f64 = 2.0;

impl SteadyCircle {
    /// The places of the log on the straight line: until its end is reached for the first time.
    fn linear_places(&self, log: &ManoeuvreLog, range: &Range<usize>) -> Vec<usize> {
        let [low, high] = self.linear;
        let end = range.clone().find(|k| log.a_y[*k] > high).unwrap_or(range.end);
        (range.start + 1..end).filter(|k| log.a_y[*k] >= low).collect()
    }
}

impl ManoeuvreKind for SteadyCircle {
    fn kind_title(&self) -> &'static str {
        "steady circle (ISO 4138)"
    }

    fn required_channels(&self) -> Vec<Channel> {
        let mut needs =
            vec![Channel::ForwardSpeed, Channel::SideSpeed, Channel::YawRate, Channel::LateralAcceleration];
        if self.constant == ConstantQuantity::Radius {
            needs.extend(Channel::POSE);
        }
        needs
    }

    fn stage_names(&self) -> &'static [&'static str] {
        &["onto the circle", "growing lateral acceleration"]
    }

    fn value_descriptions(&self) -> &'static [CharacteristicValueInfo] {
        const {
            &[
                characteristic_value_info(
                    "understeer_gradient",
                    "rad.s2/m",
                    "growth of the road-wheel angle over the lateral acceleration beyond that of a car without slip angles",
                ),
                characteristic_value_info(
                    "characteristic_speed",
                    "m/s",
                    "speed of the largest yaw rate gain; none of a car that oversteers",
                ),
                characteristic_value_info(
                    "critical_speed",
                    "m/s",
                    "speed at which the car gets unstable; none of a car that understeers",
                ),
                characteristic_value_info(
                    "sideslip_gradient",
                    "rad.s2/m",
                    "growth of the sideslip angle over the lateral acceleration",
                ),
                characteristic_value_info(
                    "yaw_rate_gain_max",
                    "1/s",
                    "largest yaw rate over the road-wheel angle",
                ),
                characteristic_value_info("lateral_acceleration_max", "m/s2", "largest lateral acceleration"),
            ]
        }
    }

    fn reference_path(&self) -> Option<GroundPath> {
        (self.constant == ConstantQuantity::Radius).then_some(GroundPath::Circle(self.radius))
    }

    fn check_parameters(&self, common: &CommonParameters) -> Result<(), ParameterError> {
        let [low, high] = self.linear;
        ParameterError::check_positive([
            ("radius", self.radius, "m"),
            ("steer", self.steer, "rad"),
            ("speed_rate", self.speed_rate, "m/s2"),
            ("steer_rate", self.steer_rate, "rad/s"),
            ("circle", self.circle, "s"),
            ("until", self.until, "m/s2"),
            ("linear", low, "m/s2"),
        ])?;
        if !(low < high && high <= self.until) {
            let message = format!(
                "expected growing lateral accelerations up to `until` = {} m/s2, found {low} and {high}",
                self.until
            );
            return Err(ParameterError::at_kind_key("linear", message));
        }
        match common.wheelbase {
            Some(_) => Ok(()),
            None => Err(ParameterError::at_common_key("wheelbase", "a steady circle needs the `wheelbase` [m] of the car: the understeer gradient is what exceeds its angle".to_owned())),
        }
    }

    fn next_action(&self, common: &CommonParameters, stage: &mut TestStage, now: &CarState) -> DriverAction {
        let speed = common.entry_speed;
        let grown = |rate: f64, number: i8| {
            if number == FASTER { rate * (now.time - stage.since) } else { 0.0 }
        };
        let faster = DriveCommand::Speed(speed + grown(self.speed_rate, stage.number));
        let action = match self.constant {
            ConstantQuantity::Radius => DriverAction::follow_path(faster),
            // The step of the steering would shake the car: it takes a second.
            ConstantQuantity::Steer if stage.number == CIRCLE => {
                DriverAction::steer_by_angle(self.steer * (now.time - stage.since).min(1.0), faster)
            }
            ConstantQuantity::Steer => DriverAction::steer_by_angle(self.steer, faster),
            ConstantQuantity::Speed => {
                DriverAction::steer_by_angle(grown(self.steer_rate, stage.number), DriveCommand::Speed(speed))
            }
        };
        if stage.number == CIRCLE {
            let waits = self.constant != ConstantQuantity::Speed && !stage_lasted(stage, now, self.circle);
            if !waits {
                stage.enter_stage(FASTER, now.time);
            }
            return action;
        }
        let left = self.reference_path().is_some_and(|path| path.lateral_offset(now.x, now.y).abs() > LEFT);
        if left || now.a_y >= self.until { stage.end_test(now.time) } else { action }
    }

    fn characteristic_values(
        &self,
        common: &CommonParameters,
        log: &ManoeuvreLog,
    ) -> Result<CharacteristicValues, String> {
        let range = log.stage_index_range(FASTER)?;
        let [low, high] = self.linear;
        let reached = max_abs(&log.a_y);
        let first = range.clone().map(|k| log.a_y[k]).fold(f64::INFINITY, f64::min);
        if reached < high || first > low {
            return Err(format!(
                "the lateral acceleration was between {first:.2} and {reached:.2} m/s2 on the circle, and the straight line needs {low} to {high} m/s2"
            ));
        }
        let wheelbase = common.wheelbase.unwrap_or(f64::NAN);
        let places = self.linear_places(log, &range);
        let extra = |k: usize| log.steer[k - 1] - wheelbase * log.r[k] / log.v_x[k];
        let gradient = LineFit::through_points(places.iter().map(|k| (log.a_y[*k], extra(*k)))).slope();
        let gradient = gradient.ok_or(
            "the communication steps are too long for the lateral acceleration to be seen twice on the line",
        )?;
        let sideslip = log.sideslip_angles();
        let slope = LineFit::through_points(places.iter().map(|k| (log.a_y[*k], sideslip[*k]))).slope();
        let gains: Vec<f64> = places.iter().map(|k| log.r[*k] / log.steer[k - 1]).collect();
        let speed = |gradient: f64| (gradient > 0.0).then(|| (wheelbase / gradient).sqrt());
        Ok(CharacteristicValues::default()
            .with_number("understeer_gradient", gradient)
            .with_number("characteristic_speed", speed(gradient))
            .with_number("critical_speed", speed(-gradient))
            .with_number("sideslip_gradient", slope)
            .with_number("yaw_rate_gain_max", max_abs(&gains))
            .with_number("lateral_acceleration_max", reached))
    }

    fn diagrams(
        &self,
        common: &CommonParameters,
        log: &ManoeuvreLog,
        values: &CharacteristicValues,
    ) -> Vec<TestDiagram> {
        let Ok(range) = log.stage_index_range(FASTER) else { return Vec::new() };
        let wheelbase = common.wheelbase.unwrap_or(f64::NAN);
        let (linear, sideslip) = (self.linear_places(log, &range), log.sideslip_angles());
        let rolling = |k: usize| (wheelbase * log.r[k] / log.v_x[k]).to_degrees();
        let steer = |k: usize| log.steer[k - 1].to_degrees();
        let curve = |y: &dyn Fn(usize) -> f64| -> Vec<[f64; 3]> {
            (range.start + 1..range.end).map(|k| [log.t[k], log.a_y[k], y(k)]).collect()
        };
        let fit = |y: &dyn Fn(usize) -> f64| -> Vec<[f64; 2]> {
            let line = LineFit::through_points(linear.iter().map(|k| (log.a_y[*k], y(*k))));
            self.linear.into_iter().filter_map(|a_y| Some([a_y, line.value_at(a_y)?])).collect()
        };
        let [low, high] = self.linear;
        let slope = |name: &str, value: &str| {
            let per_g = values.get_number(value).unwrap_or(f64::NAN).to_degrees() * STANDARD_GRAVITY;
            format!("{name} {per_g:.2} deg/g, fitted from {low} to {high} m/s²")
        };
        let axes = |y| ["lateral acceleration a_y [m/s²]", y];
        let diagram = |title, y| TestDiagram::new(title, DiagramScale::Linear, axes(y));
        vec![
            diagram("Steering over lateral acceleration (ISO 4138)", "road-wheel angle [deg]")
                .with_timed_layer(
                    "L r / v_x, without slip angles",
                    DiagramLayerKind::Reference,
                    curve(&rolling),
                )
                .with_timed_layer("delta", DiagramLayerKind::Curve, curve(&steer))
                .with_timed_layer(
                    "delta - L r / v_x",
                    DiagramLayerKind::SecondCurve,
                    curve(&|k| steer(k) - rolling(k)),
                )
                .with_layer(
                    slope("understeer gradient", "understeer_gradient"),
                    DiagramLayerKind::Fit,
                    fit(&|k| steer(k) - rolling(k)),
                ),
            diagram("Sideslip over lateral acceleration (ISO 4138)", "sideslip angle [deg]")
                .with_timed_layer("beta", DiagramLayerKind::Curve, curve(&|k| sideslip[k].to_degrees()))
                .with_layer(
                    slope("sideslip gradient", "sideslip_gradient"),
                    DiagramLayerKind::Fit,
                    fit(&|k| sideslip[k].to_degrees()),
                ),
        ]
    }
}
