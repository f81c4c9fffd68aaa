//! Compares runs with golden recordings: written, passed, failed with a picture, and across versions of an FMU.

use super::fixture::Scenario;
use super::fmus::{changed, drifting_relay, ours, relay};
use super::harness::{Ended, Lab};

tests! {
    a_blessed_run_is_a_baseline_that_the_next_one_passes: Compiler,
    a_run_that_differs_fails_with_first_and_worst_deviation_and_a_picture: Compiler,
    a_late_edge_passes_within_the_time_tolerance: Compiler,
    a_new_version_of_an_fmu_is_compared_with_the_old_one: Compiler,
    texts_are_compared_as_texts: Compiler,
    names_with_brackets_are_compared_and_played_back: Compiler,
    a_failed_run_is_never_blessed: Compiler,
    a_recording_of_others_is_replaced_by_force_only,
    the_suite_blesses_and_compares: Compiler,
}

/// The plant with a step of the steering angle at this time [s], and a baseline with these keys.
fn plant(at: f64, baseline: &str) -> String {
    Scenario::new()
        .time(0.01, 1.0)
        .fmu("plant", "plant.fmu", "start.v_x = 20.0, F_x = 0.0")
        .signal("driver.delta", &format!("unit = \"deg\"\nstep = {{ at = {at:?}, after = 1.0 }}"))
        .connect("driver.delta", "plant.delta")
        .check("drives on", "plant.v_x > 10")
        .section(&format!("[[baseline]]\nname = \"as before\"\n{baseline}"))
        .text()
}

fn lab() -> Lab {
    let lab = Lab::new();
    lab.add(&ours().join("plant.fmu"));
    lab
}

fn run(lab: &Lab, text: &str, more: &[&str]) -> Ended {
    lab.write("case.toml", text);
    lab.trackside(&[&["run", "case.toml", "--out", "out", "--rerun", "off"], more].concat())
}

fn a_blessed_run_is_a_baseline_that_the_next_one_passes() {
    for file in ["golden/plant.mcap", "golden/plant.csv"] {
        let lab = lab();
        // Nothing but rounding is allowed.
        let text = plant(0.5, &format!("recording = \"{file}\"\nrelative = 0"));
        run(&lab, &text, &[]).expect(2).says(&["there is no baseline golden/plant.", "--bless"]);
        assert!(!lab.has("out/report.json"));
        let blessed = run(&lab, &text, &["--bless"]).expect(0);
        assert!(blessed.stdout.contains(&format!("wrote the baseline {file}")), "{}", blessed.stdout);
        assert!(lab.has(file) && !lab.has("golden/plant.partial"));
        let passed = run(&lab, &text, &[]).expect(0);
        assert!(passed.stdout.contains("ok      as before  "), "{}", passed.stdout);
        assert!(passed.stdout.contains(&format!("signals as in {file}")), "{}", passed.stdout);
        let signals = &lab.report("out")["baselines"][0]["signals"];
        assert!(signals.as_array().is_some_and(|signals| signals.len() > 10), "{signals}");
        // Another step of the communication is compared at its own times.
        let finer = text
            .replace("step = 0.01\n", "step = 0.005\n")
            .replace("relative = 0", "relative = 0.3\ntime = 0.01");
        run(&lab, &finer, &[]).expect(0);
    }
}

fn a_run_that_differs_fails_with_first_and_worst_deviation_and_a_picture() {
    let lab = lab();
    let keys = "recording = \"golden.mcap\"\nsignals = [\"plant.v_x\", \"plant.r\"]\n\
                tubes = [{ signals = [\"plant.v*\"], absolute = 1.0 }]";
    run(&lab, &plant(0.5, keys), &["--bless"]).expect(0);
    let wrong = plant(0.5, keys).replace("after = 1.0", "after = 1.2");
    let failed = run(&lab, &wrong, &[]).expect(1);
    for part in ["FAILED  as before", "signals differ, first `plant.r` [rad/s]: ", "; worst ", "outside of ["]
    {
        assert!(failed.stdout.contains(part), "no {part:?} in {}", failed.stdout);
    }
    let report = lab.report("out");
    let outcome = &report["baselines"][0];
    let r = outcome["signals"].as_array().expect("signals").iter().find(|it| it["signal"] == "plant.r");
    let r = r.expect("the yaw rate");
    assert!(r["first"]["time"].as_f64() > Some(0.5) && r["first"]["time"].as_f64() < Some(0.6), "{r}");
    assert!(r["worst"]["value"].as_f64() > r["worst"]["upper"].as_f64(), "{r}");
    let check = report["checks"].as_array().expect("checks").iter().find(|it| it["name"] == "as before");
    let check = check.expect("it is a check");
    assert_eq!((&check["passed"], &check["value"]), (&false.into(), &r["worst"]["value"]));
    assert!(check["line"].as_u64() > Some(1) && check["margin"].as_f64() < Some(0.0), "{check}");
    assert_eq!(outcome["picture"], "baseline_as_before.svg");
    let picture = lab.read("out/baseline_as_before.svg");
    for part in [
        "<svg xmlns=",
        "plant.r: the run (orange) and the tube of “as before” (blue)",
        "class=\"band c0\"",
        "class=\"line c1\"",
        "plant.r [rad/s]",
    ] {
        assert!(picture.contains(part), "no {part:?} in the picture");
    }
    // The next run that passes leaves no old picture.
    run(&lab, &plant(0.5, keys), &[]).expect(0);
    assert!(!lab.has("out/baseline_as_before.svg"));
}

