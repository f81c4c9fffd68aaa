//! One step of the driver: locates the car on the line, applies the steering law and the speed law, and counts laps.
#![allow(non_snake_case, reason = "symbols as in vehicle dynamics")]

use fmu_export::ModelError;
use serde::{Deserialize, Serialize};
use track::{
    HeadingAndSpeed, LineStation, PathSteeringLaw, RoadGeometry, SpeedCommand, SpeedLaw, TireLoadCondition,
    wrap_angle,
};
use vehicle::G;

use crate::plan::DrivePlan;

/// Slowest forward speed with which the rolling angle of the front wheels is computed [m/s].
const SLOWEST: f64 = 1.0;
/// Share of the lateral limit beyond which the driver still brakes and drives with what is left there.
const LATERAL_MOST: f64 = 0.95;

/// Motion of the car.
#[derive(Debug, Clone, Copy, Default, Serialize, Deserialize)]
pub struct CarMotion {
    /// Position of the centre of gravity [m].
    pub X: f64,
    /// Position of the centre of gravity [m].
    pub Y: f64,
    /// Heading [rad].
    pub psi: f64,
    /// Forward speed [m/s].
    pub v_x: f64,
    /// Speed to the left [m/s].
    pub v_y: f64,
    /// Yaw rate [rad/s].
    pub r: f64,
}

/// Commands to the car, and its station, lap and deviation on the line.
#[derive(Debug, Clone, Copy, Default, Serialize, Deserialize)]
pub struct DriverOutput {
    /// Road-wheel angle [rad].
    pub delta: f64,
    /// Driving force [N].
    pub F_x: f64,
    /// Station [m].
    pub s: f64,
    /// Way along the line since the beginning [m].
    pub distance: f64,
    /// Completed laps.
    pub lap: i32,
    /// Duration of the last completed lap [s].
    pub lap_time: f64,
    /// Deviation to the left of the line [m].
    pub lateral_deviation: f64,
    /// Heading less that of the line [rad].
    pub heading_error: f64,
    /// From the centre of gravity to the nearer edge of the track [m]; negative beyond it.
    pub edge_distance: f64,
    /// Wanted speed [m/s].
    pub v_ref: f64,
    /// Curvature, bank and grade of the line at the station.
    pub curvature: f64,
    /// Bank angle [rad].
    pub bank: f64,
    /// Grade [rad].
    pub grade: f64,
}

/// State of the driver between steps.
#[derive(Debug, Clone, Copy, Default, Serialize, Deserialize)]
pub struct DriverMemory {
    /// Last station [m].
    s: Option<f64>,
    /// Integral of the speed law [m/s²].
    integral: f64,
    /// When the lap that goes on began [s].
    lap_began: f64,
}

/// A step of the driver.
#[derive(Debug, Clone, Copy)]
pub struct TimeStep {
    /// Its end [s].
    pub end: f64,
    /// Its length [s].
    pub h: f64,
}

/// What the driver does with the pedals.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PedalMode {
    /// Follows the speed profile.
    Profile,
    /// Steers only; somebody else sets the speed.
    Steering,
}

/// The laws with their gains.
#[derive(Debug, Clone, Copy, Default, Serialize, Deserialize)]
pub struct ControlLaws {
    /// Steering.
    pub steering: PathSteeringLaw,
    /// Speed.
    pub speed: SpeedLaw,
}

impl ControlLaws {
    /// Locates the car on the line and writes station, deviations and road into `output`.
    pub fn locate_car(
        &self,
        plan: &DrivePlan,
        input: &CarMotion,
        memory: &mut DriverMemory,
        output: &mut DriverOutput,
    ) -> LineStation {
        let (line, point) = (&plan.line, [input.X, input.Y]);
        let station = match memory.s {
            Some(s) => line.follow_point(s, point),
            None => line.locate_point(point, Some(input.psi)),
        };
        let RoadGeometry { kappa, bank, grade } = line.road_at(station.s);
        let [left, right] = line.widths_at(station.s).unwrap_or([plan.settings.half_width; 2]);
        memory.s = Some(station.s);
        output.s = station.s;
        output.lateral_deviation = station.lateral;
        output.heading_error = wrap_angle(input.psi - station.psi);
        output.edge_distance = (left - station.lateral).min(right + station.lateral);
        output.v_ref = plan.profile.speed_at(station.s);
        (output.curvature, output.bank, output.grade) = (kappa, bank, grade);
        station
    }

