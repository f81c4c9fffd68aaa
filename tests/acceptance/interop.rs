//! Compares our FMUs and our master with fmpy, which validates the archives and simulates each of them again.

use super::fmus::{example, ours};
use super::harness::{Lab, limit_handling, record};
use super::python::python;

tests! {
    fmpy_validates_the_archives: Python,
    fmpy_reproduces_the_closed_loop: Python,
}

fn fmpy_validates_the_archives() {
    let python = python();
    let name = |name: &str| ours().join(format!("{name}.fmu"));
    for fmu in [name("plant"), name("controller"), name("estimator"), example().to_owned()] {
        let ended = python.run("validate.py", &[&fmu]);
        assert_eq!(ended.stdout.trim(), "[]", "{}", fmu.display());
    }
}

fn fmpy_reproduces_the_closed_loop() {
    let python = python();
    let lab = Lab::new();
    // fmpy hands over the difference of two communication points as the step, which is off by rounding.
    lab.write("limit_handling.toml", limit_handling().read("limit_handling.toml"));
    record(&lab, "limit_handling.toml", "run", &["--rerun", "off"]);
    let csv = lab.path("run/run.csv");
    for (script, node, start) in [
        ("simulate.py", "plant", "{\"start.v_x\": 15.0}"),
        ("replay.py", "controller", "{}"),
        ("replay.py", "estimator", "{}"),
    ] {
        let fmu = ours().join(format!("{node}.fmu"));
        python.run(script, &[node.as_ref(), fmu.as_os_str(), csv.as_os_str(), start.as_ref()]);
    }
}
