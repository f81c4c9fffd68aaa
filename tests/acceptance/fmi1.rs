//! Runs FMUs of FMI 1.0 for co-simulation and model exchange: values, signs, messages, events, and what cannot be done with them.

use super::fixture::Scenario;
use super::fmus::{ball1, slave1};
use super::harness::Lab;
use super::model_exchange::{check_bounces, columns, run};

tests! {
    values_of_all_types_arrive_with_their_signs: Compiler,
    names_without_the_model_and_late_steps_are_accepted: Compiler,
    messages_and_errors_name_functions_of_the_version: Compiler,
    a_ball_bounces_at_the_times_of_the_closed_form: Compiler,
    what_needs_a_saved_state_is_refused: Compiler,
    inspect_and_conform_know_the_version: Compiler,
}

/// Half a second per step, and an input that is 1 m/s: 36 km/h would be 10 of them.
fn slave(start: &str) -> Scenario {
    Scenario::new()
        .time(0.5, 2.0)
        .fmu("it", "slave1.fmu", start)
        .key("unconnected = \"start\"")
        .signal("s.u", "unit = \"m/s\"\nstep = { before = 1.0, after = 3.0, at = 1.0 }")
        .connect("s.u", "it.u")
}

fn lab(archive: &[u8]) -> Lab {
    let lab = Lab::new();
    lab.write("slave1.fmu", archive);
    lab
}

/// A parameter that is a negated alias arrives with the other sign, and an output comes with it.
fn values_of_all_types_arrive_with_their_signs() {
    let lab = lab(&slave1(&[]));
    run(&lab, slave("k = 4.0, g = 1.5, on = true, text = \"from\""), &["--isolate=none"]);
    let table = lab.table("out/run.csv");
    let names = ["it.y", "it.n", "it.pull", "it.steps", "it.left", "it.is_on", "it.is_off"];
    let rows = columns(&lab, names);
    assert_eq!(rows[0], [0.0, 0.0, -1.5, 0.0, 0.0, 0.0, 1.0]);
    assert_eq!(rows[4], [16.0, -16.0, -1.5, 4.0, -4.0, 1.0, 0.0]);
    assert!(table.lines().nth(1).is_some_and(|row| row.contains("from: 0 to 2")), "{table}");
    run(&lab, slave("k = 4.0, g = 1.5, on = true, text = \"from\""), &["--isolate=all"]);
    assert_eq!(lab.table("out/run.csv"), table);
}

fn names_without_the_model_and_late_steps_are_accepted() {
    let lab = lab(&slave1(&["-DPLAIN"]));
    run(&lab, slave("late = 3"), &[]);
    assert_eq!(columns(&lab, ["it.y", "it.steps"])[4], [8.0, 4.0]);
}

fn messages_and_errors_name_functions_of_the_version() {
    let lab = lab(&slave1(&[]));
    lab.write("case.toml", slave("").text());
    for isolate in ["--isolate=none", "--isolate=all"] {
        let ended = lab.trackside(&["run", "case.toml", "--rerun", "off", isolate]).expect(0);
        ended.says(&["`it` warns", "made as application/x-fmu-sharedlibrary", "a step of 0.5 s"]);
    }
    lab.write("case.toml", slave("broken = true").text());
    let ended = lab.trackside(&["run", "case.toml", "--rerun", "off"]).expect(3);
    ended.says(&["`it`", "fmiDoStep at t = 0 s returned fmiError; it says: it broke at 0 s"]);
}

/// An event of time at 0.25 s, and bounces; a start value gives another height.
fn a_ball_bounces_at_the_times_of_the_closed_form() {
    let lab = Lab::new();
    lab.write("ball1.fmu", ball1());
    let ball = |start: &str| Scenario::new().time(0.01, 3.0).fmu("it", "ball1.fmu", start);
    run(&lab, ball(""), &["--isolate=none"]);
    check_bounces(&columns(&lab, ["time", "it.h", "it.v"]), "1.0");
    for [time, v, fall, ticks] in columns(&lab, ["time", "it.v", "it.fall", "it.ticks"]) {
        assert_eq!((fall, ticks), (-v, f64::from(u8::from(time > 0.249))), "{time}");
    }
    let table = lab.table("out/run.csv");
    run(&lab, ball(""), &["--isolate=all"]);
    assert_eq!(lab.table("out/run.csv"), table);
    run(&lab, ball("h = 2.0"), &[]);
    assert_eq!(columns(&lab, ["it.h"])[0], [2.0]);
}

fn what_needs_a_saved_state_is_refused() {
    let lab = lab(&slave1(&[]));
    lab.write("case.toml", slave("").text());
    let ended = lab.trackside(&["run", "case.toml", "--rerun", "off", "--checkpoint", "1"]);
    ended.expect(2).says(&["it", "canGetAndSetFMUstate"]);
}

fn inspect_and_conform_know_the_version() {
    let lab = lab(&slave1(&[]));
    lab.write("ball1.fmu", ball1());
    let shows = |arguments: &[&str], words: &[&str]| {
        let shown = lab.trackside(arguments).expect(0).stdout;
        assert!(words.iter().all(|word| shown.contains(word)), "{shown}");
    };
    shows(
        &["inspect", "slave1.fmu"],
        &["FMI                1.0", "co-simulation", "parameter  Real        g", "= 9.81"],
    );
    shows(&["inspect", "ball1.fmu"], &["model exchange: 2 continuous states, 1 event indicators"]);
    let judged = "9 passed, 0 failed, 0 not applicable\nThe FMU loads and runs. The rules are those of FMI 2.0 and 3.0";
    shows(&["conform", "slave1.fmu"], &[judged]);
    lab.trackside(&["conform", "ball1.fmu"]).expect(2).says(&["expected the interface CoSimulation"]);
}
