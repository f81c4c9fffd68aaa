//! Sums up a tire in one line (friction, stiffness, pressure), and checks these figures for plausibility.
#![allow(non_snake_case, reason = "symbols as in Pacejka, Tire and Vehicle Dynamics")]

use std::ops::RangeInclusive;

use tire::{Coefficients, MfTire, TireCharacteristics};

use crate::TireFileMessage;

/// Peak frictions, from ice to slicks on a bench.
const FRICTION: RangeInclusive<f64> = 0.05..=4.0;
/// Cornering stiffnesses divided by load [1/rad], from trucks to slicks.
const CORNERING: RangeInclusive<f64> = 2.0..=100.0;
/// Slip stiffnesses divided by load [-].
const SLIP: RangeInclusive<f64> = 2.0..=200.0;
/// Camber stiffnesses divided by load [1/rad]; a small push to the other side is that of a truck tire.
const CAMBER: RangeInclusive<f64> = -1.0..=8.0;
/// Radii without load [m] and nominal loads [N], from models of 1:10 to mining trucks.
const RADIUS: RangeInclusive<f64> = 0.02..=2.5;
const LOAD: RangeInclusive<f64> = 1.0..=1e6;
/// Below this a stiffness divided by load is none.
const NONE: f64 = 1e-3;

/// What the tire is like at its nominal load and its own pressure: a warning when a number is one that no tire has.
pub fn check_plausibility(tire: &MfTire) -> TireFileMessage {
    let c = tire.coefficients();
    let at = tire.characteristics_at_load(c.FNOMIN * c.LFZO);
    let text = describe_tire(c, &at);
    match describe_implausibilities(c, &at).as_slice() {
        [] => TireFileMessage::note(None, text),
        odd => TireFileMessage::warning(None, format!("{text}. Not plausible: {}", odd.join("; "))),
    }
}

fn has_cornering(at: &TireCharacteristics) -> bool {
    // A force to the wrong side is one.
    let has_peak = at.lateral.friction >= NONE || at.C_alpha < 0.0;
    (at.C_alpha / at.F_z).abs() >= NONE && has_peak
}

fn has_driving(at: &TireCharacteristics) -> bool {
    let friction = at.driving.friction.max(at.braking.friction);
    (at.C_kappa / at.F_z).abs() >= NONE && (friction >= NONE || at.C_kappa < 0.0)
}

fn describe_tire(c: &Coefficients, at: &TireCharacteristics) -> String {
    let TireCharacteristics { lateral, driving, braking, C_alpha, C_kappa, C_gamma, F_z, .. } = *at;
    let across = match has_cornering(at) {
        true => format!("lateral friction {:.3} and {:.2} kN/rad", lateral.friction, C_alpha / 1e3),
        false => "no cornering".to_owned(),
    };
    let [drives, brakes] = [driving.friction, braking.friction];
    let along = match has_driving(at) {
        true => format!("driving {drives:.3}, braking {brakes:.3} and {:.1} kN", C_kappa / 1e3),
        false => "no driving and braking".to_owned(),
    };
    let camber = match (C_gamma / F_z).abs() >= NONE {
        true => format!("camber {:.2} kN/rad", C_gamma / 1e3),
        false => "no camber stiffness".to_owned(),
    };
    let pressure = match c.version.has_pressure() {
        true => format!("{:.0} kPa", c.INFLPRES / 1e3),
        false => "no effect of pressure".to_owned(),
    };
    format!("{}: {across}; {along}; {camber}; at {:.2} kN, {pressure}", c.version, F_z / 1e3)
}

/// What no tire is like.
fn describe_implausibilities(c: &Coefficients, at: &TireCharacteristics) -> Vec<String> {
    let mut all = Vec::new();
    let mut judge = |name: &str, value: f64, usual: &RangeInclusive<f64>| {
        if !usual.contains(&value) {
            let (low, high) = (usual.start(), usual.end());
            all.push(format!("{name} is {value:.3}, expected {low} to {high}"));
        }
    };
    if has_cornering(at) {
        judge("lateral friction", at.lateral.friction, &FRICTION);
        judge("cornering stiffness divided by load", at.C_alpha / at.F_z, &CORNERING);
        judge("camber stiffness divided by load", at.C_gamma / at.F_z, &CAMBER);
    }
    if has_driving(at) {
        judge("driving friction", at.driving.friction, &FRICTION);
        judge("braking friction", at.braking.friction, &FRICTION);
        judge("slip stiffness divided by load", at.C_kappa / at.F_z, &SLIP);
    }
    for (force, has) in [("lateral", has_cornering(at)), ("longitudinal", has_driving(at))] {
        if !has {
            all.push(format!("it has no {force} force"));
        }
    }
    for (name, value, low, high) in [
        ("KPUMIN to KPUMAX", 0.0, c.KPUMIN, c.KPUMAX),
        ("ALPMIN to ALPMAX", 0.0, c.ALPMIN, c.ALPMAX),
        ("CAMMIN to CAMMAX", 0.0, c.CAMMIN, c.CAMMAX),
        ("FZMIN to FZMAX", at.F_z, c.FZMIN, c.FZMAX),
    ] {
        // A range that ends at 0 is that of one side only.
        if !(low < value && value < high) {
            all.push(format!(
                "{name} is {low} to {high}, without {value}: the forces beyond are those at its end"
            ));
        }
    }
    // What makes these wrong is a unit: mm over metres, kN over newtons.
    for (name, value, unit, usual) in
        [("UNLOADED_RADIUS", c.UNLOADED_RADIUS, "m", RADIUS), ("FNOMIN", c.FNOMIN, "N", LOAD)]
    {
        if !usual.contains(&value) {
            let (low, high) = (usual.start(), usual.end());
            all.push(format!("{name} is {value} {unit}, expected {low} to {high} {unit}: check [UNITS]"));
        }
    }
    let sinks = at.F_z / c.VERTICAL_STIFFNESS;
    if sinks > 0.5 * c.UNLOADED_RADIUS {
        all.push(format!("under its load it sinks in by {sinks:.3} m: check VERTICAL_STIFFNESS and [UNITS]"));
    }
    let [own, nominal] = [c.INFLPRES, c.NOMPRES];
    let has_pressure = c.version.has_pressure();
    if has_pressure && !(c.PRESMIN..=c.PRESMAX).contains(&own) {
        let (low, high) = (c.PRESMIN, c.PRESMAX);
        all.push(format!("INFLPRES is {own} Pa, outside of PRESMIN to PRESMAX, {low} to {high} Pa"));
    } else if has_pressure && !(0.5..=2.0).contains(&(own / nominal)) {
        all.push(format!("INFLPRES is {own} Pa, far from NOMPRES, {nominal} Pa"));
    }
    all
}
