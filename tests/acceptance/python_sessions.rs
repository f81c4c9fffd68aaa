//! Steps scenarios from Python: `trackside.Session`.

use std::path::Path;

use super::fixture::Scenario;
use super::fmus::{misbehave, ours, relay};
use super::harness::{Ended, Lab, ROOT, trackside};
use super::python::python;

tests! {
    a_session_sets_and_reads_variables_and_says_what_is_none: Python,
    a_session_has_the_bits_of_the_run: Python,
    a_session_goes_back_to_states_also_of_another_one: Python,
    functions_and_models_of_python_steer_a_session: Python,
    sessions_live_side_by_side_and_are_freed: Python,
    a_failing_fmu_is_an_exception_with_node_and_time: Compiler + Python,
    a_session_has_values_of_all_types: Compiler + Python,
    an_environment_in_the_form_of_gymnasium_drives_a_session: Python,
}

/// Runs a function of `python/session.py` in a lab with scenarios of the repository, whose FMUs are there.
#[track_caller]
fn run_in(lab: &Lab, test: &str) {
    for fmu in ["plant.fmu", "controller.fmu", "estimator.fmu"] {
        lab.add(&ours().join(fmu));
    }
    for scenario in ["step_steer", "double_lane_change"] {
        let path = Path::new(ROOT).join("scenarios").join(scenario).with_extension("toml");
        let text = std::fs::read_to_string(path).expect("a scenario");
        let text = text.replace("crate = \"plant-fmu\"", "path = \"plant.fmu\"");
        let text = text.replace("crate = \"controller\"", "path = \"controller.fmu\"");
        lab.write(&format!("{scenario}.toml"), text.replace("crate = \"estimator\"", "path = \"estimator.fmu\""));
    }
    python().run("session.py", &[test.into(), lab.path("")]);
}

fn a_session_sets_and_reads_variables_and_says_what_is_none() {
    run_in(&Lab::new(), "values");
}

fn a_session_has_the_bits_of_the_run() {
    run_in(&Lab::new(), "equal_to_runs");
}

fn a_session_goes_back_to_states_also_of_another_one() {
    run_in(&Lab::new(), "states");
}

fn functions_and_models_of_python_steer_a_session() {
    run_in(&Lab::new(), "controllers");
}

fn sessions_live_side_by_side_and_are_freed() {
    run_in(&Lab::new(), "lives");
}

/// Packs the model that does what its start value says.
fn add_odd_fmu(lab: &Lab) {
    let mut pack = trackside(Path::new(ROOT));
    pack.args(["pack", "--python", "tests/acceptance/python_fmu/odd.py", "--out"]).arg(lab.path(""));
    Ended::of(pack.output().expect("it starts")).expect(0);
}

fn a_failing_fmu_is_an_exception_with_node_and_time() {
    let lab = Lab::new();
    lab.write("misbehave.fmu", misbehave());
    for (name, start) in [("case", "fault = 'nan', at = 0.5"), ("crash", "fault = 'crash', at = 0.5")] {
        let scenario =
            Scenario::new().time(0.1, 1.0).fmu("tank", "misbehave.fmu", &format!("u = 0.0, {start}"));
        lab.write(&format!("{name}.toml"), scenario.text());
    }
    add_odd_fmu(&lab);
    let start = "how = 'ends', u = 0.5, n = 3, on = true, word = 'a'";
    lab.write("ends.toml", Scenario::new().time(0.1, 1.0).fmu("odd", "odd.fmu", start).text());
    run_in(&lab, "failures");
}

fn a_session_has_values_of_all_types() {
    let lab = Lab::new();
    lab.write("relay.fmu", relay());
    add_odd_fmu(&lab);
    let scenario = Scenario::new().time(0.25, 2.0).fmu("a", "relay.fmu", "").fmu("b", "relay.fmu", "");
    let scenario = scenario.signal("drive.n", "constant = 4").connect("drive.n", "a.n");
    let text = scenario.connect("a.n_out", "b.n").text();
    lab.write("relays.toml", text.replace("path = \"relay.fmu\"", "path = \"relay.fmu\"\nunconnected = \"start\""));
    run_in(&lab, "kinds");
}

fn an_environment_in_the_form_of_gymnasium_drives_a_session() {
    run_in(&Lab::new(), "environments");
}
