//! Says in one line what a tire is like, and what of it no tire is like.
#![allow(non_snake_case, reason = "symbols as in Pacejka, Tire and Vehicle Dynamics")]

use std::ops::RangeInclusive;

use tire::MfTire;

use crate::Message;

/// Peak frictions, from ice to slicks on a bench.
const FRICTION: RangeInclusive<f64> = 0.05..=4.0;
/// Cornering stiffnesses divided by load [1/rad], from trucks to slicks.
const CORNERING: RangeInclusive<f64> = 2.0..=100.0;
/// Slip stiffnesses divided by load [-].
const SLIP: RangeInclusive<f64> = 2.0..=200.0;
/// Camber stiffnesses divided by load [1/rad]; a small push to the other side is that of a truck tire.
const CAMBER: RangeInclusive<f64> = -1.0..=8.0;
/// Below this a stiffness divided by load is none.
const NONE: f64 = 1e-3;

/// What the tire is like at its nominal load and its own pressure: a warning when a number is one that no tire has.
pub fn plausibility(tire: &MfTire) -> Message {
    let c = tire.coefficients();
    let at = tire.characteristics(c.FNOMIN * c.LFZO);
    let mut odd = Vec::new();
    let mut judge = |name: &str, value: f64, usual: &RangeInclusive<f64>| {
        if !usual.contains(&value) {
            let (low, high) = (usual.start(), usual.end());
            odd.push(format!("{name} is {value:.3}, expected {low} to {high}"));
        }
    };
    let no_cornering = (at.C_alpha / at.F_z).abs() < NONE || at.lateral.friction < NONE;
    let no_slip =
        (at.C_kappa / at.F_z).abs() < NONE || at.driving.friction.max(at.braking.friction) < NONE;
    let no_camber = (at.C_gamma / at.F_z).abs() < NONE;
    if !no_cornering {
        judge("lateral friction", at.lateral.friction, &FRICTION);
        judge("cornering stiffness divided by load", at.C_alpha / at.F_z, &CORNERING);
        judge("camber stiffness divided by load", at.C_gamma / at.F_z, &CAMBER);
    }
    if !no_slip {
        judge("driving friction", at.driving.friction, &FRICTION);
        judge("braking friction", at.braking.friction, &FRICTION);
        judge("slip stiffness divided by load", at.C_kappa / at.F_z, &SLIP);
    }
    if c.KPUMAX <= 0.0 || c.KPUMIN >= 0.0 {
        odd.push(format!(
            "KPUMIN to KPUMAX is {} to {}: no slip beyond has a force",
            c.KPUMIN, c.KPUMAX
        ));
    }
    let [own, nominal] = [c.INFLPRES, c.NOMPRES];
    let has_pressure = c.version.has_pressure();
    if has_pressure && !(c.PRESMIN..=c.PRESMAX).contains(&own) {
        let (least, most) = (c.PRESMIN, c.PRESMAX);
        odd.push(format!(
            "INFLPRES is {own} Pa, outside of PRESMIN to PRESMAX, {least} to {most} Pa"
        ));
    } else if has_pressure && !(0.5..=2.0).contains(&(own / nominal)) {
        odd.push(format!("INFLPRES is {own} Pa, far from NOMPRES, {nominal} Pa"));
    }
    let across = if no_cornering {
        odd.push("it has no lateral force".to_owned());
        "no cornering".to_owned()
    } else {
        let stiffness = at.C_alpha / 1e3;
        format!("lateral friction {:.3} and {stiffness:.2} kN/rad", at.lateral.friction)
    };
    let along = if no_slip {
        odd.push("it has no longitudinal force".to_owned());
        "no driving and braking".to_owned()
    } else {
        let [driving, braking] = [at.driving.friction, at.braking.friction];
        let stiffness = at.C_kappa / 1e3;
        format!("driving {driving:.3}, braking {braking:.3} and {stiffness:.1} kN")
    };
    let camber = if no_camber {
        "no camber stiffness".to_owned()
    } else {
        format!("camber {:.2} kN/rad", at.C_gamma / 1e3)
    };
    let pressure = match has_pressure {
        true => format!("{:.0} kPa", own / 1e3),
        false => "no effect of pressure".to_owned(),
    };
    let text = format!(
        "{}: {across}; {along}; {camber}; at {:.2} kN, {pressure}",
        c.version,
        at.F_z / 1e3
    );
    match odd.is_empty() {
        true => Message::note(None, text),
        false => Message::warning(None, format!("{text}. Not plausible: {}", odd.join("; "))),
    }
}
