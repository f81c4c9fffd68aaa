//! Compares the recordings with each other through other people's readers, also those of a killed run.

use std::path::Path;
#[cfg(feature = "rerun")]
use std::path::PathBuf;
use std::sync::OnceLock;
use std::time::Duration;

use super::fixture::Scenario;
use super::fmus::ours;
#[cfg(feature = "rerun")]
use super::harness::{Ended, ROOT};
use super::harness::{Lab, limit_handling, trackside};
#[cfg(feature = "rerun")]
use super::python::Python;
use super::python::python;

tests! {
    mcap_and_csv_hold_bit_identical_numbers: Python,
    #[cfg(feature = "rerun")]
    the_viewer_loads_the_replay_without_warnings: Python,
    #[cfg(feature = "rerun")]
    only_equal_runs_give_equal_replays: Python,
    #[cfg(feature = "rerun")]
    the_replay_of_a_wide_run_has_what_its_view_and_checks_need: Python,
    #[cfg(feature = "rerun")]
    the_replay_shows_the_result_of_an_identification: Python,
    a_killed_run_leaves_a_recoverable_recording_and_no_report,
    a_file_other_than_a_recording_is_not_recovered,
    broken_and_recovered_recordings_hold_the_same_messages: Python,
}

fn mcap_and_csv_hold_bit_identical_numbers() {
    let python = python();
    let run = limit_handling();
    python.run("compare_mcap.py", &[run.path("run/run.mcap"), run.path("run/run.csv")]);
}

/// Runs the viewer's program with these arguments.
#[cfg(feature = "rerun")]
fn rerun(python: &Python, words: &[&str], files: &[PathBuf]) -> Ended {
    let mut rerun = python.rerun();
    rerun.env("RERUN_PANIC_ON_WARN", "1").args(words).args(files);
    Ended::of(rerun.output().expect("it starts"))
}

#[cfg(feature = "rerun")]
fn the_viewer_loads_the_replay_without_warnings() {
    let python = python();
    let replay = [limit_handling().path("run/run.rrd")];
    // 26 MB with all samples.
    let size = std::fs::metadata(&replay[0]).expect("a file").len();
    assert!(size <= 8_000_000, "{size} bytes");
    rerun(python, &["rrd", "verify"], &replay).expect(0);
    rerun(python, &["--test-receive", "--headless", "--port", "auto"], &replay).expect(0);
}

#[cfg(feature = "rerun")]
fn the_replay_of_a_wide_run_has_what_its_view_and_checks_need() {
    let python = python();
    let lab = Lab::new();
    let names: Vec<String> = (1..=450).map(|number| format!("c{number:03}")).collect();
    let row = |time: f64| {
        format!("{time},{}\n", names.iter().map(|_| time.to_string()).collect::<Vec<_>>().join(","))
    };
    lab.write("wide.csv", format!("t,{}\n{}{}", names.join(","), row(0.0), row(1.0)));
    let columns: Vec<String> =
        names.iter().map(|name| format!("{name} = {{ column = \"{name}\" }}")).collect();
    let entities = |name: &str, view: &str| -> Vec<String> {
        let scenario = Scenario::new()
            .time(0.1, 1.0)
            .table("wide", "wide.csv", &columns.join(", "))
            .check("small", "wide.c450 < 2")
            .section(view);
        lab.write(&format!("{name}.toml"), scenario.text());
        lab.trackside(&["run", &format!("{name}.toml"), "--out", name]).expect(0);
        let replay = lab.path(&format!("{name}/run.rrd"));
        let output = rerun(python, &["rrd", "stats"], std::slice::from_ref(&replay)).expect(0).stdout;
        let card = python.run("document.py", &[replay.as_os_str(), "/run".as_ref()]).stdout;
        assert!(card.contains("of 450"), "{card}");
        let has = |name: &&String| {
            output.split_whitespace().any(|word| word.ends_with(&format!("/outputs/{name}:")))
        };
        names.iter().filter(has).cloned().collect()
    };
    let usual = entities("usual", "");
    assert_eq!((usual.len(), usual[0].as_str(), usual[400].as_str()), (401, "c001", "c450"));
    let plot = "[[view.plot]]\ntitle = \"some\"\nsignals = [{ signal = \"wide.c007\" }]";
    assert_eq!(entities("plot", plot), ["c007", "c450"]);
    let named = format!("[view]\nsignals = [\"wide.c44*\"]\n{plot}");
    assert_eq!(entities("named", &named).len(), 12);
}

