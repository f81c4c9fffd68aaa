//! Checks that a scenario gives the same numbers on every run, another seed gives others, and the report is complete.

use super::fixture::Scenario;
use super::harness::{Lab, limit_handling, record};

tests! {
    only_equal_seeds_give_equal_bytes,
    the_report_is_complete,
    what_is_too_late_in_real_time_is_counted: Compiler,
}

fn only_equal_seeds_give_equal_bytes() {
    let lab = limit_handling();
    record(lab, "limit_handling.toml", "again", &["--rerun", "off"]);
    record(lab, "limit_handling.toml", "other", &["--rerun", "off", "--seed", "2"]);
    let table = |run: &str| lab.read(&format!("{run}/run.csv"));
    assert!(table("run") == table("again"), "two runs of the same scenario differ");
    assert!(table("run") != table("other"), "the seed changes nothing");
    assert_eq!(lab.report("other")["seed"], 2);
}

fn the_report_is_complete() {
    let report = limit_handling().report("run");
    assert_eq!(report["scenario"], "limit_handling");
    assert_eq!((&report["seed"], &report["steps"]), (&1.into(), &10_400.into()));
    assert!((report["sim_seconds"].as_f64().expect("a number") - 104.0).abs() < 1e-9);
    for number in ["wall_seconds", "realtime_factor"] {
        assert!(report[number].as_f64().is_some_and(|value| value > 0.0), "{number}");
    }
    let passed = |check: &serde_json::Value| check["passed"].as_bool().expect("a verdict");
    let all = report["checks"].as_array().expect("a list").iter().all(passed);
    assert_eq!(report["verdict"], if all { "pass" } else { "fail" });
    assert!(report["analyses"].is_object());
    let nodes = report["nodes"].as_array().expect("a list");
    for node in nodes {
        assert!(node["name"].is_string() && node["seconds"].is_number(), "{node}");
        assert_eq!(node["calls"], 10_400, "{node}");
        let time = |key: &str| node[key].as_f64().expect("a number");
        assert!(time("mean_seconds") > 0.0 && time("p99_seconds") > 0.0, "{node}");
        assert!(time("p99_seconds") <= time("max_seconds"), "{node}");
        assert!(node.get("deadline_misses").is_none(), "there is no deadline: {node}");
    }
    let fmus = report["fmus"].as_array().expect("a list");
    let names: Vec<_> = fmus.iter().filter_map(|fmu| fmu["name"].as_str()).collect();
    assert_eq!(names, ["plant", "estimator", "controller"]);
    for fmu in fmus {
        assert!(fmu["guid"].as_str().is_some_and(|guid| !guid.is_empty()), "{fmu}");
        let hexadecimal = |text: &str| text.len() == 64 && text.chars().all(|c| c.is_ascii_hexdigit());
        assert!(fmu["sha256"].as_str().is_some_and(hexadecimal), "{fmu}");
    }
}

fn what_is_too_late_in_real_time_is_counted() {
    let lab = Lab::new();
    lab.write("relay.fmu", super::fmus::relay());
    // No step takes a nanosecond.
    let scenario = Scenario::new().time(1e-9, 1e-7).fmu("relay", "relay.fmu", "");
    lab.write("case.toml", scenario.key("unconnected = 'start'").check("it", "time >= 0").text());
    let arguments = ["run", "case.toml", "--out", "out", "--rerun", "off", "--realtime"];
    lab.trackside(&arguments).expect(0);
    let report = lab.report("out");
    assert_eq!((&report["steps"], &report["late_points"]), (&100.into(), &100.into()));
    let node = &report["nodes"][0];
    assert_eq!((&node["calls"], &node["deadline_misses"]), (&100.into(), &100.into()), "{node}");
    let page = lab.read("out/report.html");
    assert!(page.contains("100 of 100 communication points"), "{page}");
}
