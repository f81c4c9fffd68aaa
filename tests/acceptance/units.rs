//! Connects, judges and analyses values with units, without, and with declared ones.

use super::fixture::Scenario;
use super::fmus::{changed, ours, relay};
use super::harness::{Ended, Lab};
use super::plugins;

tests! {
    an_fmu_without_units_is_refused_until_its_units_are_declared: Compiler,
    units_that_cannot_be_read_fit_equal_ones_only: Compiler,
    checks_convert_what_has_one_dimension,
    an_analysis_gets_no_signal_without_a_unit: Compiler,
    the_offset_of_a_difference_does_not_count: Compiler,
    a_difference_meets_no_point_on_a_scale_with_a_shifted_zero: Compiler,
    limits_of_declared_types_are_whole_numbers_of_64_bits: Compiler,
}

/// The relay, whose Real variables have no units, driven at 100 km/h.
fn driven(keys: &str, connect: &str, more: &str) -> String {
    let start = "n = 0, on = false, text = '', mode = 1, gear = 1";
    Scenario::new()
        .time(0.1, 0.3)
        .fmu("car", "relay.fmu", start)
        .key(keys)
        .signal("driver.v", "unit = \"km/h\"\nconstant = 100")
        .connect("driver.v", "car.x")
        .key(connect)
        .section(more)
        .text()
}

fn run(lab: &Lab, text: &str) -> Ended {
    lab.write("case.toml", text);
    lab.trackside(&["run", "case.toml", "--out", "out", "--csv", "--rerun", "off"])
}

/// The last value of a column.
fn last(lab: &Lab, name: &str) -> f64 {
    let mut reader = csv::Reader::from_path(lab.path("out/run.csv")).expect("a table");
    let titles = reader.headers().expect("titles").clone();
    let is_it = |title: &str| title.split([' ', '[']).next() == Some(name);
    let index = titles.iter().position(is_it).unwrap_or_else(|| panic!("no {name}: {titles:?}"));
    let row = reader.records().last().expect("a row").expect("a row");
    row[index].parse().expect("a number")
}

fn an_fmu_without_units_is_refused_until_its_units_are_declared() {
    let lab = Lab::new();
    lab.write("relay.fmu", relay());
    run(&lab, &driven("", "", "")).expect(2).says(&[
        "`driver.v` is in [km/h], and `car.x` has no unit",
        "say which unit `car.x` has: unit = { x = \"km/h\" } in [[fmu]] `car`",
        "or unit = \"km/h\" in the [[connect]]",
        "case.toml:",
    ]);
    assert!(!lab.has("out"));
    let arrived =
        "[[check]]\nname = \"arrived\"\nthat = \"abs(car.x - driver.v) < 1e-9 and car.x > 99 km/h\"";
    for (keys, connect, expected) in [
        ("unit = { x = \"m/s\" }", "", 100.0 / 3.6),
        ("unit = { \"x*\" = \"m/s\" }", "", 100.0 / 3.6),
        ("unit = { \"*\" = \"m\", x = \"mph\" }", "", 160.934_4_f64.recip() * 10_000.0),
        ("", "unit = \"m/s\"", 100.0 / 3.6),
        ("", "unit = \"km/h\"", 100.0),
    ] {
        run(&lab, &driven(keys, connect, arrived)).expect(0);
        let found = last(&lab, "car.x");
        assert!((found - expected).abs() < 1e-9, "{keys}{connect}: {found}");
    }
    // A start value on the command line is in the declared unit, or converted to it.
    let standing = driven("unit = { x = \"m/s\" }", "", "").replace("text = ''", "text = '', x = 0.0");
    let standing = standing.split("[[signal]]").next().unwrap_or_default();
    lab.write("case.toml", standing);
    let set = ["run", "case.toml", "--out", "out", "--csv", "--rerun", "off", "--set", "car.x=72 km/h"];
    lab.trackside(&set).expect(0);
    assert!((last(&lab, "car.x_out") - 20.0).abs() < 1e-9);
    // Plain numbers need no declaration.
    let plain = driven("", "", "").replace("unit = \"km/h\"", "unit = \"1\"");
    run(&lab, &plain).expect(0);
}

fn units_that_cannot_be_read_fit_equal_ones_only() {
    let lab = Lab::new();
    let relay = lab.write("relay.fmu", relay());
    let strange = changed(&relay, |name, bytes| {
        let text = match name {
            "modelDescription.xml" => {
                let text = String::from_utf8(bytes).expect("XML");
                text.replace("<Real start", "<Real unit=\"paces\" start")
                    .replace("<Real/>", "<Real unit=\"paces\"/>")
                    .into_bytes()
            }
            _ => bytes,
        };
        Some((name.to_owned(), text))
    });
    lab.write("relay.fmu", strange);
    let start = "n = 0, on = false, text = '', mode = 1, gear = 1";
    let more = "[[connect]]\nfrom = \"car.x_out\"\nto = \"next.x\"";
    let chain = Scenario::new().fmu("next", "relay.fmu", start).section(more).text();
    run(&lab, &driven("unit = { x = \"m/s\" }", "", &chain)).expect(0);
    assert!((last(&lab, "next.x") - 100.0 / 3.6).abs() < 1e-9);
}

