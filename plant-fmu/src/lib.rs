//! Exports the single-track car with its tires as an FMU: one step, plain or with options.
#![forbid(unsafe_code)]
#![allow(non_snake_case, reason = "symbols as in vehicle dynamics")]

mod car;
mod table;

use car_file::{CarParameter, SteeringMonitor, implausible_parameters};
use fmu_export::{
    EquationDerivatives, Equations, Info, Member, Model, ModelError, Number, RealValue, Terminal, Variable,
    log, real_values, warn,
};
use serde::{Deserialize, Serialize};
use tire_file::TireSpecification;
use vehicle::{
    PlanarState, RoadConditions, SingleTrackCar, SingleTrackEvaluation, SingleTrackInput, detailed_track,
};

use car::{BuiltCar, DetailedCar};

/// Largest sub-step of the integrator [s], the start value of its parameter.
const SUBSTEP: f64 = 0.002;

/// The car, where it starts, and where it is.
#[derive(Clone, Serialize, Deserialize)]
struct SingleTrackPlant {
    vehicle: SingleTrackCar,
    /// What options add. Body, air and brake balance are those of the vehicle.
    details: detailed_track::DetailedSingleTrackParameters,
    tires: [TireSpecification; 2],
    /// The car that the parameters describe; built again after a state was read.
    #[serde(skip)]
    built: Option<BuiltCar>,
    substep: f64,
    start: PlanarState,
    state: PlanarState,
    /// The state with that of wheels, tires and steering; of it the plain car uses nothing.
    detailed: detailed_track::DetailedSingleTrackState,
    input: SingleTrackInput,
    road: RoadConditions,
    outputs: PlantOutputs,
    steering_monitor: SteeringMonitor,
}

/// Outputs that are no states.
#[derive(Clone, Copy, Serialize, Deserialize)]
struct PlantOutputs {
    motion: SingleTrackEvaluation,
    kappa: [f64; 2],
    omega: [f64; 2],
    delta: f64,
}

impl Default for SingleTrackPlant {
    fn default() -> Self {
        let (vehicle, start) =
            (SingleTrackCar::default(), PlanarState { v_x: 15.0, ..PlanarState::default() });
        let input = SingleTrackInput::default();
        let details = detailed_track::DetailedSingleTrackParameters::default();
        let omega = [start.v_x / details.rims.radius; 2];
        let motion = vehicle.evaluate(&start, &input);
        SingleTrackPlant {
            vehicle,
            details,
            tires: <[TireSpecification; 2]>::default(),
            built: None,
            substep: SUBSTEP,
            start,
            state: start,
            detailed: detailed_track::DetailedSingleTrackState { planar: start, ..Default::default() },
            input,
            road: RoadConditions::default(),
            outputs: PlantOutputs { motion, kappa: [0.0; 2], omega, delta: 0.0 },
            steering_monitor: SteeringMonitor::default(),
        }
    }
}

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

const ROAD: &[Member] = &[
    Member::signal("mu_f", "mu_f"),
    Member::signal("mu_r", "mu_r"),
    Member::signal("grade", "grade"),
    Member::signal("bank", "bank"),
];

impl Equations<6, 13> for SingleTrackPlant {
    const KNOWN: [&str; 6] = ["F_x", "delta", "mu_f", "mu_r", "grade", "bank"];
    const UNKNOWN: [&str; 13] = [
        "a_x", "a_y", "alpha_f", "alpha_r", "F_zf", "F_zr", "F_xf", "F_xr", "F_yf", "F_yr", "kappa_f",
        "omega_f", "delta_f",
    ];

    fn equations<T: Number>(&self, [F_x, delta, mu_f, mu_r, grade, bank]: [T; 6]) -> [T; 13] {
        let road = RoadConditions { mu: [mu_f, mu_r], grade, bank };
        if let Some(BuiltCar { car: Some(car), .. }) = &self.built {
            let input = detailed_track::DetailedSingleTrackInput { F_x, delta, road };
            let motion = car.motion_with_derivatives(&self.detailed.cast(), &input);
            let [f, r] = motion.axles;
            return [
                motion.a_x,
                motion.a_y,
                -f.alpha,
                -r.alpha,
                f.F_z,
                r.F_z,
                f.F_x,
                r.F_x,
                f.F_y,
                r.F_y,
                f.kappa,
                f.omega,
                motion.delta,
            ];
        }
        let (car, state) = (self.vehicle.cast(), self.state.cast());
        let motion = car.evaluate_on(&state, &SingleTrackInput { F_x, delta }, &road);
        let omega = self.front_speed(&state, delta);
        let SingleTrackEvaluation { a_x, a_y, alpha_f, alpha_r, F_zf, F_zr, F_xf, F_xr, F_yf, F_yr, .. } =
            motion;
        [a_x, a_y, alpha_f, alpha_r, F_zf, F_zr, F_xf, F_xr, F_yf, F_yr, T::zero(), omega, delta]
    }
}

impl Model for SingleTrackPlant {
    const INFO: Info =
        Info::new("plant", "Single-track car with Magic Formula tires, load transfer and aerodynamics", 0.01)
            .substep(SUBSTEP)
            .terminals(&[
                Terminal::bus("actuators", "Commands to the car", ACTUATORS),
                Terminal::bus("sensors", "Motion of the car", SENSORS),
                Terminal::bus("road", "Friction and slopes of the road", ROAD),
            ]);

