//! Sends signals to runs and tests: they end in order, with their results, and nothing is left.

use std::process::{Child, Command, Stdio};

use super::ending::{analysed, lab, lives, passing, recorded, unpacked};
use super::harness::{Ended, Lab, signal, signalled, wait_until, with_signals};

tests! {
    a_signal_ends_a_run_at_the_next_communication_point: Compiler,
    a_signal_ends_an_analysis_and_the_runs_to_come: Compiler,
    a_second_signal_ends_a_run_at_once: Compiler,
    a_signal_to_a_test_is_passed_on_and_the_rest_is_told: Compiler,
    a_signal_that_is_ignored_from_the_start_stays_so: Compiler,
}

/// The program, which can be signalled, with its output in pipes.
fn listening(lab: &Lab) -> Command {
    let mut command = signalled(&lab.path(""));
    command.stdout(Stdio::piped()).stderr(Stdio::piped());
    command
}

/// Starts the program and waits until this file is there.
pub fn start(lab: &Lab, arguments: &[&str], file: &str) -> Child {
    let mut command = listening(lab);
    command.args(arguments);
    let child = command.spawn().expect("it starts");
    wait_until(&format!("there is {file}"), || lab.has(file));
    child
}

fn a_signal_ends_a_run_at_the_next_communication_point() {
    for (name, code) in [("INT", 130), ("TERM", 143), ("HUP", 129)] {
        let lab = lab();
        lab.write("case.toml", passing("misbehave.fmu", "at = 0.0").replace("stop = 1.0", "stop = 1e4"));
        lab.write("later.toml", passing("misbehave.fmu", "at = 0.0"));
        std::fs::create_dir(lab.path("temporary")).expect("a folder");
        let mut command = listening(&lab);
        command.args(["run", "case.toml", "later.toml", "--out", "out", "--csv", "--rerun", "off"]);
        command.args(["--realtime", "1"]).env("TMPDIR", lab.path("temporary"));
        let child = command.spawn().expect("it starts");
        wait_until("it records", || lab.has("out/case/run.mcap.tail"));
        signal(&child, name);
        let ended = Ended::of(child.wait_with_output().expect("it ends")).expect(code);
        ended.says(&[&format!("a signal ended the run: SIG{name}"), "not run: later.toml"]);
        let report = lab.report("out/case");
        assert_eq!(report["verdict"], "interrupted");
        let steps = usize::try_from(report["steps"].as_u64().expect("a number")).expect("a count");
        assert_eq!(recorded(&lab.path("out/case/run.mcap")), steps + 1);
        assert!(!lab.has("out/case/run.csv") && !lab.has("out/case/report.json.partial"));
        assert!(!lab.has("out/later"));
        assert_eq!(unpacked(&lab), [""; 0]);
    }
}

fn a_signal_ends_an_analysis_and_the_runs_to_come() {
    let lab = lab();
    super::plugins::compile(&lab, plugin::abi::VERSION);
    lab.write("inner.toml", passing("misbehave.fmu", "at = 0.0"));
    let validation = "\n[[validation]]\nname = \"again\"\nscenario = \"inner.toml\"\n";
    let text = analysed("goes on") + validation;
    lab.write("case.toml", text);
    let child = start(&lab, &["run", "case.toml", "--out", "out"], "analysis.begun");
    signal(&child, "TERM");
    let ended = Ended::of(child.wait_with_output().expect("it ends")).expect(143);
    ended.says(&["a signal ended the run: SIGTERM"]);
    let report = lab.report("out");
    assert_eq!((&report["verdict"], &report["steps"]), (&"interrupted".into(), &10.into()));
    assert!(!lab.has("out/again"));
}

fn a_second_signal_ends_a_run_at_once() {
    let lab = lab();
    lab.write("case.toml", passing("misbehave.fmu", "fault = 'sleep', at = 0.5"));
    let child = start(&lab, &["run", "case.toml", "--out", "out"], "sleeping.pid");
    signal(&child, "INT");
    wait_until("it noted the signal", || {
        // Both would be one if they came together.
        let status = std::fs::read_to_string(format!("/proc/{}/status", child.id())).expect("a process");
        let pending =
            status.lines().filter(|line| line.starts_with("ShdPnd:") || line.starts_with("SigPnd:"));
        pending.flat_map(|line| line.split_whitespace().nth(1)).all(|set| set.trim_matches('0').is_empty())
    });
    assert!(lives(&lab, "sleeping.pid"));
    signal(&child, "INT");
    Ended::of(child.wait_with_output().expect("it ends")).expect(130);
    assert!(!lab.has("out/report.json"));
}

fn a_signal_to_a_test_is_passed_on_and_the_rest_is_told() {
    let lab = lab();
    lab.write("a_good.toml", passing("misbehave.fmu", "at = 0.0"));
    lab.write("b_sleeps.toml", passing("misbehave.fmu", "fault = 'sleep', at = 0.5"));
    lab.write("c_good.toml", passing("misbehave.fmu", "at = 0.0"));
    let arguments = ["test", ".", "--jobs", "1", "--junit", "junit.xml", "--isolate", "none"];
    let child = start(&lab, &arguments, "sleeping.pid");
    signal(&child, "INT");
    let ended = Ended::of(child.wait_with_output().expect("it ends")).expect(130);
    for line in [
        "ok       ./a_good.toml",
        "stopped  ./b_sleeps.toml",
        "stopped  ./c_good.toml",
        "(not started: SIGINT)",
        "1 passed, 0 failed, 0 skipped, 2 not run to the end",
    ] {
        assert!(ended.stdout.contains(line), "{line}\n{}", ended.stdout);
    }
    assert!(lab.read("junit.xml").contains("errors=\"2\""));
    wait_until("the run is gone", || !lives(&lab, "sleeping.pid"));
}

/// As `nohup` and the background jobs of shells have it.
fn a_signal_that_is_ignored_from_the_start_stays_so() {
    let lab = lab();
    let long = passing("misbehave.fmu", "at = 0.0").replace("stop = 1.0", "stop = 1e4");
    lab.write("case.toml", long);
    let mut command = with_signals(&lab.path(""), "--ignore-signal=INT,HUP");
    command.args(["run", "case.toml", "--out", "out", "--rerun", "off", "--realtime", "1"]);
    let child = command.stderr(Stdio::piped()).spawn().expect("it starts");
    let steps = || lab.path("out/run.mcap.tail").metadata().map_or(0, |file| file.len());
    wait_until("it records", || steps() > 0);
    signal(&child, "INT");
    signal(&child, "HUP");
    let before = steps();
    wait_until("it goes on", || steps() > before);
    signal(&child, "TERM");
    let ended = Ended::of(child.wait_with_output().expect("it ends")).expect(143);
    ended.says(&["a signal ended the run: SIGTERM"]);
}
