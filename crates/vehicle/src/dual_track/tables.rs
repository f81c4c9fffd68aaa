//! Refuses tables of no car, and tells which of them a drive leaves.
#![allow(non_snake_case, reason = "forces are written as in the equations")]

use super::driveline::EngineTorque;
use super::parameters::{BadParameter, DualTrackParameters, ParameterBound, check_parameter};
use super::state::{DualTrackInput, DualTrackState};
use super::{DualTrack, FRONT, PerAxle, PerWheel, REAR, Suspension, axle_of};
use crate::table::PiecewiseLinearCurve;

/// Number of quantities over which tables are given.
pub const QUANTITIES: usize = 7;

/// Largest toe and camber [rad]: beyond it is a table in degrees without its unit.
const ANGLE_MAX: f64 = 0.5;

/// Steepest toe and camber over travel [rad/m]: beyond it is a table in millimetres without their unit.
const STEEPEST: f64 = 20.0;

/// Fastest pole that an engine gives to its wheels [1/s]: one that is faster takes sub-steps of less than 0.1 ms.
const POLE_MAX: f64 = 2e4;

/// A quantity that is outside of a table, which is held at its end.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TableExcess {
    /// Name of the table, as in the FMU.
    pub table: &'static str,
    /// What the table is over, for a message.
    pub quantity: &'static str,
    /// Its unit.
    pub unit: &'static str,
    /// Its value.
    pub value: f64,
    /// First and last point of the table.
    pub ends: [f64; 2],
}

const KINEMATICS: PerAxle<&str> = ["suspension.kinematics_f", "suspension.kinematics_r"];
const CAMBER: PerAxle<&str> = ["camber of the front wheels", "camber of the rear wheels"];
const TOE: PerAxle<&str> = ["toe of the front wheels", "toe of the rear wheels"];
const TRAVEL: PerAxle<&str> = ["travel of a front wheel", "travel of a rear wheel"];
const HEIGHT: PerAxle<&str> = ["front ride height", "rear ride height"];

impl DualTrackParameters {
    /// Asserts that the tables are those of a car.
    pub(super) fn check_tables(&self) -> Result<(), BadParameter> {
        for axle in [FRONT, REAR] {
            let steer = &self.steering;
            for (name, curve) in [(TOE, &steer.toe), (CAMBER, &steer.camber)] {
                check_angle_curve(name[axle], &curve[axle])?;
            }
        }
        let map = self.aero.map.iter().flat_map(|map| map.values());
        for &[C_d, C_lf, C_lr] in map.filter_map(|values| values.first_chunk::<3>()) {
            let drag = ParameterBound::NotNegative;
            check_parameter("C_d in aero.map", C_d, drag.is_met_by(C_d), || drag.describe())?;
            for (name, value) in [("C_lf in aero.map", C_lf), ("C_lr in aero.map", C_lr)] {
                let bound = ParameterBound::Within(100.0);
                check_parameter(name, value, bound.is_met_by(value), || bound.describe())?;
            }
        }
        for &torque in self.brakes.map.iter().flatten().flat_map(|axle| axle.values()) {
            let bound = ParameterBound::NotNegative;
            check_parameter("torque in brake.map", torque, bound.is_met_by(torque), || bound.describe())?;
        }
        let pole = self.drive.fastest_pole(self.rims.I_yy);
        let slope = 2.0 * self.rims.I_yy * POLE_MAX / (self.drive.ratio * self.drive.ratio);
        check_parameter("pole of the wheels by drive.map [1/s]", pole, pole <= POLE_MAX, || {
            format!(
                "at most {POLE_MAX}: a torque that changes by at most {slope:.3} N.m per rad/s of the engine"
            )
        })
    }
}

fn check_angle_curve(name: &'static str, curve: &PiecewiseLinearCurve) -> Result<(), BadParameter> {
    let bound = ParameterBound::Within(ANGLE_MAX);
    for &value in curve.values() {
        check_parameter(name, value, bound.is_met_by(value), || format!("{} [rad]", bound.describe()))?;
    }
    let steepest = curve.steepest_slope();
    check_parameter(name, steepest, steepest <= STEEPEST, || {
        format!("a slope over travel of at most {STEEPEST} rad/m")
    })
}

