//! Checks the output, exit codes and files of the commands for valid input.

use super::fixture::Scenario;
use super::fmus::ours;
use super::harness::{Ended, Lab, ROOT, trackside};

tests! {
    inspect_lists_variables_units_and_dependencies,
    a_passing_run_prints_a_summary_and_nothing_on_stderr,
    a_failing_command_prints_the_reason,
    set_changes_the_result,
    set_reaches_signals_effects_and_faults,
    a_value_that_cannot_be_set_is_told,
    several_scenarios_get_a_folder_each_and_the_worst_exit_code_counts,
    test_distinguishes_passed_failed_broken_and_skipped,
    implausible_parameters_steps_and_checks_are_told_with_their_places,
    an_example_is_packed_by_one_command_and_built_by_a_scenario,
    #[cfg(unix)]
    view_opens_the_matching_viewer_or_explains_its_installation,
    a_file_of_another_kind_is_named_as_such,
}

/// A car that coasts, with a check on how far it comes.
fn coasting(check: &str) -> String {
    Scenario::headed("title = \"Coasting\"")
        .time(0.01, 1.0)
        .fmu("plant", "plant.fmu", "start.v_x = 20.0, F_x = 1000.0, delta = 0.02")
        .check("distance", check)
        .text()
}

fn lab() -> Lab {
    let lab = Lab::new();
    lab.add(&ours().join("plant.fmu"));
    lab.write("good.toml", coasting("plant.X < 30"));
    lab
}

fn inspect_lists_variables_units_and_dependencies() {
    let ended = lab().trackside(&["inspect", "plant.fmu"]).expect(0);
    let words = ended.stdout.lines().map(|line| line.split_whitespace().collect::<Vec<_>>().join(" "));
    let lines: Vec<_> = words.collect();
    for expected in [
        "model plant",
        "platforms linux64",
        "default step 0.01 s",
        "get and set state yes",
        "input Real F_x [N] = 0 Driving force; braking when negative",
        "output Real v_x [m/s] Forward speed of the centre of gravity follows nothing",
        "output Real a_y [m/s2] Acceleration to the left follows F_x, delta, mu_f, mu_r, grade, bank",
        "output Real alpha_f [rad] Front slip angle follows delta",
    ] {
        assert!(lines.iter().any(|line| line == expected), "{expected}\n{}", ended.stdout);
    }
    let parameter = lines.iter().find(|line| line.starts_with("parameter Real body.m [kg] = "));
    assert!(parameter.is_some(), "{}", ended.stdout);
}

fn a_passing_run_prints_a_summary_and_nothing_on_stderr() {
    let lab = lab();
    let ended = lab.trackside(&["run", "good.toml"]).expect(0);
    assert_eq!(ended.stderr, "");
    for expected in ["good: Coasting", "ok      distance", "1.0 s simulated in", "the check passed"] {
        assert!(ended.stdout.contains(expected), "{expected}\n{}", ended.stdout);
    }
    assert!(lab.has("target/runs/good/report.json") && lab.has("target/runs/good/run.mcap"));
    assert!(!lab.has("target/runs/good/run.csv"), "nobody asked for it");
}

fn a_failing_command_prints_the_reason() {
    let lab = lab();
    lab.write("text.fmu", "no archive");
    lab.write("drive.xlsx", "PK\u{3}\u{4}");
    for (arguments, says) in [
        (&["inspect", "nowhere.fmu"][..], "cannot read nowhere.fmu"),
        (&["inspect", "text.fmu"], "text.fmu is not an .fmu archive"),
        (&["inspect", "drive.xlsx"], "drive.xlsx is a ZIP archive"),
        (&["inspect", "--dot", "text.fmu"], "expected a scenario for `--dot`"),
        (&["inspect", "--all", "text.fmu"], "expected a log for `--all`, found text.fmu"),
        (&["test", "nowhere"], "cannot read nowhere"),
        (&["test", "nowhere.toml"], "cannot read nowhere.toml"),
        (
            &["test", ".", "god.toml"],
            "cannot read god.toml: there is no such scenario or folder, so no scenario was run",
        ),
        (&["test", ".", "god.toml"], "did you mean `good.toml`?"),
        (&["pack", "plant-fmu"], "no cargo workspace"),
        (&["run", "--csv"], "required"),
        (&["rnu", "good.toml"], "rnu"),
    ] {
        lab.trackside(arguments).expect(2).says(&[says]);
    }
}

