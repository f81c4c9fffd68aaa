//! Exports the speed and yaw controller as an FMU: the table of its variables, and one step.
#![forbid(unsafe_code)]
#![allow(non_snake_case, reason = "symbols as in vehicle dynamics")]

mod adrc;

use adrc::{AdrcController, CarCommand, ControlMode, ControlReference, ControllerMemory, StateEstimate};
use car_file::{CarParameter, implausible_parameters};
use fmu_export::{
    Info, Member, Model, ModelError, RealValue, Terminal, Variable, input, output, parameter, real_values,
    warn,
};
use serde::{Deserialize, Serialize};

/// The controller between its inputs and its outputs.
#[derive(Clone, Default, Serialize, Deserialize)]
struct ControllerModel {
    mode: i32,
    controller: AdrcController,
    reference: ControlReference,
    estimate: StateEstimate,
    driver: CarCommand,
    command: CarCommand,
    memory: ControllerMemory,
}

const ACTUATORS: &[Member] = &[Member::signal("F_x", "F_x"), Member::signal("delta", "delta")];

const ESTIMATES: &[Member] = &[
    Member::signal("v_x", "v_x"),
    Member::signal("v_y", "v_y"),
    Member::signal("r", "r"),
    Member::signal("xi_x", "xi_x"),
    Member::signal("xi_y", "xi_y"),
    Member::signal("xi_psi", "xi_psi"),
];

impl Model for ControllerModel {
    const INFO: Info =
        Info::new("controller", "Speed and yaw control with rejection of the estimated disturbances", 0.01)
            .terminals(&[
                Terminal::bus("estimates", "State of the car and disturbances", ESTIMATES),
                Terminal::bus("sensors", "Motion of the car", &[Member::signal("psi", "psi")]),
                Terminal::bus("actuators", "Commands to the car", ACTUATORS),
            ]);

