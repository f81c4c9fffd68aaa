//! Writes the lines of a scenario's `[[analysis]]` that take an error of a sensor or of the car into account.

use numerics::text::format_significant;
use vehicle::{SingleTrackCar, VehicleBody};

use preparation::{ErrorDescription, ErrorKind, SystematicError, SystematicErrors};

/// Digits that are written.
const DIGITS: usize = 4;

/// TOML, relative to `[[analysis]]`: keys of a column, in SI units; data of the car with what is left of their standard deviations,
/// the one of the error being `std`; for what no column can correct, that the fit always estimates it.
pub fn correction_lines(
    error: SystematicError,
    errors: &SystematicErrors,
    std: f64,
    car: &SingleTrackCar,
) -> String {
    let ErrorDescription { channel, kind, name, unit, .. } = error.describe();
    let value = errors[error];
    // That of the scale of the same channel.
    let gain = SystematicError::ALL.into_iter().find(|other| {
        let other = other.describe();
        other.channel == *channel && other.kind == ErrorKind::Gain
    });
    if let Some(key) = error.correction_key(value, gain.map_or(0.0, |gain| errors[gain])) {
        let unit = if *kind == ErrorKind::Offset { format!("  # [{unit}]") } else { String::new() };
        return format!("table.columns.{channel}.{key}{unit}");
    }
    let VehicleBody { m, I_zz, l_f, l_r, h } = car.body;
    match error {
        SystematicError::Mass => car_datum_line("m", m * (1.0 + value), m * std),
        SystematicError::Inertia => car_datum_line("I_zz", I_zz * (1.0 + value), I_zz * std),
        SystematicError::Height => car_datum_line("h", (h + value).max(0.0), std),
        SystematicError::CentreOfGravity => {
            let behind = format_significant(l_r + value, DIGITS);
            format!("{}\nconfig.car.body.l_r = {behind}", car_datum_line("l_f", l_f - value, std))
        }
        _ => format!("config.errors.{name} = \"on\""),
    }
}

fn car_datum_line(name: &str, value: f64, std: f64) -> String {
    let [value, std] = [value, std].map(|number| format_significant(number, DIGITS));
    format!("config.car.body.{name} = {{ value = {value}, std = {std} }}")
}
