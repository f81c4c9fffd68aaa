//! Checks how runs end that foreign code, a limit or a signal ends: never as passed, with their results, and without leftovers.

use std::path::Path;
use std::process::{Command, Stdio};

use super::fixture::Scenario;
use super::fmus::{compile, misbehave};
use super::harness::{Ended, Lab, limit, signal, signalled, trackside, wait_until};

tests! {
    an_exit_of_an_fmu_never_passes_for_a_verdict: Compiler,
    an_exit_while_a_library_loads_is_told: Compiler,
    an_fmu_that_crashes_after_the_run_does_not_change_its_verdict: Compiler,
    a_plugin_that_ends_the_program_is_named: Compiler,
    a_validation_does_not_need_that_the_first_run_is_freed: Compiler,
    a_run_over_its_limit_is_ended_with_node_and_call: Compiler,
    a_signal_ends_a_run_that_loads,
    a_limit_that_is_none_is_refused: Compiler,
    a_test_over_its_limit_does_not_stop_the_others: Compiler,
    what_an_fmu_starts_ends_with_its_test: Compiler,
    nothing_outlives_a_test_that_is_killed: Compiler,
    what_a_killed_conform_leaves_goes_at_the_next_start: Compiler,
}

/// A scenario with the `misbehave` of this archive, ten steps and a check that fails.
fn failing(fmu: &str, start: &str) -> String {
    passing(fmu, start) + "\n[[check]]\nname = \"never\"\nthat = \"time < 0\"\n"
}

pub fn passing(fmu: &str, start: &str) -> String {
    let node = Scenario::new().time(0.1, 1.0).fmu("tank", fmu, &format!("u = 0.0, {start}"));
    node.check("clock", "time >= 0").text()
}

pub fn lab() -> Lab {
    let lab = Lab::new();
    lab.write("misbehave.fmu", misbehave());
    lab
}

fn run(lab: &Lab, text: &str) -> Ended {
    lab.write("case.toml", text);
    lab.trackside(&["run", "case.toml", "--out", "out", "--rerun", "off"])
}

fn an_exit_of_an_fmu_never_passes_for_a_verdict() {
    let lab = lab();
    let step = "fmi2DoStep at t = 0.5 s";
    for (fault, says) in [
        ("exit", step),
        ("quick_exit", step),
        ("exit on a thread", step),
        ("pthread_exit", step),
        ("_exit", step),
        ("_Exit", step),
    ] {
        let start = format!("fault = '{fault}', at = 0.5");
        let ended = run(&lab, &failing("misbehave.fmu", &start));
        ended.expect(3).says(&["node `tank`", says, "xit"]);
        assert!(!lab.has("out/report.json"), "{fault}");
        // The report of an earlier run that passed must not stand for this one.
        lab.write("good.toml", passing("misbehave.fmu", "at = 0.0"));
        lab.trackside(&["run", "good.toml", "--out", "target/runs/case"]).expect(0);
        for isolate in ["none", "all"] {
            let arguments = ["test", "case.toml", "--junit", "junit.xml", "--isolate", isolate];
            let ended = lab.trackside(&arguments).expect(1);
            assert!(ended.stdout.contains("0 passed, 1 failed"), "{fault}\n{}", ended.stdout);
            assert!(lab.read("junit.xml").contains("errors=\"1\""), "{fault}");
        }
    }
}

fn an_exit_while_a_library_loads_is_told() {
    let lab = lab();
    for (defined, doing) in [("AT_LOAD", "loading"), ("AT_UNLOAD", "unloading")] {
        lab.write("odd.fmu", compile(&[&format!("-D{defined}=exit(0)")]));
        // A refused start value unloads the library before the end of the run.
        let text = failing("odd.fmu", "fault = 'fmi2EnterInitializationMode', status = 3");
        let ended = run(&lab, &text).expect(3);
        ended.says(&["the FMU", "odd.fmu", &format!("{doing} its library"), "called exit"]);
        lab.trackside(&["test", "case.toml"]).expect(1);
    }
}

