//! Checks that what an FMU or a plugin changes for the whole process is put back, and told once.

use super::ending::analysed;
use super::fixture::Scenario;
use super::fmus::{misbehave, relay};
use super::harness::{Ended, Lab};

tests! {
    numbers_of_other_nodes_do_not_depend_on_what_an_fmu_sets: Compiler,
    traps_that_no_library_sets_are_put_back_after_some_steps: Compiler,
    what_an_instance_sets_for_the_process_is_put_back: Compiler,
    what_a_step_sets_for_files_is_put_back: Compiler,
    what_a_plugin_sets_is_put_back: Compiler,
    a_late_step_is_watched_as_an_early_one: Compiler,
}

/// A node that may set something in its steps, and others with numbers that are rounded, and tiny ones; to a time [s].
fn scenario(fault: &str, stop: f64) -> String {
    let start = format!("u = 0.0, fault = '{fault}', at = 0.375");
    // The times of its steps are exact, so its own number does not depend on how it rounds.
    let odd = Scenario::new().time(0.125, stop).fmu("tank", "misbehave.fmu", &start);
    let keep = "unconnected = 'start'";
    let others =
        ["one", "small", "tiny"].iter().fold(odd, |nodes, name| nodes.fmu(name, "relay.fmu", "").key(keep));
    others
        .signal("driver.u", "ramp = { start = 0.0, end = 1.0, before = 0.1, after = 0.9 }")
        .signal("driver.small", "ramp = { start = 0.0, end = 2.0, before = 0.0, after = 1e-150 }")
        .connect("driver.u", "one.x")
        .key("gain = 0.1\nbias = 1e-3")
        .connect("driver.small", "small.x")
        .key("gain = 1e-150")
        .connect("small.x_out", "tiny.x")
        .key("gain = 1e-10")
        .check("tiny", "tiny.x_out > 0")
        .key("during = [0.5, 1.0]")
        .text()
}

fn run(text: &str) -> (Lab, Ended) {
    let lab = Lab::new();
    lab.write("misbehave.fmu", misbehave());
    lab.write("relay.fmu", relay());
    lab.write("case.toml", text);
    let ended = lab.trackside(&["run", "case.toml", "--out", "out", "--csv", "--rerun", "off"]);
    (lab, ended)
}

/// The warnings of the report, and what its nodes said.
fn warnings(lab: &Lab) -> Vec<String> {
    let report = lab.report("out");
    let warnings = report["warnings"].as_array().expect("a list").iter();
    let messages = report["messages"].as_array().expect("a list").iter();
    let texts = warnings.chain(messages.map(|it| &it["text"]));
    texts.map(|it| it.as_str().expect("a text").to_owned()).collect()
}

fn numbers_of_other_nodes_do_not_depend_on_what_an_fmu_sets() {
    let (lab, ended) = run(&scenario("", 1.0));
    ended.expect(0);
    let (table, calm) = (lab.read("out/run.csv"), warnings(&lab));
    for (fault, what) in [
        ("rounds", "set how numbers are rounded"),
        ("flushes", "had tiny numbers flushed to zero"),
        ("traps", "had calculations without a result end the program"),
        ("sets the locale", "set the locale"),
        ("uses a locale", "set the locale"),
    ] {
        let (lab, ended) = run(&scenario(fault, 1.0));
        let said = format!("fmi2DoStep or a call beside it {what}");
        ended.expect(0).says(&["`tank` warns at", &said]);
        assert!(lab.read("out/run.csv") == table, "{fault}");
        let told = warnings(&lab);
        let told: Vec<_> = told.iter().filter(|warning| !calm.contains(warning)).collect();
        assert!(told.len() == 1 && told[0].starts_with(&said), "{fault}: {told:?}");
    }
}

