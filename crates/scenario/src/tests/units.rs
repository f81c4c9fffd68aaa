//! Messages about units: missing, unreadable, declared, and of different dimensions.

use super::fmus;
use super::lab::Lab;

fn lab() -> Lab {
    let lab = Lab::new();
    lab.fmu("relay.fmu", fmus::RELAY);
    lab.fmu("plant.fmu", &fmus::plant());
    lab
}

/// The relay, whose Real variables have no units, driven at 100 km/h.
fn driven(keys: &str, connect: &str, more: &str) -> String {
    format!(
        r#"[time]
step = 0.1
stop = 0.3

[[fmu]]
name = "car"
path = "relay.fmu"
start = {{ n = 0, on = false, text = '', mode = 1, gear = 1 }}
{keys}

[[signal]]
name = "driver.v"
unit = "km/h"
constant = 100

[[connect]]
from = "driver.v"
to = "car.x"
{connect}

{more}
"#
    )
}

#[test]
fn an_fmu_without_units_is_refused_until_its_units_are_declared() {
    let lab = lab();
    lab.message(&driven("", "", "")).says(&[
        "`driver.v` is in [km/h], and `car.x` has no unit",
        "say which unit `car.x` has: unit = { x = \"km/h\" } in [[fmu]] `car`",
        "or unit = \"km/h\" in the [[connect]]",
        "case.toml:",
    ]);
    for (keys, connect) in [
        ("unit = { x = \"m/s\" }", ""),
        ("unit = { \"x*\" = \"m/s\" }", ""),
        ("unit = { \"*\" = \"m\", x = \"mph\" }", ""),
        ("", "unit = \"m/s\""),
        ("", "unit = \"km/h\""),
    ] {
        assert!(lab.resolve(&driven(keys, connect, "")).is_ok(), "{keys}{connect}");
    }
}

#[test]
fn several_variables_without_units_are_one_mistake() {
    let more = "[[fmu]]\nname = \"plant\"\npath = \"plant.fmu\"\nstart = { F_x = 0.0 }\n\
                [[connect]]\nfrom = \"car.x_out\"\nto = \"plant.delta\"\n";
    let message = lab().message(&driven("", "", more)).says(&[
        "connected variables of `car` have no unit: `x` meets `driver.v` [km/h], `x_out` meets `plant.delta` [rad]",
        "in [[fmu]] `car` which units they have, such as unit = { x = ",
        "x_out = \"rad\" }",
    ]);
    assert_eq!(message.text.matches("no unit").count(), 1, "{}", message.text);
}

#[test]
fn units_that_cannot_be_read_fit_equal_ones_only() {
    let lab = lab();
    let strange = fmus::RELAY
        .replace("<Real start", "<Real unit=\"paces\" start")
        .replace("<Real/>", "<Real unit=\"paces\"/>");
    lab.fmu("relay.fmu", &strange);
    lab.message(&driven("", "", ""))
        .says(&["`driver.v` is in [km/h], and the unit [paces] of `car.x` cannot be read", "unit = { x ="]);
}

