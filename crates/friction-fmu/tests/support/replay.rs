//! Replays logs into the estimator by the names of its variables, as an importer does.

use fmu_export::{Model, VariableAccess};
use friction_fmu::FrictionNode;
use vehicle::{MagicFormula, VehicleBody};

use super::log::Log;

/// The estimator, seen through its table.
#[derive(Default)]
pub struct Fmu(pub FrictionNode);

impl Fmu {
    fn access(name: &str) -> &'static VariableAccess<FrictionNode> {
        let row = FrictionNode::VARIABLES.iter().find(|it| it.row.name == name);
        &row.unwrap_or_else(|| panic!("no variable {name}")).access
    }

    /// Writes a variable; 0 is false.
    pub fn set(&mut self, name: &str, value: f64) {
        match Self::access(name) {
            VariableAccess::Real(at) => *at(&mut self.0) = value,
            VariableAccess::Boolean(at) => *at(&mut self.0) = value != 0.0,
            _ => panic!("{name} is no number"),
        }
    }

    /// Reads a variable; false is 0.
    pub fn get(&mut self, name: &str) -> f64 {
        match Self::access(name) {
            VariableAccess::Real(at) => *at(&mut self.0),
            VariableAccess::Boolean(at) => f64::from(*at(&mut self.0)),
            VariableAccess::Integer(at) => f64::from(*at(&mut self.0)),
            VariableAccess::String(_) => panic!("{name} is no number"),
        }
    }

    /// An estimator of the car of a log with nominal curves.
    pub fn of(log: &Log, curves: &[MagicFormula; 2], settings: &[(&str, f64)]) -> Self {
        let mut fmu = Fmu::default();
        fmu.describe(&log.car.body, curves);
        fmu.set("v_x_min", log.car.v_x_min);
        fmu.set("measured.v_y", 1.0);
        settings.iter().for_each(|(name, value)| fmu.set(name, *value));
        fmu.start();
        fmu
    }

    /// Sets a car and its nominal curves.
    pub fn describe(&mut self, body: &VehicleBody, curves: &[MagicFormula; 2]) {
        for (name, value) in
            [("body.m", body.m), ("body.I_zz", body.I_zz), ("body.l_f", body.l_f), ("body.l_r", body.l_r)]
        {
            self.set(name, value);
        }
        for (axle, curve) in ["f", "r"].iter().zip(curves) {
            let MagicFormula { B, C, D, E, S_h, S_v } = *curve;
            let values = [("B", B), ("C", C), ("D", D), ("E", E), ("S_h", S_h), ("S_v", S_v)];
            values.iter().for_each(|(key, value)| self.set(&format!("tire_{axle}.{key}"), *value));
        }
    }

    /// Ends the initialisation.
    pub fn start(&mut self) {
        self.0.initialise().expect("parameters of a car");
    }

    /// One row of a log.
    pub fn take(&mut self, log: &Log, k: usize) {
        let row = [log.v_x[k], log.v_y[k], log.r[k], log.a_y[k], log.delta[k]];
        self.sample(row, k, log.period);
    }

    /// The step `k` of `h` [s], with v_x, v_y, r, a_y and delta at its end.
    pub fn sample(&mut self, values: [f64; 5], k: usize, h: f64) {
        let names = ["v_x_meas", "v_y_meas", "r_meas", "a_y_meas", "delta"];
        names.iter().zip(values).for_each(|(name, value)| self.set(name, value));
        self.0.step(k as f64 * h, h).expect("a step");
    }

    /// D and K of both axles over those of curves: D_f, D_r, K_f, K_r.
    pub fn relative(&mut self, curves: &[MagicFormula; 2]) -> [f64; 4] {
        [
            self.get("D_f") / curves[0].D,
            self.get("D_r") / curves[1].D,
            self.get("K_f") / curves[0].cornering_stiffness_per_load(),
            self.get("K_r") / curves[1].cornering_stiffness_per_load(),
        ]
    }
}