/// By each way in which the code of an FMU runs after the run.
fn an_fmu_that_crashes_after_the_run_does_not_change_its_verdict() {
    let lab = lab();
    lab.write("unloaded.fmu", compile(&["-DAT_UNLOAD=abort()"]));
    lab.write("stays.fmu", compile(&["-DAT_UNLOAD=abort()", "-Wl,-z,nodelete"]));
    for (fmu, fault, says) in [
        ("misbehave.fmu", "abort when freed", &["node `tank`: fmi2FreeInstance", "SIGABRT"][..]),
        ("misbehave.fmu", "exit when freed", &["node `tank`: fmi2FreeInstance", "called exit"]),
        ("unloaded.fmu", "", &["unloading its library", "SIGABRT"]),
        ("stays.fmu", "", &[]),
    ] {
        let start = format!("fault = '{fault}', at = 0.0");
        for (text, code, verdict) in [(passing(fmu, &start), 0, "pass"), (failing(fmu, &start), 1, "fail")] {
            let ended = run(&lab, &text).expect(code).says(says);
            let warned = ended.stderr.contains("its results are complete");
            assert_eq!(warned, !says.is_empty(), "{}", ended.stderr);
            assert_eq!(lab.report("out")["verdict"], verdict, "{fault}");
            assert_eq!(recorded(&lab.path("out/run.mcap")), 11, "{fault}");
        }
        // What follows does not take place: that is no success.
        lab.write("good.toml", passing("misbehave.fmu", "at = 0.0"));
        lab.write("case.toml", passing(fmu, &start));
        let ended = lab.trackside(&["run", "case.toml", "good.toml", "--out", "both"]);
        assert_eq!(ended.code() == Some(0), lab.has("both/good/report.json"), "{fault}");
        lab.trackside(&["test", "case.toml"]).expect(0);
    }
}

/// The messages of the node, of a closed recording.
pub fn recorded(file: &Path) -> usize {
    let bytes = std::fs::read(file).expect("a recording");
    assert!(mcap::Summary::read(&bytes).expect("a closed recording").is_some());
    let messages = mcap::MessageStream::new(&bytes).expect("a recording");
    let messages = messages.map(|message| message.expect("a readable recording"));
    messages.filter(|message| message.channel.topic == "/tank/outputs").count()
}

fn a_plugin_that_ends_the_program_is_named() {
    let lab = lab();
    super::plugins::compile(&lab, plugin::abi::VERSION);
    for (mode, says) in [
        ("exits", "its run ended this program: the plugin called exit"),
        ("_exits", "its run ended this program: the plugin called _exit"),
        ("leaves", "a thread that it started in its run ended this program: the plugin called exit"),
        ("aborts", "its run ended this program: the plugin aborted (SIGABRT)"),
        ("overflows", "its run ended this program: the plugin overflowed its stack (SIGSEGV)"),
        ("crashes", "a thread that it started in its run ended this program: the plugin touched memory"),
    ] {
        run(&lab, &analysed(mode)).expect(3).says(&[&format!("analysis `odd`: {says}")]);
        assert!(!lab.has("out/report.json"), "{mode}");
        let ended = lab.trackside(&["test", "case.toml"]).expect(1);
        assert!(ended.stdout.contains(says), "{mode}\n{}", ended.stdout);
    }
}

/// A scenario with an analysis of this mode.
pub fn analysed(mode: &str) -> String {
    let node = Scenario::new().time(0.1, 1.0).fmu("tank", "misbehave.fmu", "u = 0.0, at = 0.0");
    let signal = node.signal("car.v", "unit = \"km/h\"\nconstant = 3.6");
    let keys = "name = \"odd\"\npath = \"odd.so\"\nsignals = { speed = \"car.v\" }";
    signal.section(&format!("[[analysis]]\n{keys}\nconfig = {{ mode = \"{mode}\" }}")).text()
}

fn a_validation_does_not_need_that_the_first_run_is_freed() {
    let lab = lab();
    lab.write("inner.toml", passing("misbehave.fmu", "at = 0.0"));
    let validation = "\n[[validation]]\nname = \"again\"\nscenario = \"inner.toml\"\n";
    let text = passing("misbehave.fmu", "fault = 'abort when freed', at = 0.0") + validation;
    run(&lab, &text).expect(0).says(&["fmi2FreeInstance", "its results are complete"]);
    let report = lab.report("out");
    assert_eq!((&report["verdict"], &report["validations"][0]["verdict"]), (&"pass".into(), &"pass".into()));
}