    /// Does one step.
    ///
    /// # Errors
    /// When the motion is not finite.
    pub fn step_driver(
        &self,
        plan: &DrivePlan,
        mode: PedalMode,
        input: &CarMotion,
        step: TimeStep,
        memory: &mut DriverMemory,
        output: &mut DriverOutput,
    ) -> Result<(), ModelError> {
        let CarMotion { X, Y, psi, v_x, v_y, r } = *input;
        if ![X, Y, psi, v_x, v_y, r].iter().all(|it| it.is_finite()) {
            let message = format!("expected a finite motion of the car, found {input:?}");
            return Err(ModelError::Error(message));
        }
        let before = memory.s;
        let station = self.locate_car(plan, input, memory, output);
        let moved = before.map_or(0.0, |s| plan.line.station_change(s, station.s));
        count_laps(plan.line.length(), moved, step, memory, output);
        let road = RoadGeometry { kappa: station.kappa, bank: output.bank, grade: output.grade };
        output.delta = self.steering_angle(plan, &station, &road, input, step.h, output.delta);
        output.F_x = match mode {
            PedalMode::Profile => {
                self.longitudinal_force(plan, &station, &road, input, step.h, &mut memory.integral)
            }
            PedalMode::Steering => 0.0,
        };
        Ok(())
    }

    /// The steering law within the slip that the front tires can use, the largest angle and the fastest change.
    fn steering_angle(
        &self,
        plan: &DrivePlan,
        station: &LineStation,
        road: &RoadGeometry,
        input: &CarMotion,
        h: f64,
        before: f64,
    ) -> f64 {
        let (limit, v) = (&plan.settings.limit, input.v_x);
        let load = (road.normal_acceleration(v) + plan.ggv.limits_at_speed(v).downforce).max(0.1 * G) / G;
        let tire_load =
            TireLoadCondition { bank_acceleration: road.lateral_acceleration(0.0), load_factor: load };
        let motion = HeadingAndSpeed { psi: input.psi, v_x: v };
        let wanted = self.steering.steering_angle(&plan.handling, &plan.line, station, &motion, &tire_load);
        let l_f = plan.settings.car.body.l_f;
        let rolling = (input.v_y + l_f * input.r).atan2(v.max(SLOWEST));
        let usable = wanted.clamp(rolling - plan.front_slip, rolling + plan.front_slip);
        let change = limit.delta_rate * h;
        usable.clamp(-limit.delta, limit.delta).clamp(before - change, before + change)
    }

    /// The speed law: F_x = m (a + drag + g sin θ), within what tires and engine can do beside the lateral acceleration.
    fn longitudinal_force(
        &self,
        plan: &DrivePlan,
        station: &LineStation,
        road: &RoadGeometry,
        input: &CarMotion,
        h: f64,
        integral: &mut f64,
    ) -> f64 {
        let (m, v) = (plan.settings.car.body.m, input.v_x);
        let limits = plan.ggv.limits_at_speed(v);
        let turning = v * input.r + road.lateral_acceleration(0.0);
        let most = LATERAL_MOST * limits.lateral * limits.normal_load_factor(road);
        let lateral = road.lateral_acceleration(v).abs().max(turning.abs()).min(most);
        let range = plan.ggv.range_with_lateral_acceleration(v, road, lateral);
        let wanted = SpeedCommand {
            speed: plan.profile.speed_at(station.s),
            acceleration: plan.profile.acceleration_at(station.s),
        };
        let a = self.speed.commanded_acceleration(&wanted, v, range, integral, h);
        m * (a + limits.drag + G * road.grade.sin())
    }
}

/// Counts laps of this length [m] from where the drive began; the end of a lap lies between two steps.
fn count_laps(length: f64, moved: f64, step: TimeStep, memory: &mut DriverMemory, output: &mut DriverOutput) {
    let before = output.distance;
    output.distance += moved;
    let end = f64::from(output.lap + 1) * length;
    if before < end && output.distance >= end {
        let crossed = step.end - step.h * (output.distance - end) / moved;
        output.lap += 1;
        output.lap_time = crossed - memory.lap_began;
        memory.lap_began = crossed;
    }
}