fn a_late_edge_passes_within_the_time_tolerance() {
    let lab = lab();
    let keys = |more: &str| format!("recording = \"golden.mcap\"\nsignals = [\"driver.delta\"]\n{more}");
    run(&lab, &plant(0.5, &keys("")), &["--bless"]).expect(0);
    run(&lab, &plant(0.53, &keys("")), &[]).expect(1);
    run(&lab, &plant(0.53, &keys("time = 0.03")), &[]).expect(0);
    run(&lab, &plant(0.55, &keys("time = 0.03")), &[]).expect(1);
    run(&lab, &plant(0.55, &keys("during = [0.0, 0.4]")), &[]).expect(0);
    let tubes = "tubes = [{ signals = [\"driver.*\"], absolute = 1.0 }]";
    run(&lab, &plant(0.55, &keys(tubes)), &[]).expect(0);
}

/// The recipe of the documentation: a baseline by the old FMU, then a run with the new one.
fn a_new_version_of_an_fmu_is_compared_with_the_old_one() {
    let lab = Lab::new();
    let text = |baseline: &str| {
        let start = "n = 0, on = false, text = \"\", mode = \"off\", gear = \"drive\"";
        Scenario::new()
            .time(0.01, 0.2)
            .fmu("relay", "relay.fmu", start)
            .signal("driver.x", "ramp = { start = 0.0, end = 0.2, after = 1.0 }")
            .connect("driver.x", "relay.x")
            .section(&format!(
                "[[baseline]]\nname = \"version 1\"\n{baseline}\nsignals = [\"relay.*\"]\nrelative = 0\nabsolute = 1e-3"
            ))
            .text()
    };
    let golden = text("recording = \"golden.mcap\"");
    lab.write("relay.fmu", relay());
    run(&lab, &golden, &["--bless"]).expect(0);
    lab.write("relay.fmu", drifting_relay(4e-5));
    run(&lab, &golden, &[]).expect(0);
    lab.write("relay.fmu", drifting_relay(1e-4));
    let failed = run(&lab, &golden, &[]).expect(1);
    assert!(failed.stdout.contains("1 of "), "{}", failed.stdout);
    assert!(failed.stdout.contains("first `relay.x_out`"), "{}", failed.stdout);
    // The folder of an earlier run serves as well.
    let earlier = text("recording = \"earlier/run.mcap\"");
    lab.write("relay.fmu", relay());
    lab.write("case.toml", text("recording = \"golden.mcap\""));
    lab.trackside(&["run", "case.toml", "--out", "earlier", "--rerun", "off"]).expect(0);
    lab.write("relay.fmu", drifting_relay(1e-4));
    run(&lab, &earlier, &[]).expect(1);
    lab.write("case.toml", &earlier);
    let same = lab.trackside(&["run", "case.toml", "--out", "earlier"]).expect(2);
    same.says(&["`earlier/run.mcap` is in the folder that the results go to"]);
}

/// A text that is empty, and one that looks like a number, in either form of recording.
/// A relay whose variables have other names.
fn renamed(lab: &Lab, name: &str, names: &[(&str, &str)]) {
    lab.write("relay.fmu", relay());
    let fmu = changed(&lab.path("relay.fmu"), |file, bytes| {
        let named = |text: String, (from, to): &(&str, &str)| {
            text.replace(&format!("name=\"{from}\""), &format!("name=\"{to}\""))
        };
        let bytes = match file {
            "modelDescription.xml" => {
                let text = String::from_utf8(bytes).expect("a text");
                names.iter().fold(text, named).into_bytes()
            }
            _ => bytes,
        };
        Some((file.to_owned(), bytes))
    });
    lab.write(name, fmu);
}