fn set_changes_the_result() {
    let lab = lab();
    lab.write("heavy.toml", "[plant]\nbody.m = 1600.0\n");
    let speed = |out: &str, more: &[&str]| {
        let arguments = [&["run", "good.toml", "--csv", "--out", out], more].concat();
        lab.trackside(&arguments).expect(0);
        last(&lab.table(&format!("{out}/run.csv")), "plant.v_x")
    };
    let (light, heavy) = (speed("a", &[]), speed("b", &["--set", "plant.body.m=1600"]));
    assert!(light > heavy + 0.1, "{light} m/s against {heavy} m/s");
    assert_eq!(speed("c", &["--set", "@heavy.toml"]).to_bits(), heavy.to_bits());
}

/// A car with a driver, a sensor effect and a fault.
fn driven() -> String {
    Scenario::headed("title = \"Driven\"")
        .time(0.01, 0.1)
        .fmu("plant", "plant.fmu", "start.v_x = 20.0")
        .signal("driver.delta", "unit = \"deg\"\nstep = { at = 0.05, after = 1.5 }")
        .signal("driver.F_x", "unit = \"N\"\nconstant = 0.0")
        .connect("driver.delta", "plant.delta")
        .key("bias = 0.0")
        .connect("driver.F_x", "plant.F_x")
        .section("[[fault]]\ninput = \"plant.F_x\"\nfrom = 0.05\nvalue = 0.0")
        .text()
}

fn set_reaches_signals_effects_and_faults() {
    let lab = lab();
    lab.write("driven.toml", driven());
    for (set, column, expected) in [
        ("driver.delta=3", "driver.delta", 3.0),
        ("driver.delta=4deg", "driver.delta", 4.0),
        ("driver.delta=0.5 rad", "driver.delta", 0.5_f64.to_degrees()),
        ("driver.delta.step.after=2", "driver.delta", 2.0),
        ("driver.delta.step.at=1", "driver.delta", 0.0),
        ("plant.delta.bias=0.25", "plant.delta", 1.5_f64.to_radians() + 0.25),
        ("plant.delta.gain=2", "plant.delta", 3_f64.to_radians()),
        ("plant.F_x.fault.value=40", "plant.F_x", 40.0),
        ("plant.start.v_x=100 km/h", "plant.v_x", 100.0 / 3.6),
    ] {
        let arguments = ["run", "driven.toml", "--csv", "--out", "out", "--rerun", "off", "--set", set];
        lab.trackside(&arguments).expect(0);
        let value = last(&lab.table("out/run.csv"), column);
        let near = if column == "plant.v_x" { 0.1 } else { 1e-9 };
        assert!((value - expected).abs() < near, "{set}: {column} is {value}, expected {expected}");
        assert_eq!(lab.report("out")["set"], serde_json::json!([set]));
    }
}

fn a_value_that_cannot_be_set_is_told() {
    let lab = lab();
    lab.write("log.csv", "t,v\n0,1\n1,2\n");
    lab.write(
        "driven.toml",
        driven()
            + "\n[[table]]\nname = \"log\"\npath = \"log.csv\"\ntime = \"t\"\ncolumns = { v = { column = \"v\" } }\n",
    );
    for (set, says) in [
        ("driver.dleta=3", &["unknown signal `driver.dleta`", "did you mean `driver.delta`?"][..]),
        ("drivr.delta=3", &["unknown node `drivr`", "did you mean `driver`?"]),
        ("driver.delta=fast", &["--set driver.delta", "expected a number, found a text"]),
        ("driver.delta=3 m", &["--set driver.delta", "expected a value in [deg], found one in [m]"]),
        ("driver.delta=3 degs", &["unknown unit `degs`", "did you mean `deg`?"]),
        ("driver.delta.stp.after=3", &["unknown key `stp`", "did you mean `step`?"]),
        ("driver.delta.step.aftr=3", &["unknown key `aftr`", "did you mean `after`?"]),
        ("driver.delta.sine.frequency=3", &["the key `amplitude` is missing"]),
        ("plant.delta.noise.sdt=3", &["unknown key `sdt`", "did you mean `std`?"]),
        ("plant.F_x.fault.valu=3", &["unknown key `valu`", "did you mean `value`?"]),
        (
            "plant.start.v_x=100 km",
            &["--set plant.start.v_x", "expected a value in [m/s], found one in [km]"],
        ),
        ("log.v=3", &["`log` is a table"]),
    ] {
        let ended = lab.trackside(&["run", "driven.toml", "--out", "wrong", "--set", set]).expect(2);
        ended.says(says);
        assert!(!lab.has("wrong"), "{set}");
    }
    // All of them at once.
    let set = ["--set", "driver.delta=fast", "--set", "plant.bdy.m=3", "--set", "plant.delta.gain=big"];
    let ended = lab.trackside(&[&["run", "driven.toml", "--out", "wrong"][..], &set].concat());
    ended.expect(2).says(&[
        "--set driver.delta",
        "--set plant.bdy.m",
        "--set plant.delta.gain",
        "3 mistakes",
    ]);
}

