//! Checks texts, sizes, conversions and errors.

use std::f64::consts::PI;

use super::*;
use crate::table::ANGLE;

fn unit(text: &str) -> Unit {
    Unit::parse(text).unwrap_or_else(|error| panic!("{error}"))
}

/// Unit text, its dimension and its SI value.
const SIZES: &[(&str, &str, f64)] = &[
    ("1", "1", 1.0),
    ("%", "1", 0.01),
    ("m/s", "m/s", 1.0),
    ("km/h", "m/s", 1.0 / 3.6),
    ("mph", "m/s", 0.44704),
    ("kn", "m/s", 0.514_444_444_444_444_4),
    ("m/s2", "m/s2", 1.0),
    ("m/s^2", "m/s2", 1.0),
    ("rad/s", "rad/s", 1.0),
    ("deg/s", "rad/s", PI / 180.0),
    ("rpm", "rad/s", PI / 30.0),
    ("N", "kg.m/s2", 1.0),
    ("kN", "kg.m/s2", 1e3),
    ("N.m", "kg.m2/s2", 1.0),
    ("N*m", "kg.m2/s2", 1.0),
    ("N/rad", "kg.m/(s2.rad)", 1.0),
    ("N/(m/s)", "kg/s", 1.0),
    ("N.s/m", "kg/s", 1.0),
    ("N/m/s", "kg/s3", 1.0),
    ("kg.m2", "kg.m2", 1.0),
    ("g", "kg", 1e-3),
    ("bar", "kg/(m.s2)", 1e5),
    ("psi", "kg/(m.s2)", 6_894.757_293_168),
    ("degC", "K", 1.0),
    ("s-1", "1/s", 1.0),
    ("1/min", "1/s", 1.0 / 60.0),
    ("Hz", "1/s", 1.0),
    ("m2/s3", "m2/s3", 1.0),
    ("rad2/s3", "rad2/s3", 1.0),
    ("N2/s", "kg2.m2/s5", 1.0),
    ("kW", "kg.m2/s3", 1e3),
    ("(km/h)2", "m2/s2", 1.0 / 12.96),
    ("mm^-2", "1/m2", 1e6),
    (" N . m / rad ", "kg.m2/(s2.rad)", 1.0),
    ("V/Ohm", "A", 1.0),
    ("C/V/F", "1", 1.0),
    ("g0", "m/s2", 9.806_65),
    ("g02", "m2/s4", 9.806_65 * 9.806_65),
    ("g0/rad", "m/(s2.rad)", 9.806_65),
    ("kgf", "kg.m/s2", 9.806_65),
    ("lbf", "kg.m/s2", 4.448_221_615_260_5),
];

#[test]
fn texts_have_the_dimension_and_the_size_that_they_say() {
    for (text, dimension, factor) in SIZES {
        let parsed = unit(text);
        assert_eq!(parsed.dimension_text(), *dimension, "{text}");
        assert!((parsed.factor / factor - 1.0).abs() < 1e-12, "{text}");
    }
}

#[test]
fn every_name_reads_back_and_its_dimension_is_a_unit_again() {
    for (name, exponents, factor) in NAMES {
        assert_eq!(unit(name), Unit::from_base(*exponents, *factor, 0.0));
        assert!(unit(&unit(name).dimension_text()).same_dimension(&unit(name)), "{name}");
    }
}

#[test]
fn conversions_scale_shift_and_invert() {
    for (from, to, value, expected) in [
        ("km/h", "m/s", 36.0, 10.0),
        ("deg", "rad", 180.0, PI),
        ("degC", "K", 20.0, 293.15),
        ("K", "degC", 293.15, 20.0),
        ("degF", "degC", 212.0, 100.0),
        ("rpm", "deg/s", 1.0, 6.0),
        ("N/(m/s)", "kN.s/m", 1500.0, 1.5),
    ] {
        let convert = |from: &str, to: &str, value: f64| {
            let (scale, offset) = Unit::conversion(&unit(from), &unit(to)).expect("same dimension");
            scale * value + offset
        };
        let there = convert(from, to, value);
        assert!((there - expected).abs() < 1e-9, "{from} -> {to}: {there}");
        assert!((convert(to, from, there) - value).abs() < 1e-9, "{to} -> {from}");
    }
}

#[test]
fn equal_units_convert_exactly_even_when_written_with_15_digits() {
    let rounded = Unit::from_base(ANGLE, 0.017_453_292_519_943_3, 0.0);
    for (from, to) in [
        (unit("km/h"), unit("km/h")),
        (unit("degF"), unit("degF")),
        (unit("N.m"), unit("J")),
        (rounded, unit("deg")),
    ] {
        assert_eq!(Unit::conversion(&from, &to), Some((1.0, 0.0)));
    }
}

#[test]
fn different_dimensions_do_not_convert() {
    for (from, to) in [("m", "s"), ("rad/s", "Hz"), ("rad", "1"), ("N", "N.m")] {
        assert_eq!(Unit::conversion(&unit(from), &unit(to)), None, "{from} {to}");
    }
}