fn names_with_brackets_are_compared_and_played_back() {
    let lab = Lab::new();
    // `h` and `s` are units, and some names differ by brackets only.
    let names = [("x_out", "der(h)"), ("n_out", "h"), ("on_out", "w[s]"), ("mode_out", "der")];
    renamed(&lab, "odd.fmu", &names);
    renamed(
        &lab,
        "odder.fmu",
        &[("x_out", "a[1].b (s)"), ("n_out", "der(body.v, 2)"), ("on_out", "'q, \u{e4}'")],
    );
    let fmu = |name: &str| {
        format!(
            "[[fmu]]\nname = \"{name}\"\npath = \"{name}.fmu\"\nunconnected = \"start\"\nstart = {{ gear = \"reverse\" }}\n"
        )
    };
    let head = "[time]\nstep = 0.1\nstop = 0.5\n";
    let both = fmu("odd") + &fmu("odder");
    for file in ["golden.csv", "golden.mcap"] {
        let baseline = format!("[[baseline]]\nname = \"as before\"\nrecording = \"{file}\"\nrelative = 0\n");
        let checks = "[[check]]\nname = \"derivative\"\nthat = \"odd.der(h) >= 0 and `odder.a[1].b (s)` == odd.der(h)\"\n";
        let text = format!("{head}{both}{baseline}{checks}");
        run(&lab, &text, &["--bless", "--csv", "--parquet"]).expect(0);
        let passed = run(&lab, &text, &[]).expect(0);
        assert!(passed.stdout.contains("10 signals as in"), "{}", passed.stdout);
    }
    run(&lab, &format!("{head}{both}"), &["--csv", "--parquet"]).expect(0);
    // The next run takes the folder.
    std::fs::copy(lab.path("out/run.parquet"), lab.path("played.parquet")).expect("a copy");
    for file in ["golden.csv", "golden.mcap", "played.parquet"] {
        let time = if file.ends_with("mcap") { "" } else { "time = \"time\"\n" };
        let table = format!(
            "[[table]]\nname = \"log\"\npath = \"{file}\"\n{time}columns.v = {{ column = \"odd.der(h)\", unit = \"m/s\" }}\n\
             columns.w = {{ column = \"odder.a[1].b (s)\", unit = \"m/s\" }}\n"
        );
        let check = "[[check]]\nname = \"same\"\nthat = \"abs(last(log.v) - 5 / 3) < 1e-12 and last(log.w) == last(log.v)\"\n";
        run(&lab, &format!("{head}{table}{check}"), &[]).expect(0);
    }
}

fn texts_are_compared_as_texts() {
    for file in ["golden.mcap", "golden.csv"] {
        let lab = Lab::new();
        lab.write("relay.fmu", relay());
        let text = |label: &str| {
            let start = format!("x = 0, n = 0, on = false, text = \"{label}\", mode = 1, gear = 1");
            let scenario = Scenario::new().time(0.1, 0.2).fmu("relay", "relay.fmu", &start);
            scenario.section(&format!("[[baseline]]\nname = \"b\"\nrecording = \"{file}\"")).text()
        };
        for label in ["", "12"] {
            run(&lab, &text(label), &["--bless"]).expect(0);
            run(&lab, &text(label), &[]).expect(0);
        }
        let failed = run(&lab, &text("13"), &[]).expect(1);
        assert!(failed.stdout.contains("another text at 0.000 s: \"13\""), "{}", failed.stdout);
    }
}

fn a_failed_run_is_never_blessed() {
    let lab = lab();
    let text = plant(0.5, "recording = \"golden.mcap\"").replace("plant.v_x > 10", "plant.v_x > 100");
    let failed = run(&lab, &text, &["--bless"]).expect(1);
    assert!(failed.stderr.contains("golden.mcap was not written: the run did not pass"), "{}", failed.stderr);
    assert!(!lab.has("golden.mcap"));
}

fn the_suite_blesses_and_compares() {
    let lab = lab();
    lab.write(
        "cases/case.toml",
        plant(0.5, "recording = \"../golden/case.csv\"").replace("plant.fmu", "../plant.fmu"),
    );
    lab.trackside(&["test", "cases"]).expect(1);
    lab.trackside(&["test", "cases", "--bless"]).expect(0);
    lab.trackside(&["test", "cases", "--junit", "junit.xml"]).expect(0);
    assert!(lab.read("junit.xml").contains("name=\"as before\""));
}

fn a_recording_of_others_is_replaced_by_force_only() {
    for file in ["measured.csv", "measured.mcap"] {
        let lab = Lab::new();
        let baseline = format!("[[baseline]]\nname = \"as before\"\nrecording = \"{file}\"");
        let text = Scenario::new().time(0.1, 1.0).signal("a.b", "constant = 1.0").section(&baseline).text();
        lab.write(file, "precious\n");
        let says = [&format!("{file} was not written by --bless") as &str, "--force", "case.toml:"];
        run(&lab, &text, &["--bless"]).expect(2).says(&says);
        assert!(lab.read(file) == "precious\n" && !lab.has("out"));
        run(&lab, &text, &["--force"]).expect(2);
        run(&lab, &text, &["--bless", "--force"]).expect(0);
        // From here on it is our own.
        run(&lab, &text, &["--bless"]).expect(0);
        run(&lab, &text, &[]).expect(0);
        lab.trackside(&["bless", "out"]).expect(0);
        run(&lab, &text, &["--bless"]).expect(0);
        run(&lab, &text, &[]).expect(0);
        // Until somebody writes into it.
        lab.write(file, "precious\n");
        lab.trackside(&["bless", "out"]).expect(2).says(&says[..2]);
        lab.trackside(&["test", "case.toml", "--bless"]).expect(1);
        assert_eq!(lab.read(file), "precious\n");
        lab.trackside(&["bless", "out", "--force"]).expect(0);
    }
}
