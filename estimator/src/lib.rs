//! Exports the extended-state Kalman filter as an FMU: the table of its variables, and one step.
#![forbid(unsafe_code)]
#![allow(non_snake_case, reason = "symbols as in vehicle dynamics")]

mod car;
mod filter;

use std::sync::Arc;

use car::{CarDynamics, OnTires};
use car_file::{CarParameter, implausible_parameters};
use filter::{CarStateEstimator, FilterOutput};
use fmu_export::{
    Info, Member, Model, ModelError, RealValue, Terminal, Variable, input, log, output, parameter,
    real_values, warn,
};
use nalgebra::Vector4;
use serde::{Deserialize, Serialize};
use tire::{BadCoefficient, MagicFormula, MfTire};
use tire_file::TireSpecification;
use vehicle::{Aerodynamics, NominalCar, TireCar, VehicleBody};

/// The filter between its inputs and its outputs.
#[derive(Clone, Serialize, Deserialize)]
struct EstimatorNode {
    estimator: CarStateEstimator,
    model: i32,
    body: VehicleBody,
    aero: Aerodynamics,
    brake_front_share: f64,
    /// Cornering stiffness of the front and the rear axle of the linear tires [N/rad].
    stiffness: [f64; 2],
    tires: [MagicFormula; 2],
    /// Tires of a file, which win over those of the plain formula.
    files: [TireSpecification; 2],
    /// What the parameters make, once it is asked for.
    #[serde(skip)]
    car: Option<Arc<dyn CarDynamics>>,
    start: [f64; 3],
    F_x: f64,
    delta: f64,
    measured: Vector4<f64>,
    output: FilterOutput,
}

impl Default for EstimatorNode {
    fn default() -> Self {
        EstimatorNode {
            estimator: CarStateEstimator::default(),
            model: 0,
            body: VehicleBody::default(),
            aero: Aerodynamics::default(),
            brake_front_share: 0.6,
            stiffness: [NominalCar::default().C_f, NominalCar::default().C_r],
            tires: [MagicFormula::default(); 2],
            files: <[TireSpecification; 2]>::default(),
            car: None,
            start: [15.0, 0.0, 0.0],
            F_x: 0.0,
            delta: 0.0,
            measured: Vector4::zeros(),
            output: FilterOutput::default(),
        }
    }
}

/// Value of `model` for tires with combined slip.
const MODEL_TIRES: i32 = 1;

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

impl EstimatorNode {
    /// The car that the parameters describe; made anew after a state was read.
    fn build_car(&mut self) -> Result<Arc<dyn CarDynamics>, String> {
        if let Some(car) = &self.car {
            return Ok(Arc::clone(car));
        }
        let car: Arc<dyn CarDynamics> = if self.model == MODEL_TIRES {
            let EstimatorNode { body, aero, brake_front_share, tires, .. } = *self;
            let car = TireCar { body, aero, brake_front_share, tires };
            if self.files.iter().all(|file| file.tir.is_empty()) {
                Arc::new(OnTires { car, dual: car.with_tires(tires.map(|it| it.cast())) })
            } else {
                let [front, rear] = &self.files;
                let [(front, told_f), (rear, told_r)] =
                    [front.load_tire("tire_f.tir")?, rear.load_tire("tire_r.tir")?];
                told_f.into_iter().chain(told_r).for_each(|message| message.send_to_log(log, warn));
                let tires = [front, rear];
                let [dual_f, dual_r] = tires.map(|tire| MfTire::new(tire.coefficients().cast()));
                let wrong = |bad: BadCoefficient| bad.to_string();
                let dual = car.with_tires([dual_f.map_err(wrong)?, dual_r.map_err(wrong)?]);
                Arc::new(OnTires { car: car.with_tires(tires), dual })
            }
        } else {
            let (VehicleBody { m, I_zz, l_f, l_r, .. }, [C_f, C_r]) = (self.body, self.stiffness);
            Arc::new(NominalCar { m, I_zz, l_f, l_r, C_f, C_r })
        };
        self.car = Some(Arc::clone(&car));
        Ok(car)
    }
}

