//! Exports the extended-state Kalman filter as an FMU: the table of its variables, and one step.
#![forbid(unsafe_code)]
#![allow(non_snake_case, reason = "symbols as in vehicle dynamics")]

mod filter;

use filter::{Estimator, Output};
use fmu_export::{Info, Member, Model, ModelError, Terminal, Variable, input, output, parameter};
use nalgebra::Vector4;
use serde::{Deserialize, Serialize};

/// The filter between its inputs and its outputs.
#[derive(Clone, Serialize, Deserialize)]
struct Node {
    estimator: Estimator,
    start: [f64; 3],
    F_x: f64,
    delta: f64,
    measured: Vector4<f64>,
    output: Output,
}

impl Default for Node {
    fn default() -> Self {
        Node {
            estimator: Estimator::default(),
            start: [15.0, 0.0, 0.0],
            F_x: 0.0,
            delta: 0.0,
            measured: Vector4::zeros(),
            output: Output::default(),
        }
    }
}

/// The measurements act on the estimate at the end of a step. `F_x` and `delta` act during it, so the
/// values from its start are the right ones.
const MEASURED: &[&str] = &["v_x_meas", "v_y_meas", "r_meas", "a_y_meas"];

const ACTUATORS: &[Member] = &[Member::signal("F_x", "F_x"), Member::signal("delta", "delta")];

const SENSORS: &[Member] = &[
    Member::signal("v_x", "v_x_meas"),
    Member::signal("v_y", "v_y_meas"),
    Member::signal("r", "r_meas"),
    Member::signal("a_y", "a_y_meas"),
];

const ESTIMATES: &[Member] = &[
    Member::signal("v_x", "v_x"),
    Member::signal("v_y", "v_y"),
    Member::signal("r", "r"),
    Member::signal("xi_x", "xi_x"),
    Member::signal("xi_y", "xi_y"),
    Member::signal("xi_psi", "xi_psi"),
];

impl Model for Node {
    const INFO: Info = Info::new(
        "estimator",
        "Extended-state Kalman filter of a single-track car with three disturbances",
        0.01,
    )
    .terminals(&[
        Terminal::bus("actuators", "Commands to the car", ACTUATORS),
        Terminal::bus("sensors", "Measured motion of the car", SENSORS),
        Terminal::bus("estimates", "State of the car and disturbances", ESTIMATES),
    ]);