/// The plant, driven straight on by a speed in km/h, with a check or a view.
fn judged(section: &str) -> String {
    Scenario::new()
        .time(0.1, 0.2)
        .fmu("plant", "plant.fmu", "start.v_x = 10.0, F_x = 0.0, delta = 0.0")
        .signal("driver.v", "unit = \"km/h\"\nconstant = 36")
        .signal("driver.bare", "constant = 36")
        .section(section)
        .text()
}

fn checks_convert_what_has_one_dimension() {
    let lab = Lab::new();
    lab.add(&ours().join("plant.fmu"));
    let check = |that: &str| run(&lab, &judged(&format!("[[check]]\nname = \"c\"\nthat = \"{that}\"")));
    for that in [
        "abs(plant.v_x - driver.v) < 0.5",
        "plant.v_x < 37 km/h and plant.v_x > 9 m/s",
        "abs(plant.psi) < 5 deg",
        "max(abs(plant.a_y)) < 1.4 g0",
    ] {
        check(that).expect(0);
    }
    check("abs(plant.v_x - driver.v) < 0.001 km/h").expect(1);
}

fn an_analysis_gets_no_signal_without_a_unit() {
    let lab = Lab::new();
    plugins::compile(&lab, plugin::abi::VERSION);
    lab.write("log.csv", "t,v\n5,1\n6,2\n");
    let head = "[time]\nstep = 0.5\nstop = 1.0\n[[signal]]\nname = \"car.v\"\nconstant = 3\n\
                [[analysis]]\nname = \"odd\"\npath = \"odd.so\"\n";
    run(&lab, &format!("{head}signals = {{ speed = \"car.v\" }}\n")).expect(2).says(&[
        "`speed` is wanted in [m/s], and `car.v` has no unit",
        "unit = \"m/s\" in [[signal]] `car.v`",
    ]);
    let table =
        "[analysis.table]\npath = \"log.csv\"\ntime = \"t\"\ncolumns = { speed = { column = \"v\" } }\n";
    run(&lab, &format!("{head}{table}")).expect(2).says(&[
        "`speed` is wanted in [m/s], and `v` has no unit",
        "unit = \"m/s\", or \"km/h\" if its numbers are in km/h, in the column `speed`",
    ]);
}

/// The relay with these attributes of its real numbers, among declared types.
fn relay_with(real: &str) -> Vec<u8> {
    let lab = Lab::new();
    changed(&lab.write("relay.fmu", relay()), |name, bytes| {
        let bytes = match name {
            "modelDescription.xml" => {
                let types = "<SimpleType name=\"Difference\"><Real unit=\"degC\" relativeQuantity=\"true\"/></SimpleType>\
                             <SimpleType name=\"Share\"><Real min=\"0\" max=\"0.7\" nominal=\"1e300\"/></SimpleType>\
                             <SimpleType name=\"Unused\"><Integer max=\"4294967295\"/></SimpleType></TypeDefinitions>";
                String::from_utf8(bytes)
                    .expect("XML")
                    .replace("</TypeDefinitions>", types)
                    .replace("<Real start", &format!("<Real {real} start"))
                    .replace("<Real/>", &format!("<Real {real}/>"))
                    .into_bytes()
            }
            _ => bytes,
        };
        Some((name.to_owned(), bytes))
    })
}

/// A relay with these attributes that gets a value of a start, a signal or another relay.
fn relayed(first: &str, second: &str, more: &str) -> (Lab, String) {
    let lab = Lab::new();
    lab.write("first.fmu", relay_with(first));
    lab.write("second.fmu", relay_with(second));
    let start = "n = 0, on = false, text = '', mode = 1, gear = 1";
    let text = Scenario::new()
        .time(0.1, 0.3)
        .fmu("a", "first.fmu", &format!("{start}, x = 5.0"))
        .fmu("b", "second.fmu", start)
        .connect("a.x_out", "b.x")
        .section(more);
    (lab, text.text())
}

