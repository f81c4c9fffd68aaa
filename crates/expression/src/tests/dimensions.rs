//! Checks units of expressions: conversions, results and messages.

use super::*;

/// Units of the signals of these tests; `a.on` is a plain number, `b.x` has no unit.
const UNITS: [(&str, &str); 7] = [
    ("a.x", "m/s"),
    ("a.y", "km/h"),
    ("b.x", ""),
    ("plant.tyre.f[1,2]", "rad"),
    ("plant.der(v)", "m/s2"),
    ("plant.der(c.v[3])", "deg/s"),
    ("my node.a-b", "degC"),
];

/// Short names in place of the columns.
fn full(text: &str) -> String {
    [
        ("psi", "plant.tyre.f[1,2]"),
        ("a_y", "plant.der(v)"),
        ("r", "plant.der(c.v[3])"),
        ("T", "`my node.a-b`"),
        ("v", "a.x"),
        ("w", "a.y"),
        ("none", "b.x"),
    ]
    .into_iter()
    .fold(text.to_owned(), |text, (short, name)| text.replace(&format!("${short}"), name))
}

fn typed(text: &str) -> Result<Expression<Tested>, ParseError> {
    parse_in(&full(text), &UNITS)
}

/// The value of an expression over signals of 10, 36, 2, 0.5, 14, 90, 20 and 1 in their units.
fn value(text: &str) -> f64 {
    let expression = typed(text).unwrap_or_else(|error| panic!("{text}: {error:?}"));
    let numbers = [10.0, 36.0, 2.0, 0.5, 14.0, 90.0, 20.0, 1.0];
    expression.evaluate(3.0, &TestedRow(&numbers, &[]))
}

#[test]
fn the_right_side_is_converted_to_the_unit_of_the_left_one() {
    for (text, expected) in [
        ("$v - $w", 0.0),
        ("$w - $v", 0.0),
        ("abs($v - $w) < 1e-9", 1.0),
        ("$v + 1 + $w", 21.0),
        ("min($w, $v, 7)", 7.0),
        ("hypot($v, $w)", 200.0_f64.sqrt()),
        ("$v < 36.1 km/h and 35.9 km/h < $v", 1.0),
        ("$psi < 29 deg and $psi > 28.6 deg", 1.0),
        ("$psi == 0.5 rad", 1.0),
        ("$psi - -5 deg", 0.5 + PI / 36.0),
        ("$a_y > 1.4 g0", 1.0),
        ("$a_y > 1.5 g0", 0.0),
        ("$v * $r / $a_y * 1 s", 10.0 * 90.0 / 14.0),
        ("$v * $r - $a_y", 10.0 * 90.0 - 14.0 * 180.0 / PI),
        ("$a_y - $v * $r", 14.0 - 5.0 * PI),
        ("$v / 2 m - $r", 5.0 - 0.5 * PI),
        ("3 m / $v + 1 s", 1.3),
        ("100 km/h * 1 s", 100.0),
        ("$v * 3600 s - 18 km", 18000.0),
        ("time + 1 min", 63.0),
        ("sin(30 deg) + cos($psi - 0.5)", 1.5),
        ("deg($psi) - 0.5 rad", 0.0),
        ("deg($r) + 90", 180.0),
        ("rad($r) - rad(90) / 1 s", 0.0),
        ("rad($psi)", 0.5),
        ("sqrt($v^2 + $w^2)", 200.0_f64.sqrt()),
        ("sqrt(2 * 1 g0 * 20 m) - $v", (2.0 * 20.0_f64).sqrt() - 10.0 / 9.806_65_f64.sqrt()),
        ("atan2($v, $w) - 45 deg", 0.0),
        ("1 rev * 3 Hz - $r", 2.75),
        ("$T - 10", 10.0),
        ("$T < 294 K", 1.0),
        ("($T - 0 degC) * 3 + 1 K", 61.0),
        ("$none + 3", 5.0),
        ("$none * $v / $none > 5", 1.0),
        ("$none < $on", 0.0),
        ("exp($v / $w * 0)", 1.0),
        ("5 %", 5.0),
        ("2 1/s * $none", 4.0),
    ] {
        let text = text.replace("$on", "a.on");
        let found = value(&text);
        assert!((found - expected).abs() < 1e-9, "{text}: {found}, expected {expected}");
    }
}

#[test]
fn equal_units_are_compared_as_they_are() {
    let expression = typed("$v - 0.1 m/s < 3 and $w * 3 < $w").expect("a condition");
    assert!(!format!("{expression:?}").contains("Convert"), "{expression:?}");
}

#[test]
fn the_unit_of_an_expression_is_known() {
    for (text, expected) in [
        ("$v + 3", Some("m/s")),
        ("3 + $w", Some("km/h")),
        ("0.05 * std($w)", Some("km/h")),
        ("quantile(abs($v), 0.5)", Some("m/s")),
        ("2 * $psi", Some("rad")),
        ("deg($r)", Some("deg/s")),
        ("std($T)", Some("K")),
        ("max($T)", Some("degC")),
        ("$v / $v", Some("1")),
        ("atan($v / $w)", Some("rad")),
        ("1.6 * 9.81 + pi", None),
        ("$none * $v", None),
        ("time", Some("s")),
        ("780 kg * $a_y", Some("kg.m/s2")),
        ("204048 N/rad * $psi", Some("kg.m/s2")),
        ("count($v > 1)", Some("1")),
    ] {
        let unit = typed(text).unwrap_or_else(|error| panic!("{text}: {error:?}")).unit();
        let name = unit.map(|(unit, name)| name.unwrap_or_else(|| unit.dimension_text()));
        assert_eq!(name.as_deref(), expected, "{text}");
    }
}

