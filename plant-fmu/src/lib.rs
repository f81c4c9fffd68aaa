//! Exports the single-track car with its tires as an FMU: the table of its variables, and one step.
#![forbid(unsafe_code)]
#![allow(non_snake_case, reason = "symbols as in vehicle dynamics")]

use fmu_export::{
    Derivatives, Equations, Info, Member, Model, ModelError, Number, Terminal, Variable, input,
    output, parameter,
};
use serde::{Deserialize, Serialize};
use vehicle::{Input, Motion, State, Vehicle};

/// Largest sub-step of the integrator [s], the start value of its parameter.
const SUBSTEP: f64 = 0.002;

/// The car, where it starts, and where it is.
#[derive(Clone, Serialize, Deserialize)]
struct Plant {
    vehicle: Vehicle,
    substep: f64,
    start: State,
    state: State,
    input: Input,
    motion: Motion,
}

impl Default for Plant {
    fn default() -> Self {
        let (vehicle, start) = (Vehicle::default(), State { v_x: 15.0, ..State::default() });
        let input = Input::default();
        let motion = vehicle.evaluate(&start, &input);
        Plant { vehicle, substep: SUBSTEP, start, state: start, input, motion }
    }
}

/// Forces and accelerations follow both inputs at once: steering turns the tire, and the driving force
/// moves load between the axles.
const BOTH: &[&str] = &["F_x", "delta"];

const ACTUATORS: &[Member] = &[Member::signal("F_x", "F_x"), Member::signal("delta", "delta")];

const SENSORS: &[Member] = &[
    Member::signal("X", "X"),
    Member::signal("Y", "Y"),
    Member::signal("psi", "psi"),
    Member::signal("v_x", "v_x"),
    Member::signal("v_y", "v_y"),
    Member::signal("r", "r"),
    Member::signal("a_x", "a_x"),
    Member::signal("a_y", "a_y"),
];

impl Equations<2, 10> for Plant {
    const KNOWN: [&str; 2] = ["F_x", "delta"];
    const UNKNOWN: [&str; 10] =
        ["a_x", "a_y", "alpha_f", "alpha_r", "F_zf", "F_zr", "F_xf", "F_xr", "F_yf", "F_yr"];

    fn equations<T: Number>(&self, [F_x, delta]: [T; 2]) -> [T; 10] {
        let motion = self.vehicle.lift().evaluate(&self.state.lift(), &Input { F_x, delta });
        let Motion { a_x, a_y, alpha_f, alpha_r, F_zf, F_zr, F_xf, F_xr, F_yf, F_yr, .. } = motion;
        [a_x, a_y, alpha_f, alpha_r, F_zf, F_zr, F_xf, F_xr, F_yf, F_yr]
    }
}

impl Model for Plant {
    const INFO: Info = Info::new(
        "plant",
        "Single-track car with Magic Formula tires, load transfer and aerodynamics",
        0.01,
    )
    .substep(SUBSTEP)
    .terminals(&[
        Terminal::bus("actuators", "Commands to the car", ACTUATORS),
        Terminal::bus("sensors", "Motion of the car", SENSORS),
    ]);

