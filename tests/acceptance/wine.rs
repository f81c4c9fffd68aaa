//! Runs FMUs for Windows through Wine: the numbers of Linux, messages, states, failures that are named, and no process that stays behind.

use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::Instant;

use super::clocks;
use super::fixture::Scenario;
use super::fmus::{
    archive, clocked, equations, for_windows, forgetful, hazard_for_windows, relay, resizable,
};
use super::harness::{Ended, Lab, is_overdue, limit, signal, signalled, trackside, wait_until};

tests! {
    windows_fmus_give_the_numbers_of_linux: Wine,
    states_go_back_and_on_under_wine: Wine,
    messages_and_resources_arrive: Wine,
    failures_are_named_by_call_and_time: Wine,
    a_call_that_does_not_return_is_ended_with_its_process: Wine,
    a_killed_process_ends_the_run_and_a_killed_run_its_process: Wine,
    ten_fmus_and_two_runs_at_once_go_together: Wine,
    a_sandbox_is_refused_for_what_it_does_not_confine: Wine,
    what_is_missing_is_told_beforehand: Wine,
}

/// All tests share one prefix, which the first of them makes.
fn with_prefix(mut command: Command) -> Command {
    command.env("XDG_CACHE_HOME", Path::new(env!("CARGO_TARGET_TMPDIR")).join("cache"));
    command
}

fn run_in(lab: &Lab, arguments: &[&str]) -> Ended {
    let mut command = with_prefix(trackside(&lab.path(".")));
    Ended::of(command.args(arguments).output().expect("it starts"))
}

/// The table of a run with this archive.
fn table(scenario: &Scenario, archives: &[(&str, &[u8])], more: &[&str]) -> String {
    let lab = Lab::new();
    archives.iter().for_each(|(name, bytes)| drop(lab.write(name, bytes)));
    lab.write("case.toml", scenario.clone().text());
    run_in(&lab, &[&["run", "case.toml", "--out", "out", "--csv", "--rerun", "off"], more].concat())
        .expect(0);
    lab.read("out/run.csv")
}

fn windows_fmus_give_the_numbers_of_linux() {
    let relays = Scenario::new()
        .time(0.1, 1.0)
        .fmu("tail", "it.fmu", "x = 3.5, text = 'two', gear = 'drive'")
        .key("unconnected = 'start'")
        .fmu("head", "it.fmu", "x = 1.5, text = 'Größe', gear = 'drive'")
        .key("unconnected = 'start'");
    let row = Scenario::new()
        .time(0.1, 1.0)
        .fmu("row", "it.fmu", "n = 3, 'u[1]' = 1.0, 'u[2]' = 2.0, 'u[3]' = 3.0")
        .key("unconnected = 'start'");
    let driven = Scenario::new()
        .time(0.1, 2.0)
        .fmu("it", "it.fmu", "kind = 'driven'")
        .key("unconnected = 'start'")
        .signal("s.u", "ramp = { start = 0.0, end = 2.0, after = 2.0 }")
        .connect("s.u", "it.u");
    for (name, scenario, native) in [
        ("relay", relays, relay()),
        ("resizable", row, resizable()),
        ("clocked", clocks::scenario(), clocked()),
        ("equations", driven, equations()),
    ] {
        let file = if name == "clocked" { "clocked.fmu" } else { "it.fmu" };
        let windows = table(&scenario, &[(file, &for_windows(name))], &[]);
        assert_eq!(windows, table(&scenario, &[(file, native)], &[]), "{name}");
    }
}

fn states_go_back_and_on_under_wine() {
    let scenario = Scenario::new().time(0.1, 2.0).fmu("it", "it.fmu", "u = 2.0").key("unconnected = 'start'");
    let lab = Lab::new();
    lab.write("it.fmu", for_windows("forgetful"));
    lab.write("case.toml", scenario.clone().text());
    let run = ["run", "case.toml", "--csv", "--rerun", "off", "--out"];
    run_in(&lab, &[&run[..], &["whole", "--checkpoint", "1"]].concat()).expect(0);
    let whole = lab.read("whole/run.csv");
    assert_eq!(whole, table(&scenario, &[("it.fmu", &forgetful(&[]))], &[]));
    run_in(&lab, &[&run[..], &["rest", "--resume", "whole/checkpoint_1.state"]].concat()).expect(0);
    assert_eq!(lab.read("rest/run.csv").lines().last(), whole.lines().last());
}

/// A run of the FMU that does what ends a process, from 0.5 s on.
fn hazard(fault: &str, keys: &str) -> Scenario {
    let start = format!("at = 0.5, fault = '{fault}'");
    let node = Scenario::new().time(0.1, 1.0).fmu("tank", "hazard.fmu", &start);
    node.key("unconnected = 'start'").key(keys).check("clock", "time >= 0")
}