/// The scenario with a limit.
fn limited(text: &str, limit: &str) -> String {
    text.replace("stop = 1.0", &format!("stop = 1.0\nlimit = {limit}"))
}

fn a_run_over_its_limit_is_ended_with_node_and_call() {
    let lab = lab();
    let hanging = passing("misbehave.fmu", "fault = 'sleep', at = 0.5");
    let short = limit(0.5).to_string();
    let says =
        ["node `tank`: fmi2DoStep at t = 0.5 s did not return", &format!("after {short} s, its time limit")];
    run(&lab, &limited(&hanging, &short)).expect(3).says(&says);
    let report = lab.report("out");
    assert_eq!((&report["verdict"], &report["steps"]), (&"error".into(), &5.into()));
    assert!(
        report["error"].as_str().is_some_and(|error| error.contains("fmi2DoStep at t = 0.5 s")),
        "{report}"
    );
    assert!(lab.read("out/report.html").contains("did not return"));
    // The argument counts, not the scenario.
    lab.write("case.toml", limited(&hanging, "1e6"));
    let arguments = ["run", "case.toml", "--out", "out", "--limit", &short];
    lab.trackside(&arguments).expect(3).says(&says);
    // A run that goes on ends at a communication point, with all that it has recorded.
    lab.write("case.toml", passing("misbehave.fmu", "at = 0.0").replace("stop = 1.0", "stop = 1e4"));
    let arguments = [&arguments[..], &["--realtime", "1"]].concat();
    lab.trackside(&arguments).expect(3).says(&[&format!("the run was not over after {short} s")]);
    let report = lab.report("out");
    assert_eq!(report["verdict"], "error");
    let steps = usize::try_from(report["steps"].as_u64().expect("a number")).expect("a count");
    assert_eq!(recorded(&lab.path("out/run.mcap")), steps + 1);
    // After the end of the run it is a matter of the FMU alone.
    let late = passing("misbehave.fmu", "fault = 'sleep when freed', at = 0.0");
    run(&lab, &limited(&late, &limit(5.0).to_string())).expect(0).says(&[
        "fmi2FreeInstance",
        "did not return",
        "its verdict stands",
    ]);
}

/// Nobody ever writes into the pipe.
fn a_signal_ends_a_run_that_loads() {
    let lab = Lab::new();
    assert!(Command::new("mkfifo").arg(lab.path("log.csv")).status().expect("mkfifo").success());
    let text = Scenario::new().time(0.1, 1.0).table("log", "log.csv", "v = \"v\"").text();
    lab.write("case.toml", text);
    let mut program = signalled(&lab.path(""));
    program.args(["run", "case.toml", "--out", "out"]).stderr(Stdio::piped()).stdout(Stdio::null());
    let child = program.spawn().expect("it starts");
    let status = format!("/proc/{}/status", child.id());
    // The set of signals with handlers, in hexadecimal digits.
    let handled =
        |line: &str| Some(u64::from_str_radix(line.strip_prefix("SigCgt:")?.trim(), 16).ok()? >> 14 & 1);
    let is_caught =
        || std::fs::read_to_string(&status).is_ok_and(|it| it.lines().find_map(handled) == Some(1));
    wait_until("it notes signals", is_caught);
    signal(&child, "TERM");
    let ended = Ended::of(child.wait_with_output().expect("it ends")).expect(128 + 15);
    ended.says(&["SIGTERM", "while it loaded its files"]);
    assert!(!lab.has("out"));
}

fn a_limit_that_is_none_is_refused() {
    let lab = lab();
    let text = passing("misbehave.fmu", "at = 0.0");
    run(&lab, &text.replace("stop = 1.0", "stop = 1.0\nlimit = 1e300")).expect(0);
    for limit in ["0.0", "-1.0", "nan", "inf"] {
        run(&lab, &text.replace("stop = 1.0", &format!("stop = 1.0\nlimit = {limit}")))
            .expect(2)
            .says(&["expected a time limit above 0 s", "case.toml:4:"]);
        for command in ["run", "test"] {
            let argument = format!("--limit={limit}");
            lab.trackside(&[command, "case.toml", &argument])
                .expect(2)
                .says(&["--limit: expected a time above 0 s"]);
        }
    }
}