impl<S> DualTrack<S> {
    /// Way of each wheel towards the body [m].
    pub fn wheel_travel(&self, state: &DualTrackState) -> PerWheel<f64> {
        self.parameters.suspension.wheel_travel(&self.parameters.body, &state.attitude)
    }

    /// Height of the underbody at each axle [m].
    pub fn ride_heights(&self, state: &DualTrackState) -> PerAxle<f64> {
        let p = &self.parameters;
        let compressed = |axle: usize| Suspension::spring_compression(&p.body, axle, &state.attitude);
        p.aero.ride_heights([compressed(FRONT), compressed(REAR)])
    }

    /// Angle of each wheel to the body [rad], positive to the left.
    pub fn wheel_angles(&self, state: &DualTrackState, input: &DualTrackInput) -> PerWheel<f64> {
        self.wheel_angle_sin_cos(state, input, &self.wheel_travel(state)).map(|(sin, cos)| sin.atan2(cos))
    }

    /// The tables that are left, each quantity at its own place.
    pub fn table_range_excesses(
        &self,
        state: &DualTrackState,
        input: &DualTrackInput,
    ) -> [Option<TableExcess>; QUANTITIES] {
        let p = &self.parameters;
        let travel = self.wheel_travel(state);
        let [front, rear] = [FRONT, REAR].map(|axle| self.travel_table_excess(&travel, axle));
        let heights = self.ride_heights(state);
        let aero = p.aero.map.as_ref().map_or([None; 2], |map| map.argument_ranges());
        let height = |axle: usize| {
            let excess = TableExcess { table: "aero.map", quantity: HEIGHT[axle], ..LENGTH };
            table_range_excess(heights[axle], aero[axle], excess)
        };
        let brakes = p.brakes.map.as_ref().and_then(|map| map[FRONT].argument_range());
        let brake = TableExcess { table: "brake.map", quantity: "brake pedal", ..SHARE };
        let (revs, pedal) = match &p.drive.engine {
            None => (None, None),
            Some(EngineTorque::FullLoad(curve)) => (curve.argument_range(), None),
            Some(EngineTorque::Pedal(map)) => map.argument_ranges().into(),
        };
        let omega = state.wheels.map(|wheel| wheel.omega);
        let speed = p.drive.driven_wheel_speed(omega).abs() * p.drive.ratio;
        let engine = TableExcess { table: "drive.map", quantity: "engine speed", ..SPEED };
        let drive = TableExcess { table: "drive.map", quantity: "drive pedal", ..SHARE };
        [
            front,
            rear,
            height(FRONT),
            height(REAR),
            table_range_excess(p.brakes.pedal_position(input.F_x), brakes, brake),
            table_range_excess(speed, revs, engine),
            table_range_excess(p.drive.pedal_position(input.F_x), pedal, drive),
        ]
    }

    fn travel_table_excess(&self, travel: &PerWheel<f64>, axle: usize) -> Option<TableExcess> {
        let steer = &self.parameters.steering;
        let excess = TableExcess { table: KINEMATICS[axle], quantity: TRAVEL[axle], ..LENGTH };
        let wheels = (0..4).filter(|wheel| axle_of(*wheel) == axle).map(|wheel| travel[wheel]);
        let curves = || [&steer.toe[axle], &steer.camber[axle]];
        let mut all = wheels
            .flat_map(|way| curves().map(|curve| table_range_excess(way, curve.argument_range(), excess)));
        all.find_map(|it| it)
    }
}

const LENGTH: TableExcess = TableExcess { table: "", quantity: "", unit: "m", value: 0.0, ends: [0.0; 2] };
const SHARE: TableExcess = TableExcess { unit: "1", ..LENGTH };
const SPEED: TableExcess = TableExcess { unit: "rad/s", ..LENGTH };

/// A value that is beyond the ends of a table.
fn table_range_excess(value: f64, ends: Option<[f64; 2]>, excess: TableExcess) -> Option<TableExcess> {
    let ends = ends?;
    (value < ends[0] || value > ends[1]).then_some(TableExcess { value, ends, ..excess })
}
