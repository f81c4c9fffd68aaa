//! Uses the Python package `trackside` with the program of this build.

use super::ending::{lab, passing};
use super::fixture::Scenario;
use super::fmus::{misbehave, ours};
use super::harness::Lab;
use super::python::python;

tests! {
    frames_have_the_bits_of_the_csv_file_and_units: Python,
    a_run_that_is_held_keeps_its_folder: Python,
    a_failed_check_is_a_result_and_a_mistake_an_exception: Python,
    the_failure_of_an_fmu_is_an_exception_with_what_was_recorded: Compiler + Python,
    control_c_closes_the_recordings_and_leaves_no_process: Compiler + Python,
    a_notebook_shows_checks_and_plots_and_escapes_texts: Python,
    without_a_viewer_the_page_opens: Python,
    recordings_without_parquet_are_converted: Python,
    a_frame_becomes_tires_with_intervals_and_verdicts: Python,
    frames_of_all_kinds_become_the_same_log: Python,
    a_sweep_is_a_table_and_its_variants_are_replayed: Compiler + Python,
    everything_public_has_types_and_a_docstring: Python,
}

/// Runs a function of `python/package.py` in the lab.
#[track_caller]
fn run_in(lab: &Lab, test: &str) {
    python().run("package.py", &[test.into(), lab.path("")]);
}

fn frames_have_the_bits_of_the_csv_file_and_units() {
    run_in(&Lab::new(), "frames");
}

fn a_run_that_is_held_keeps_its_folder() {
    run_in(&Lab::new(), "folders");
}

fn a_failed_check_is_a_result_and_a_mistake_an_exception() {
    run_in(&Lab::new(), "failures");
}

fn the_failure_of_an_fmu_is_an_exception_with_what_was_recorded() {
    let lab = Lab::new();
    lab.write("misbehave.fmu", misbehave());
    for (name, start) in [("case", "fault = 'nan', at = 0.5"), ("crash", "fault = 'crash', at = 0.5")] {
        let scenario =
            Scenario::new().time(0.1, 1.0).fmu("tank", "misbehave.fmu", &format!("u = 0.0, {start}"));
        lab.write(&format!("{name}.toml"), scenario.text());
    }
    run_in(&lab, "failing_fmu");
}

fn control_c_closes_the_recordings_and_leaves_no_process() {
    let lab = lab();
    let text = passing("misbehave.fmu", "at = 0.0").replace("stop = 1.0", "stop = 10000.0");
    lab.write("case.toml", text);
    run_in(&lab, "control_c");
}

fn a_notebook_shows_checks_and_plots_and_escapes_texts() {
    let lab = Lab::new();
    lab.add(&ours().join("plant.fmu"));
    let scenario = Scenario::headed("title = \"<script>alert(1)</script>\"").time(0.01, 5.0);
    let scenario = scenario.fmu("plant", "plant.fmu", "start.v_x = 20.0, F_x = 0.0, delta = 0.02");
    lab.write("case.toml", scenario.check("<b>", "plant.v_x > 1").text());
    run_in(&lab, "pictures");
}

fn without_a_viewer_the_page_opens() {
    run_in(&Lab::new(), "viewing");
}

fn recordings_without_parquet_are_converted() {
    run_in(&Lab::new(), "earlier_runs");
}

fn a_frame_becomes_tires_with_intervals_and_verdicts() {
    run_in(&Lab::new(), "identification");
}

fn frames_of_all_kinds_become_the_same_log() {
    run_in(&Lab::new(), "logs");
}

fn a_sweep_is_a_table_and_its_variants_are_replayed() {
    let lab = lab();
    let start = "u = 0.0, fault = 'nan', at = 2.0";
    let tank = Scenario::new().time(0.1, 1.0).fmu("tank", "misbehave.fmu", start);
    let checked = tank.signal("wanted.v", "constant = 2.0").check("late", "max(wanted.v) >= 2");
    let sweep = "[sweep]\ndesign = \"list\"\nlist = \"vary.csv\"\n\n[sweep.collect]\nend = \"max(time)\"";
    lab.write("vary.toml", checked.section(sweep).text());
    lab.write("vary.csv", "tank.at,wanted.v\n0.5,2\n2.0,1\n2.0,3\n");
    run_in(&lab, "sweeps");
}

fn everything_public_has_types_and_a_docstring() {
    run_in(&Lab::new(), "documented");
}