fn run_hazard(fault: &str, keys: &str, more: &[&str]) -> (Lab, Ended) {
    let lab = Lab::new();
    lab.write("hazard.fmu", hazard_for_windows());
    lab.write("case.toml", hazard(fault, keys).text());
    let arguments = ["run", "case.toml", "--out", "out", "--csv", "--rerun", "off"];
    let ended = run_in(&lab, &[&arguments, more].concat());
    (lab, ended)
}

fn is_whole_recording(lab: &Lab) -> bool {
    let bytes = std::fs::read(lab.path("out/run.mcap")).expect("a recording");
    mcap::Summary::read(&bytes).is_ok_and(|summary| summary.is_some())
}

fn messages_and_resources_arrive() {
    let (lab, ended) = run_hazard("log", "", &[]);
    ended.expect(0);
    let report = lab.report("out").to_string();
    for words in ["resources at file:///Z:/", "/resources, 50% of 1.50", "message 0 of the flood at 0.5 s"] {
        assert!(report.contains(words), "{words}: {report}");
    }
    // 20,000 in each of five steps, of one kind.
    assert!(report.contains("99999") || report.contains("100000"), "{report}");
}

fn failures_are_named_by_call_and_time() {
    for (fault, says) in [
        ("memory", "an access violation (0xC0000005)"),
        ("division", "an integer division by zero (0xC0000094)"),
        ("stack", "a stack overflow (0xC00000FD)"),
        ("exit", "ended with exit code 7"),
        ("abort", "ended with exit code 3"),
        ("error", "fmi2Error"),
    ] {
        let (lab, ended) = run_hazard(fault, "", &[]);
        let step = "node `tank`: fmi2DoStep at t = 0.5 s";
        ended.expect(3).says(&[step, says]);
        let report = lab.report("out");
        assert_eq!((&report["verdict"], &report["steps"]), (&"error".into(), &5.into()), "{fault}");
        assert!(is_whole_recording(&lab), "{fault}");
    }
    run_hazard("past", "", &[]).1.expect(3).says(&["fmi2GetReal at t = 0.6 s", "wrote past the end"]);
    // Wine's heap may overlook it.
    let (lab, ended) = run_hazard("twice", "", &[]);
    assert!(matches!(ended.code(), Some(0 | 3)), "{}", ended.stderr);
    assert!(is_whole_recording(&lab));
}

fn a_call_that_does_not_return_is_ended_with_its_process() {
    let (lab, ended) = run_hazard("hang", "", &["--limit", &limit(2.0).to_string()]);
    ended.expect(3).says(&["fmi2DoStep at t = 0.5 s", "did not return when the run had to end"]);
    assert_eq!(lab.report("out")["steps"], 5);
    assert!(is_whole_recording(&lab));
    let isolated = "isolate = true\nsandbox = false\ncall_limit = 2.0";
    run_hazard("hang", isolated, &[]).1.expect(3).says(&["fmi2DoStep at t = 0.5 s", "`call_limit`"]);
}

/// The program under Wine of a run, once it has begun the call that does not return.
fn hanging(lab: &Lab) -> (Child, u32) {
    lab.write("hazard.fmu", hazard_for_windows());
    lab.write("case.toml", hazard("hang", "").text());
    let mut command = with_prefix(signalled(&lab.path(".")));
    command.args(["run", "case.toml", "--out", "out", "--rerun", "off"]);
    let child = command.stdout(Stdio::null()).stderr(Stdio::piped()).spawn().expect("it starts");
    let mut guest = None;
    wait_until("its FMU is busy", || {
        let mut busy = children(child.id()).into_iter().filter(|process| processor_time(*process) > 50);
        guest = busy.next();
        guest.is_some()
    });
    (child, guest.expect("a process"))
}

fn children(process: u32) -> Vec<u32> {
    let tasks = std::fs::read_dir(format!("/proc/{process}/task")).into_iter().flatten().flatten();
    let lists = tasks.map(|task| std::fs::read_to_string(task.path().join("children")));
    let numbers = |list: String| list.split_whitespace().map(str::parse).collect::<Vec<_>>();
    lists.flatten().flat_map(numbers).flatten().collect()
}

/// How long a process has computed in its own code [1/100 s].
fn processor_time(process: u32) -> u64 {
    let status = std::fs::read_to_string(format!("/proc/{process}/stat")).unwrap_or_default();
    let mut fields = status.rsplit(')').next().unwrap_or_default().split_whitespace();
    fields.nth(11).and_then(|ticks| ticks.parse().ok()).unwrap_or_default()
}

fn lives(process: u32) -> bool {
    let status = std::fs::read_to_string(format!("/proc/{process}/status"));
    status.is_ok_and(|status| !status.contains("State:\tZ"))
}

