//! Replays logs into the estimator by the names of its variables, as an importer does.

use fmu_export::{Access, Model};
use friction_fmu::Friction;
use vehicle::MagicFormula;

use super::log::Log;

/// The estimator, seen through its table.
#[derive(Default)]
pub struct Fmu(pub Friction);

impl Fmu {
    fn access(name: &str) -> &'static Access<Friction> {
        let row = Friction::VARIABLES.iter().find(|it| it.row.name == name);
        &row.unwrap_or_else(|| panic!("no variable {name}")).access
    }

    /// Writes a variable; 0 is false.
    pub fn set(&mut self, name: &str, value: f64) {
        match Self::access(name) {
            Access::Real(at) => *at(&mut self.0) = value,
            Access::Boolean(at) => *at(&mut self.0) = value != 0.0,
            _ => panic!("{name} is no number"),
        }
    }

    /// Reads a variable; false is 0.
    pub fn get(&mut self, name: &str) -> f64 {
        match Self::access(name) {
            Access::Real(at) => *at(&mut self.0),
            Access::Boolean(at) => f64::from(*at(&mut self.0)),
            Access::Integer(at) => f64::from(*at(&mut self.0)),
            Access::String(_) => panic!("{name} is no number"),
        }
    }

    /// An estimator of a car with nominal curves.
    pub fn of(log: &Log, curves: &[MagicFormula; 2], settings: &[(&str, f64)]) -> Self {
        let (mut fmu, body) = (Fmu::default(), &log.car.body);
        for (name, value) in [
            ("body.m", body.m),
            ("body.I_zz", body.I_zz),
            ("body.l_f", body.l_f),
            ("body.l_r", body.l_r),
            ("v_x_min", log.car.v_x_min),
            ("measured.v_y", 1.0),
        ] {
            fmu.set(name, value);
        }
        for (axle, curve) in ["f", "r"].iter().zip(curves) {
            let MagicFormula { B, C, D, E, S_h, S_v } = *curve;
            let values = [("B", B), ("C", C), ("D", D), ("E", E), ("S_h", S_h), ("S_v", S_v)];
            values.iter().for_each(|(key, value)| fmu.set(&format!("tire_{axle}.{key}"), *value));
        }
        settings.iter().for_each(|(name, value)| fmu.set(name, *value));
        fmu.0.initialise().expect("parameters of a car");
        fmu
    }

    /// One row of a log.
    pub fn take(&mut self, log: &Log, k: usize) {
        for (name, value) in [
            ("v_x_meas", log.v_x[k]),
            ("v_y_meas", log.v_y[k]),
            ("r_meas", log.r[k]),
            ("a_y_meas", log.a_y[k]),
            ("delta", log.delta[k]),
        ] {
            self.set(name, value);
        }
        self.0.step(k as f64 * log.period, log.period).expect("a step");
    }

    /// D and K of both axles over those of curves: D_f, D_r, K_f, K_r.
    pub fn relative(&mut self, curves: &[MagicFormula; 2]) -> [f64; 4] {
        [
            self.get("D_f") / curves[0].D,
            self.get("D_r") / curves[1].D,
            self.get("K_f") / curves[0].stiffness(),
            self.get("K_r") / curves[1].stiffness(),
        ]
    }
}
