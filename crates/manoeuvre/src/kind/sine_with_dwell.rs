//! Sine with dwell: one period of steering that rests at its second peak, and how soon the car calms down (FMVSS 126 S5, ISO 19365).

use std::f64::consts::TAU;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::slowly_increasing_steer::{AT, SlowlyIncreasingSteer};
use super::{ManoeuvreKind, ShortestPhase, characteristic_value_info};
use crate::action::{CarState, DriveCommand, DriverAction, EDGE, TestStage};
use crate::channel::Channel;
use crate::characteristic_value::{CharacteristicValueInfo, CharacteristicValues, ParameterError};
use crate::common::CommonParameters;
use crate::diagram::{DiagramLayerKind, TestDiagram};
use crate::log::{ManoeuvreLog, max_abs, peak_index};

/// Sine with dwell (FMVSS 126, ISO 19365): off the pedals one period of steering that rests at its second peak. Its amplitude is an
/// angle, or a multiple of A, which the test finds before, by slowly increasing steer, unless it is given.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct SineWithDwell {
    /// Amplitude of the road-wheel angle [rad].
    #[schemars(example = 0.08)]
    pub amplitude: Option<f64>,
    /// Amplitude in multiples of A [-].
    #[schemars(example = 5.0)]
    pub times_A: Option<f64>,
    /// A, the road-wheel angle at 0.3 g [rad]; the test finds it without.
    #[schemars(example = 0.016)]
    pub A: Option<f64>,
    /// Frequency of the sine [Hz].
    #[schemars(example = 0.7)]
    pub frequency: f64,
    /// Rest at the second peak [s].
    #[schemars(example = 0.5)]
    pub dwell: f64,
    /// How A is found.
    pub search: SlowlyIncreasingSteer,
}

impl Default for SineWithDwell {
    fn default() -> Self {
        SineWithDwell {
            amplitude: None,
            times_A: None,
            A: None,
            frequency: 0.7,
            dwell: 0.5,
            search: SlowlyIncreasingSteer::default(),
        }
    }
}

/// Stages: A is found, the car comes back to its speed, the sine.
const SEARCH: i8 = 1;
const RECOVERY: i8 = 2;
const SINE: i8 = 3;

/// After the completion of steer the yaw rate is judged at these times [s].
const JUDGED: [f64; 2] = [1.0, 1.75];
/// At most such shares of the peak the yaw rate may have then (S5.2.1, S5.2.2).
const YAW_RATE_LIMITS: [f64; 2] = [0.35, 0.20];
/// At least so much displacement a car of up to 3500 kg must have (S5.2.3) [m].
const LEAST_DISPLACEMENT: f64 = 1.83;
/// Half the length of a drawn limit [s].
const LIMIT_LENGTH: f64 = 0.2;
/// The diagrams begin so long before the steering [s].
const BEFORE: f64 = 0.25;
/// After the beginning of steer the lateral displacement is judged at this time [s].
const DISPLACED: f64 = 1.07;
/// A car that yaws less is straight again [rad/s].
const CALM: f64 = 0.01;

impl SineWithDwell {
    /// The steering [-] at a time after its beginning [s]: at most 1.
    #[must_use]
    pub fn steer_shape(&self, time: f64) -> f64 {
        let rest = 0.75 / self.frequency;
        if time < 0.0 || time >= self.steer_duration() {
            return 0.0;
        }
        let time = if time <= rest { time } else { (time - self.dwell).max(rest) };
        (TAU * self.frequency * time).sin()
    }

    /// From the beginning to the completion of steer [s].
    #[must_use]
    pub fn steer_duration(&self) -> f64 {
        1.0 / self.frequency + self.dwell
    }

    fn has_amplitude_search(&self) -> bool {
        self.amplitude.is_none() && self.A.is_none()
    }

    /// The amplitude [rad]; A is what was found, if nothing else says it.
    fn steer_amplitude(&self, found: f64) -> f64 {
        self.amplitude.unwrap_or(self.times_A.unwrap_or(0.0) * self.A.unwrap_or(found))
    }
}

/// The displacement to the left since a place of the log, against the heading there [m].
fn displacements(log: &ManoeuvreLog, begin: usize) -> Vec<f64> {
    let (sin, cos) = log.psi[begin].sin_cos();
    let side = |k: usize| cos * log.y[k] - sin * log.x[k];
    (0..log.t.len()).map(|k| side(k) - side(begin)).collect()
}

