//! Exports a driver who follows a line as fast as the car can: the table of its variables, and one step.
#![forbid(unsafe_code)]
#![allow(non_snake_case, reason = "symbols as in vehicle dynamics")]

mod axle;
mod car;
mod control;
mod plan;

use std::sync::Arc;

use car_file::{CarParameter, implausible_parameters};
use control::{CarMotion, ControlLaws, DriverMemory, DriverOutput, PedalMode, TimeStep};
use fmu_export::{
    Info, Member, Model, ModelError, RealValue, Terminal, Variable, calculated_parameter, input, output,
    parameter, real_values, warn,
};
use plan::{DrivePlan, DriveSettings};
use serde::{Deserialize, Serialize};

/// The driver between its inputs and its outputs.
#[derive(Clone, Default, Serialize, Deserialize)]
struct DriverModel {
    mode: i32,
    settings: DriveSettings,
    laws: ControlLaws,
    input: CarMotion,
    output: DriverOutput,
    memory: DriverMemory,
    figures: PlanSummary,
    /// The track as it was read: a state goes on without its file.
    read: Option<DriveSettings>,
    /// Made of the above, and made again of it where a state was restored from bytes.
    #[serde(skip)]
    plan: Option<Arc<DrivePlan>>,
}

/// Figures of the line and of its speed profile.
#[derive(Clone, Copy, Default, Serialize, Deserialize)]
struct PlanSummary {
    length: f64,
    duration: f64,
    slowest: f64,
    fastest: f64,
    start: f64,
}

const SENSORS: &[Member] = &[
    Member::signal("X", "X"),
    Member::signal("Y", "Y"),
    Member::signal("psi", "psi"),
    Member::signal("v_x", "v_x"),
    Member::signal("v_y", "v_y"),
    Member::signal("r", "r"),
];

const ACTUATORS: &[Member] = &[Member::signal("F_x", "F_x"), Member::signal("delta", "delta")];

impl DriverModel {
    /// The prepared drive.
    fn prepared_plan(&mut self) -> Result<Arc<DrivePlan>, ModelError> {
        if let Some(plan) = &self.plan {
            return Ok(Arc::clone(plan));
        }
        let settings = self.read.as_ref().unwrap_or(&self.settings);
        let plan = Arc::new(DrivePlan::prepare(settings).map_err(ModelError::Error)?);
        self.plan = Some(Arc::clone(&plan));
        Ok(plan)
    }
}

impl Model for DriverModel {
    const INFO: Info =
        Info::new("driver", "Driver who follows a line as fast as the g-g-v diagram of the car allows", 0.01)
            .terminals(&[
                Terminal::bus("sensors", "Motion of the car", SENSORS),
                Terminal::bus("actuators", "Commands to the car", ACTUATORS),
            ]);

