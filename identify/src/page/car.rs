//! Says which car was assumed, and how well it is known.
#![allow(non_snake_case, reason = "symbols as in vehicle dynamics")]

use drive_inference::CarUncertainty;
use numerics::text::{format_significant, with_std};
use preparation::{BrakeShare, Car};
use vehicle::{Aerodynamics, SingleTrackCar, VehicleBody};

/// Name and value.
pub type NamedFacts = Vec<(String, String)>;

fn body_facts(body: &VehicleBody, aero: &Aerodynamics, uncertainty: &CarUncertainty) -> NamedFacts {
    let CarUncertainty { m, cg, I_zz, h, .. } = *uncertainty;
    let fact = |name: &str, value: f64, std: f64, unit: &str| {
        let known = if std > 0.0 { "" } else { " (taken as exact)" };
        (name.to_owned(), format!("{} {unit}{known}", with_std(value, std)))
    };
    let air = match aero {
        Aerodynamics { C_d: 0.0, C_lf: 0.0, C_lr: 0.0, .. } => "none".to_owned(),
        Aerodynamics { rho, area, C_d, C_lf, C_lr } => format!(
            "C_d {}, C_lf {}, C_lr {} over {} m² in air of {} kg/m³",
            format_significant(*C_d, 3),
            format_significant(*C_lf, 3),
            format_significant(*C_lr, 3),
            format_significant(*area, 3),
            format_significant(*rho, 4)
        ),
    };
    vec![
        fact("mass m", body.m, m * body.m, "kg"),
        fact("yaw moment of inertia I_zz", body.I_zz, I_zz * body.I_zz, "kg·m²"),
        fact("centre of gravity to front axle l_f", body.l_f, cg, "m"),
        fact("wheelbase", body.wheelbase(), 0.0, "m"),
        fact("height of the centre of gravity h", body.h, h, "m"),
        ("aerodynamics".to_owned(), air),
    ]
}

/// The car of drives under closed-loop control.
pub fn closed_loop_car_facts(car: &SingleTrackCar, uncertainty: &CarUncertainty) -> NamedFacts {
    let mut facts = body_facts(&car.body, &car.aero, uncertainty);
    let share = format_significant(car.brake_front_share, 3);
    facts.push(("share of the braking force at the front axle".to_owned(), share));
    let gain = format_significant(100.0 * uncertainty.F_x_gain, 2);
    let gain = match uncertainty.F_x_gain {
        0.0 => "1 (taken as exact)".to_owned(),
        _ => format!("1 ± {gain} %"),
    };
    facts.push(("gain of F_x".to_owned(), gain));
    facts
}

/// The car of a log.
pub fn logged_car_facts(car: &Car, uncertainty: &CarUncertainty) -> NamedFacts {
    let mut facts = body_facts(&car.body, &car.aero, uncertainty);
    let brakes = match car.brake_front_share {
        BrakeShare::Fixed(share) => format_significant(share, 3),
        BrakeShare::Rule(_) => "in proportion to the loads".to_owned(),
    };
    facts.push(("share of the braking force at the front axle".to_owned(), brakes));
    let drive = format_significant(car.drive_front_share, 3);
    facts.push(("share of the driving force at the front axle".to_owned(), drive));
    facts
}
