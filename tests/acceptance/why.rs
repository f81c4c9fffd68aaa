//! Explains why two runs differ: causes of many kinds, causes that cancel, runs that cannot be repeated.

use super::fixture::Scenario;
use super::fmus::{changed, drifting_relay, ours, relay};
use super::harness::Lab;

tests! {
    a_change_of_each_kind_is_named,
    equal_runs_differ_in_nothing_in_one_line,
    of_many_differences_the_only_cause_is_found,
    causes_that_cancel_are_named,
    another_version_of_an_fmu_differs_by_itself: Compiler,
    a_failed_baseline_is_explained,
    a_flipped_check_names_its_cause,
    a_run_that_cannot_be_repeated_is_compared_as_far_as_it_goes,
    damaged_and_missing_runs_are_mistakes,
}

/// The plant, steered by a sine, whose yaw rate an output of a second plant follows.
fn scenario() -> String {
    Scenario::new()
        .time(0.01, 0.5)
        .fmu("plant", "plant.fmu", "start.v_x = 20.0, F_x = 0.0")
        .signal("driver.delta", "unit = \"deg\"\nsine = { amplitude = 2.0, frequency = 1.0 }")
        .connect("driver.delta", "plant.delta")
        .check("drives on", "plant.v_x > 10")
        .text()
}

fn lab() -> Lab {
    let lab = Lab::new();
    lab.add(&ours().join("plant.fmu"));
    lab
}

fn run(lab: &Lab, out: &str, text: &str, more: &[&str]) {
    let file = format!("{out}.toml");
    lab.write(&file, text);
    lab.trackside(&[&["run", &file, "--out", out, "--rerun", "off"], more].concat()).completes();
}

/// The answer to why `b` differs from `a`.
#[track_caller]
fn why(lab: &Lab, a: &str, b: &str, code: i32) -> serde_json::Value {
    let answer = lab.trackside(&["why", a, b, "--json"]).expect(code);
    serde_json::from_str(&answer.stdout).expect("JSON")
}

/// The places of the differences that are causes.
fn causes(answer: &serde_json::Value) -> Vec<String> {
    let causes = answer["causes"].as_array().expect("a list").iter();
    let numbers = causes.flat_map(|cause| cause["differences"].as_array().expect("a list"));
    let place = |number: &serde_json::Value| {
        let number = number.as_u64().expect("a number") as usize;
        answer["differences"][number]["place"].as_str().expect("a text").to_owned()
    };
    numbers.map(place).collect()
}

fn a_change_of_each_kind_is_named() {
    let lab = lab();
    let base = scenario();
    run(&lab, "a", &base, &[]);
    let (mass, none): (&[&str], &[&str]) = (&["--set", "plant.body.m=820"], &[]);
    let cases = [
        ("plant.body.m", base.clone(), mass),
        ("plant.start.v_x", base.replace("start.v_x = 20.0", "start.v_x = 21.0"), none),
        ("signal.driver.delta.sine.amplitude", base.replace("amplitude = 2.0", "amplitude = 2.5"), none),
        (
            "connect.plant.delta.gain",
            base.replace("to = \"plant.delta\"", "to = \"plant.delta\"\ngain = -1.0"),
            none,
        ),
        ("time.step", base.replace("step = 0.01", "step = 0.005"), none),
        ("signal.driver.delta.unit", base.replace("unit = \"deg\"", "unit = \"rad\""), none),
    ];
    for (place, text, more) in cases {
        assert!(more.len() == 2 || text != base, "{place}");
        run(&lab, "b", &text, more);
        let answer = why(&lab, "a", "b", 1);
        assert_eq!(causes(&answer), [place], "{answer:#}");
        assert_eq!(answer["causes"][0]["effect"], "all", "{place}");
    }
    let page = lab.read("b/why.html");
    assert!(page.contains("signal.driver.delta.unit") && page.contains("All of it is"), "{page}");
}

fn equal_runs_differ_in_nothing_in_one_line() {
    let lab = lab();
    run(&lab, "a", &scenario(), &[]);
    run(&lab, "b", &scenario().replace("title = ", "title = \"Another title\" # "), &[]);
    let answer = lab.trackside(&["why", "a", "b"]).expect(0);
    assert!(answer.stdout.starts_with("The runs differ in nothing that is simulated"), "{}", answer.stdout);
}

fn of_many_differences_the_only_cause_is_found() {
    let lab = lab();
    run(&lab, "a", &scenario(), &[]);
    // Faults at a time that the run does not reach, a seed that nothing needs, and the mass.
    let faults: String = (0..40)
        .map(|place| format!("[[signal]]\nname = \"idle.s{place}\"\nconstant = {place}.0\n"))
        .collect();
    run(&lab, "b", &(scenario() + &faults), &["--set", "plant.body.m=820", "--seed", "9"]);
    let answer = why(&lab, "a", "b", 1);
    assert_eq!(causes(&answer), ["plant.body.m"], "{answer:#}");
    assert_eq!(answer["without_effect"].as_array().map(Vec::len), Some(41), "{answer:#}");
    assert!(answer["runs"].as_u64() <= Some(17 + 3), "{answer:#}");
    // Two causes are told apart, with the share of each.
    run(&lab, "c", &scenario(), &["--set", "plant.body.m=820", "--set", "plant.start.v_x=21", "--seed", "9"]);
    let mut found = causes(&why(&lab, "a", "c", 1));
    found.sort();
    assert_eq!(found, ["plant.body.m", "plant.start.v_x"]);
}

