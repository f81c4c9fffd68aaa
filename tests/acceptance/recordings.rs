//! Compares the recordings with each other through other people's readers, also those of a killed run.

#[cfg(feature = "rerun")]
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use super::fmus::ours;
#[cfg(feature = "rerun")]
use super::harness::{Ended, ROOT};
use super::harness::{Lab, limit_handling, trackside};
#[cfg(feature = "rerun")]
use super::python::Python;
use super::python::python;

#[test]
fn the_mcap_holds_the_numbers_of_the_csv_bit_for_bit() {
    let Some(python) = python() else { return };
    let run = limit_handling();
    let ended = python.run("compare_mcap.py", &[run.path("run/run.mcap"), run.path("run/run.csv")]);
    println!("{}", ended.stdout);
}

/// What the viewer's program says to these words.
#[cfg(feature = "rerun")]
fn rerun(python: &Python, words: &[&str], files: &[PathBuf]) -> Ended {
    let mut rerun = python.rerun();
    rerun.env("RERUN_PANIC_ON_WARN", "1").args(words).args(files);
    Ended::of(rerun.output().expect("it starts"))
}

#[test]
#[cfg(feature = "rerun")]
fn the_viewer_loads_the_replay_without_a_warning() {
    let Some(python) = python() else { return };
    let replay = [limit_handling().path("run/run.rrd")];
    rerun(python, &["rrd", "verify"], &replay).expect(0);
    rerun(python, &["--test-receive", "--headless", "--port", "auto"], &replay).expect(0);
}

#[test]
#[cfg(feature = "rerun")]
fn the_replays_of_equal_runs_are_equal_and_others_are_not() {
    let Some(python) = python() else { return };
    let lab = Lab::new();
    lab.add(&ours().join("plant.fmu"));
    let replay = |name: &str, steering: &str| {
        let scenario = format!(
            "[time]\nstep = 0.01\nstop = 3.0\n[[fmu]]\nname = \"plant\"\npath = \"plant.fmu\"\n\
             start = {{ start.v_x = 20.0, F_x = 0.0, delta = {steering} }}\n\
             [[check]]\nname = \"drives on\"\nthat = \"plant.X > 10\"\n\
             [view.pose]\nx = \"plant.X\"\ny = \"plant.Y\"\nheading = \"plant.psi\"\n"
        );
        lab.write(&format!("{name}/case.toml"), scenario.replace("plant.fmu", "../plant.fmu"));
        lab.trackside(&["run", &format!("{name}/case.toml"), "--out", name]);
        lab.path(&format!("{name}/run.rrd"))
    };
    let [a, b, c] = [("a", "0.01"), ("b", "0.01"), ("c", "0.0100001")].map(|it| replay(it.0, it.1));
    rerun(python, &["rrd", "compare", "--unordered"], &[a.clone(), b]).expect(0);
    let told = rerun(python, &["rrd", "stats"], std::slice::from_ref(&a)).expect(0).stdout;
    for entity in
        ["/checks/01_drives_on", "/world/car", "/world/path/line", "/signals/plant/outputs/v_x"]
    {
        assert!(told.contains(entity), "no {entity}");
    }
    rerun(python, &["rrd", "compare", "--unordered"], &[a, c]).expect(1);
}

#[test]
#[cfg(feature = "rerun")]
fn what_an_identification_found_is_in_the_replay() {
    let Some(python) = python() else { return };
    let lab = Lab::new();
    let mut command = trackside(Path::new(ROOT));
    command.args(["run", "scenarios/tires_from_driving.toml", "--out"]).arg(lab.path("run"));
    Ended::of(command.output().expect("it starts")).expect(0);
    let replay = [lab.path("run/run.rrd")];
    let told = rerun(python, &["rrd", "stats"], &replay).expect(0).stdout;
    // Curve, seven densities and the trace of the fits, each with axes and layers.
    for axle in [r"Front\ axle\,\ lateral", r"Rear\ axle\,\ lateral"] {
        for number in 1..=9 {
            for part in ["grid", "labels", "01"] {
                let entity = format!("/diagrams/tires/{axle}/{number}/{part}");
                assert!(told.contains(&entity), "no {entity} in:\n{told}");
            }
        }
    }
    rerun(python, &["rrd", "verify"], &replay).expect(0);
    rerun(python, &["--test-receive", "--headless", "--port", "auto"], &replay).expect(0);
}

/// How long the killed run lives, and how far its recording must reach: chunks are closed once a second.
const LIFE: Duration = Duration::from_millis(3500);
const LOST: f64 = 1.5;

#[test]
fn a_killed_run_leaves_a_readable_recording_and_nothing_that_looks_complete() {
    let lab = Lab::new();
    lab.add(&ours().join("plant.fmu"));
    lab.write(
        "case.toml",
        "[time]\nstep = 0.01\nstop = 60.0\n[[fmu]]\nname = \"plant\"\npath = \"plant.fmu\"\n\
         start = { start.v_x = 20.0, F_x = 0.0, delta = 0.01 }\n",
    );
    let mut command = trackside(&lab.path(""));
    command.args(["run", "case.toml", "--out", "out", "--csv", "--realtime"]);
    let mut child = command.spawn().expect("it starts");
    let patience = Instant::now();
    while !lab.has("out/run.mcap") && patience.elapsed() < Duration::from_secs(30) {
        std::thread::sleep(Duration::from_millis(5));
    }
    std::thread::sleep(LIFE);
    child.kill().expect("it still runs");
    child.wait().expect("it ends");
    assert!(!lab.has("out/report.json") && !lab.has("out/run.csv"));
    let told = lab.trackside(&["recover", "out/run.mcap"]).expect(0).stdout;
    assert!(told.contains("out/run.recovered.mcap: ") && told.contains("broken"), "{told}");
    lab.trackside(&["recover", "out/run.mcap", "--out", "out/run.mcap"]).expect(2);
    lab.write("text.mcap", "no recording");
    lab.trackside(&["recover", "text.mcap"])
        .expect(2)
        .says(&["text.mcap", "expected an MCAP file"]);
    assert!(!lab.has("text.recovered.mcap") && !lab.has("text.recovered.mcap.partial"));
    let Some(python) = python() else { return };
    let ended = python.run("last_time.py", &[lab.path("out/run.mcap")]);
    let recovered = python.run(
        "compare_messages.py",
        &["out/run.mcap", "out/run.recovered.mcap"].map(|it| lab.path(it)),
    );
    println!("{}", recovered.stdout);
    let last: f64 = ended.stdout.trim().parse().expect("a time");
    assert!(last >= LIFE.as_secs_f64() - LOST, "the recording ends at {last} s");
}