    const VARIABLES: &'static [Variable<Self>] = &[
        input("F_x", "N", "Driving force; braking when negative").at(|p| &mut p.input.F_x),
        input("delta", "rad", "Road-wheel angle of the front axle").at(|p| &mut p.input.delta),
        output("X", "m", "Position east").depends_on(&[]).at(|p| &mut p.state.X),
        output("Y", "m", "Position north").depends_on(&[]).at(|p| &mut p.state.Y),
        output("psi", "rad", "Heading, counter-clockwise from X")
            .depends_on(&[])
            .at(|p| &mut p.state.psi),
        output("v_x", "m/s", "Forward speed of the centre of gravity")
            .depends_on(&[])
            .at(|p| &mut p.state.v_x),
        output("v_y", "m/s", "Speed to the left of the centre of gravity")
            .depends_on(&[])
            .at(|p| &mut p.state.v_y),
        output("r", "rad/s", "Yaw rate").depends_on(&[]).at(|p| &mut p.state.r),
        output("a_x", "m/s2", "Forward acceleration").depends_on(BOTH).at(|p| &mut p.motion.a_x),
        output("a_y", "m/s2", "Acceleration to the left")
            .depends_on(BOTH)
            .at(|p| &mut p.motion.a_y),
        output("alpha_f", "rad", "Front slip angle")
            .depends_on(&["delta"])
            .at(|p| &mut p.motion.alpha_f),
        output("alpha_r", "rad", "Rear slip angle").depends_on(&[]).at(|p| &mut p.motion.alpha_r),
        output("F_zf", "N", "Front axle load").depends_on(BOTH).at(|p| &mut p.motion.F_zf),
        output("F_zr", "N", "Rear axle load").depends_on(BOTH).at(|p| &mut p.motion.F_zr),
        output("F_xf", "N", "Front longitudinal tire force")
            .depends_on(&["F_x"])
            .at(|p| &mut p.motion.F_xf),
        output("F_xr", "N", "Rear longitudinal tire force")
            .depends_on(&["F_x"])
            .at(|p| &mut p.motion.F_xr),
        output("F_yf", "N", "Front lateral tire force").depends_on(BOTH).at(|p| &mut p.motion.F_yf),
        output("F_yr", "N", "Rear lateral tire force").depends_on(BOTH).at(|p| &mut p.motion.F_yr),
        parameter("body.m", "kg", "Mass").min(1.0).at(|p| &mut p.vehicle.body.m),
        parameter("body.I_zz", "kg.m2", "Yaw inertia").min(1.0).at(|p| &mut p.vehicle.body.I_zz),
        parameter("body.l_f", "m", "Centre of gravity to front axle")
            .min(0.01)
            .at(|p| &mut p.vehicle.body.l_f),
        parameter("body.l_r", "m", "Centre of gravity to rear axle")
            .min(0.01)
            .at(|p| &mut p.vehicle.body.l_r),
        parameter("body.h", "m", "Height of the centre of gravity")
            .min(0.0)
            .at(|p| &mut p.vehicle.body.h),
        parameter("brake.front_share", "1", "Share of a braking force that the front axle takes")
            .min(0.0)
            .max(1.0)
            .at(|p| &mut p.vehicle.brake_front_share),
        parameter("aero.rho", "kg/m3", "Density of the air")
            .min(0.0)
            .at(|p| &mut p.vehicle.aero.rho),
        parameter("aero.area", "m2", "Frontal area").min(0.0).at(|p| &mut p.vehicle.aero.area),
        parameter("aero.C_d", "1", "Drag coefficient").min(0.0).at(|p| &mut p.vehicle.aero.C_d),
        parameter("aero.C_lf", "1", "Downforce coefficient of the front axle")
            .at(|p| &mut p.vehicle.aero.C_lf),
        parameter("aero.C_lr", "1", "Downforce coefficient of the rear axle")
            .at(|p| &mut p.vehicle.aero.C_lr),
        parameter("tire_f.B", "1/rad", "Front stiffness factor")
            .tunable()
            .at(|p| &mut p.vehicle.tire_f.B),
        parameter("tire_f.C", "1", "Front shape factor").tunable().at(|p| &mut p.vehicle.tire_f.C),
        parameter("tire_f.D", "1", "Front peak factor").tunable().at(|p| &mut p.vehicle.tire_f.D),
        parameter("tire_f.E", "1", "Front curvature factor")
            .tunable()
            .at(|p| &mut p.vehicle.tire_f.E),
        parameter("tire_f.S_h", "rad", "Front horizontal shift")
            .tunable()
            .at(|p| &mut p.vehicle.tire_f.S_h),
        parameter("tire_f.S_v", "1", "Front vertical shift, in units of the load")
            .tunable()
            .at(|p| &mut p.vehicle.tire_f.S_v),
        parameter("tire_r.B", "1/rad", "Rear stiffness factor")
            .tunable()
            .at(|p| &mut p.vehicle.tire_r.B),
        parameter("tire_r.C", "1", "Rear shape factor").tunable().at(|p| &mut p.vehicle.tire_r.C),
        parameter("tire_r.D", "1", "Rear peak factor").tunable().at(|p| &mut p.vehicle.tire_r.D),
        parameter("tire_r.E", "1", "Rear curvature factor")
            .tunable()
            .at(|p| &mut p.vehicle.tire_r.E),
        parameter("tire_r.S_h", "rad", "Rear horizontal shift")
            .tunable()
            .at(|p| &mut p.vehicle.tire_r.S_h),
        parameter("tire_r.S_v", "1", "Rear vertical shift, in units of the load")
            .tunable()
            .at(|p| &mut p.vehicle.tire_r.S_v),
        parameter("start.X", "m", "Initial position east").at(|p| &mut p.start.X),
        parameter("start.Y", "m", "Initial position north").at(|p| &mut p.start.Y),
        parameter("start.psi", "rad", "Initial heading").at(|p| &mut p.start.psi),
        parameter("start.v_x", "m/s", "Initial forward speed").at(|p| &mut p.start.v_x),
        parameter("start.v_y", "m/s", "Initial speed to the left").at(|p| &mut p.start.v_y),
        parameter("start.r", "rad/s", "Initial yaw rate").at(|p| &mut p.start.r),
        parameter("solver.substep", "s", "Largest step of the integrator")
            .min(1e-6)
            .at(|p| &mut p.substep),
    ];

    const DERIVATIVES: Option<Derivatives<Self>> = Some(Derivatives::of());

    fn initialise(&mut self) -> Result<(), ModelError> {
        self.state = self.start;
        Ok(())
    }

    fn step(&mut self, time: f64, step: f64) -> Result<(), ModelError> {
        self.state = self.vehicle.advance(&self.state, &self.input, step, self.substep);
        let State { X, Y, psi, v_x, v_y, r } = self.state;
        if [X, Y, psi, v_x, v_y, r].iter().all(|value| value.is_finite()) {
            return Ok(());
        }
        let (Input { F_x, delta }, end) = (self.input, time + step);
        Err(ModelError::Error(format!(
            "the state is not finite at {end} s, with F_x = {F_x} N and delta = {delta} rad"
        )))
    }

    fn outputs(&mut self) {
        self.motion = self.vehicle.evaluate(&self.state, &self.input);
    }
}

fmu_export::export!(Plant);

#[cfg(test)]
mod tests;