fn a_test_over_its_limit_does_not_stop_the_others() {
    let lab = lab();
    lab.write("a_good.toml", passing("misbehave.fmu", "at = 0.0"));
    let sleeping = passing("misbehave.fmu", "fault = 'sleep', at = 0.5");
    let short = limit(0.5).to_string();
    lab.write("b_sleeps.toml", limited(&sleeping, &short));
    // One that does not even react to its own limit.
    lab.write("stopped.fmu", compile(&["-DAT_LOAD=kill(getpid(),SIGSTOP)"]));
    lab.write("c_stops.toml", limited(&passing("stopped.fmu", "at = 0.0"), &short));
    lab.write("d_good.toml", passing("misbehave.fmu", "at = 0.0"));
    let ended = lab.trackside(&["test", ".", "--jobs", "1", "--isolate", "none"]).expect(1);
    for line in [
        "ok       ./a_good.toml",
        "FAILED   ./b_sleeps.toml",
        "node `tank`: fmi2DoStep at t = 0.5 s did not return",
        "FAILED   ./c_stops.toml",
        &format!("it did not end by itself after {short} s, its time limit, and was killed"),
        "ok       ./d_good.toml",
    ] {
        assert!(ended.stdout.contains(line), "{line}\n{}", ended.stdout);
    }
}

fn what_an_fmu_starts_ends_with_its_test() {
    for fault in ["another process", "another session"] {
        let lab = lab();
        lab.write("case.toml", passing("misbehave.fmu", &format!("fault = '{fault}', at = 0.5")));
        lab.trackside(&["test", "case.toml", "--isolate", "none"]).expect(0);
        assert!(lab.has("other.pid"), "{fault}");
        wait_until("the other process is gone", || !lives(&lab, "other.pid"));
    }
}

fn what_a_killed_conform_leaves_goes_at_the_next_start() {
    let lab = lab();
    lab.write("slow.fmu", super::fmus::deviate(&["-DBREAKS=\"a step takes for ever\""]));
    std::fs::create_dir(lab.path("temporary")).expect("a folder");
    let conform = |fmu: &str| {
        let mut command = trackside(&lab.path(""));
        command.args(["conform", fmu]).env("TMPDIR", lab.path("temporary"));
        command
    };
    let mut child = conform("slow.fmu").stdout(Stdio::null()).spawn().expect("it starts");
    wait_until("it judges", || !unpacked(&lab).is_empty());
    child.kill().and_then(|()| child.wait()).expect("it can be killed");
    assert!(!unpacked(&lab).is_empty());
    // The lock of its folder goes with it, those of the rules that it ran with their processes.
    wait_until("nothing is left", || {
        conform("misbehave.fmu").output().expect("it starts");
        unpacked(&lab).is_empty()
    });
}

fn nothing_outlives_a_test_that_is_killed() {
    for (fault, file) in [("sleep", "sleeping.pid"), ("another session and sleep", "other.pid")] {
        let lab = lab();
        lab.write("case.toml", passing("misbehave.fmu", &format!("fault = '{fault}', at = 0.5")));
        let mut child = trackside(&lab.path(""))
            .args(["test", "case.toml", "--isolate", "none"])
            .spawn()
            .expect("it starts");
        wait_until("the FMU sleeps", || lives(&lab, "sleeping.pid") && lives(&lab, file));
        child.kill().and_then(|()| child.wait()).expect("it can be killed");
        wait_until("the run is gone", || !lives(&lab, "sleeping.pid"));
        wait_until("what it started is gone", || !lives(&lab, file));
    }
}

/// Whether the process lives whose number this file holds.
pub fn lives(lab: &Lab, file: &str) -> bool {
    let Ok(number) = std::fs::read_to_string(lab.path(file)) else { return false };
    let status = std::fs::read_to_string(format!("/proc/{number}/stat")).unwrap_or_default();
    let state = status.rsplit(')').next().unwrap_or_default().trim_start().chars().next();
    !number.is_empty() && state.is_some_and(|state| state != 'Z' && state != 'X')
}

/// The folders of unpacked archives whose process is this one.
pub fn unpacked(lab: &Lab) -> Vec<String> {
    let entries = std::fs::read_dir(lab.path("temporary")).expect("a folder").flatten();
    entries.map(|entry| entry.file_name().to_string_lossy().into_owned()).collect()
}