impl ManoeuvreKind for SineWithDwell {
    fn kind_title(&self) -> &'static str {
        "sine with dwell (FMVSS 126, ISO 19365)"
    }

    fn required_channels(&self) -> Vec<Channel> {
        let mut needs = vec![Channel::ForwardSpeed, Channel::SideSpeed, Channel::YawRate];
        needs.push(Channel::LateralAcceleration);
        needs.extend(Channel::POSE);
        needs
    }

    fn stage_names(&self) -> &'static [&'static str] {
        &["slowly increasing steer", "back to the entry speed", "sine with dwell"]
    }

    fn value_descriptions(&self) -> &'static [CharacteristicValueInfo] {
        const {
            &[
                characteristic_value_info("A", "rad", "road-wheel angle at 0.3 g"),
                characteristic_value_info("amplitude", "rad", "amplitude of the road-wheel angle"),
                characteristic_value_info("entry_speed", "m/s", "speed at the beginning of steer"),
                characteristic_value_info(
                    "yaw_rate_peak",
                    "rad/s",
                    "second peak of the yaw rate, against the first steering",
                ),
                characteristic_value_info(
                    "yaw_rate_ratio_1_00",
                    "1",
                    "yaw rate 1.00 s after the completion of steer, in terms of its peak",
                ),
                characteristic_value_info(
                    "yaw_rate_ratio_1_75",
                    "1",
                    "yaw rate 1.75 s after the completion of steer, in terms of its peak",
                ),
                characteristic_value_info(
                    "lateral_displacement",
                    "m",
                    "displacement 1.07 s after the beginning of steer",
                ),
                characteristic_value_info("lateral_acceleration_max", "m/s2", "largest lateral acceleration"),
                characteristic_value_info("sideslip_max", "rad", "largest sideslip angle"),
            ]
        }
    }

    fn shortest_phase(&self) -> Option<ShortestPhase> {
        let quarter = 0.25 / self.frequency;
        Some(match quarter < self.dwell {
            true => ShortestPhase { key: "frequency", duration: quarter },
            false => ShortestPhase { key: "dwell", duration: self.dwell },
        })
    }

    fn check_parameters(&self, common: &CommonParameters) -> Result<(), ParameterError> {
        ParameterError::check_positive([("frequency", self.frequency, "Hz"), ("dwell", self.dwell, "s")])?;
        match (self.amplitude, self.times_A) {
            (Some(_), Some(_)) => {
                let message = "expected `amplitude` or `times_A`, found both".to_owned();
                return Err(ParameterError::at_kind_key("times_A", message));
            }
            (None, None) => {
                let message = "expected an `amplitude` [rad], or `times_A`, found neither".to_owned();
                return Err(ParameterError::at_kind_key("amplitude", message));
            }
            (Some(amplitude), None) => ParameterError::check_positive([("amplitude", amplitude, "rad")])?,
            (None, Some(times)) => ParameterError::check_positive([("times_A", times, "1")])?,
        }
        ParameterError::check_positive([("A", self.A.unwrap_or(1.0), "rad")])?;
        let inner =
            |it: ParameterError| ParameterError::at_kind_key("search", format!("`search`: {}", it.message));
        self.search.check_parameters(common).map_err(inner)
    }

    fn next_action(&self, common: &CommonParameters, stage: &mut TestStage, now: &CarState) -> DriverAction {
        let drive = DriveCommand::Speed(common.entry_speed);
        if stage.number == SEARCH {
            if let (true, Some(steer)) =
                (self.has_amplitude_search(), self.search.ramp_steer_angle(stage, now))
            {
                return DriverAction::steer_by_angle(steer, drive);
            }
            stage.angle = self.steer_amplitude(stage.line.value_at(AT).unwrap_or(0.0));
            stage.enter_stage(RECOVERY, now.time);
        }
        if stage.number == RECOVERY {
            let right = (now.v_x - common.entry_speed).abs() <= common.speed_tolerance && now.r.abs() < CALM;
            // Without a search the car is at its speed already.
            if self.has_amplitude_search() && !stage.has_held_for(right, now.time, common.settle) {
                return DriverAction::steer_by_angle(0.0, drive);
            }
            stage.enter_stage(SINE, now.time);
        }
        let time = now.time - stage.since;
        if time > self.steer_duration() + JUDGED[1] + common.step {
            return stage.end_test(now.time);
        }
        DriverAction::steer_by_angle(stage.angle * self.steer_shape(time + EDGE), DriveCommand::Force(0.0))
    }

    fn characteristic_values(
        &self,
        _: &CommonParameters,
        log: &ManoeuvreLog,
    ) -> Result<CharacteristicValues, String> {
        let A = if self.has_amplitude_search() {
            Some(self.search.fit_steer_gradient(log, SEARCH)?.A)
        } else {
            self.A
        };
        let begin = log.stage_index_range(SINE)?.start;
        let completed = log.t[begin] + self.steer_duration();
        // The peak after the steering has changed its sign, which happens after half a period.
        let changed = log.t[begin] + 0.5 / self.frequency;
        let against: Vec<f64> = log
            .t
            .iter()
            .zip(&log.r)
            .map(|(t, r)| if *t >= changed { -r } else { f64::NEG_INFINITY })
            .collect();
        let peak = peak_index(&against).map_or(0.0, |place| against[place]);
        if peak <= 0.0 {
            return Err(
                "the car did not yaw against its first steering, so there is no peak of the yaw rate"
                    .to_owned(),
            );
        }
        let ratio = |after: f64| log.interpolate_at(&log.r, completed + after).map(|r| -r / peak);
        let sides = displacements(log, begin);
        Ok(CharacteristicValues::default()
            .with_number("A", A)
            .with_number("amplitude", self.steer_amplitude(A.unwrap_or(0.0)))
            .with_number("entry_speed", log.v_x[begin])
            .with_number("yaw_rate_peak", -peak)
            .with_number("yaw_rate_ratio_1_00", ratio(JUDGED[0]))
            .with_number("yaw_rate_ratio_1_75", ratio(JUDGED[1]))
            .with_number("lateral_displacement", log.interpolate_at(&sides, log.t[begin] + DISPLACED))
            .with_number("lateral_acceleration_max", max_abs(&log.a_y[begin..]))
            .with_number("sideslip_max", max_abs(&log.sideslip_angles()[begin..])))
    }

    fn diagrams(
        &self,
        _: &CommonParameters,
        log: &ManoeuvreLog,
        values: &CharacteristicValues,
    ) -> Vec<TestDiagram> {
        let Ok(range) = log.stage_index_range(SINE) else { return Vec::new() };
        let begin = log.t[range.start];
        let (changed, completed) = (begin + 0.5 / self.frequency, begin + self.steer_duration());
        let shown = log.t.partition_point(|t| *t < begin - BEFORE)..log.t.len();
        let curve = |of: &[f64], factor: f64| -> Vec<[f64; 3]> {
            shown.clone().map(|k| [log.t[k], log.t[k], factor * of[k]]).collect()
        };
        let at = |of: &[f64], factor: f64, time: f64| {
            log.interpolate_at(of, time).map(|value| [time, factor * value])
        };
        let limit = |time: f64, value: f64| [[time - LIMIT_LENGTH, value], [time + LIMIT_LENGTH, value]];
        let degrees = 1_f64.to_degrees();
        let peak = degrees * values.get_number("yaw_rate_peak").unwrap_or(f64::NAN);
        let top = (shown.start..log.t.len())
            .filter(|k| log.t[*k] >= changed)
            .min_by(|a, b| log.r[*a].total_cmp(&log.r[*b]));
        let ends = |of: &[f64], factor: f64| {
            let shown = || of[shown.clone()].iter().map(|value| factor * value);
            [shown().fold(f64::INFINITY, f64::min), shown().fold(f64::NEG_INFINITY, f64::max)]
        };
        let completion = |of: &[f64], factor: f64| ends(of, factor).map(|value| [completed, value]);
        let sides = displacements(log, range.start);
        let mut yaw_rate = TestDiagram::over_time("Yaw rate (FMVSS 126)", "yaw rate [deg/s]")
            .with_layer("completion of steer", DiagramLayerKind::Reference, completion(&log.r, degrees))
            .with_timed_layer("yaw rate", DiagramLayerKind::Curve, curve(&log.r, degrees))
            .with_mark(format!("peak {peak:.1} deg/s"), top.map(|k| [log.t[k], degrees * log.r[k]]));
        for (after, share) in JUDGED.into_iter().zip(YAW_RATE_LIMITS) {
            let name = format!("at most {:.0} % of it {after:.2} s after completion", 100.0 * share);
            yaw_rate = yaw_rate
                .with_layer(name, DiagramLayerKind::Limit, limit(completed + after, share * peak))
                .with_mark_labelled_by_value("deg/s", at(&log.r, degrees, completed + after));
        }
        let name = format!("at least {LEAST_DISPLACEMENT} m {DISPLACED} s after the beginning");
        let displacement = TestDiagram::over_time("Lateral displacement (FMVSS 126)", "displacement [m]")
            .with_timed_layer("displacement", DiagramLayerKind::Curve, curve(&sides, 1.0))
            .with_layer(name, DiagramLayerKind::Limit, limit(begin + DISPLACED, LEAST_DISPLACEMENT))
            .with_mark_labelled_by_value("m", at(&sides, 1.0, begin + DISPLACED));
        let acceleration = TestDiagram::over_time("Lateral acceleration (FMVSS 126)", "a_y [m/s²]")
            .with_layer("completion of steer", DiagramLayerKind::Reference, completion(&log.a_y, 1.0))
            .with_timed_layer("a_y", DiagramLayerKind::Curve, curve(&log.a_y, 1.0));
        let steer = TestDiagram::over_time("Steering (FMVSS 126)", "road-wheel angle [deg]")
            .with_layer("completion of steer", DiagramLayerKind::Reference, completion(&log.steer, degrees))
            .with_timed_layer("delta", DiagramLayerKind::Curve, curve(&log.steer, degrees));
        let search = self.has_amplitude_search().then(|| self.search.steer_diagram(log, SEARCH)).flatten();
        [yaw_rate, displacement, acceleration, steer].into_iter().chain(search).collect()
    }
}