/// Text, the place of the mistake, and parts of the message and of the help.
#[rustfmt::skip]
const MISTAKES: &[(&str, &str, &str, &str)] = &[
    ("abs($v - $psi) < 1", "$v - $psi", "`$v` is in [m/s], `$psi` in [rad]: they cannot be subtracted", "rad is not m/s"),
    ("$v < 3 m", "$v < 3 m", "`3 m` in [m]: they cannot be compared", "m is not m/s"),
    ("max($v, $a_y) > 1", "$v, $a_y", "they cannot be arguments of one `max`", "m/s2 is not m/s"),
    ("$v > 2 + $psi", "$v > 2 + $psi", "`2 + $psi` in [rad]", ""),
    ("2.1 m - 0.01 * time < 3", "2.1 m - 0.01 * time", "`0.01 * time` in [s]", ""),
    ("$r * 3 / $v < $psi", "$r * 3 / $v < $psi", "[rad/m]", "numbers may have units too"),
    ("$a_y > 1.4 g", "$a_y > 1.4 g", "in [g]", "standard gravity is `g0`"),
    ("$r < 2 * pi * 3 Hz", "$r < 2 * pi * 3 Hz", "in [Hz]: they cannot", "`1 rev`"),
    ("$none < $v", "$none < $v", "`$v` is in [m/s], and `$none` has no unit: they cannot be compared", "`$none`"),
    ("abs(3 * $none - $v) < 1", "3 * $none - $v", "`$none` has no unit: they cannot be subtracted", ""),
    ("exp($v) > 1", "$v", "`exp` takes an angle or a plain number, and `$v` is in [m/s]", ""),
    ("sin($r) > 1", "$r", "`$r` is in [deg/s]", ""),
    ("deg($v) > 1", "$v", "`deg` takes an angle", ""),
    ("deg(3 Hz) > 1", "3 Hz", "`deg` takes an angle", ""),
    ("sqrt($v) > 1", "$v", "no unit with whole exponents", "numbers may have units too"),
    ("$v^$none > 1", "$none", "takes a number as its exponent, found `$none`", ""),
    ("2^$v > 1", "$v", "the exponent `$v` has a unit", ""),
    ("2 * $T > 1", "$T", "`$T` is in [degC], whose zero is shifted", "`($T - 0 degC)` is a difference in K"),
    ("$T - 273.15 K > 1", "$T", "whose zero is shifted", ""),
    ("$T + $T > 1", "$T", "whose zero is shifted", ""),
    ("rms($T) > 1", "$T", "whose zero is shifted", ""),
    ("-$T > 1", "$T", "whose zero is shifted", ""),
    ("quantile($v, 0.5 s) > 1", "quantile($v, 0.5 s)", "from 0 to 1", ""),
    ("$v < 100 kmh", "kmh", "unknown unit `kmh`", "km/h"),
    ("$v < 100 km/hr", "km/hr", "did you mean `km/h`?", ""),
    ("$v < 100 kM", "kM", "unknown unit `kM`", "did you mean `km`?"),
    ("$psi < 5degrees", "degrees", "did you mean `deg`?", ""),
    ("$psi < 5 °", "°", "did you mean `deg`?", ""),
    ("$a_y < 2 G", "G", "did you mean `g0`?", ""),
    ("$v < 5 m/degC", "m/degC", "can only stand alone: write `K`", ""),
    ("$v < 2 pi", "pi", "expected an operator or the end, found `pi`", ""),
    ("$v < 3 sin($psi)", "sin", "expected an operator or the end", ""),
    ("$v < 5 $v", "$v", "expected an operator", ""),
    ("$v < 5 m/s s", "s", "expected an operator", ""),
];

#[test]
fn mistakes_with_units_name_the_place_and_the_cure() {
    for (text, place, message, help) in MISTAKES {
        let (place, message, help) = (full(place), full(message), full(help));
        let error = typed(text).expect_err(text);
        let told = format!("{} {}", error.message, error.help.clone().unwrap_or_default());
        assert!(error.message.contains(&message), "{text}: {error:?}");
        assert!(told.contains(&help), "{text}: {error:?}");
        assert_eq!(&full(text)[error.span.clone()], place, "{text}: {error:?}");
        assert_eq!(error.unitless.is_some(), message.contains("has no unit:"), "{text}");
    }
}

#[test]
fn words_after_numbers_are_operators_or_units() {
    for text in ["a.on < 5 and a.on < 3 or not 0 and 1", "1 < 2", "a.on^2 m < 1"] {
        assert_eq!(typed(text).is_ok(), !text.contains('m'), "{text}");
    }
}

#[test]
fn a_comparison_names_the_unit_of_its_sides() {
    for (text, unit) in [
        ("$v < 3", Some("m/s")),
        ("3 < $w", Some("km/h")),
        ("$w < $v", Some("km/h")),
        ("max(abs($a_y)) < 1.4 g0", Some("m/s2")),
        ("5 deg > $psi", Some("deg")),
        ("$v * 2 s < 3", Some("m")),
        ("$v * $w < 3", None),
        ("$none < 3", None),
        ("count($v < 3) < 5", None),
        ("$v < 3 and $w < 4", None),
        ("$v", None),
    ] {
        assert_eq!(
            typed(text).map(|it| it.compared_unit().map(str::to_owned)),
            Ok(unit.map(str::to_owned)),
            "{text}"
        );
    }
}
