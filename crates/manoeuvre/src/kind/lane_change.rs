//! Severe lane change between cones (ISO 3888-1, double lane change; ISO 3888-2, obstacle avoidance).

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{ManoeuvreKind, characteristic_value_info};
use crate::action::{CarState, DriveCommand, DriverAction, TestStage};
use crate::channel::Channel;
use crate::characteristic_value::{CharacteristicValueInfo, CharacteristicValues, ParameterError};
use crate::common::CommonParameters;
use crate::log::{ManoeuvreLog, max_abs};
use crate::path::GroundPath;

/// The course of a lane change.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum LaneChangeCourse {
    /// Double lane change, 125 m.
    #[default]
    #[serde(rename = "iso_3888_1")]
    DoubleLaneChange,
    /// Obstacle avoidance, 61 m; the driver goes off the pedals 2 m behind the entry.
    #[serde(rename = "iso_3888_2")]
    ObstacleAvoidance,
}

/// Severe lane change (ISO 3888). Three lanes between cones, whose widths follow from that of the car; the driver follows the middle of
/// the lanes. The test is passed when no cone is hit.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct LaneChange {
    /// The course.
    #[schemars(example = &"iso_3888_2")]
    pub course: LaneChangeCourse,
    /// Width of the car without its mirrors [m].
    #[schemars(example = 1.8)]
    pub width: f64,
    /// From the centre of gravity to the front end of the car [m].
    #[schemars(example = 2.2)]
    pub front: f64,
    /// From the centre of gravity to its rear end [m].
    #[schemars(example = 2.3)]
    pub rear: f64,
    /// From the beginning of the test to the first cones [m].
    #[schemars(example = 20.0)]
    pub lead: f64,
}

impl Default for LaneChange {
    fn default() -> Self {
        LaneChange {
            course: LaneChangeCourse::DoubleLaneChange,
            width: 1.8,
            front: 2.2,
            rear: 2.3,
            lead: 20.0,
        }
    }
}

/// A lane between cones: where it begins and ends, and its right and left edge [m].
#[derive(Debug, Clone, Copy, PartialEq)]
struct ConeLane {
    along: [f64; 2],
    across: [f64; 2],
}

impl ConeLane {
    fn lane_center(&self) -> f64 {
        0.5 * (self.across[0] + self.across[1])
    }
}

/// Cones on each side of a lane.
const CONES: u32 = 5;
/// Behind the last lane the car is observed for this way [m].
const BEHIND: f64 = 5.0;
/// In the obstacle avoidance the driver goes off the pedals so far behind the first cones [m].
const OFF: f64 = 2.0;

impl LaneChange {
    /// The three lanes, from the first cones on, with the middle of the first one at 0. In the double lane change the right edges of
    /// first and second lane are 3.5 m apart; in the obstacle avoidance the lanes themselves are 1 m apart.
    fn cone_lanes(&self) -> [ConeLane; 3] {
        let width = |factor: f64, more: f64| factor * self.width + more;
        let first = width(1.1, 0.25);
        let right = -0.5 * first;
        let (lengths, second, third, offset) = match self.course {
            LaneChangeCourse::DoubleLaneChange => {
                ([15.0, 30.0, 25.0, 25.0, 30.0], width(1.2, 0.25), width(1.3, 0.25), 3.5)
            }
            LaneChangeCourse::ObstacleAvoidance => {
                ([12.0, 13.5, 11.0, 12.5, 12.0], width(1.0, 1.0), width(1.3, 0.25).max(3.0), first + 1.0)
            }
        };
        let mut at = 0.0;
        let ends = lengths.map(|length| {
            at += length;
            at
        });
        let lane = |begin: f64, end: f64, right: f64, width: f64| ConeLane {
            along: [begin, end],
            across: [right, right + width],
        };
        [
            lane(0.0, ends[0], right, first),
            lane(ends[1], ends[2], right + offset, second),
            lane(ends[3], ends[4], right, third),
        ]
    }

    /// The cones of the first two lanes and of the third one, and where the last of them stands [m].
    fn cone_positions(&self) -> Vec<[f64; 2]> {
        let lanes = self.cone_lanes().into_iter();
        let of = |lane: ConeLane| {
            let [begin, end] = lane.along;
            let along = move |k: u32| begin + (end - begin) * f64::from(k) / f64::from(CONES - 1);
            lane.across.into_iter().flat_map(move |y| (0..CONES).map(move |k| [along(k), y]))
        };
        lanes.flat_map(of).map(|[x, y]| [x + self.lead, y]).collect()
    }

    /// How far a point is inside of the car at a moment [m]; negative outside.
    fn distance_inside_car(&self, log: &ManoeuvreLog, k: usize, [x, y]: [f64; 2]) -> f64 {
        let [along, across] = crate::frame::rotate_into_frame([x - log.x[k], y - log.y[k]], log.psi[k]);
        (self.front - along).min(along + self.rear).min(0.5 * self.width - across.abs())
    }
}

