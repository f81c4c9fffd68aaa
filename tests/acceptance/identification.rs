//! Checks that identification recovers known tires, agrees with scipy, and points at mistakes.

use std::collections::BTreeSet;
use std::path::Path;

use super::harness::{Ended, Lab, ROOT, limit_handling, trackside};
use super::python::python;

tests! {
    a_recording_gives_the_tires_that_the_run_gave_and_they_drive_the_plant,
    noisy_sensors_in_a_closed_loop_give_the_tires_of_the_plant,
    the_optimum_is_the_one_of_scipy: Python,
    a_run_starts_from_what_an_earlier_one_found,
    the_same_seed_gives_the_same_numbers,
    a_wrong_setting_is_pointed_at_before_anything_runs,
    the_reference_of_the_plugin_is_that_of_its_schema,
}

/// Runs a scenario of a lab from the workspace, where the plugin is.
fn run(lab: &Lab, text: &str) -> Ended {
    let file = lab.write("case.toml", text);
    lab.write("cars/demo/car.toml", include_str!("../../scenarios/cars/demo/car.toml"));
    let mut command = trackside(Path::new(ROOT));
    let output = command.arg("run").arg(file).arg("--out").arg(lab.path("out")).output();
    Ended::of(output.expect("it starts"))
}

/// A scenario that identifies the tires of a run while it has it.
const DRIVING: &str = include_str!("../../scenarios/tires_from_driving.toml");

/// The same from the recording of the run, which `path` names.
fn from_recording(path: &Path) -> String {
    let analysis = &DRIVING[DRIVING.find("[[analysis]]").expect("it has one")..];
    let analysis = analysis[..analysis.find("[[check]]").expect("it has checks")].replace(
        "[analysis.signals]\n",
        &format!("[analysis.table]\npath = {path:?}\n\n[analysis.table.columns]\n"),
    );
    let column = |line: &str| match line.split_once(" = \"plant.") {
        Some((name, signal)) => format!("{name} = {{ column = \"plant.{signal} }}\n"),
        None => format!("{line}\n"),
    };
    analysis.lines().map(column).collect()
}

fn a_recording_gives_the_tires_that_the_run_gave_and_they_drive_the_plant() {
    let lab = Lab::new();
    run(&lab, DRIVING).expect(0);
    let recording = lab.path("driven.mcap");
    std::fs::copy(lab.path("out/run.mcap"), &recording).expect("a recording");
    let during = lab.report("out")["analyses"]["tires"].clone();
    let bytes = std::fs::read(&recording).expect("a recording");
    for stage in ["/tires/0 ", "/tires/1 ", "axle forces and slips"] {
        let found = bytes.windows(stage.len()).any(|bytes| bytes == stage.as_bytes());
        assert!(found, "no {stage} in the recording");
    }
    let page = lab.read("out/tires.html");
    assert!(page.contains("Front axle, lateral") && !page.contains("<script"));

    run(&lab, &from_recording(&recording)).expect(0);
    let afterwards = &lab.report("out")["analyses"]["tires"];
    for (axle, name) in [("front", "B"), ("front", "E"), ("rear", "C"), ("rear", "K")] {
        let of = |result: &serde_json::Value| {
            result["least_squares"][axle]["mean"][name].as_f64().expect("a number")
        };
        let (during, afterwards) = (of(&during), of(afterwards));
        assert!((during / afterwards - 1.0).abs() < 1e-6, "{axle} {name}: {during} {afterwards}");
    }

    let mut command = trackside(Path::new(ROOT));
    command.args(["run", "scenarios/step_steer.toml", "--rerun", "off", "--out"]);
    command.arg(lab.path("steer")).arg("--set");
    command.arg(format!("@{}", lab.path("out/tires.toml").display()));
    Ended::of(command.output().expect("it starts")).expect(0);
}

/// The configuration of a scenario's analysis.
fn car_and_task(scenario: &str) -> &str {
    let config = &scenario[scenario.find("[analysis.config]").expect("a configuration")..];
    &config[..config.find("[[").expect("more than that")]
}

fn noisy_sensors_in_a_closed_loop_give_the_tires_of_the_plant() {
    let lab = Lab::new();
    let recording = limit_handling().path("run/run.mcap");
    let measured = ["v_x", "v_y", "r", "a_y"].map(|name| (name, format!("{name}_meas")));
    let inputs = ["F_x", "delta"].map(|name| (name, name.to_owned()));
    let columns = measured.into_iter().chain(inputs);
    let columns = columns.map(|(name, signal)| format!("{name} = {{ column = \"estimator.{signal}\" }}\n"));
    let text = format!(
        "[[analysis]]\nname = \"tires\"\ncrate = \"identify\"\n\n{}\n[analysis.table]\npath = {recording:?}\n[analysis.table.columns]\n{}",
        car_and_task(include_str!("../../scenarios/closed_loop_identification.toml")),
        columns.collect::<String>()
    );
    run(&lab, &text).expect(0);
    let found = &lab.report("out")["analyses"]["tires"];
    for axle in ["front", "rear"] {
        for (name, truth) in [("B", 22.0), ("C", 1.8), ("D", 1.6), ("E", 0.8), ("K", 63.36)] {
            let value = found["pem"][axle]["mean"][name].as_f64().expect("a number");
            let part = if name == "K" { 0.003 } else { 0.01 };
            assert!((value / truth - 1.0).abs() < part, "{axle} {name}: {value}, truth {truth}");
        }
    }
    let [cost, expected] =
        ["cost", "expected_cost"].map(|name| found["innovations"][name].as_f64().expect("a number"));
    assert!((cost / expected - 1.0).abs() < 0.03, "{cost} {expected}");
    let bytes = std::fs::read(lab.path("out/run.mcap")).expect("a recording");
    let topic = b"/tires/whitened innovations";
    assert!(bytes.windows(topic.len()).any(|bytes| bytes == topic));
}

