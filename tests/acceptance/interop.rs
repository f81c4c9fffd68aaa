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
    let three = ["plant_fmi3", "controller_fmi3", "estimator_fmi3"].map(name);
    let two = [name("plant"), name("controller"), name("estimator"), example().to_owned()];
    for fmu in two.into_iter().chain(three) {
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
        // The script that replays calls makes those of FMI 2.0.
        let versions: &[_] = if script == "simulate.py" { &["", "_fmi3"] } else { &[""] };
        for version in versions {
            let fmu = ours().join(format!("{node}{version}.fmu"));
            python.run(script, &[node.as_ref(), fmu.as_os_str(), csv.as_os_str(), start.as_ref()]);
        }
    }
}