#[test]
fn a_declared_unit_fits_the_description_and_the_type() {
    let lab = lab();
    let plant = "[[fmu]]\nname = \"plant\"\npath = \"plant.fmu\"\nstart = { F_x = 0.0, delta = 0.0 }\n";
    let of_plant = |unit: &str| driven("unit = { x = \"m/s\" }", "", &format!("{plant}unit = {{ {unit} }}"));
    for (text, parts) in [
        (driven("unit = { x = \"kmh\" }", "", ""), &["unknown unit `kmh`", "did you mean `km/h`?"][..]),
        (
            driven("unit = { xx = \"m/s\" }", "unit = \"m/s\"", ""),
            &["unknown variable of `car` `xx`", "did you mean `x`?"],
        ),
        (driven("unit = { x = 3 }", "", ""), &["expected a unit such as \"m/s\" for `x`"]),
        (
            driven("unit = { x = \"m/s\", n = \"m\" }", "", ""),
            &["`n` is Integer, and only Real variables have units"],
        ),
        (
            driven("unit = { \"x*\" = \"m/s\", \"*x\" = \"km/h\" }", "", ""),
            &["two patterns fit `x`", "a full name wins"],
        ),
        (
            of_plant("v_x = \"km/h\""),
            &["`v_x` is in [m/s] by the description of the FMU", "and is said to be in"],
        ),
        (
            driven("unit = { x = \"m/s\" }", "unit = \"m/s\"", ""),
            &["neither of `driver.v` and `car.x` lacks a unit"],
        ),
        (
            driven("", "unit = \"m/s\"", "").replace("unit = \"km/h\"\n", ""),
            &["both of `driver.v` and `car.x` lack a unit"],
        ),
        (driven("", "unit = \"rad\"", ""), &["[km/h] is no unit of [rad]", "m/s is not rad"]),
    ] {
        let message = lab.message(&text).says(parts);
        assert!(!message.text.contains("has no unit"), "one mistake only: {}", message.text);
    }
    assert!(lab.resolve(&of_plant("v_x = \"m/s\", \"v_*\" = \"m/s\"")).is_ok());
}

/// The plant, driven straight on by a speed in km/h, with a check or a view.
fn judged(section: &str) -> String {
    format!(
        r#"[time]
step = 0.1
stop = 0.2

[[fmu]]
name = "plant"
path = "plant.fmu"
start = {{ start.v_x = 10.0, F_x = 0.0, delta = 0.0 }}

[[signal]]
name = "driver.v"
unit = "km/h"
constant = 36

[[signal]]
name = "driver.bare"
constant = 36

{section}
"#
    )
}

#[test]
fn checks_convert_what_has_one_dimension_and_refuse_the_rest() {
    let lab = lab();
    let check = |that: &str| judged(&format!("[[check]]\nname = \"c\"\nthat = \"{that}\""));
    for that in [
        "abs(plant.v_x - driver.v) < 0.5",
        "plant.v_x < 37 km/h and plant.v_x > 9 m/s",
        "abs(plant.psi) < 5 deg",
        "max(abs(plant.a_y)) < 1.4 g0",
    ] {
        assert!(lab.resolve(&check(that)).is_ok(), "{that}");
    }
    for (that, parts) in [
        (
            "plant.v_x - plant.psi < 1",
            &[
                "`plant.v_x` is in [m/s], `plant.psi` in [rad]: they cannot be subtracted",
                "rad is not m/s",
                "case.toml:",
            ][..],
        ),
        (
            "plant.v_x < driver.bare",
            &[
                "`driver.bare` has no unit: they cannot be compared",
                "unit = \"m/s\" in [[signal]] `driver.bare`",
            ],
        ),
        ("plant.v_x < 100 kph", &["unknown unit `kph`", "did you mean `km/h`?"]),
        ("max(plant.a_y) < 1.4 g", &["standard gravity is `g0`"]),
    ] {
        lab.message(&check(that)).says(parts);
    }
}

#[test]
fn diagrams_of_formulas_have_units() {
    let lab = lab();
    let plot = |curve: &str| {
        judged(&format!("[[view.plot]]\ntitle = \"t\"\nunit = \"deg\"\nsignals = [{{ {curve} }}]"))
    };
    for curve in ["signal = \"plant.psi + plant.r * 0.1 s\"", "signal = \"plant.v_y / plant.v_x\""] {
        assert!(lab.resolve(&plot(curve)).is_ok(), "{curve}");
    }
    for (curve, part) in [
        ("signal = \"plant.v_x * 2 s\"", "`plant.v_x * 2 s` [m] cannot be shown in deg"),
        ("signal = \"plant.psi * 2\", unit = \"deg\"", "is in [rad], and is said to be in [deg]"),
        ("signal = \"plant.psi + plant.v_x\"", "they cannot be added"),
    ] {
        lab.message(&plot(curve)).says(&[part]);
    }
}