/// The last value of a column.
fn last(csv: &str, column: &str) -> f64 {
    let mut lines = csv.lines();
    let names = lines.next().expect("a header");
    let index = names.split(',').position(|name| name == column).expect("the column");
    let cell = lines.next_back().and_then(|line| line.split(',').nth(index));
    cell.expect("a row").parse().expect("a number")
}

fn several_scenarios_get_a_folder_each_and_the_worst_exit_code_counts() {
    let lab = lab();
    lab.write("bad.toml", coasting("plant.X < 10"));
    let ended = lab.trackside(&["run", "bad.toml", "good.toml", "--out", "all"]).expect(1);
    assert!(ended.stdout.contains("FAILED  distance"), "{}", ended.stdout);
    assert_eq!(lab.report("all/bad")["verdict"], "fail");
    assert_eq!(lab.report("all/good")["verdict"], "pass");
}

fn test_distinguishes_passed_failed_broken_and_skipped() {
    let lab = lab();
    lab.write("fails.toml", coasting("plant.X < 10"));
    lab.write("broken.toml", coasting("plnt.X < 10"));
    let table = "\n[[table]]\nname = \"log\"\npath = \"log.csv\"\ntime = \"t\"\ncolumns = {}\n";
    lab.write("skipped.toml", coasting("plant.X < 30") + table);
    let unchecked = coasting("plant.X < 30");
    lab.write("unchecked.toml", unchecked.split("[[check]]").next().expect("the part before the check"));
    let ended = lab.trackside(&["test", ".", "--junit", "results.xml"]).expect(1);
    for line in [
        "ok       ./good.toml",
        "FAILED   ./fails.toml",
        "FAILED   ./broken.toml",
        "skipped  ./skipped.toml",
        "did you mean `plant.X`?",
        "  FAILED  distance  plant.X < 10  (",
        "  ./fails.toml:13",
        "log.csv is not there",
        "s  (no checks)",
        "2 passed (1 without checks), 2 failed, 1 skipped",
    ] {
        assert!(ended.stdout.contains(line), "{line}\n{}", ended.stdout);
    }
    // Page, file and JUnit have the place of a mistake and what was meant.
    let page = lab.read("target/runs/suite.html");
    for expected in [
        "./broken.toml:14:",
        "did you mean `plant.X`?",
        "<span class=\"title\">Coasting</span>",
        "trackside test .",
    ] {
        assert!(page.contains(expected), "{expected} is not in\n{page}");
    }
    let kept: serde_json::Value = serde_json::from_str(&lab.read("target/runs/suite.json")).expect("JSON");
    let error = &kept["scenarios"]["./broken.toml"]["errors"][0];
    assert_eq!(
        (&error["help"], &error["place"]["file"]),
        (&"did you mean `plant.X`?".into(), &"./broken.toml".into())
    );
    let ended = lab.trackside(&["run", "unchecked.toml", "--out", "unchecked"]).expect(0);
    assert!(ended.stdout.ends_with("no checks: the run is done, nothing was checked\n"), "{}", ended.stdout);
    assert_eq!(lab.report("unchecked")["verdict"], "no checks");
    assert!(lab.read("unchecked/report.html").contains("banner neutral\"><b>NO CHECKS</b>"));
    junit(&lab.read("results.xml"));
}

fn implausible_parameters_steps_and_checks_are_told_with_their_places() {
    let lab = lab();
    let text = coasting("plant.X < 1e9").replace("delta = 0.02", "delta = 0.02, body.h = 0.17");
    lab.write("case.toml", text.replace("step = 0.01", "step = 0.5"));
    let ended =
        lab.trackside(&["run", "case.toml", "--out", "out", "--set", "plant.body.l_f=1600"]).expect(0);
    ended.says(&[
        "--set plant.body.l_f: `plant` warns at 0 s: `body.l_f` is 1600 m, expected 0.6 to 2.8 m for a passenger car",
        "Is it 1600 mm = 1.6 m?",
        "case.toml:10: `plant` warns at 0 s: ",
        "`body.h` is 0.17 m, expected 0.3 to 1 m for a passenger car",
        "a small-scale car may have it",
        "case.toml:4: `plant` gets steps of 0.5 s, 50 times the 0.01 s that its description proposes (stepSize)",
        "case.toml:13: no value of this run could fail the check `distance`: the bound of `plant.X < 1e9`, 1e9 m, is more than a million",
        "`plant.X` was 0.0 to 20.57 m",
    ]);
    let report = lab.report("out");
    assert_eq!(report["messages"][0]["place"], "--set plant.body.l_f");
    assert_eq!(report["warnings"].as_array().map(Vec::len), Some(2), "{report}");
    let page = lab.read("out/report.html");
    assert!(
        page.contains("Is it 1600 mm = 1.6 m?") && page.contains("no value of this run could fail"),
        "{page}"
    );
}

