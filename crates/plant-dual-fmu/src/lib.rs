//! Exports the dual-track car on its tires as an FMU: builds the car from the parameters, steps it, computes the outputs.
#![forbid(unsafe_code)]
#![allow(non_snake_case, reason = "symbols as in vehicle dynamics")]

mod maps;
mod table;

use std::sync::Arc;

use car_file::{CarParameter, SteeringMonitor, implausible_parameters};
use fmu_export::{Info, Member, Model, ModelError, RealValue, Terminal, Variable, log, real_values, warn};
use maps::CarTables;
use serde::{Deserialize, Serialize};
use tire::{MfSet, Tire, TireOperatingPoint, TireSet};
use tire_file::TireSpecification;
use vehicle::dual_track::{
    AxleSprings, AxleStiffness, DualTrack, DualTrackInput, DualTrackParameters, DualTrackState, QUANTITIES,
    TableExcess, WheelForcesAndSlips,
};

/// Largest sub-step of the integrator [s], the start value of its parameter.
const SUBSTEP: f64 = 0.001;

/// The wheels, as names of variables call them.
const WHEELS: [&str; 4] = ["front left", "front right", "rear left", "rear right"];

/// The motion at the start: position, heading and velocities.
type StartMotion = vehicle::PlanarState;

/// The car, where it starts, and where it is.
#[derive(Clone, Serialize, Deserialize)]
struct DualTrackPlant {
    /// The parameters without tables.
    parameters: DualTrackParameters,
    /// Springs of a data sheet, which go before the stiffness in the parameters.
    springs: [AxleSprings; 2],
    maps: CarTables,
    /// The tables as they were read: a state goes on without their files.
    read: Option<CarTables>,
    tires: [TireSpecification; 2],
    /// The car that the parameters describe; built again after a state was read.
    #[serde(skip)]
    car: Option<Arc<DualTrack<MfSet>>>,
    substep: f64,
    start: StartMotion,
    state: DualTrackState,
    input: DualTrackInput,
    outputs: PlantOutputs,
    steering_monitor: SteeringMonitor,
    /// Wheels whose tire was told to be outside of its limits.
    tire_warned: [bool; 4],
    /// Quantities that were told to leave their table.
    table_warned: [bool; QUANTITIES],
}

/// Outputs that are no states.
#[derive(Clone, Copy, Default, Serialize, Deserialize)]
struct PlantOutputs {
    a_x: f64,
    a_y: f64,
    wheels: [WheelOutputs; 4],
    drag: f64,
    downforce: [f64; 2],
    ride_height: [f64; 2],
    /// Wheels whose tire is outside of the limits that its coefficients are valid for.
    outside_tires: i32,
    /// Quantities that are outside of their table.
    outside_tables: i32,
}

/// One wheel, in its own axes.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
struct WheelOutputs {
    F_x: f64,
    F_y: f64,
    F_z: f64,
    M_z: f64,
    kappa: f64,
    alpha: f64,
    gamma: f64,
    torque: f64,
    travel: f64,
    delta: f64,
}

impl From<&WheelForcesAndSlips> for WheelOutputs {
    fn from(it: &WheelForcesAndSlips) -> Self {
        let WheelForcesAndSlips { F_x, F_y, F_z, M_z, kappa, alpha, gamma, torque, .. } = *it;
        Self { F_x, F_y, F_z, M_z, kappa, alpha, gamma, torque, ..Self::default() }
    }
}

impl Default for DualTrackPlant {
    fn default() -> Self {
        DualTrackPlant {
            parameters: table::default_car_parameters(),
            springs: <[AxleSprings; 2]>::default(),
            maps: CarTables::default(),
            read: None,
            tires: <[TireSpecification; 2]>::default(),
            car: None,
            substep: SUBSTEP,
            start: StartMotion { v_x: 15.0, ..StartMotion::default() },
            state: DualTrackState::default(),
            input: DualTrackInput::default(),
            outputs: PlantOutputs::default(),
            steering_monitor: SteeringMonitor::default(),
            tire_warned: [false; 4],
            table_warned: [false; QUANTITIES],
        }
    }
}

impl DualTrackPlant {
    /// The car that the parameters describe.
    fn prepared_car(&mut self) -> Result<Arc<DualTrack<MfSet>>, ModelError> {
        if let Some(car) = &self.car {
            return Ok(Arc::clone(car));
        }
        let [front, rear] = &self.tires;
        let tire = |choice: &TireSpecification, name: &str| {
            let (tire, messages) = choice.load_tire(name).map_err(ModelError::Error)?;
            messages.into_iter().for_each(|message| message.send_to_log(log, warn));
            Ok::<_, ModelError>(tire)
        };
        let tires = [tire(front, "tire_f.tir")?, tire(rear, "tire_r.tir")?];
        let mut parameters = self.parameters.clone();
        let suspension = &mut parameters.suspension;
        for (axle, (springs, tire)) in self.springs.iter().zip(&tires).enumerate() {
            let tire_stiffness = tire.coefficients().VERTICAL_STIFFNESS;
            let stiffness = springs.axle_stiffness(suspension.track[axle], tire_stiffness);
            if let Some(AxleStiffness { ride, roll }) = stiffness {
                (suspension.ride_stiffness[axle], suspension.roll_stiffness[axle]) = (ride, roll);
            }
        }
        let maps = self.read.as_ref().unwrap_or(&self.maps);
        maps.apply_to_car(&mut parameters).map_err(ModelError::Error)?;
        let car = DualTrack::new(parameters, MfSet::from(tires));
        let car = Arc::new(car.map_err(|bad| ModelError::Error(bad.to_string()))?);
        self.car = Some(Arc::clone(&car));
        Ok(car)
    }