fn causes_that_cancel_are_named() {
    let lab = lab();
    let base = scenario();
    run(&lab, "a", &base, &[]);
    let twice = base
        .replace("amplitude = 2.0", "amplitude = 4.0")
        .replace("to = \"plant.delta\"", "to = \"plant.delta\"\ngain = 0.5");
    run(&lab, "b", &twice, &[]);
    let text = lab.trackside(&["why", "a", "b"]).expect(1).stdout;
    for words in [
        "signal.driver.delta.sine.amplitude: 2 -> 4",
        "connect.plant.delta.gain: none -> 0.5",
        "driver.delta",
    ] {
        assert!(text.contains(words), "no {words} in {text}");
    }
}

fn another_version_of_an_fmu_differs_by_itself() {
    let lab = Lab::new();
    lab.write("relay.fmu", relay());
    let text = Scenario::new()
        .time(0.1, 1.0)
        .fmu("relay", "relay.fmu", "n = 0, on = false, text = \"\", mode = 1, gear = 1")
        .signal("source.x", "ramp = { start = 0.0, end = 1.0, after = 1.0 }")
        .connect("source.x", "relay.x")
        .text();
    run(&lab, "a", &text, &[]);
    lab.write("relay.fmu", drifting_relay(0.01));
    run(&lab, "b", &text, &[]);
    let answer = why(&lab, "a", "b", 1);
    assert_eq!(causes(&answer), ["fmu.relay"], "{answer:#}");
    assert_eq!(answer["local"][0]["node"], "relay", "{answer:#}");
    assert!(answer["differences"][0]["details"].to_string().contains("binaries/"), "{answer:#}");
    // Packed again with the same files, it is no cause.
    let again = changed(&lab.path("relay.fmu"), |name, bytes| Some((name.to_owned(), bytes)));
    lab.write("relay.fmu", again);
    run(&lab, "c", &text, &[]);
    assert!(why(&lab, "b", "c", 0)["same"].as_bool().expect("a truth value"));
}

fn a_failed_baseline_is_explained() {
    let lab = lab();
    let text = scenario() + "[[baseline]]\nname = \"as before\"\nrecording = \"golden.csv\"\nrelative = 0\n";
    lab.write("case.toml", &text);
    lab.trackside(&["run", "case.toml", "--out", "out", "--rerun", "off", "--bless"]).expect(0);
    assert!(lab.has("golden.csv.inputs.zip"));
    let line = "why `as before` failed: All of it is plant.body.m: 780 kg -> 820 kg.";
    let set = text.replace("start.v_x = 20.0", "start.v_x = 20.0, body.m = 820.0");
    lab.write("case.toml", set);
    let failed = lab.trackside(&["run", "case.toml", "--out", "out", "--rerun", "off"]).expect(1);
    assert!(failed.stdout.contains(line), "{}", failed.stdout);
    let tested = lab.trackside(&["test", "case.toml", "--why"]).expect(1);
    assert!(tested.stdout.contains(line), "{}", tested.stdout);
    // Without the inputs of the baseline its values still tell the node.
    std::fs::remove_file(lab.path("golden.csv.inputs.zip")).expect("a file");
    let answer = why(&lab, "golden.csv", "out", 1);
    assert_eq!(answer["local"][0]["node"], "plant", "{answer:#}");
}

fn a_flipped_check_names_its_cause() {
    let lab = lab();
    run(&lab, "a", &scenario(), &[]);
    run(&lab, "b", &scenario().replace("plant.v_x > 10", "plant.v_x > 30"), &[]);
    let answer = why(&lab, "a", "b", 0);
    let summary = "The runs differ only in the limit of the check `drives on` (10 -> 30 m/s)";
    assert!(answer["summary"].as_str().is_some_and(|it| it.starts_with(summary)), "{answer:#}");
    assert_eq!(answer["checks"][0]["flipped_by"], "check", "{answer:#}");
    let page = lab.read("b/why.html");
    assert!(page.contains("./../a/report.html") && page.contains("passed → failed"), "{page}");
    run(&lab, "c", &scenario(), &["--set", "plant.start.v_x=8"]);
    let text = lab.trackside(&["why", "a", "c"]).expect(1).stdout;
    assert!(text.contains("drives on: passed -> failed because the value moved"), "{text}");
}

fn a_run_that_cannot_be_repeated_is_compared_as_far_as_it_goes() {
    let lab = lab();
    run(&lab, "a", &scenario(), &[]);
    run(&lab, "b", &scenario(), &["--set", "plant.body.m=820"]);
    std::fs::remove_file(lab.path("a/run.inputs.zip")).expect("a file");
    let answer = why(&lab, "a", "b", 1);
    assert!(answer["notes"].to_string().contains("A cannot be repeated"), "{answer:#}");
    assert_eq!(answer["first_deviation"]["node"], "plant", "{answer:#}");
    assert_eq!(answer["local"][0]["node"], "plant", "{answer:#}");
    lab.write("b/run.inputs.zip", b"no archive");
    let answer = why(&lab, "a", "b", 1);
    assert!(answer["notes"].to_string().contains("B cannot be repeated"), "{answer:#}");
}

fn damaged_and_missing_runs_are_mistakes() {
    let lab = lab();
    run(&lab, "a", &scenario(), &[]);
    lab.trackside(&["why", "a", "nothing"]).expect(2).says(&["found nothing at nothing"]);
    lab.write("empty/notes.txt", "mine");
    lab.trackside(&["why", "a", "empty"]).expect(2);
    run(&lab, "b", &scenario(), &[]);
    lab.write("b/report.json", "{");
    lab.trackside(&["why", "a", "b"]).expect(2).says(&["b/report.json", "expected the report of a run"]);
}