fn the_optimum_is_the_one_of_scipy() {
    let python = python();
    let lab = Lab::new();
    let csv = lab.path("curve.csv");
    python.run("fit_peer.py", &["make".as_ref(), csv.as_os_str()]);
    let text = "[[analysis]]\nname = \"tire\"\ncrate = \"identify\"\n\n[analysis.table]\npath = \"curve.csv\"\n\
                time = \"t\"\ncolumns = { slip = { column = \"slip\" }, force = { column = \"force\" } }\n\n\
                [analysis.config]\ntask = \"curve\"\ndirection = \"longitudinal\"\nfit = { hold = \"nothing\" }\n";
    run(&lab, text).expect(0);
    let report = lab.path("out/report.json");
    python.run("fit_peer.py", &["compare".as_ref(), csv.as_os_str(), report.as_os_str()]);
}

fn a_run_starts_from_what_an_earlier_one_found() {
    let lab = Lab::new();
    // One half of the points each, the tires and the noise being the same.
    let study = |turn: f64| {
        let force = |i: usize| {
            let u = 15.0 * 0.001 * i as f64;
            let v = u - 0.8 * (u - u.atan());
            1.5 * (2.0 * v.atan()).sin() + 0.05 * (1e4 * (i as f64 + turn).sin()).sin()
        };
        let rows = (0..400).map(|i| format!("{i},{},{}\n", 0.001 * i as f64, force(i)));
        format!("t,slip,force\n{}", rows.collect::<String>())
    };
    lab.write("first.csv", study(0.0));
    lab.write("second.csv", study(0.3));
    let text = |csv: &str, files: &str| {
        format!(
            "[[analysis]]\nname = \"tire\"\ncrate = \"identify\"\nexpect = \"any\"\n\n[analysis.table]\npath = \"{csv}\"\ntime = \"t\"\n\
             columns = {{ slip = {{ column = \"slip\" }}, force = {{ column = \"force\" }} }}\n\n{files}\
             [analysis.config]\ntask = \"curve\"\ndirection = \"longitudinal\"\n"
        )
    };
    let std = |csv: &str, files: &str| {
        run(&lab, &text(csv, files)).expect(0);
        let found = &lab.report("out")["analyses"]["tire"]["least_squares"]["curve"];
        found["std"]["K"].as_f64().expect("a number")
    };
    let alone = std("second.csv", "");
    std("first.csv", "");
    std::fs::copy(lab.path("out/report.json"), lab.path("first.json")).expect("a report");
    let after = std("second.csv", "[analysis.files]\nprior = \"first.json\"\n\n");
    let ratio = after / alone;
    assert!((0.6..0.85).contains(&ratio), "twice the data: {ratio} times the width");
}

fn the_same_seed_gives_the_same_numbers() {
    let lab = Lab::new();
    let study = "[[analysis]]\nname = \"study\"\ncrate = \"identify\"\nconfig = { task = \"excitation_study\", \
                 levels = [0.08], samples = 400 }\n";
    let result = || {
        run(&lab, study).expect(0);
        lab.report("out")["analyses"].clone()
    };
    assert_eq!(result(), result());
}

