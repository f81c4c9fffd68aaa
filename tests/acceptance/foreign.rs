//! Runs an FMU that behaves as foreign ones do: start values, experiment, stop time, messages and the end of a run.

use super::fixture::Scenario;
use super::fmus::stubborn;
use super::harness::{Ended, Lab};

tests! {
    start_values_come_when_an_fmu_keeps_them: Compiler,
    a_start_value_that_is_not_kept_is_told: Compiler,
    the_last_step_ends_at_the_announced_stop_time: Compiler,
    the_tolerance_is_that_of_the_option_the_scenario_or_the_description: Compiler,
    the_last_values_of_an_fmu_that_ends_the_run_are_recorded: Compiler,
    messages_with_a_foreign_environment_arrive_and_the_broken_rule_is_told_once: Compiler,
    inspect_shows_the_default_experiment: Compiler,
    locals_and_parameters_can_be_observed: Compiler,
    inputs_may_keep_the_start_values_of_the_description: Compiler,
}

/// The lab with the FMU, in which the scenario of one node `s` ran with these start values.
fn run(step: f64, stop: f64, start: &str, arguments: &[&str]) -> (Lab, Ended) {
    let scenario = Scenario::new().time(step, stop).fmu("s", "stubborn.fmu", start);
    run_text(&scenario.text(), arguments)
}

fn run_text(text: &str, arguments: &[&str]) -> (Lab, Ended) {
    let lab = Lab::new();
    lab.write("stubborn.fmu", stubborn());
    lab.write("case.toml", text);
    let given = ["run", "case.toml", "--out", "out", "--csv"];
    let ended = lab.trackside(&[&given, arguments].concat());
    (lab, ended)
}

/// The last row of the table, by the names of its columns.
fn last(lab: &Lab, column: &str) -> f64 {
    let table = lab.table("out/run.csv");
    let mut lines = table.lines();
    let titles = lines.next().expect("titles").split(',');
    let place = titles.clone().position(|title| title == column);
    let place = place.unwrap_or_else(|| panic!("no {column} in {titles:?}"));
    let cell = lines.last().expect("a row").split(',').nth(place).expect("a cell");
    cell.parse().expect("a number")
}

fn start_values_come_when_an_fmu_keeps_them() {
    let (lab, ended) = run(0.1, 1.0, "u = 2.5, early = 5.0, late = 6.0", &[]);
    ended.expect(0);
    let seen = ["s.early.seen", "s.late.seen", "s.y"].map(|column| last(&lab, column));
    assert_eq!(seen, [5.0, 6.0, 3.5]);
    assert_eq!(lab.report("out")["warnings"], serde_json::json!([]));
}

fn a_start_value_that_is_not_kept_is_told() {
    let (lab, ended) = run(0.1, 1.0, "u = 0.0, fixed = 7.0", &[]);
    let told = "`s` does not keep the start value 7.0 of `fixed`: it has 1.0";
    ended.expect(0).says(&[told]);
    assert_eq!(lab.report("out")["warnings"], serde_json::json!([told]));
}

/// Both the stop time and equal steps are enforced to the last bit.
fn the_last_step_ends_at_the_announced_stop_time() {
    for (step, steps) in [(0.1, 3), (0.1, 7), (0.1, 29), (0.01, 57), (1.0 / 3.0, 11)] {
        let (lab, ended) = run(step, f64::from(steps) * step, "u = 0.0", &[]);
        ended.expect(0);
        assert_eq!(lab.report("out")["steps"], steps);
    }
}

fn the_tolerance_is_that_of_the_option_the_scenario_or_the_description() {
    let own = Scenario::new().time(0.1, 0.3).fmu("s", "stubborn.fmu", "u = 0.0").text();
    let given = own.replace("stop = 0.3", "stop = 0.3\ntolerance = 1e-6");
    for (text, arguments, expected) in
        [(&own, &[][..], 1e-4), (&given, &[], 1e-6), (&given, &["--tolerance", "1e-8"], 1e-8)]
    {
        let (lab, ended) = run_text(text, arguments);
        ended.expect(0);
        assert_eq!(last(&lab, "s.tolerance"), expected);
    }
    let wrong = given.replace("1e-6", "2.0");
    run_text(&wrong, &[]).1.expect(2).says(&["case.toml:4", "between 0 and 1, found 2"]);
    run_text(&own, &["--tolerance", "0"]).1.expect(2).says(&["--tolerance", "found 0"]);
}

fn the_last_values_of_an_fmu_that_ends_the_run_are_recorded() {
    for (end, steps) in [("0.95", 9), ("0.5", 5)] {
        let (lab, ended) = run(0.1, 2.0, &format!("u = 0.0, end = {end}"), &[]);
        ended.expect(0).says(&[&format!("`s` ended the simulation at {end} s")]);
        let end: f64 = end.parse().expect("a number");
        assert!((last(&lab, "time") - end).abs() < 1e-12 && (last(&lab, "s.y") - end).abs() < 1e-12);
        assert_eq!(lab.report("out")["steps"], steps);
    }
}

fn messages_with_a_foreign_environment_arrive_and_the_broken_rule_is_told_once() {
    let (lab, ended) = run(0.1, 0.3, "u = 0.0", &[]);
    ended.expect(0);
    let bytes = std::fs::read(lab.path("out/run.mcap")).expect("a recording");
    let messages = mcap::MessageStream::new(&bytes).expect("a recording");
    let texts: Vec<String> = messages
        .map(|message| message.expect("a readable recording"))
        .filter(|message| message.channel.topic == "/log")
        .map(|message| String::from_utf8_lossy(&message.data).into_owned())
        .collect();
    let with = |part: &str| texts.iter().filter(|text| text.contains(part)).count();
    assert_eq!((with("ready"), with("componentEnvironment")), (1, 1), "{texts:?}");
}

fn inspect_shows_the_default_experiment() {
    let lab = Lab::new();
    lab.write("stubborn.fmu", stubborn());
    let ended = lab.trackside(&["inspect", "stubborn.fmu"]).expect(0);
    for line in ["default start      0 s", "default stop       3 s", "default tolerance  0.0001"] {
        assert!(ended.stdout.contains(line), "{}", ended.stdout);
    }
}

fn locals_and_parameters_can_be_observed() {
    let text = Scenario::new()
        .time(0.1, 0.3)
        .fmu("s", "stubborn.fmu", "u = 0.0, early = 4.0")
        .key("observe = ['earl*', 'end']")
        .check("a parameter", "s.early == 4 and s.end > 1e8")
        .text();
    let (lab, ended) = run_text(&text, &[]);
    ended.expect(0);
    assert_eq!((last(&lab, "s.early"), last(&lab, "s.end")), (4.0, 1e9));
    let misspelt = text.replace("'end'", "'edn'");
    run_text(&misspelt, &[]).1.expect(2).says(&["unknown variable `edn`", "did you mean `end`?"]);
}

fn inputs_may_keep_the_start_values_of_the_description() {
    let text = Scenario::new().time(0.1, 0.3).fmu("s", "stubborn.fmu", "").text();
    let (_, ended) = run_text(&text, &[]);
    ended.expect(2).says(&["nothing is connected to `u` of `s`", "unconnected = \"start\""]);
    let (lab, ended) = run_text(&(text + "unconnected = 'start'\n"), &[]);
    let told = "`s` keeps the start values of its description: `u` = 0";
    ended.expect(0).says(&[told]);
    assert_eq!(lab.report("out")["warnings"], serde_json::json!([told]));
}
