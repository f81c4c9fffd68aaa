//! Finds the key figures of a tire.
#![allow(non_snake_case, reason = "symbols as in Pacejka, Tire and Vehicle Dynamics")]

use tire::{MfTire, Tire, TireOperatingPoint};

/// Speed of the figures and the curves [m/s].
pub(crate) const SPEED: f64 = 16.7;

/// A number with its name and unit.
#[derive(Clone, Debug, PartialEq)]
pub struct KeyFigure {
    /// What it is.
    pub name: String,
    /// Its unit, or nothing.
    pub unit: &'static str,
    /// Its value; not a number where there is none, such as a peak that is not reached.
    pub value: f64,
}

/// Load [N] and pressure [Pa] that a tire is looked at with.
#[derive(Clone, Copy)]
pub(crate) struct TireLoadCase<'t> {
    pub tire: &'t MfTire,
    pub F_z: f64,
    pub pressure: f64,
}

impl<'t> TireLoadCase<'t> {
    pub fn at_nominal_load_share(tire: &'t MfTire, share: f64) -> Self {
        let c = tire.coefficients();
        Self { tire, F_z: share * c.FNOMIN * c.LFZO, pressure: c.INFLPRES }
    }

    pub fn slip_state(&self, kappa: f64, alpha: f64, gamma: f64) -> TireOperatingPoint {
        let pressure = Some(self.pressure);
        TireOperatingPoint {
            kappa,
            alpha,
            gamma,
            F_z: self.F_z,
            v_x: SPEED,
            pressure,
            ..TireOperatingPoint::default()
        }
    }

    pub fn F_x(&self, kappa: f64, alpha: f64) -> f64 {
        self.tire.F_xy(&self.slip_state(kappa, alpha, 0.0))[0]
    }

    pub fn F_y(&self, kappa: f64, alpha: f64, gamma: f64) -> f64 {
        self.tire.F_xy(&self.slip_state(kappa, alpha, gamma))[1]
    }
}

/// The key figures of a tire, in one order for all tires.
pub fn key_figures(tire: &MfTire) -> Vec<KeyFigure> {
    let c = tire.coefficients();
    let mut all = Vec::new();
    let mut add = |name: &str, unit, value| all.push(KeyFigure { name: name.to_owned(), unit, value });
    let nominal = TireLoadCase::at_nominal_load_share(tire, 1.0);
    let load = nominal.F_z;
    add("nominal load", "N", load);
    add("inflation pressure", "kPa", c.INFLPRES / 1e3);
    add("unloaded radius", "mm", c.UNLOADED_RADIUS * 1e3);
    let [half, full, more] = [0.5, 1.0, 1.5].map(|share| tire.characteristics_at_load(share * load));
    add("lateral peak friction", "", full.lateral.friction);
    add("  at the slip angle", "deg", full.lateral.slip.to_degrees());
    add("  at half the load", "", half.lateral.friction);
    add("  at one and a half", "", more.lateral.friction);
    add("driving peak friction", "", full.driving.friction);
    add("  at the slip", "%", full.driving.slip * 100.0);
    add("braking peak friction", "", full.braking.friction);
    add("  at the slip", "%", -full.braking.slip * 100.0);
    for (name, at) in [("half", half), ("nominal", full), ("one and a half", more)] {
        add(&format!("cornering stiffness at {name} load"), "kN/rad", at.C_alpha / 1e3);
    }
    add("slip stiffness", "kN", full.C_kappa / 1e3);
    add("camber stiffness", "kN/rad", full.C_gamma / 1e3);
    let (forces, details) = tire.forces_and_details(&nominal.slip_state(0.0, 0.0, 0.0));
    add("ply steer and conicity, force at no slip", "N", forces.F_y);
    add("pneumatic trail", "mm", details.trail * 1e3);
    let relaxation = tire.relaxation(&nominal.slip_state(0.0, 0.0, 0.0));
    add("relaxation length, longitudinal", "mm", relaxation.x * 1e3);
    add("relaxation length, lateral", "mm", relaxation.y * 1e3);
    let slip = nominal.slip_state(0.0, 0.0, 0.0);
    let millimetres = |radius: Option<f64>| radius.map_or(f64::NAN, |it| it * 1e3);
    add("effective rolling radius", "mm", millimetres(tire.effective_radius(&slip)));
    add("loaded radius", "mm", millimetres(tire.loaded_radius(&slip, &forces)));
    add("rolling resistance", "N", -forces.M_y / c.UNLOADED_RADIUS);
    add("valid load from", "N", c.FZMIN);
    add("valid load to", "N", c.FZMAX);
    add("valid slip angle to", "deg", c.ALPMAX.to_degrees());
    add("valid slip to", "%", c.KPUMAX * 100.0);
    add("valid camber to", "deg", c.CAMMAX.to_degrees());
    all
}

/// Four digits of a number, and a word for what is none.
pub fn format_four_digits(value: f64) -> String {
    if value.is_nan() {
        return "none".to_owned();
    }
    if value == 0.0 {
        return "0".to_owned();
    }
    let before = value.abs().max(1e-9).log10().floor() as i32 + 1;
    let behind = (4 - before).clamp(0, 8) as usize;
    format!("{value:.behind$}")
}

#[cfg(test)]
mod tests {
    use tire::Coefficients;

    use super::*;

    #[test]
    fn the_figures_are_those_of_the_coefficients() {
        let coefficients = Coefficients::sports_tire();
        let tire = MfTire::new(coefficients).expect("a tire");
        let all = key_figures(&tire);
        let of = |name: &str| all.iter().find(|it| it.name == name).expect("a figure").value;
        assert!((of("lateral peak friction") - coefficients.PDY1).abs() < 1e-3);
        assert!((of("driving peak friction") - coefficients.PDX1).abs() < 1e-3);
        let stiffness = -coefficients.PKY1 * 4.0 * (2.0 * (1.0 / coefficients.PKY2).atan()).sin();
        assert!((of("cornering stiffness at nominal load") - stiffness).abs() < 1e-6);
        assert!((of("slip stiffness") - coefficients.PKX1 * 4.0).abs() < 1e-9);
        assert!(of("  at half the load") > of("  at one and a half"));
        assert!(of("camber stiffness") > 0.0 && of("pneumatic trail") > 10.0);
    }
}