    const VARIABLES: &'static [Variable<Self>] = &[
        input("v_ref", "m/s", "Wanted forward speed").at(|n| &mut n.reference.v),
        input("psi_ref", "rad", "Wanted heading, followed in mode 1").at(|n| &mut n.reference.psi),
        input("r_ref", "rad/s", "Wanted yaw rate; in mode 1 the heading error adds to it")
            .at(|n| &mut n.reference.r),
        input("v_x", "m/s", "Estimated forward speed").at(|n| &mut n.estimate.v_x),
        input("v_y", "m/s", "Estimated speed to the left").at(|n| &mut n.estimate.v_y),
        input("r", "rad/s", "Estimated yaw rate").at(|n| &mut n.estimate.r),
        input("xi_x", "N", "Estimated forward disturbance force").at(|n| &mut n.estimate.xi_x),
        input("xi_y", "N", "Estimated disturbance force to the left").at(|n| &mut n.estimate.xi_y),
        input("xi_psi", "N.m", "Estimated disturbance yaw moment").at(|n| &mut n.estimate.xi_psi),
        input("psi", "rad", "Heading").at(|n| &mut n.estimate.psi),
        output("F_x", "N", "Driving force").at(|n| &mut n.command.F_x),
        output("delta", "rad", "Road-wheel angle").at(|n| &mut n.command.delta),
        output("r_cmd", "rad/s", "Yaw rate that the steering follows").at(|n| &mut n.command.r),
        input("mode", "", "What the commands follow: 0 yaw rate, 1 heading, 2 driver")
            .min(0.0)
            .max(2.0)
            .optional()
            .at_integer(|n| &mut n.mode),
        input("driver.F_x", "N", "Driving force in mode 2").optional().at(|n| &mut n.driver.F_x),
        input("driver.delta", "rad", "Road-wheel angle in mode 2").optional().at(|n| &mut n.driver.delta),
        parameter("body.m", "kg", "Nominal mass").min(1.0).at(|n| &mut n.controller.car.m),
        parameter("body.I_zz", "kg.m2", "Nominal yaw inertia").min(1.0).at(|n| &mut n.controller.car.I_zz),
        parameter("body.l_f", "m", "Nominal centre of gravity to front axle")
            .min(0.01)
            .at(|n| &mut n.controller.car.l_f),
        parameter("body.l_r", "m", "Nominal centre of gravity to rear axle")
            .min(0.01)
            .at(|n| &mut n.controller.car.l_r),
        parameter("nominal.C_f", "N/rad", "Nominal cornering stiffness of the front axle")
            .min(1.0)
            .at(|n| &mut n.controller.car.C_f),
        parameter("nominal.C_r", "N/rad", "Nominal cornering stiffness of the rear axle")
            .min(1.0)
            .at(|n| &mut n.controller.car.C_r),
        parameter("speed.gain", "1/s", "Speed error to acceleration").tunable().at(|n| &mut n.controller.k_v),
        parameter("yaw.gain", "1/s", "Yaw-rate error to yaw acceleration")
            .tunable()
            .at(|n| &mut n.controller.k_r),
        parameter("heading.gain", "1/s", "Heading error to yaw rate")
            .tunable()
            .at(|n| &mut n.controller.k_psi),
        parameter("limit.F_x_min", "N", "Strongest braking").at(|n| &mut n.controller.limit.F_x_min),
        parameter("limit.F_x_max", "N", "Strongest driving").at(|n| &mut n.controller.limit.F_x_max),
        parameter("limit.delta", "rad", "Largest road-wheel angle")
            .min(0.0)
            .at(|n| &mut n.controller.limit.delta),
        parameter("limit.alpha_f", "rad", "Largest front slip angle")
            .min(0.0)
            .at(|n| &mut n.controller.limit.alpha_f),
        parameter("limit.r", "rad/s", "Largest yaw rate asked for in mode 1")
            .min(0.0)
            .at(|n| &mut n.controller.limit.r),
        parameter("limit.r_rate", "rad/s2", "Fastest change of the yaw rate that the steering follows")
            .min(0.0)
            .at(|n| &mut n.controller.limit.r_rate),
        parameter("limit.delta_rate", "rad/s", "Fastest change of the road-wheel angle")
            .min(0.0)
            .at(|n| &mut n.controller.limit.delta_rate),
        parameter("drive.power_max", "W", "Largest driving power")
            .min(0.0)
            .at(|n| &mut n.controller.limit.power),
        parameter("limit.a_y", "m/s2", "Largest lateral acceleration asked for")
            .min(0.0)
            .at(|n| &mut n.controller.limit.a_y),
        parameter(
            "limit.anti_windup",
            "",
            "Whether the yaw rate that the steering follows stays within its reach",
        )
        .at_boolean(|n| &mut n.controller.limit.anti_windup),
        parameter("transfer.time", "s", "Time in which a change of mode takes effect")
            .min(0.0)
            .tunable()
            .at(|n| &mut n.controller.transfer_time),
    ];

    fn initialise(&mut self) -> Result<(), ModelError> {
        (self.command, self.memory) = (CarCommand::default(), ControllerMemory::default());
        let limit = &self.controller.limit;
        if limit.F_x_min <= limit.F_x_max {
            return Ok(());
        }
        Err(ModelError::Error(format!(
            "limit.F_x_min = {} N is above limit.F_x_max = {} N",
            limit.F_x_min, limit.F_x_max
        )))
    }

    fn review_parameters(&mut self) {
        let parameter =
            |it: &RealValue| CarParameter { name: it.name, value: it.value, is_given: it.is_given };
        let parameters: Vec<_> = real_values(self).iter().map(parameter).collect();
        implausible_parameters(&parameters).into_iter().for_each(warn);
    }

    fn step(&mut self, _time: f64, step: f64) -> Result<(), ModelError> {
        let mode = match self.mode {
            0 => ControlMode::YawRate,
            1 => ControlMode::Heading,
            2 => ControlMode::Manual,
            other => {
                return Err(ModelError::Error(format!(
                    "mode: expected 0 (yaw rate), 1 (heading) or 2 (driver), found {other}"
                )));
            }
        };
        self.command = self.controller.next_command(
            mode,
            &self.reference,
            &self.estimate,
            &self.driver,
            &mut self.memory,
            step,
        );
        Ok(())
    }
}

fmu_export::export!(ControllerModel);