fn junit(xml: &str) {
    for element in [
        "tests=\"5\" skipped=\"2\" failures=\"1\" errors=\"1\"",
        "<testsuite name=\"good\"",
        "<testcase name=\"distance\" classname=\"good\" file=\"./good.toml\" line=\"13\"",
        "<testcase name=\"distance\" classname=\"fails\" file=\"./fails.toml\" line=\"13\">",
        "<failure message=\"plant.X is 20.",
        " m at 1 s, limit 10.0 m",
        "<testcase name=\"run\" classname=\"broken\"",
        "<error message=\"check `distance`: unknown signal `plnt.X`\"",
        "<testcase name=\"run\" classname=\"skipped\"",
        "<skipped message=\"no checks: the run came to its end, and nothing was judged\"",
        "<skipped message=\"the data file ./log.csv is not there\"",
    ] {
        assert!(xml.contains(element), "{element}\n{xml}");
    }
}

fn an_example_is_packed_by_one_command_and_built_by_a_scenario() {
    let root = std::path::Path::new(ROOT);
    let lab = Lab::new();
    let mut pack = trackside(root);
    pack.args(["pack", "--example", "spring_damper", "--out"]).arg(lab.path("fmu"));
    let packed = Ended::of(pack.output().expect("it starts")).expect(0);
    assert!(packed.stdout.contains("spring_damper.fmu"), "{}", packed.stdout);
    // A mass of 1 kg at 100 N/m, damped by 1/s, swings back to -0.1 m exp(-pi / 9.95) = -0.0729 m.
    lab.write(
        "swing.toml",
        "[time]\nstep = 0.01\nstop = 2.0\n\n[[fmu]]\nname = \"mass\"\ncrate = \"fmu-export\"\n\
         example = \"spring_damper\"\nstart = { F = 0.0 }\n\n[[check]]\nname = \"swing\"\n\
         that = \"abs(mass.a + 100 1/s2 * mass.x + 2 1/s * mass.v) < 1e-9 and mass.x > -0.074\"\n",
    );
    let mut run = trackside(root);
    run.args(["run", "--rerun", "off", "--out"]).arg(lab.path("out")).arg(lab.path("swing.toml"));
    Ended::of(run.output().expect("it starts")).expect(0);
}

#[cfg(unix)]
fn view_opens_the_matching_viewer_or_explains_its_installation() {
    use std::os::unix::fs::PermissionsExt;
    let lab = Lab::new();
    lab.write("run/run.rrd", "");
    let view = |run: &str, version: Option<&str>| {
        if let Some(version) = version {
            let answer = format!("if [ \"$1\" = --version ]; then echo rerun-cli {version} [built]");
            let script = format!("#!/bin/sh\n{answer}; else echo \"opens $1\" > opened; fi\n");
            let path = lab.write("bin/rerun", script);
            std::fs::set_permissions(path, PermissionsExt::from_mode(0o755)).expect("a program");
        }
        let mut command = trackside(&lab.path(""));
        command.args(["view", run]).env("PATH", lab.path("bin")).env_remove("VIRTUAL_ENV");
        Ended::of(command.output().expect("it starts"))
    };
    let install = "pip install rerun-sdk==0.36.3";
    view("run", None).expect(2).says(&["no Rerun viewer", install]);
    view("run", Some("0.20.0")).expect(2).says(&["is version 0.20.0, expected 0.36.3", install]);
    view("nowhere", Some("0.36.3")).expect(2).says(&["nowhere has no recording"]);
    view("run", Some("0.41.0")).expect(0).says(&["is version 0.41.0", "0.32 to 0.41 open them"]);
    view("run", Some("0.36.3")).expect(0);
    assert_eq!(lab.read("opened").trim(), "opens run/run.rrd");
}

fn a_file_of_another_kind_is_named_as_such() {
    let lab = Lab::new();
    for (name, says) in [
        ("log.csv", "a table, which a scenario names"),
        ("run.mcap", "a recording: `trackside view` shows it"),
    ] {
        lab.write(name, [0xff, 0xfe, 0x00]);
        let expected = format!("expected a scenario in TOML, found {name}, {says}");
        lab.trackside(&["run", name]).expect(2).says(&[&expected]);
    }
    // An FMU runs by itself.
    lab.write("car.FMU", [0xff, 0xfe, 0x00]);
    lab.trackside(&["run", "car.FMU"]).expect(2).says(&["car.FMU is not an .fmu archive"]);
}
