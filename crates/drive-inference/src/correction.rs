//! Writes the lines of a scenario's `[[analysis]]` that take an error of a sensor or of the car into account.

use numerics::text::significant;
use vehicle::{Body, Vehicle};

use crate::cause::{Cause, Causes};

/// Digits that are written.
const DIGITS: usize = 4;

/// TOML, relative to `[[analysis]]`: keys of a column, in SI units; data of the car with what is left of their standard deviations,
/// the one of the error being `std`; for what no column can correct, that the fit always estimates it.
///
/// A column has sign · gain · record + offset, and the record (1 + gain) · truth + offset.
pub fn lines(cause: Cause, found: &Causes, std: f64, car: &Vehicle) -> String {
    let value = found[cause];
    let Body { m, I_zz, l_f, l_r, h } = car.body;
    let times = 1.0 + value;
    match cause {
        Cause::SteeringOffset => offset("delta", value, found[Cause::SteeringGain], "rad"),
        Cause::YawRateOffset => offset("r", value, found[Cause::YawRateGain], "rad/s"),
        Cause::AccelerationOffset => offset("a_y", value, found[Cause::AccelerationGain], "m/s2"),
        Cause::SteeringGain => column("delta", "gain", 1.0 / times),
        Cause::SpeedGain => column("v_x", "gain", 1.0 / times),
        Cause::YawRateGain => column("r", "gain", 1.0 / times),
        Cause::AccelerationGain => column("a_y", "gain", 1.0 / times),
        Cause::ForceGain => column("F_x", "gain", times),
        Cause::SteeringDelay => column("delta", "delay", value),
        Cause::SideslipDelay => column("v_y", "delay", value),
        Cause::YawRateDelay => column("r", "delay", value),
        Cause::AccelerationDelay => column("a_y", "delay", value),
        Cause::ForceDelay => column("F_x", "delay", value),
        Cause::Mass => datum("m", m * times, m * std),
        Cause::Inertia => datum("I_zz", I_zz * times, I_zz * std),
        Cause::Height => datum("h", (h + value).max(0.0), std),
        Cause::CentreOfGravity => {
            let behind = significant(l_r + value, DIGITS);
            format!("{}\nconfig.car.body.l_r = {behind}", datum("l_f", l_f - value, std))
        }
        Cause::SideslipOffset
        | Cause::SideslipLever
        | Cause::AccelerationLever
        | Cause::RelaxationFront
        | Cause::RelaxationRear => format!("config.errors.{} = \"on\"", cause.about().name),
    }
}

fn column(name: &str, key: &str, value: f64) -> String {
    format!("table.columns.{name}.{key} = {}", significant(value, DIGITS))
}

/// Of a record that also has an error of its scale.
fn offset(name: &str, value: f64, scale: f64, unit: &str) -> String {
    format!("{}  # [{unit}]", column(name, "offset", -value / (1.0 + scale)))
}

fn datum(name: &str, value: f64, std: f64) -> String {
    let [value, std] = [value, std].map(|number| significant(number, DIGITS));
    format!("config.car.body.{name} = {{ value = {value}, std = {std} }}")
}