fn the_offset_of_a_difference_does_not_count() {
    let [own, typed] = ["unit=\"degC\" relativeQuantity=\"true\"", "declaredType=\"Difference\""];
    let kelvin = "unit=\"K\" relativeQuantity=\"true\"";
    let fahrenheit = "unit=\"degF\" relativeQuantity=\"true\"";
    let absolute = ["unit=\"degC\"", "unit=\"K\""];
    for (first, second, expected) in [
        (own, kelvin, 5.0),
        (typed, kelvin, 5.0),
        (kelvin, own, 5.0),
        (own, typed, 5.0),
        (own, fahrenheit, 9.0),
        (fahrenheit, kelvin, 25.0 / 9.0),
        ("declaredType=\"Difference\" relativeQuantity=\"false\"", absolute[1], 278.15),
        (absolute[0], absolute[1], 278.15),
    ] {
        let (lab, text) = relayed(first, second, "");
        run(&lab, &text).expect(0);
        let found = last(&lab, "b.x_out");
        assert!((found - expected).abs() < 1e-9, "{first} to {second}: {found}");
    }
    // Whoever reads a recording knows nothing of differences: the unit says it.
    let (lab, text) = relayed(own, fahrenheit, "");
    run(&lab, &text).expect(0);
    let titles = lab.read("out/run.csv").lines().next().expect("titles").to_owned();
    assert!(titles.contains("a.x_out [K]") && titles.contains("b.x_out [degR]"), "{titles}");
    for (from, expected) in [("x = '5 degC'", 5.0), ("x = '9 degF'", 5.0), ("x = '5 K'", 5.0)] {
        let (lab, text) = relayed(own, kelvin, "");
        run(&lab, &text.replace("x = 5.0", from)).expect(0);
        assert!((last(&lab, "b.x_out") - expected).abs() < 1e-9, "{from}");
    }
    let signal = "[[signal]]\nname = \"s.dT\"\nunit = \"degC\"\nconstant = 7.0\n[[connect]]\nfrom = \"s.dT\"\nto = \"a.x\"";
    let (lab, text) = relayed(own, kelvin, signal);
    run(&lab, &text.replace(", x = 5.0", "")).expect(0);
    assert!((last(&lab, "b.x_out") - 7.0).abs() < 1e-9);
    // A packed scenario keeps the attribute.
    let (lab, text) = relayed(own, kelvin, "");
    lab.write("case.toml", text);
    let pack = [
        "pack",
        "case.toml",
        "--fmu",
        "outer",
        "--out",
        ".",
        "--inputs",
        "a.x",
        "--outputs",
        "a.x_out",
        "b.x_out",
    ];
    lab.trackside(&pack).expect(0);
    let inspected = lab.trackside(&["inspect", "outer.fmu", "--json"]).expect(0).stdout;
    let inspected: serde_json::Value = serde_json::from_str(&inspected).expect("JSON");
    let of = |name: &str| {
        let mut all = inspected["variables"].as_array().expect("a list").iter();
        let found = all.find(|it| it["name"] == name).expect("a variable");
        (found["unit"].clone(), found["relative"].clone())
    };
    for (name, unit) in [("a.x", "degC"), ("a.x_out", "degC"), ("b.x_out", "K")] {
        assert_eq!(of(name), (unit.into(), true.into()), "{name}");
    }
}

fn a_difference_meets_no_point_on_a_scale_with_a_shifted_zero() {
    let (relative, absolute) = ("unit=\"degC\" relativeQuantity=\"true\"", "unit=\"degC\"");
    let (lab, text) = relayed(relative, absolute, "");
    let says = [
        "cannot connect `a.x_out` to `b.x`",
        "`a.x_out` [K] is a difference (relativeQuantity)",
        "`b.x` [degC] is a point on a scale with a shifted zero",
        "transform = { factor = 1.0, offset = 0.0 }",
    ];
    run(&lab, &text).expect(2).says(&says);
    let cured = text.replace("to = \"b.x\"", "to = \"b.x\"\ntransform = { factor = 1.0, offset = 0.0 }");
    run(&lab, &cured).expect(0);
    assert!((last(&lab, "b.x_out") - 5.0).abs() < 1e-9);
    let (lab, text) = relayed("unit=\"K\"", relative, "");
    run(&lab, &text).expect(2).says(&["`b.x` [K] is a difference (relativeQuantity)"]);
    let (lab, text) = relayed("unit=\"K\" relativeQuantity=\"true\"", "unit=\"K\"", "");
    run(&lab, &text).expect(0);
    let check = |that: &str| {
        let check = format!("[[check]]\nname = \"c\"\nthat = \"{that}\"");
        let (lab, text) = relayed(relative, "unit=\"K\" relativeQuantity=\"true\"", &check);
        run(&lab, &text)
    };
    check("a.x_out < 6 K and b.x_out == a.x_out").expect(0);
    check("a.x_out < 6 degC").expect(2).says(&["one is a difference", "such as `5 K`"]);
}

fn limits_of_declared_types_are_whole_numbers_of_64_bits() {
    let (lab, text) = relayed("declaredType=\"Share\"", "declaredType=\"Share\"", "");
    lab.write("values.toml", "x = 0.7\n");
    let given = text.replace(", x = 5.0 }", " }\nparameters = \"values.toml\"");
    run(&lab, &given).expect(0);
    assert!((last(&lab, "b.x_out") - 0.7).abs() < 1e-12);
    lab.write("values.toml", "x = 0.7000001\n");
    run(&lab, &given).expect(2).says(&["`x` is at most 0.7, found 0.7000001"]);
    let inspected = lab.trackside(&["inspect", "first.fmu", "--json"]).expect(0).stdout;
    let inspected: serde_json::Value = serde_json::from_str(&inspected).expect("JSON");
    let x = &inspected["variables"][0];
    assert_eq!((&x["max"], &x["nominal"]), (&0.7.into(), &1e300.into()));
}