fn traps_that_no_library_sets_are_put_back_after_some_steps() {
    // Where there is no such register, nothing is set.
    if !cfg!(target_arch = "x86_64") {
        return;
    }
    let (lab, ended) = run(&scenario("traps by itself", 4.0));
    ended.expect(0);
    let what = "fmi2DoStep or a call beside it had calculations without a result end the program";
    let told = warnings(&lab);
    assert_eq!(told.iter().filter(|told| told.contains(what)).count(), 1, "{told:?}");
}

fn what_an_instance_sets_for_the_process_is_put_back() {
    let text = Scenario::new().time(0.1, 1.0).fmu("wanderer", "misbehave.fmu", "u = 0.0");
    let (lab, ended) = run(&text.check("clock", "time >= 0").text());
    // It is in the folder `/` otherwise, and would write there.
    ended.expect(0).says(&["`wanderer` warns at 0 s: fmi2Instantiate set the current folder"]);
    let told = warnings(&lab);
    for what in [
        "set the current folder",
        "set the permissions of new files",
        "held signals back",
        "took handlers of signals away",
    ] {
        assert_eq!(told.iter().filter(|warning| warning.contains(what)).count(), 1, "{told:?}");
    }
    use std::os::unix::fs::PermissionsExt as _;
    let mode = |name: &str| std::fs::metadata(lab.path(name)).expect("a file").permissions().mode();
    assert_eq!(mode("out/run.csv"), mode("case.toml"));
}

fn what_a_step_sets_for_files_is_put_back() {
    use std::os::unix::fs::PermissionsExt as _;
    let (lab, ended) = run(&scenario("goes away", 4.0));
    ended.expect(0);
    let told = warnings(&lab);
    for what in ["set the current folder", "set the permissions of new files"] {
        assert_eq!(told.iter().filter(|warning| warning.contains(what)).count(), 1, "{told:?}");
    }
    let mode = |name: &str| std::fs::metadata(lab.path(name)).expect("a file").permissions().mode();
    let modes = ["out/report.html", "out/report.json", "out/run.csv"].map(mode);
    assert_eq!(modes, [mode("case.toml"); 3]);
}

fn what_a_plugin_sets_is_put_back() {
    let lab = Lab::new();
    lab.write("misbehave.fmu", misbehave());
    super::plugins::compile(&lab, plugin::abi::VERSION);
    lab.write("case.toml", analysed("rounds"));
    let ended = lab.trackside(&["run", "case.toml", "--out", "out", "--rerun", "off"]).expect(0);
    ended.says(&["analysis `odd`: its run set how numbers are rounded"]);
}

/// Exit code, error, warnings and messages of a run whose node does something wrong at a time [s], without numbers.
fn outcome(fault: &str, status: u8, at: f64) -> (Option<i32>, Vec<String>) {
    let start = format!("fault = '{fault}', at = {at}, status = {status}");
    let node = Scenario::new().time(0.125, 20.0).fmu("tank", "misbehave.fmu", &start);
    let driven = node.signal("driver.u", "sine = { amplitude = 1.0, frequency = 1.0 }");
    let (lab, ended) = run(&driven.connect("driver.u", "tank.u").text());
    let mut texts = warnings(&lab);
    texts.extend(lab.report("out")["error"].as_str().map(str::to_owned));
    let without_numbers = |text: String| text.replace(|it: char| it.is_ascii_digit() || it == '.', "");
    (ended.status.code(), texts.into_iter().map(without_numbers).collect())
}

/// After its first steps a node goes a shorter way.
fn a_late_step_is_watched_as_an_early_one() {
    let sets =
        ["rounds", "flushes", "traps", "sets the locale", "uses a locale", "nan", "writes past the end"];
    let statuses = ["fmi2SetReal", "fmi2DoStep", "fmi2GetReal"];
    let statuses = statuses.iter().flat_map(|call| (1..=4).map(move |status| (*call, status)));
    for (fault, status) in sets.map(|fault| (fault, 0)).into_iter().chain(statuses) {
        let (early, late) = (outcome(fault, status, 0.375), outcome(fault, status, 5.0));
        assert!(!early.1.is_empty(), "{fault} {status}");
        assert_eq!(early, late, "{fault} {status}");
    }
}
