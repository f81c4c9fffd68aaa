//! Lists the named units with their dimensions and sizes.

use std::f64::consts::{PI, TAU};

pub(crate) const NONE: [i8; 8] = [0; 8];
const MASS: [i8; 8] = [1, 0, 0, 0, 0, 0, 0, 0];
const LENGTH: [i8; 8] = [0, 1, 0, 0, 0, 0, 0, 0];
const TIME: [i8; 8] = [0, 0, 1, 0, 0, 0, 0, 0];
const CURRENT: [i8; 8] = [0, 0, 0, 1, 0, 0, 0, 0];
pub(crate) const TEMPERATURE: [i8; 8] = [0, 0, 0, 0, 1, 0, 0, 0];
pub(crate) const ANGLE: [i8; 8] = [0, 0, 0, 0, 0, 0, 0, 1];
const SPEED: [i8; 8] = [0, 1, -1, 0, 0, 0, 0, 0];
const ACCELERATION: [i8; 8] = [0, 1, -2, 0, 0, 0, 0, 0];
const RATE: [i8; 8] = [0, 0, -1, 0, 0, 0, 0, 0];
const FORCE: [i8; 8] = [1, 1, -2, 0, 0, 0, 0, 0];
const PRESSURE: [i8; 8] = [1, -1, -2, 0, 0, 0, 0, 0];
const ENERGY: [i8; 8] = [1, 2, -2, 0, 0, 0, 0, 0];
const POWER: [i8; 8] = [1, 2, -3, 0, 0, 0, 0, 0];
const VOLTAGE: [i8; 8] = [1, 2, -3, -1, 0, 0, 0, 0];

/// Standard gravity [m/s2], exact by the third General Conference on Weights and Measures, 1901: the size of the unit g0, of the units of
/// weight, and of the accelerations that standards state in g. What pulls modelled cars down is `vehicle::G`.
pub const STANDARD_GRAVITY: f64 = 9.806_65;

/// Name, base-unit exponents and SI value of one, for all units without an offset.
/// Inch, foot, mile, pound and psi follow the international yard and pound agreement of 1959.
pub(crate) const NAMES: &[(&str, [i8; 8], f64)] = &[
    ("%", NONE, 0.01),
    ("kg", MASS, 1.0),
    ("g", MASS, 1e-3),
    ("mg", MASS, 1e-6),
    ("t", MASS, 1e3),
    ("lb", MASS, 0.453_592_37),
    ("m", LENGTH, 1.0),
    ("um", LENGTH, 1e-6),
    ("mm", LENGTH, 1e-3),
    ("cm", LENGTH, 1e-2),
    ("dm", LENGTH, 0.1),
    ("km", LENGTH, 1e3),
    ("in", LENGTH, 0.0254),
    ("ft", LENGTH, 0.3048),
    ("mi", LENGTH, 1609.344),
    ("l", [0, 3, 0, 0, 0, 0, 0, 0], 1e-3),
    ("s", TIME, 1.0),
    ("ns", TIME, 1e-9),
    ("us", TIME, 1e-6),
    ("ms", TIME, 1e-3),
    ("min", TIME, 60.0),
    ("h", TIME, 3600.0),
    ("A", CURRENT, 1.0),
    ("mA", CURRENT, 1e-3),
    ("K", TEMPERATURE, 1.0),
    ("degR", TEMPERATURE, 5.0 / 9.0),
    ("mol", [0, 0, 0, 0, 0, 1, 0, 0], 1.0),
    ("cd", [0, 0, 0, 0, 0, 0, 1, 0], 1.0),
    ("rad", ANGLE, 1.0),
    ("mrad", ANGLE, 1e-3),
    ("deg", ANGLE, PI / 180.0),
    ("rev", ANGLE, TAU),
    ("rpm", [0, 0, -1, 0, 0, 0, 0, 1], TAU / 60.0),
    ("mph", SPEED, 1609.344 / 3600.0),
    ("kn", SPEED, 1852.0 / 3600.0),
    ("g0", ACCELERATION, STANDARD_GRAVITY),
    ("Hz", RATE, 1.0),
    ("kHz", RATE, 1e3),
    ("N", FORCE, 1.0),
    ("kN", FORCE, 1e3),
    ("MN", FORCE, 1e6),
    ("kgf", FORCE, STANDARD_GRAVITY),
    ("lbf", FORCE, 0.453_592_37 * STANDARD_GRAVITY),
    ("Pa", PRESSURE, 1.0),
    ("hPa", PRESSURE, 1e2),
    ("kPa", PRESSURE, 1e3),
    ("MPa", PRESSURE, 1e6),
    ("mbar", PRESSURE, 1e2),
    ("bar", PRESSURE, 1e5),
    ("psi", PRESSURE, 0.453_592_37 * STANDARD_GRAVITY / (0.0254 * 0.0254)),
    ("J", ENERGY, 1.0),
    ("kJ", ENERGY, 1e3),
    ("MJ", ENERGY, 1e6),
    ("Wh", ENERGY, 3.6e3),
    ("kWh", ENERGY, 3.6e6),
    ("W", POWER, 1.0),
    ("kW", POWER, 1e3),
    ("MW", POWER, 1e6),
    ("V", VOLTAGE, 1.0),
    ("mV", VOLTAGE, 1e-3),
    ("kV", VOLTAGE, 1e3),
    ("C", [0, 0, 1, 1, 0, 0, 0, 0], 1.0),
    ("Ah", [0, 0, 1, 1, 0, 0, 0, 0], 3600.0),
    ("Ohm", [1, 2, -3, -2, 0, 0, 0, 0], 1.0),
    ("F", [-1, -2, 4, 2, 0, 0, 0, 0], 1.0),
    ("H", [1, 2, -2, -2, 0, 0, 0, 0], 1.0),
    ("T", [1, 0, -2, -1, 0, 0, 0, 0], 1.0),
    ("Wb", [1, 2, -2, -1, 0, 0, 0, 0], 1.0),
];

/// Name, factor and offset of the temperature scales whose zero is not 0 K.
pub(crate) const SCALES: &[(&str, f64, f64)] =
    &[("degC", 1.0, 273.15), ("degF", 5.0 / 9.0, 459.67 * 5.0 / 9.0)];
