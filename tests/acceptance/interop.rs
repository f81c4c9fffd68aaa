//! Compares our FMUs and our master with fmpy, which validates the archives and simulates the plant again.

use super::fmus::ours;
use super::harness::{Lab, limit_handling, record};
use super::python::python;

#[test]
fn fmpy_finds_nothing_wrong_with_the_archives() {
    let Some(python) = python() else { return };
    for name in ["plant", "controller", "estimator"] {
        let ended = python.run("validate.py", &[ours().join(format!("{name}.fmu"))]);
        assert_eq!(ended.stdout.trim(), "[]", "{name}");
    }
}

#[test]
fn fmpy_simulates_the_same_plant() {
    let Some(python) = python() else { return };
    let lab = Lab::new();
    // fmpy hands over the difference of two communication points as the step, which is off by rounding.
    lab.write("limit_handling.toml", limit_handling().read("limit_handling.toml"));
    record(&lab, "limit_handling.toml", "run", &["--rerun", "off"]);
    let (plant, csv) = (ours().join("plant.fmu"), lab.path("run/run.csv"));
    let ended = python.run("simulate_plant.py", &[plant, csv]);
    println!("{}", ended.stdout);
}
