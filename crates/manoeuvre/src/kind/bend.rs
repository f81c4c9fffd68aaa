//! Changes the driving force in a bend with the steering held: what power on, power off and braking have in common.

use super::characteristic_value_info;
use crate::action::stage_lasted;
use crate::action::{CarState, DriveCommand, DriverAction, TestStage};
use crate::channel::Channel;
use crate::characteristic_value::{CharacteristicValueInfo, CharacteristicValues};
use crate::common::CommonParameters;
use crate::log::{ManoeuvreLog, max_abs, mean};

/// A change of the driving force in a bend.
pub(super) struct BendForceChange {
    /// Time to settle on the circle [s].
    pub circle: f64,
    /// The driving force after the change [N].
    pub force: f64,
    /// How long the test goes on after the change [s].
    pub observe: f64,
}

/// Stages: onto the circle, steering and force held, the change.
const CIRCLE: i8 = 1;
const HELD: i8 = 2;
const CHANGE: i8 = 3;
/// Steering and driving force are held before the change for so long [s]; the means of this time are the initial state.
const INITIAL: f64 = 1.0;
/// A slower car stands [m/s].
pub(super) const STANDS: f64 = 0.2;

pub(super) const STAGES: &[&str] =
    &["onto the circle", "steering and driving force held", "change of the driving force"];

pub(super) const DESCRIPTIONS: [CharacteristicValueInfo; 9] = [
    characteristic_value_info("lateral_acceleration_0", "m/s2", "lateral acceleration before the change"),
    characteristic_value_info(
        "longitudinal_acceleration",
        "m/s2",
        "mean longitudinal acceleration in the first second",
    ),
    characteristic_value_info(
        "yaw_rate_ratio_1_0",
        "1",
        "yaw rate after 1 s, in terms of that on the initial circle at the same speed",
    ),
    characteristic_value_info("yaw_rate_ratio_2_0", "1", "the same after 2 s"),
    characteristic_value_info(
        "yaw_rate_change_max",
        "rad/s",
        "largest difference from the yaw rate on the initial circle in the first 2 s",
    ),
    characteristic_value_info(
        "sideslip_change_max",
        "rad",
        "largest change of the sideslip angle in the first 2 s",
    ),
    characteristic_value_info(
        "path_deviation_2_0",
        "m",
        "how far the car is outside of its initial circle after 2 s",
    ),
    characteristic_value_info(
        "stopping_distance",
        "m",
        "distance from the change to standstill; none of a car that goes on",
    ),
    characteristic_value_info("stopping_time", "s", "time from the change to standstill"),
];

impl BendForceChange {
    pub fn required_channels() -> Vec<Channel> {
        Channel::ALL.to_vec()
    }

    pub fn next_action(
        &self,
        common: &CommonParameters,
        stage: &mut TestStage,
        now: &CarState,
    ) -> DriverAction {
        if stage.number == CIRCLE {
            if !stage_lasted(stage, now, self.circle) {
                return DriverAction::follow_path(DriveCommand::Speed(common.entry_speed));
            }
            stage.angle = now.steer;
            stage.enter_stage(HELD, now.time);
        }
        if stage.number == HELD {
            if !stage_lasted(stage, now, INITIAL) {
                return DriverAction::steer_by_angle(stage.angle, DriveCommand::Hold);
            }
            stage.enter_stage(CHANGE, now.time);
        }
        if now.v_x < STANDS || stage_lasted(stage, now, self.observe) {
            return stage.end_test(now.time);
        }
        DriverAction::steer_by_angle(stage.angle, DriveCommand::Force(self.force))
    }

    pub fn characteristic_values(&self, log: &ManoeuvreLog) -> Result<CharacteristicValues, String> {
        let (held, change) = (log.stage_index_range(HELD)?, log.stage_index_range(CHANGE)?.start);
        let [v0, r0, a0] = [&log.v_x, &log.r, &log.a_y].map(|values| mean(&values[held.clone()]));
        if r0 <= 0.0 || v0 <= 0.0 {
            return Err(format!(
                "the car was on no circle before the change: its yaw rate was {r0:.3} rad/s"
            ));
        }
        let t0 = log.t[change];
        let circle: Vec<f64> = log.v_x.iter().map(|v_x| r0 / v0 * v_x).collect();
        let ratio = |after: f64| {
            let [r, on_circle] = [&log.r, &circle].map(|values| log.interpolate_at(values, t0 + after));
            r.zip(on_circle).map(|(r, on_circle)| r / on_circle)
        };
        let first = change..log.t.partition_point(|t| *t <= t0 + 2.0);
        let sideslip = log.sideslip_angles();
        let changed = |values: &[f64], from: &dyn Fn(usize) -> f64| {
            max_abs(&first.clone().map(|k| values[k] - from(k)).collect::<Vec<_>>())
        };
        // The centre is to the left of the course.
        let course = log.psi[change] + sideslip[change];
        let radius = v0.hypot(log.v_y[change]) / r0;
        let centre = [log.x[change] - radius * course.sin(), log.y[change] + radius * course.cos()];
        let outside: Vec<f64> =
            (0..log.t.len()).map(|k| (log.x[k] - centre[0]).hypot(log.y[k] - centre[1]) - radius).collect();
        let last = log.t.len() - 1;
        let stands = log.v_x[last] < STANDS;
        let distance = log.travelled_distances();
        Ok(CharacteristicValues::default()
            .with_number("lateral_acceleration_0", a0)
            .with_number(
                "longitudinal_acceleration",
                log.interpolate_at(&log.v_x, t0 + 1.0).map(|v| v - log.v_x[change]),
            )
            .with_number("yaw_rate_ratio_1_0", ratio(1.0))
            .with_number("yaw_rate_ratio_2_0", ratio(2.0))
            .with_number("yaw_rate_change_max", changed(&log.r, &|k| circle[k]))
            .with_number("sideslip_change_max", changed(&sideslip, &|_| sideslip[change]))
            .with_number("path_deviation_2_0", log.interpolate_at(&outside, t0 + 2.0))
            .with_number("stopping_distance", stands.then(|| distance[last] - distance[change]))
            .with_number("stopping_time", stands.then(|| log.t[last] - t0)))
    }
}
