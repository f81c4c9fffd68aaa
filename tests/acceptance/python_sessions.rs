//! Steps scenarios from Python: `trackside.Session`.

use std::path::Path;

use super::fixture::Scenario;
use super::fmus::{misbehave, ours, relay};
use super::harness::{Ended, Lab, ROOT, trackside};
use super::python::python;

tests! {
    sessions_set_and_read_variables_and_controllers_steer: Python,
    a_session_has_the_bits_of_the_run: Python,
    sessions_go_back_to_states_live_side_by_side_and_are_freed: Python,
    sessions_have_values_of_all_types_and_failures_are_exceptions: Compiler + Python,
}

/// Runs functions of `python/session.py` in a lab with scenarios of the repository, whose FMUs are there.
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
        lab.write(
            &format!("{scenario}.toml"),
            text.replace("crate = \"estimator\"", "path = \"estimator.fmu\""),
        );
    }
    python().run("session.py", &[test.into(), lab.path("")]);
}

fn sessions_set_and_read_variables_and_controllers_steer() {
    run_in(&Lab::new(), "values+controllers+environments");
}

fn a_session_has_the_bits_of_the_run() {
    run_in(&Lab::new(), "equal_to_runs");
}

fn sessions_go_back_to_states_live_side_by_side_and_are_freed() {
    run_in(&Lab::new(), "states+lives");
}

/// Packs the model that does what its start value says.
fn add_odd_fmu(lab: &Lab) {
    let mut pack = trackside(Path::new(ROOT));
    pack.args(["pack", "--python", "tests/acceptance/python_fmu/odd.py", "--out"]).arg(lab.path(""));
    Ended::of(pack.output().expect("it starts")).expect(0);
}

fn sessions_have_values_of_all_types_and_failures_are_exceptions() {
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
    lab.write("relay.fmu", relay());
    let relays = Scenario::new().time(0.25, 2.0).fmu("a", "relay.fmu", "").fmu("b", "relay.fmu", "");
    let relays = relays.signal("drive.n", "constant = 4").connect("drive.n", "a.n").connect("a.n_out", "b.n");
    let path = "path = \"relay.fmu\"";
    lab.write("relays.toml", relays.text().replace(path, &format!("{path}\nunconnected = \"start\"")));
    run_in(&lab, "failures+kinds");
}