    const VARIABLES: &'static [Variable<Self>] = &[
        input("X", "m", "Position east").at(|d| &mut d.input.X),
        input("Y", "m", "Position north").at(|d| &mut d.input.Y),
        input("psi", "rad", "Heading, counter-clockwise from X").at(|d| &mut d.input.psi),
        input("v_x", "m/s", "Forward speed of the centre of gravity").at(|d| &mut d.input.v_x),
        input("v_y", "m/s", "Speed to the left of the centre of gravity").at(|d| &mut d.input.v_y),
        input("r", "rad/s", "Yaw rate").at(|d| &mut d.input.r),
        output("delta", "rad", "Road-wheel angle").at(|d| &mut d.output.delta),
        output("F_x", "N", "Driving force; braking when negative").at(|d| &mut d.output.F_x),
        output("s", "m", "Station on the line").at(|d| &mut d.output.s),
        output("distance", "m", "Way along the line since the beginning").at(|d| &mut d.output.distance),
        output("lap", "", "Completed laps, counted from where the drive began")
            .discrete()
            .at_integer(|d| &mut d.output.lap),
        output("lap_time", "s", "Duration of the last completed lap; 0 before")
            .at(|d| &mut d.output.lap_time),
        output("lateral_deviation", "m", "From the line to the car, positive to the left")
            .at(|d| &mut d.output.lateral_deviation),
        output("heading_error", "rad", "Heading of the car less that of the line")
            .at(|d| &mut d.output.heading_error),
        output("edge_distance", "m", "From the car to the nearer edge of the track; negative beyond it")
            .at(|d| &mut d.output.edge_distance),
        output("curvature", "1/m", "Curvature of the line").at(|d| &mut d.output.curvature),
        output("bank", "rad", "Bank of the road; positive where its left side is higher")
            .at(|d| &mut d.output.bank),
        output("grade", "rad", "Grade of the road; positive uphill").at(|d| &mut d.output.grade),
        output("v_ref", "m/s", "Speed of the profile").at(|d| &mut d.output.v_ref),
        parameter(
            "track.csv",
            "",
            "Table of the centre line, or the path of its file; without it a circle of 100 m",
        )
        .at_string(|d| d.settings.track.get_mut()),
        parameter("track.half_width", "m", "Half the width of a track whose table has no widths")
            .min(0.0)
            .at(|d| &mut d.settings.half_width),
        parameter("mode", "", "What the driver does: 0 steers and follows the speed profile, 1 steers only")
            .min(0.0)
            .max(1.0)
            .at_integer(|d| &mut d.mode),
        parameter("grip", "1", "Share of the grip that the speed profile uses")
            .min(0.05)
            .max(1.0)
            .at(|d| &mut d.settings.grip),
        parameter(
            "profile.share",
            "1",
            "Share of the speeds in the table of the track, such as that of a fastest lap, that the speed profile has; 0 plans it by grip",
        )
        .min(0.0)
        .max(1.5)
        .at(|d| &mut d.settings.speed_share),
        parameter("body.m", "kg", "Mass").min(1.0).at(|d| &mut d.settings.car.body.m),
        parameter("body.l_f", "m", "Centre of gravity to front axle")
            .min(0.01)
            .at(|d| &mut d.settings.car.body.l_f),
        parameter("body.l_r", "m", "Centre of gravity to rear axle")
            .min(0.01)
            .at(|d| &mut d.settings.car.body.l_r),
        parameter("body.h", "m", "Height of the centre of gravity")
            .min(0.0)
            .at(|d| &mut d.settings.car.body.h),
        parameter("brake.front_share", "1", "Share of a braking force that the front axle takes")
            .min(0.0)
            .max(1.0)
            .at(|d| &mut d.settings.car.brake_front_share),
        parameter("aero.rho", "kg/m3", "Density of the air").min(0.0).at(|d| &mut d.settings.car.aero.rho),
        parameter("aero.area", "m2", "Frontal area").min(0.0).at(|d| &mut d.settings.car.aero.area),
        parameter("aero.C_d", "1", "Drag coefficient").min(0.0).at(|d| &mut d.settings.car.aero.C_d),
        parameter("aero.C_lf", "1", "Downforce coefficient of the front axle")
            .at(|d| &mut d.settings.car.aero.C_lf),
        parameter("aero.C_lr", "1", "Downforce coefficient of the rear axle")
            .at(|d| &mut d.settings.car.aero.C_lr),
        parameter("tire_f.B", "1/rad", "Front stiffness factor").at(|d| &mut d.settings.car.plain[0].B),
        parameter("tire_f.C", "1", "Front shape factor").at(|d| &mut d.settings.car.plain[0].C),
        parameter("tire_f.D", "1", "Front peak factor").at(|d| &mut d.settings.car.plain[0].D),
        parameter("tire_f.E", "1", "Front curvature factor").at(|d| &mut d.settings.car.plain[0].E),
        parameter("tire_r.B", "1/rad", "Rear stiffness factor").at(|d| &mut d.settings.car.plain[1].B),
        parameter("tire_r.C", "1", "Rear shape factor").at(|d| &mut d.settings.car.plain[1].C),
        parameter("tire_r.D", "1", "Rear peak factor").at(|d| &mut d.settings.car.plain[1].D),
        parameter("tire_r.E", "1", "Rear curvature factor").at(|d| &mut d.settings.car.plain[1].E),
        parameter(
            "tire_f.tir",
            "",
            "Front tires: text of a .tir file or its path; empty for the plain formula",
        )
        .at_string(|d| Arc::make_mut(&mut d.settings.car.files[0].tir)),
        parameter("tire_f.LMUX", "1", "Front tires of a file: factor to the longitudinal friction")
            .at(|d| &mut d.settings.car.files[0].LMUX),
        parameter("tire_f.LMUY", "1", "Front tires of a file: factor to the lateral friction")
            .at(|d| &mut d.settings.car.files[0].LMUY),
        parameter(
            "tire_r.tir",
            "",
            "Rear tires: text of a .tir file or its path; empty for the plain formula",
        )
        .at_string(|d| Arc::make_mut(&mut d.settings.car.files[1].tir)),
        parameter("tire_r.LMUX", "1", "Rear tires of a file: factor to the longitudinal friction")
            .at(|d| &mut d.settings.car.files[1].LMUX),
        parameter("tire_r.LMUY", "1", "Rear tires of a file: factor to the lateral friction")
            .at(|d| &mut d.settings.car.files[1].LMUY),
        parameter("body.track_f", "m", "Track width of the front axle; 0 moves no load across")
            .min(0.0)
            .at(|d| &mut d.settings.car.tracks[0]),
        parameter("body.track_r", "m", "Track width of the rear axle; 0 moves no load across")
            .min(0.0)
            .at(|d| &mut d.settings.car.tracks[1]),
        parameter("roll.stiffness_f", "N.m/rad", "Roll stiffness of the front axle")
            .min(0.0)
            .at(|d| &mut d.settings.car.roll_stiffness[0]),
        parameter("roll.stiffness_r", "N.m/rad", "Roll stiffness of the rear axle")
            .min(0.0)
            .at(|d| &mut d.settings.car.roll_stiffness[1]),
        parameter("limit.v", "m/s", "Highest speed").min(0.1).at(|d| &mut d.settings.limit.v),
        parameter("limit.F_x_min", "N", "Strongest braking").max(0.0).at(|d| &mut d.settings.limit.F_x_min),
        parameter("limit.F_x_max", "N", "Strongest driving").min(0.0).at(|d| &mut d.settings.limit.F_x_max),
        parameter("drive.power_max", "W", "Power of the engine at the wheels")
            .min(0.0)
            .at(|d| &mut d.settings.limit.power),
        parameter("limit.delta", "rad", "Largest road-wheel angle")
            .min(0.01)
            .at(|d| &mut d.settings.limit.delta),
        parameter("limit.delta_rate", "rad/s", "Fastest change of the road-wheel angle")
            .min(0.0)
            .at(|d| &mut d.settings.limit.delta_rate),
        parameter("steering.gain", "rad/m", "Deviation ahead to steering angle")
            .tunable()
            .at(|d| &mut d.laws.steering.gain),
        parameter("steering.lookahead", "m", "Distance of the point ahead")
            .min(0.0)
            .tunable()
            .at(|d| &mut d.laws.steering.lookahead),
        parameter("steering.preview", "s", "How far ahead the curvature of the feed-forward is read")
            .min(0.0)
            .tunable()
            .at(|d| &mut d.laws.steering.preview),
        parameter("speed.gain", "1/s", "Speed error to acceleration")
            .tunable()
            .at(|d| &mut d.laws.speed.gain),
        parameter("speed.integral_gain", "1/s2", "Integral of the speed error to acceleration")
            .tunable()
            .at(|d| &mut d.laws.speed.integral_gain),
        calculated_parameter("track.length", "m", "Length of the line").at(|d| &mut d.figures.length),
        calculated_parameter("profile.lap_time", "s", "Time of the speed profile for the whole line")
            .at(|d| &mut d.figures.duration),
        calculated_parameter("profile.v_min", "m/s", "Lowest speed of the profile")
            .at(|d| &mut d.figures.slowest),
        calculated_parameter("profile.v_max", "m/s", "Highest speed of the profile")
            .at(|d| &mut d.figures.fastest),
        calculated_parameter("profile.v_start", "m/s", "Speed of the profile where the line begins")
            .at(|d| &mut d.figures.start),
    ];

    fn initialise(&mut self) -> Result<(), ModelError> {
        let is_current = |plan: &&Arc<DrivePlan>| plan.source_settings == self.settings;
        if self.plan.as_ref().filter(is_current).is_none() {
            (self.plan, self.read) = (None, None);
        }
        let plan = self.prepared_plan()?;
        self.read = Some(plan.settings.clone());
        let [slowest, fastest] = plan.profile.speed_range();
        self.figures = PlanSummary {
            length: plan.line.length(),
            duration: plan.profile.travel_time(),
            slowest,
            fastest,
            start: plan.profile.speed_at(0.0),
        };
        (self.output, self.memory) = (DriverOutput::default(), DriverMemory::default());
        self.laws.locate_car(&plan, &self.input, &mut self.memory, &mut self.output);
        Ok(())
    }

    fn review_parameters(&mut self) {
        let parameter =
            |it: &RealValue| CarParameter { name: it.name, value: it.value, is_given: it.is_given };
        let parameters: Vec<_> = real_values(self).iter().map(parameter).collect();
        implausible_parameters(&parameters).into_iter().for_each(warn);
    }

    fn step(&mut self, time: f64, step: f64) -> Result<(), ModelError> {
        let plan = self.prepared_plan()?;
        let mode = if self.mode == 1 { PedalMode::Steering } else { PedalMode::Profile };
        let end = time + step;
        let step = TimeStep { end, h: step };
        self.laws.step_driver(&plan, mode, &self.input, step, &mut self.memory, &mut self.output)
    }
}

fmu_export::export!(DriverModel);

#[cfg(test)]
mod tests;