impl ManoeuvreKind for LaneChange {
    fn kind_title(&self) -> &'static str {
        match self.course {
            LaneChangeCourse::DoubleLaneChange => "double lane change (ISO 3888-1)",
            LaneChangeCourse::ObstacleAvoidance => "obstacle avoidance (ISO 3888-2)",
        }
    }

    fn required_channels(&self) -> Vec<Channel> {
        Channel::ALL.to_vec()
    }

    fn stage_names(&self) -> &'static [&'static str] {
        &["lane change"]
    }

    fn value_descriptions(&self) -> &'static [CharacteristicValueInfo] {
        const {
            &[
                characteristic_value_info("cones_hit", "1", "number of cones that the car hits"),
                characteristic_value_info("passed", "1", "1 when it hits none, else 0"),
                characteristic_value_info(
                    "clearance",
                    "m",
                    "smallest distance between car and cones; how deep it is in the worst one when negative",
                ),
                characteristic_value_info("entry_speed", "m/s", "speed at the first cones"),
                characteristic_value_info("exit_speed", "m/s", "speed at the last cones"),
                characteristic_value_info("steer_max", "rad", "largest road-wheel angle"),
                characteristic_value_info("yaw_rate_max", "rad/s", "largest yaw rate"),
                characteristic_value_info("lateral_acceleration_max", "m/s2", "largest lateral acceleration"),
                characteristic_value_info("sideslip_max", "rad", "largest sideslip angle"),
            ]
        }
    }

    fn reference_path(&self) -> Option<GroundPath> {
        let lanes = self.cone_lanes();
        let ends = lanes.iter().flat_map(|lane| lane.along.map(|x| [x + self.lead, lane.lane_center()]));
        Some(GroundPath::Gates(ends.collect()))
    }

    fn cones(&self) -> Vec<[f64; 2]> {
        self.cone_positions()
    }

    fn cone_hit_times(&self, log: &ManoeuvreLog) -> Vec<Option<f64>> {
        let first_touch =
            |cone| (0..log.t.len()).find(|k| self.distance_inside_car(log, *k, cone) > 0.0).map(|k| log.t[k]);
        self.cone_positions().into_iter().map(first_touch).collect()
    }

    fn check_parameters(&self, _: &CommonParameters) -> Result<(), ParameterError> {
        ParameterError::check_positive([
            ("width", self.width, "m"),
            ("front", self.front, "m"),
            ("rear", self.rear, "m"),
            ("lead", self.lead, "m"),
        ])
    }

    fn next_action(&self, common: &CommonParameters, stage: &mut TestStage, now: &CarState) -> DriverAction {
        let end = self.lead + self.cone_lanes()[2].along[1];
        // A car that stands or turns round never comes to the end.
        if now.x - self.rear > end + BEHIND || now.v_x < 1.0 || now.psi.cos() < 0.0 {
            return stage.end_test(now.time);
        }
        let off = self.course == LaneChangeCourse::ObstacleAvoidance && now.x + self.front > self.lead + OFF;
        DriverAction::follow_path(if off {
            DriveCommand::Force(0.0)
        } else {
            DriveCommand::Speed(common.entry_speed)
        })
    }

    fn characteristic_values(
        &self,
        _: &CommonParameters,
        log: &ManoeuvreLog,
    ) -> Result<CharacteristicValues, String> {
        let places = 0..log.t.len();
        let deepest = |cone: [f64; 2]| {
            places.clone().map(|k| self.distance_inside_car(log, k, cone)).fold(f64::NEG_INFINITY, f64::max)
        };
        let depths: Vec<f64> = self.cone_positions().into_iter().map(deepest).collect();
        let hit = depths.iter().filter(|depth| **depth > 0.0).count();
        let end = self.lead + self.cone_lanes()[2].along[1];
        let ahead = log.x.iter().map(|x| x + self.front).collect::<Vec<_>>();
        let speed = |way: f64| {
            log.level_crossing_time(&ahead, way, true, 0).and_then(|t| log.interpolate_at(&log.v_x, t))
        };
        let exit = speed(end).ok_or_else(|| {
            let last = log.t.len() - 1;
            format!("the car did not come to the end of the course: at {:.2} s it turned round or stood, {:.1} m behind its beginning", log.t[last], log.x[last] - self.lead)
        })?;
        Ok(CharacteristicValues::default()
            .with_number("cones_hit", hit as f64)
            .with_number("passed", f64::from(u8::from(hit == 0)))
            .with_number("clearance", -depths.iter().copied().fold(f64::NEG_INFINITY, f64::max))
            .with_number("entry_speed", speed(self.lead))
            .with_number("exit_speed", exit)
            .with_number("steer_max", max_abs(&log.steer))
            .with_number("yaw_rate_max", max_abs(&log.r))
            .with_number("lateral_acceleration_max", max_abs(&log.a_y))
            .with_number("sideslip_max", max_abs(&log.sideslip_angles())))
    }
}
