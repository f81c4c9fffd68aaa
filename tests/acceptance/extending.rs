//! Checks that a scenario inherits the unchanged parts of another one.

use super::fmus::ours;
use super::harness::{Ended, Lab};

tests! {
    unchanged_sections_are_inherited,
    chains_of_extends_work_with_set_and_test,
    an_fmu_replaces_the_inherited_one,
}

/// A scenario in a folder of its own, whose paths are relative to it.
const BASE: &str = include_str!("../../crates/scenario/src/tests/files/base.toml");

/// A scenario that extends it.
const CHANGED: &str = include_str!("../../crates/scenario/src/tests/files/changed.toml");

fn lab() -> Lab {
    let lab = Lab::new();
    let plant = std::fs::read(ours().join("plant.fmu")).expect("an FMU");
    lab.write("base/plant.fmu", plant);
    lab.write("base/log.csv", "t,v\n0,20\n1,20\n");
    lab.write("base/base.toml", BASE);
    lab
}

fn run(lab: &Lab, text: &str) -> Ended {
    lab.write("case.toml", text);
    lab.trackside(&["run", "case.toml", "--out", "out", "--csv"])
}

/// The last value of a column.
fn last(lab: &Lab, column: &str) -> Option<f64> {
    let csv = lab.table("out/run.csv");
    let index = csv.lines().next()?.split(',').position(|name| name == column)?;
    csv.lines().next_back()?.split(',').nth(index)?.parse().ok()
}

fn unchanged_sections_are_inherited() {
    let lab = lab();
    run(&lab, CHANGED).expect(0);
    let report = lab.report("out");
    assert_eq!((&report["title"], &report["seed"]), (&"Changed".into(), &3.into()));
    assert_eq!(report["steps"], 20);
    let of_checks = |key: &str| {
        let checks = report["checks"].as_array().expect("a list").iter();
        checks.map(|check| check[key].clone()).collect::<Vec<_>>()
    };
    assert_eq!(of_checks("name"), ["slow", "log"]);
    assert_eq!(of_checks("during"), [serde_json::json!([0.0, 0.05]), serde_json::json!([0.0, 0.2])]);
    let files: Vec<_> = report["sources"].as_array().expect("a list").iter().collect();
    assert_eq!(files.iter().map(|file| &file["path"]).collect::<Vec<_>>(), ["case.toml", "base/base.toml"]);
    assert!(files.iter().all(|file| file["sha256"].as_str().is_some_and(|sum| sum.len() == 64)));
    // The bias of the steering was taken over, the noise added, the table left out of the recordings.
    let delta = last(&lab, "plant.delta").expect("recorded");
    assert!((delta - 0.001).abs() < 0.005 && delta != 0.001, "{delta}");
    assert_eq!(last(&lab, "log.v"), None);
    // A scenario that says it all itself gives the same numbers.
    let csv = lab.read("out/run.csv");
    let whole = BASE
        .replace("stop = 0.1", "stop = 0.2")
        .replace("start.v_x = 20.0", "start.v_x = 30.0")
        .replace("\"tire_f.D\" = 1.5", "tire_f.D = 1.2")
        .replace("\"m/s\"\nconstant = 20.0", "\"km/h\"\nconstant = 108.0")
        .replace("bias = 0.001", "bias = 0.001\nnoise = { std = 0.001 }")
        .replace("base/", "")
        .replace(".fmu\"", ".fmu\"\n");
    lab.write("base/whole.toml", whole);
    lab.trackside(&["run", "base/whole.toml", "--out", "out", "--csv"]).expect(1);
    assert!(lab.read("out/run.csv") == csv, "the numbers differ");
}

fn chains_of_extends_work_with_set_and_test() {
    let lab = lab();
    lab.write("middle.toml", CHANGED);
    let text = "extends = \"middle.toml\"\n[[fmu]]\nname = \"plant\"\nstart.body.m = 900.0\n";
    run(&lab, text).expect(0);
    let speed = last(&lab, "plant.v_x");
    let arguments = ["run", "middle.toml", "--out", "out", "--csv", "--set", "plant.body.m=900"];
    lab.trackside(&arguments).expect(0);
    assert_eq!(last(&lab, "plant.v_x"), speed);
    std::fs::remove_file(lab.path("base/log.csv")).expect("it was there");
    let ended = lab.trackside(&["test", "case.toml"]).expect(0);
    assert!(ended.stdout.contains("the data file base/log.csv is not there"), "{}", ended.stdout);
}

fn an_fmu_replaces_the_inherited_one() {
    let lab = lab();
    std::fs::copy(lab.path("base/plant.fmu"), lab.path("other.fmu")).expect("a copy");
    let base = BASE.replace("path = \"plant.fmu\"", "crate = \"nowhere\"\nexample = \"none\"");
    lab.write("base/base.toml", base);
    run(
        &lab,
        &format!(
            "{CHANGED}\n[[fmu]]\nname = \"twin\"\npath = \"base/plant.fmu\"\nstart = {{ F_x = 0.0, delta = 0.0 }}\n"
        ),
    )
    .expect(2)
    .says(&["no cargo workspace", "base/base.toml:10:"]);
    run(&lab, &CHANGED.replace("name = \"plant\"", "name = \"plant\"\npath = \"other.fmu\"")).expect(0);
}