    const VARIABLES: &'static [Variable<Self>] = table::VARIABLES;

    const DERIVATIVES: Option<EquationDerivatives<Self>> = Some(EquationDerivatives::of());

    fn initialise(&mut self) -> Result<(), ModelError> {
        self.state = self.start;
        self.built = None;
        self.build_car()?;
        self.detailed = match &self.built {
            Some(BuiltCar { car: Some(car), .. }) => car.rolling_state(self.start, self.input.delta),
            _ => detailed_track::DetailedSingleTrackState { planar: self.start, ..Default::default() },
        };
        Ok(())
    }

    fn review_parameters(&mut self) {
        let parameter =
            |it: &RealValue| CarParameter { name: it.name, value: it.value, is_given: it.is_given };
        let parameters: Vec<_> = real_values(self).iter().map(parameter).collect();
        implausible_parameters(&parameters).into_iter().for_each(warn);
        self.steering_monitor = SteeringMonitor::default();
        // It is among the sentences above.
        let _ = self.steering_monitor.check(0.0, self.input.delta);
    }

    fn step(&mut self, time: f64, step: f64) -> Result<(), ModelError> {
        self.steering_monitor.check(time, self.input.delta).into_iter().for_each(warn);
        self.build_car()?;
        if let Some(BuiltCar { car: Some(car), .. }) = &self.built {
            let input = self.detailed_input();
            self.detailed = car.advance_state(&self.detailed, &input, step, self.substep);
            self.state = self.detailed.planar;
        } else {
            let (input, road) = (&self.input, &self.road);
            self.state = self.vehicle.advance_on(&self.state, input, road, step, self.substep);
        }
        let PlanarState { X, Y, psi, v_x, v_y, r } = self.state;
        let rolls = self.detailed.axles.iter().all(|axle| axle.omega.is_finite());
        if rolls && [X, Y, psi, v_x, v_y, r].iter().all(|value| value.is_finite()) {
            return Ok(());
        }
        let (SingleTrackInput { F_x, delta }, end) = (self.input, time + step);
        Err(ModelError::Error(format!(
            "the state is not finite at {end} s, with F_x = {F_x} N and delta = {delta} rad"
        )))
    }

    fn compute_outputs(&mut self) {
        // Parameters that make no car are an error of the initialisation.
        let _ = self.build_car();
        self.outputs = match &self.built {
            Some(BuiltCar { car: Some(car), .. }) => PlantOutputs::from_detailed_motion(
                &car.compute_motion(&self.detailed, &self.detailed_input()),
            ),
            _ => self.plain_outputs(),
        };
    }
}

impl SingleTrackPlant {
    fn detailed_input(&self) -> detailed_track::DetailedSingleTrackInput {
        let SingleTrackInput { F_x, delta } = self.input;
        detailed_track::DetailedSingleTrackInput { F_x, delta, road: self.road }
    }

    /// The outputs of the plain car, whose wheels roll freely.
    fn plain_outputs(&self) -> PlantOutputs {
        let SingleTrackInput { delta, .. } = self.input;
        let radius = self.details.rims.radius;
        PlantOutputs {
            motion: self.vehicle.evaluate_on(&self.state, &self.input, &self.road),
            kappa: [0.0; 2],
            omega: [self.front_speed(&self.state, delta), self.state.v_x / radius],
            delta,
        }
    }

    /// Speed of the front wheels of the plain car [rad/s].
    fn front_speed<T: Number>(&self, state: &PlanarState<T>, delta: T) -> T {
        let (sin, cos) = delta.sin_cos();
        let v_y = state.v_y + state.r * self.vehicle.body.l_f;
        (state.v_x * cos + v_y * sin) / self.details.rims.radius
    }

    /// Makes the car of the parameters, unless it is the one of the last time.
    fn build_car(&mut self) -> Result<(), ModelError> {
        let curves = [self.vehicle.tire_f, self.vehicle.tire_r];
        if self.built.as_ref().is_some_and(|built| built.curves == curves) {
            return Ok(());
        }
        let mut parameters = self.details.clone();
        (parameters.body, parameters.aero) = (self.vehicle.body, self.vehicle.aero);
        parameters.brakes.front_share = self.vehicle.brake_front_share;
        let (car, messages) =
            DetailedCar::build(parameters, &self.tires, curves).map_err(ModelError::Error)?;
        messages.into_iter().for_each(|message| message.send_to_log(log, warn));
        self.built = Some(BuiltCar { curves, car });
        Ok(())
    }
}

impl PlantOutputs {
    fn from_detailed_motion(it: &detailed_track::DetailedTrackEvaluation) -> Self {
        let [f, r] = &it.axles;
        let motion = SingleTrackEvaluation {
            derivative: it.derivative.planar,
            a_x: it.a_x,
            a_y: it.a_y,
            alpha_f: -f.alpha,
            alpha_r: -r.alpha,
            F_zf: f.F_z,
            F_zr: r.F_z,
            F_xf: f.F_x,
            F_xr: r.F_x,
            F_yf: f.F_y,
            F_yr: r.F_y,
            drag: it.drag,
        };
        let (kappa, omega) = ([f.kappa, r.kappa], [f.omega, r.omega]);
        Self { motion, kappa, omega, delta: it.delta }
    }
}

fmu_export::export!(SingleTrackPlant);

#[cfg(test)]
mod tests;