fn a_killed_process_ends_the_run_and_a_killed_run_its_process() {
    let lab = Lab::new();
    let (child, guest) = hanging(&lab);
    let kill = Command::new("kill").args(["-KILL", &guest.to_string()]).status();
    assert!(kill.expect("kill").success());
    let ended = Ended::of(child.wait_with_output().expect("it ends")).expect(3);
    ended.says(&["node `tank`: fmi2DoStep at t = 0.5 s", "was ended by signal 9"]);
    assert!(is_whole_recording(&lab));

    let (mut child, guest) = hanging(&lab);
    child.kill().expect("it is there");
    child.wait().expect("it ends");
    wait_until("its FMU ends", || !lives(guest));

    let (child, guest) = hanging(&lab);
    signal(&child, "INT");
    Ended::of(child.wait_with_output().expect("it ends")).expect(130);
    assert!(!lives(guest));
    assert!(is_whole_recording(&lab));
}

fn ten_fmus_and_two_runs_at_once_go_together() {
    let names: Vec<_> = (0..10).map(|number| format!("car_{number}.fmu")).collect();
    let nodes = names.iter().fold(Scenario::new().time(0.01, 1.0), |scenario, file| {
        let name = file.trim_end_matches(".fmu");
        scenario.fmu(name, file, "at = 9.0").key("unconnected = 'start'")
    });
    let lab = Lab::new();
    names.iter().for_each(|name| drop(lab.write(name, hazard_for_windows())));
    lab.write("case.toml", nodes.text());
    let begin = Instant::now();
    let start = |out: &str| {
        let mut command = with_prefix(trackside(&lab.path(".")));
        command.args(["run", "case.toml", "--csv", "--rerun", "off", "--out", out]);
        command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("it starts")
    };
    let both = ["one", "two"].map(start);
    let ended = both.map(|child| Ended::of(child.wait_with_output().expect("it ends")));
    ended.into_iter().for_each(|ended| drop(ended.expect(0)));
    assert_eq!(lab.read("one/run.csv"), lab.read("two/run.csv"));
    let table = lab.table("one/run.csv");
    let last: Vec<f64> =
        table.lines().last().expect("a row").split(',').map(|cell| cell.parse().expect("a number")).collect();
    assert!(last.iter().all(|y| (y - 1.0).abs() < 1e-9) && last.len() == 11, "{last:?}");
    assert!(!is_overdue(begin, std::time::Duration::from_secs(60)));
}

fn a_sandbox_is_refused_for_what_it_does_not_confine() {
    run_hazard("", "isolate = true", &[])
        .1
        .expect(2)
        .says(&["no sandbox confines Wine", "`sandbox = false`"]);
    let (lab, ended) = run_hazard("", "isolate = true\nsandbox = false", &[]);
    ended.expect(0);
    let (alone, ended) = run_hazard("", "", &[]);
    ended.expect(0);
    assert_eq!(lab.read("out/run.csv"), alone.read("out/run.csv"));
    let (lab, ended) = run_hazard("", "", &["--isolate"]);
    ended.expect(0);
    let report = lab.report("out").to_string();
    assert!(
        report.contains("`tank`: its win64 library runs through Wine, which no sandbox confines"),
        "{report}"
    );
}

fn what_is_missing_is_told_beforehand() {
    let lab = Lab::new();
    lab.write("hazard.fmu", hazard_for_windows());
    let inspected = run_in(&lab, &["inspect", "hazard.fmu"]).expect(0);
    assert!(inspected.stdout.contains("through Wine (win64 library)"), "{}", inspected.stdout);
    // A machine without what compiles the program for Windows.
    let mut bare = trackside(&lab.path("."));
    bare.env("XDG_CACHE_HOME", lab.path("empty")).env("PATH", "").args(["inspect", "hazard.fmu"]);
    let told = Ended::of(bare.output().expect("it starts")).expect(0);
    let says = "the library for win64 runs through Wine, for which this system lacks";
    assert!(told.stdout.contains(says) && told.stdout.contains("gcc-mingw-w64-x86-64"), "{}", told.stdout);
    // A library that needs another one, which its archive lacks.
    lab.write("other.c", "int other(void) { return 1; }\n");
    lab.write("main.c", "int other(void);\nint fmi2DoStep(void) { return other(); }\n");
    for (source, more, library) in [("other.c", "-O0", "other.dll"), ("main.c", "other.dll", "hazard.dll")] {
        let mut cc = Command::new("x86_64-w64-mingw32-gcc");
        cc.current_dir(lab.path(".")).args(["-shared", source, more, "-o", library]);
        assert!(cc.status().expect("MinGW-w64").success());
    }
    let description = include_str!("fmu/hazard.xml");
    let library = std::fs::read(lab.path("hazard.dll")).expect("a library");
    let entries = [("modelDescription.xml", description.as_bytes()), ("binaries/win64/hazard.dll", &library)];
    lab.write("lacking.fmu", archive(&entries));
    lab.write("case.toml", Scenario::new().time(0.1, 1.0).fmu("it", "lacking.fmu", "u = 0.0").text());
    run_in(&lab, &["run", "case.toml", "--rerun", "off"]).expect(3).says(&["it needs other.dll"]);
}