#[test]
fn errors_say_where_they_are() {
    for (text, span, part) in [
        ("N.furlong/s", 2..9, "unknown unit `furlong` at byte 2"),
        ("m/sec", 2..5, "unknown unit `sec` at byte 2 of `m/sec`: did you mean `s`?"),
        ("N/degC", 2..6, "write `K`"),
        ("degC2", 0..4, "stand alone"),
        ("", 0..0, "found the end"),
        ("N m", 2..3, "expected `.`, `*`, `/` or the end at byte 2"),
        ("N/(m/s", 6..6, "expected `)`"),
        ("m/", 2..2, "a unit name"),
        ("m^", 2..2, "whole exponent"),
        ("m^x", 2..3, "whole exponent"),
        ("m999", 1..2, "whole exponent"),
        ("m100.m100", 9..9, "powers within"),
        ("2.m", 0..1, "a unit name"),
        ("km/hr", 0..5, "did you mean `km/h`?"),
        ("Nm/rad", 0..2, "did you mean `N.m`?"),
        (" deg. ", 1..5, "did you mean `deg`?"),
        ("m²", 1..3, "found `²`"),
        ("((((((((((((((((((((m", 16..17, "a unit name"),
    ] {
        let error = Unit::parse(text).expect_err(text);
        assert_eq!(error.byte_range(), span, "{text}: {error}");
        assert!(error.to_string().contains(part), "{text}: {error}");
    }
}

#[test]
fn all_known_names_are_units_and_none_is_listed_twice() {
    let mut names: Vec<_> = known_unit_names().collect();
    assert!(names.iter().all(|name| Unit::parse(name).is_ok()));
    let count = names.len();
    names.sort_unstable();
    names.dedup();
    assert_eq!(names.len(), count);
    assert!(["degC", "rpm", "N", "%"].iter().all(|name| names.contains(name)));
}

#[test]
fn common_spellings_lead_to_a_unit_and_none_is_a_unit_itself() {
    for (written, expected) in [
        ("kmh", "km/h"),
        ("KPH", "km/h"),
        ("Degrees", "deg"),
        ("°", "deg"),
        ("RPM", "rpm"),
        ("MPH", "mph"),
        ("PSI", "psi"),
        ("Bar", "bar"),
        ("Nm", "N.m"),
        ("seconds", "s"),
        ("hours", "h"),
        ("meters", "m"),
        ("G", "g0"),
        ("Gee", "g0"),
        ("-", "1"),
        ("°C", "degC"),
        ("knots", "kn"),
        ("KTS", "kn"),
        ("kPA", "kPa"),
        ("deg C", "degC"),
        ("NM", "N.m"),
    ] {
        let error = Unit::parse(written).expect_err(written).to_string();
        assert!(error.contains(&format!("did you mean `{expected}`?")), "{error}");
        assert!(Unit::parse(expected).is_ok());
    }
    assert!(Unit::parse("nm").is_err_and(|error| !error.to_string().contains("N.m")), "a nanometre");
}

#[test]
fn powers_and_roots_of_units_have_whole_exponents() {
    let raised = |text: &str, power| unit(text).powf(power).map(|unit| unit.dimension_text());
    for (text, power, expected) in [
        ("m/s", 2.0, Some("m2/s2")),
        ("m2/s2", 0.5, Some("m/s")),
        ("m", -1.0, Some("1/m")),
        ("m.rad/s2", 2.0, Some("m2.rad2/s4")),
        ("rad.m2", 0.5, Some("m")),
        ("m", 0.5, None),
        ("m100", 2.0, None),
    ] {
        assert_eq!(raised(text, power).as_deref(), expected, "{text}^{power}");
    }
    assert!((unit("km/h").powf(2.0).expect("a unit").factor - 1.0 / 12.96).abs() < 1e-15);
}

#[test]
fn angles_can_count_as_plain_numbers() {
    let (degrees, plain) = (unit("deg/s").without_angle(), unit("1/s"));
    let (scale, _) = Unit::conversion(&degrees, &plain).expect("angles left out");
    assert!((scale - PI / 180.0).abs() < 1e-17);
}

#[test]
fn the_unit_after_a_number_ends_where_signals_begin() {
    for (text, unit) in [
        ("m/s2", "m/s2"),
        ("g0)", "g0"),
        ("%", "%"),
        ("1/s < 2", "1/s"),
        ("1/plant.v", ""),
        ("m*s/kg-2", "m*s/kg"),
        ("m/s.x", "m"),
        ("N.m/rad*plant.psi", "N.m/rad"),
        ("m/s(2)", "m"),
        ("m/(plant.x)", "m"),
        ("m/time", "m"),
        ("m^x", "m"),
        ("s^-1", "s^-1"),
        ("m_x", ""),
        ("m[1]", ""),
        ("((((((((((m", ""),
        ("kmh", ""),
    ] {
        assert_eq!(&text[..leading_unit_length(text)], unit, "{text}");
    }
}

#[test]
fn differences_have_a_unit_of_their_own() {
    for (name, plain) in [("degC", Some("K")), ("degF", Some("degR")), ("bar", Some("bar")), ("kg.m2", None)]
    {
        let unit = Unit::parse(name).expect("a unit").difference_unit();
        assert_eq!((unit.offset_free_name(), unit.offset), (plain, 0.0), "{name}");
    }
    assert_eq!(Unit::parse("degC").expect("a unit").offset_free_name(), None);
}