impl Model for EstimatorNode {
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
        output("v_y", "m/s", "Speed to the left").depends_on(MEASURED).at(|n| &mut n.output.mean[1]),
        output("r", "rad/s", "Yaw rate").depends_on(MEASURED).at(|n| &mut n.output.mean[2]),
        output("xi_x", "N", "Forward disturbance force").depends_on(MEASURED).at(|n| &mut n.output.mean[3]),
        output("xi_y", "N", "Disturbance force to the left")
            .depends_on(MEASURED)
            .at(|n| &mut n.output.mean[4]),
        output("xi_psi", "N.m", "Disturbance yaw moment").depends_on(MEASURED).at(|n| &mut n.output.mean[5]),
        output("std.v_x", "m/s", "Standard deviation of v_x").depends_on(&[]).at(|n| &mut n.output.std[0]),
        output("std.v_y", "m/s", "Standard deviation of v_y").depends_on(&[]).at(|n| &mut n.output.std[1]),
        output("std.r", "rad/s", "Standard deviation of r").depends_on(&[]).at(|n| &mut n.output.std[2]),
        output("std.xi_x", "N", "Standard deviation of xi_x").depends_on(&[]).at(|n| &mut n.output.std[3]),
        output("std.xi_y", "N", "Standard deviation of xi_y").depends_on(&[]).at(|n| &mut n.output.std[4]),
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
        output("warning", "", "Whether nis_mean is outside its band: the model or its noises are wrong")
            .depends_on(MEASURED)
            .at_boolean(|n| &mut n.output.warning),
        output("nis", "1", "Normalised innovation squared, 4 on average for a consistent filter")
            .depends_on(MEASURED)
            .at(|n| &mut n.output.nis),
        parameter("body.m", "kg", "Nominal mass").min(1.0).at(|n| &mut n.body.m),
        parameter("body.I_zz", "kg.m2", "Nominal yaw inertia").min(1.0).at(|n| &mut n.body.I_zz),
        parameter("body.l_f", "m", "Nominal centre of gravity to front axle")
            .min(0.01)
            .at(|n| &mut n.body.l_f),
        parameter("body.l_r", "m", "Nominal centre of gravity to rear axle")
            .min(0.01)
            .at(|n| &mut n.body.l_r),
        parameter("nominal.C_f", "N/rad", "Nominal cornering stiffness of the front axle")
            .min(1.0)
            .at(|n| &mut n.stiffness[0]),
        parameter("nominal.C_r", "N/rad", "Nominal cornering stiffness of the rear axle")
            .min(1.0)
            .at(|n| &mut n.stiffness[1]),
        parameter("model", "", "Tires of the car: 0 linear, 1 with combined slip")
            .min(0.0)
            .max(1.0)
            .at_integer(|n| &mut n.model),
        parameter("body.h", "m", "Height of the centre of gravity in model 1").min(0.0).at(|n| &mut n.body.h),
        parameter("brake.front_share", "1", "Share of a braking force that the front axle takes")
            .min(0.0)
            .max(1.0)
            .at(|n| &mut n.brake_front_share),
        parameter("aero.rho", "kg/m3", "Density of the air").min(0.0).at(|n| &mut n.aero.rho),
        parameter("aero.area", "m2", "Frontal area").min(0.0).at(|n| &mut n.aero.area),
        parameter("aero.C_d", "1", "Drag coefficient").min(0.0).at(|n| &mut n.aero.C_d),
        parameter("aero.C_lf", "1", "Downforce coefficient of the front axle").at(|n| &mut n.aero.C_lf),
        parameter("aero.C_lr", "1", "Downforce coefficient of the rear axle").at(|n| &mut n.aero.C_lr),
        parameter("tire_f.B", "1/rad", "Front stiffness factor in model 1").at(|n| &mut n.tires[0].B),
        parameter("tire_f.C", "1", "Front shape factor in model 1").at(|n| &mut n.tires[0].C),
        parameter("tire_f.D", "1", "Front peak factor in model 1").at(|n| &mut n.tires[0].D),
        parameter("tire_f.E", "1", "Front curvature factor in model 1").at(|n| &mut n.tires[0].E),
        parameter("tire_f.S_h", "rad", "Front horizontal shift in model 1").at(|n| &mut n.tires[0].S_h),
        parameter("tire_f.S_v", "1", "Front vertical shift, in units of the load in model 1")
            .at(|n| &mut n.tires[0].S_v),
        parameter("tire_r.B", "1/rad", "Rear stiffness factor in model 1").at(|n| &mut n.tires[1].B),
        parameter("tire_r.C", "1", "Rear shape factor in model 1").at(|n| &mut n.tires[1].C),
        parameter("tire_r.D", "1", "Rear peak factor in model 1").at(|n| &mut n.tires[1].D),
        parameter("tire_r.E", "1", "Rear curvature factor in model 1").at(|n| &mut n.tires[1].E),
        parameter("tire_r.S_h", "rad", "Rear horizontal shift in model 1").at(|n| &mut n.tires[1].S_h),
        parameter("tire_r.S_v", "1", "Rear vertical shift, in units of the load in model 1")
            .at(|n| &mut n.tires[1].S_v),
        parameter(
            "tire_f.tir",
            "",
            "Front tires in model 1: text of a .tir file or its path; empty for the plain formula",
        )
        .at_string(|n| Arc::make_mut(&mut n.files[0].tir)),
        parameter("tire_f.LMUX", "1", "Front tires of a file: factor to the longitudinal friction")
            .min(0.0)
            .at(|n| &mut n.files[0].LMUX),
        parameter("tire_f.LMUY", "1", "Front tires of a file: factor to the lateral friction")
            .min(0.0)
            .at(|n| &mut n.files[0].LMUY),
        parameter("tire_f.LKX", "1", "Front tires of a file: factor to the slip stiffness")
            .min(0.0)
            .at(|n| &mut n.files[0].LKX),
        parameter("tire_f.LKY", "1", "Front tires of a file: factor to the cornering stiffness")
            .min(0.0)
            .at(|n| &mut n.files[0].LKY),
        parameter(
            "tire_r.tir",
            "",
            "Rear tires in model 1: text of a .tir file or its path; empty for the plain formula",
        )
        .at_string(|n| Arc::make_mut(&mut n.files[1].tir)),
        parameter("tire_r.LMUX", "1", "Rear tires of a file: factor to the longitudinal friction")
            .min(0.0)
            .at(|n| &mut n.files[1].LMUX),
        parameter("tire_r.LMUY", "1", "Rear tires of a file: factor to the lateral friction")
            .min(0.0)
            .at(|n| &mut n.files[1].LMUY),
        parameter("tire_r.LKX", "1", "Rear tires of a file: factor to the slip stiffness")
            .min(0.0)
            .at(|n| &mut n.files[1].LKX),
        parameter("tire_r.LKY", "1", "Rear tires of a file: factor to the cornering stiffness")
            .min(0.0)
            .at(|n| &mut n.files[1].LKY),
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
        self.car = None;
        self.build_car().map_err(ModelError::Error)?;
        self.output = self.estimator.start(self.start);
        Ok(())
    }

    fn review_parameters(&mut self) {
        let parameter =
            |it: &RealValue| CarParameter { name: it.name, value: it.value, is_given: it.is_given };
        let parameters: Vec<_> = real_values(self).iter().map(parameter).collect();
        implausible_parameters(&parameters).into_iter().for_each(warn);
    }

    fn step(&mut self, time: f64, step: f64) -> Result<(), ModelError> {
        let car = self.build_car().map_err(ModelError::Error)?;
        let commands = [self.F_x, self.delta];
        let stepped = self.estimator.step(&*car, commands, &self.measured, step);
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

fmu_export::export!(EstimatorNode);