    const VARIABLES: &'static [Variable<Self>] = &[
        input("F_x", "N", "Driving force during the step").at(|n| &mut n.F_x),
        input("delta", "rad", "Road-wheel angle during the step").at(|n| &mut n.delta),
        input("v_x_meas", "m/s", "Measured forward speed").at(|n| &mut n.measured[0]),
        input("v_y_meas", "m/s", "Measured speed to the left").at(|n| &mut n.measured[1]),
        input("r_meas", "rad/s", "Measured yaw rate").at(|n| &mut n.measured[2]),
        input("a_y_meas", "m/s2", "Measured acceleration to the left").at(|n| &mut n.measured[3]),
        output("v_x", "m/s", "Forward speed").depends_on(MEASURED).at(|n| &mut n.output.mean[0]),
        output("v_y", "m/s", "Speed to the left")
            .depends_on(MEASURED)
            .at(|n| &mut n.output.mean[1]),
        output("r", "rad/s", "Yaw rate").depends_on(MEASURED).at(|n| &mut n.output.mean[2]),
        output("xi_x", "N", "Forward disturbance force")
            .depends_on(MEASURED)
            .at(|n| &mut n.output.mean[3]),
        output("xi_y", "N", "Disturbance force to the left")
            .depends_on(MEASURED)
            .at(|n| &mut n.output.mean[4]),
        output("xi_psi", "N.m", "Disturbance yaw moment")
            .depends_on(MEASURED)
            .at(|n| &mut n.output.mean[5]),
        output("std.v_x", "m/s", "Standard deviation of v_x")
            .depends_on(&[])
            .at(|n| &mut n.output.std[0]),
        output("std.v_y", "m/s", "Standard deviation of v_y")
            .depends_on(&[])
            .at(|n| &mut n.output.std[1]),
        output("std.r", "rad/s", "Standard deviation of r")
            .depends_on(&[])
            .at(|n| &mut n.output.std[2]),
        output("std.xi_x", "N", "Standard deviation of xi_x")
            .depends_on(&[])
            .at(|n| &mut n.output.std[3]),
        output("std.xi_y", "N", "Standard deviation of xi_y")
            .depends_on(&[])
            .at(|n| &mut n.output.std[4]),
        output("std.xi_psi", "N.m", "Standard deviation of xi_psi")
            .depends_on(&[])
            .at(|n| &mut n.output.std[5]),
        output("innovation.v_x", "m/s", "Measured minus predicted v_x")
            .depends_on(MEASURED)
            .at(|n| &mut n.output.innovation[0]),
        output("innovation.v_y", "m/s", "Measured minus predicted v_y")
            .depends_on(MEASURED)
            .at(|n| &mut n.output.innovation[1]),
        output("innovation.r", "rad/s", "Measured minus predicted r")
            .depends_on(MEASURED)
            .at(|n| &mut n.output.innovation[2]),
        output("innovation.a_y", "m/s2", "Measured minus predicted a_y")
            .depends_on(MEASURED)
            .at(|n| &mut n.output.innovation[3]),
        output("nis_mean", "1", "Mean of nis over the time warning.time")
            .depends_on(MEASURED)
            .at(|n| &mut n.output.judged.mean),
        output("nis_low", "1", "Lower end of the band of nis_mean for a consistent filter")
            .depends_on(&[])
            .at(|n| &mut n.output.judged.low),
        output("nis_high", "1", "Upper end of the band of nis_mean for a consistent filter")
            .depends_on(&[])
            .at(|n| &mut n.output.judged.high),
        output(
            "warning",
            "",
            "Whether nis_mean is outside its band: the model or its noises are wrong",
        )
        .depends_on(MEASURED)
        .at_boolean(|n| &mut n.output.warning),
        output("nis", "1", "Normalised innovation squared, 4 on average for a consistent filter")
            .depends_on(MEASURED)
            .at(|n| &mut n.output.nis),
        parameter("body.m", "kg", "Nominal mass").min(1.0).at(|n| &mut n.estimator.car.m),
        parameter("body.I_zz", "kg.m2", "Nominal yaw inertia")
            .min(1.0)
            .at(|n| &mut n.estimator.car.I_zz),
        parameter("body.l_f", "m", "Nominal centre of gravity to front axle")
            .min(0.01)
            .at(|n| &mut n.estimator.car.l_f),
        parameter("body.l_r", "m", "Nominal centre of gravity to rear axle")
            .min(0.01)
            .at(|n| &mut n.estimator.car.l_r),
        parameter("nominal.C_f", "N/rad", "Nominal cornering stiffness of the front axle")
            .min(1.0)
            .at(|n| &mut n.estimator.car.C_f),
        parameter("nominal.C_r", "N/rad", "Nominal cornering stiffness of the rear axle")
            .min(1.0)
            .at(|n| &mut n.estimator.car.C_r),
        parameter("sensor.v_x", "m/s", "Standard deviation of the noise of v_x_meas")
            .min(1e-9)
            .at(|n| &mut n.estimator.sensor[0]),
        parameter("sensor.v_y", "m/s", "Standard deviation of the noise of v_y_meas")
            .min(1e-9)
            .at(|n| &mut n.estimator.sensor[1]),
        parameter("sensor.r", "rad/s", "Standard deviation of the noise of r_meas")
            .min(1e-9)
            .at(|n| &mut n.estimator.sensor[2]),
        parameter("sensor.a_y", "m/s2", "Standard deviation of the noise of a_y_meas")
            .min(1e-9)
            .at(|n| &mut n.estimator.sensor[3]),
        parameter("process.v_x", "m2/s3", "Growth of the variance of v_x")
            .min(0.0)
            .at(|n| &mut n.estimator.process[0]),
        parameter("process.v_y", "m2/s3", "Growth of the variance of v_y")
            .min(0.0)
            .at(|n| &mut n.estimator.process[1]),
        parameter("process.r", "rad2/s3", "Growth of the variance of r")
            .min(0.0)
            .at(|n| &mut n.estimator.process[2]),
        parameter("process.xi_x", "N2/s", "Growth of the variance of xi_x")
            .min(0.0)
            .at(|n| &mut n.estimator.process[3]),
        parameter("process.xi_y", "N2/s", "Growth of the variance of xi_y")
            .min(0.0)
            .at(|n| &mut n.estimator.process[4]),
        parameter("process.xi_psi", "N2.m2/s", "Growth of the variance of xi_psi")
            .min(0.0)
            .at(|n| &mut n.estimator.process[5]),
        parameter("start.v_x", "m/s", "Initial forward speed").at(|n| &mut n.start[0]),
        parameter("start.v_y", "m/s", "Initial speed to the left").at(|n| &mut n.start[1]),
        parameter("start.r", "rad/s", "Initial yaw rate").at(|n| &mut n.start[2]),
        parameter("start.std_xi", "N", "Initial standard deviation of the disturbances")
            .min(0.0)
            .at(|n| &mut n.estimator.start_std_xi),
        parameter("start.at_measurement", "", "Whether the first measurement replaces start.*")
            .at_boolean(|n| &mut n.estimator.start_at_measurement),
        parameter("warning.time", "s", "Time that nis_mean remembers")
            .min(1e-3)
            .at(|n| &mut n.estimator.warning_time),
        parameter("warning.deviations", "1", "Width of the band in standard deviations")
            .min(0.1)
            .at(|n| &mut n.estimator.warning_deviations),
    ];

    fn initialise(&mut self) -> Result<(), ModelError> {
        self.output = self.estimator.start(self.start);
        Ok(())
    }

    fn step(&mut self, time: f64, step: f64) -> Result<(), ModelError> {
        let stepped = self.estimator.step(self.F_x, self.delta, &self.measured, step);
        self.output = stepped.map_err(|error| {
            ModelError::Error(format!(
                "at {} s with measurements {:?}: {error}",
                time + step,
                self.measured.as_slice()
            ))
        })?;
        Ok(())
    }
}

fmu_export::export!(Node);