fn a_wrong_setting_is_pointed_at_before_anything_runs() {
    let lab = Lab::new();
    lab.write("log.csv", "t,v_x\n0,1\n1,1\n");
    let good = DRIVING;
    #[rustfmt::skip]
    let cases = [
        ("task = \"tires\"", "task = \"tyres\"", "tyres", "unknown value `tyres`"),
        ("window = 0.01", "window = -0.01", "yaw_rate = ", "`smooth.yaw_rate.window` is -0.01, expected a positive number"),
        ("offsets =", "ofsets =", "ofsets", "did you mean `offsets`?"),
        ("a_y = \"plant.a_y\"\n", "", "\"tires\"\ncrate", "signal `a_y` (lateral acceleration [m/s²]) is missing"),
        ("task = \"tires\"", "task = \"tires\"\nlateral = { bounds = { B = [9.0, 2.0] } }", "B = [", "expected two rising numbers"),
        ("task = \"tires\"", "task = \"tires\"\nlateral = {\n  bounds = {\n    C = [1.0, 2.0],\n    B = [9.0, 2.0],\n  },\n}", "B = [", "expected two rising numbers, found 9 and 2"),
        ("[analysis.signals]", "[analysis.config.lateral]\nboundz = { B = [2.0, 9.0] }\n\n[analysis.signals]", "boundz", "did you mean `bounds`?"),
        ("crate = \"identify\"\nparameters = \"cars/demo/car.toml\"", "crate = \"identify\"", "[analysis.config.car]", "`body.I_zz`: yaw moment of inertia [kg·m²], for"),
        ("exact = true", "exact = true\nbody = { x = 1.0 }", "body = {", "unknown key `x`"),
        ("order = 2", "ordr = 2", "ordr", "did you mean `order`?"),
        ("task = \"tires\"", "task = \"tires\"\nmethods = []", "methods", "expected one method or more"),
        ("[analysis.signals]", "[analysis.files]\nprior = \"no.json\"\n\n[analysis.signals]", "no.json", "no.json cannot be read"),
        ("[analysis.signals]", "[analysis.files]\nprior = \"log.csv\"\n\n[analysis.signals]", "prior", "expected a report in JSON"),
    ];
    for (old, new, at, says) in cases {
        let text = good.replacen(old, new, 1);
        assert_ne!(text, good, "{old}");
        let offset = text.find(at).unwrap_or_else(|| panic!("no {at} in {text}"));
        let line = format!("case.toml:{}:", 1 + text[..offset].matches('\n').count());
        run(&lab, &text).expect(2).says(&[says, &line]);
        assert!(!lab.has("out"), "{new}");
    }
    let text = good.replacen("offsets =", "ofsets =", 1).replacen("order = 2", "ordr = 2", 1);
    run(&lab, &text).expect(2).says(&["mean `offsets`?", "mean `order`?", "2 mistakes"]);
}

fn the_reference_of_the_plugin_is_that_of_its_schema() {
    let reference = in_root(&["explain", "--plugin", "identify", "--all"]);
    let path = Path::new(ROOT).join("docs/reference/identify.md");
    if std::env::var_os("BLESS").is_some() {
        std::fs::write(&path, &reference).expect("a file that can be written");
    }
    let found = std::fs::read_to_string(&path).unwrap_or_default();
    assert!(
        found == reference,
        "docs/reference/identify.md is not what the code makes: run `cargo run -- explain --plugin identify --all > docs/reference/identify.md`"
    );
    let schema = in_root(&["schema", "--plugin", "identify"]);
    let path = path.with_file_name("identify.schema.json");
    if std::env::var_os("BLESS").is_some() {
        std::fs::write(&path, &schema).expect("a file that can be written");
    }
    assert!(
        std::fs::read_to_string(&path).unwrap_or_default() == schema,
        "docs/reference/identify.schema.json is not what the code makes: run `cargo run -- schema --plugin identify > docs/reference/identify.schema.json`"
    );
    let schema = serde_json::from_str(&schema).expect("JSON");
    let mut keys = BTreeSet::new();
    collect_keys(&schema, &mut keys);
    assert!(keys.contains("axle_coupling") && keys.contains("threshold"), "{keys:?}");
    for key in keys {
        let named = [format!("`{key}`"), format!(".{key}`")];
        assert!(named.iter().any(|name| reference.contains(name)), "no {key} in the reference");
    }
    let bounds = in_root(&["explain", "lateral.bounds", "--plugin", "identify"]);
    assert!(bounds.contains("lateral.bounds") && bounds.contains("task = \"tires\""), "{bounds}");

    let mut configurations = 0;
    for entry in std::fs::read_dir(Path::new(ROOT).join("scenarios")).expect("a folder") {
        let path = entry.expect("an entry").path();
        if path.extension().is_none_or(|extension| extension != "toml") {
            continue;
        }
        let text = std::fs::read_to_string(&path).expect("a text");
        configurations += usize::from(text.contains("[analysis.config]"));
        let scenario = scenario::Scenario::read(&path).expect("a scenario");
        let findings = scenario.schema_violations(&["analysis", "0", "config"], &schema);
        assert!(findings.is_empty(), "{}: {findings:?}", path.display());
    }
    assert!(configurations >= 5, "{configurations}");
}

/// The output of a command in the root of the repository.
fn in_root(words: &[&str]) -> String {
    let output = trackside(Path::new(ROOT)).args(words).output();
    Ended::of(output.expect("it starts")).expect(0).stdout
}

/// The names of all keys in a schema.
fn collect_keys(schema: &serde_json::Value, keys: &mut BTreeSet<String>) {
    if let Some(properties) = schema["properties"].as_object() {
        keys.extend(properties.keys().cloned());
    }
    match schema {
        serde_json::Value::Object(map) => map.values().for_each(|value| collect_keys(value, keys)),
        serde_json::Value::Array(list) => list.iter().for_each(|value| collect_keys(value, keys)),
        _ => {}
    }
}