#[cfg(feature = "rerun")]
fn only_equal_runs_give_equal_replays() {
    let python = python();
    let lab = Lab::new();
    lab.add(&ours().join("plant.fmu"));
    let replay = |name: &str, steering: &str| {
        let start = format!("start.v_x = 20.0, F_x = 0.0, delta = {steering}");
        let scenario = Scenario::new()
            .time(0.01, 3.0)
            .fmu("plant", "../plant.fmu", &start)
            .check("drives on", "plant.X > 10")
            .pose("plant");
        lab.write(&format!("{name}/case.toml"), scenario.text());
        lab.trackside(&["run", &format!("{name}/case.toml"), "--out", name]);
        lab.path(&format!("{name}/run.rrd"))
    };
    let [a, b, c] = [("a", "0.01"), ("b", "0.01"), ("c", "0.0100001")].map(|it| replay(it.0, it.1));
    rerun(python, &["rrd", "compare", "--unordered"], &[a.clone(), b]).expect(0);
    let output = rerun(python, &["rrd", "stats"], std::slice::from_ref(&a)).expect(0).stdout;
    for entity in ["/checks/01_drives_on", "/world/car", "/world/path/line", "/signals/plant/outputs/v_x"] {
        assert!(output.contains(entity), "no {entity}");
    }
    rerun(python, &["rrd", "compare", "--unordered"], &[a, c]).expect(1);
}

#[cfg(feature = "rerun")]
fn the_replay_shows_the_result_of_an_identification() {
    let python = python();
    let lab = Lab::new();
    let mut command = trackside(Path::new(ROOT));
    command.args(["run", "scenarios/tires_from_driving.toml", "--out"]).arg(lab.path("run"));
    Ended::of(command.output().expect("it starts")).expect(0);
    let replay = [lab.path("run/run.rrd")];
    let output = rerun(python, &["rrd", "stats"], &replay).expect(0).stdout;
    // Curve, seven densities and the trace of the fits, each with axes and layers.
    for axle in [r"Front\ axle\,\ lateral", r"Rear\ axle\,\ lateral"] {
        for number in 1..=9 {
            for part in ["grid", "labels", "01"] {
                let entity = format!("/diagrams/tires/{axle}/{number}/{part}");
                assert!(output.contains(&entity), "no {entity} in:\n{output}");
            }
        }
    }
    rerun(python, &["rrd", "verify"], &replay).expect(0);
    rerun(python, &["--test-receive", "--headless", "--port", "auto"], &replay).expect(0);
}

/// A killed run that was to take a minute, and the time up to which its recording could be read while it went on [s].
fn killed() -> &'static (Lab, f64) {
    static KILLED: OnceLock<(Lab, f64)> = OnceLock::new();
    KILLED.get_or_init(|| {
        let lab = Lab::new();
        lab.add(&ours().join("plant.fmu"));
        let start = "start.v_x = 20.0, F_x = 0.0, delta = 0.01";
        let scenario = Scenario::new().time(0.01, 60.0).fmu("plant", "plant.fmu", start);
        lab.write("case.toml", scenario.text());
        let mut command = trackside(&lab.path(""));
        command.args(["run", "case.toml", "--out", "out", "--csv", "--realtime"]);
        let mut child = command.spawn().expect("it starts");
        let read = loop {
            assert!(child.try_wait().expect("its state").is_none(), "it ended before it was killed");
            match readable(&lab.path("out/run.mcap")) {
                Some(time) if time >= 2.0 => break time,
                _ => std::thread::sleep(Duration::from_millis(20)),
            }
        };
        child.kill().expect("it still runs");
        child.wait().expect("it ends");
        (lab, read)
    })
}

/// The time of the last message that can be read of an unfinished recording [s].
fn readable(file: &Path) -> Option<f64> {
    let bytes = std::fs::read(file).ok()?;
    let messages = mcap::MessageStream::new_with_options(&bytes, mcap::read::Options::IgnoreEndMagic.into());
    let times = messages.ok()?.map_while(Result::ok).map(|message| message.log_time as f64 * 1e-9);
    times.reduce(f64::max)
}

fn a_killed_run_leaves_a_recoverable_recording_and_no_report() {
    let (lab, read) = killed();
    assert!(!lab.has("out/report.json") && !lab.has("out/run.csv"));
    let into = ["recover", "out/run.mcap", "--out", "out/new.mcap"];
    let stdout = lab.trackside(&into).expect(0).stdout;
    assert!(stdout.contains("out/new.mcap: ") && stdout.contains("broken"), "{stdout}");
    let recovered = readable(&lab.path("out/new.mcap")).expect("messages");
    assert!(recovered >= *read, "{recovered} s were recovered, {read} s had been readable");
    lab.trackside(&["recover", "out/run.mcap", "--out", "out/run.mcap"]).expect(2);
}

fn a_file_other_than_a_recording_is_not_recovered() {
    let lab = Lab::new();
    lab.write("text.mcap", "no recording");
    lab.trackside(&["recover", "text.mcap"]).expect(2).says(&["text.mcap", "expected an MCAP file"]);
    assert!(!lab.has("text.recovered.mcap") && !lab.has("text.recovered.mcap.partial"));
}

fn broken_and_recovered_recordings_hold_the_same_messages() {
    let (lab, read) = killed();
    let python = python();
    lab.trackside(&["recover", "out/run.mcap"]).expect(0);
    let ended = python.run("last_time.py", &[lab.path("out/run.mcap")]);
    python.run("compare_messages.py", &["out/run.mcap", "out/run.recovered.mcap"].map(|it| lab.path(it)));
    let last: f64 = ended.stdout.trim().parse().expect("a time");
    assert!(last >= *read - 1e-9, "the recording ends at {last} s, {read} s had been readable");
}