    /// Says once for each wheel that its tire is asked beyond what it was measured for.
    fn warn_tire_limits(&mut self, car: &DualTrack<MfSet>, time: f64) {
        let mut outside = 0;
        for (i, wheel) in self.outputs.wheels.iter().enumerate() {
            let WheelOutputs { kappa, alpha, gamma, F_z, .. } = *wheel;
            let slip = TireOperatingPoint { kappa, alpha, gamma, F_z, ..TireOperatingPoint::default() };
            let validity = car.tires().axle_tires()[i / 2].validity_excess(&slip);
            if F_z <= 0.0 || validity.is_valid() {
                continue;
            }
            outside += 1;
            if !std::mem::replace(&mut self.tire_warned[i], true) {
                let what = validity.input_excesses().into_iter().find(|(_, excess)| *excess != 0.0);
                let (name, excess) = what.unwrap_or_default();
                warn(format!(
                    "at {time:.4} s the {} tire is outside of its limits of validity: {name} by {excess:.3}; its forces are those at the limit",
                    WHEELS[i]
                ));
            }
        }
        self.outputs.outside_tires = outside;
    }

    /// Says once for each quantity that it is outside of its table.
    fn warn_table_limits(&mut self, car: &DualTrack<MfSet>, time: f64) {
        let excesses = car.table_range_excesses(&self.state, &self.input);
        for (told, excess) in self.table_warned.iter_mut().zip(&excesses) {
            let Some(excess) = excess else { continue };
            if !std::mem::replace(told, true) {
                let TableExcess { table, quantity, unit, value, ends: [first, last] } = excess;
                warn(format!(
                    "at {time:.4} s the {quantity}, {value:.4} {unit}, is outside of {table}, which goes from {first:.4} to {last:.4} {unit}; its values are those at the end"
                ));
            }
        }
        self.outputs.outside_tables = excesses.iter().map(|excess| i32::from(excess.is_some())).sum();
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
    Member::signal("mu_fl", "mu_fl"),
    Member::signal("mu_fr", "mu_fr"),
    Member::signal("mu_rl", "mu_rl"),
    Member::signal("mu_rr", "mu_rr"),
    Member::signal("grade", "grade"),
    Member::signal("bank", "bank"),
];

impl Model for DualTrackPlant {
    const INFO: Info = Info::new(
        "plant_dual",
        "Dual-track car: four wheels with Magic Formula tires, roll, pitch, brakes and driveline",
        0.01,
    )
    .substep(SUBSTEP)
    .terminals(&[
        Terminal::bus("actuators", "Commands to the car", ACTUATORS),
        Terminal::bus("sensors", "Motion of the car", SENSORS),
        Terminal::bus("road", "Friction and slopes of the road", ROAD),
    ]);

    const VARIABLES: &'static [Variable<Self>] = table::VARIABLES;

    fn initialise(&mut self) -> Result<(), ModelError> {
        self.car = None;
        self.read = Some(self.maps.load_files().map_err(ModelError::Error)?);
        let car = self.prepared_car()?;
        (self.tire_warned, self.table_warned) = ([false; 4], [false; QUANTITIES]);
        self.state = DualTrackState { planar: self.start, ..car.straight_rolling_state(self.start.v_x) };
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
        let car = self.prepared_car()?;
        self.state = car.advance(&self.state, &self.input, step, self.substep);
        let StartMotion { X, Y, psi, v_x, v_y, r } = self.state.planar;
        let rolls = self.state.wheels.iter().all(|wheel| wheel.omega.is_finite());
        if !rolls || ![X, Y, psi, v_x, v_y, r].iter().all(|value| value.is_finite()) {
            let (DualTrackInput { F_x, delta, .. }, end) = (self.input, time + step);
            return Err(ModelError::Error(format!(
                "the state is not finite at {end} s, with F_x = {F_x} N and delta = {delta} rad"
            )));
        }
        self.update_outputs(&car);
        self.warn_tire_limits(&car, time + step);
        self.warn_table_limits(&car, time + step);
        Ok(())
    }

    fn compute_outputs(&mut self) {
        // Parameters that make no car are an error of the initialisation.
        if let Ok(car) = self.prepared_car() {
            self.update_outputs(&car);
        }
    }
}

impl DualTrackPlant {
    fn update_outputs(&mut self, car: &DualTrack<MfSet>) {
        let motion = car.evaluate(&self.state, &self.input);
        (self.outputs.a_x, self.outputs.a_y) = (motion.a_x, motion.a_y);
        (self.outputs.drag, self.outputs.downforce) = (motion.drag, motion.downforce);
        self.outputs.ride_height = car.ride_heights(&self.state);
        let travel = car.wheel_travel(&self.state);
        let delta = car.wheel_angles(&self.state, &self.input);
        self.outputs.wheels = std::array::from_fn(|i| {
            let wheel = WheelOutputs::from(&motion.wheels[i]);
            WheelOutputs { travel: travel[i], delta: delta[i], ..wheel }
        });
    }
}

fmu_export::export!(DualTrackPlant);

#[cfg(test)]
mod tests;
