//! Checks that the failure of an FMU is reported with node, call and time, and leaves a usable recording.

use std::path::Path;
use std::process::Stdio;

use super::fixture::Scenario;
use super::fmus::{changed, compile, faulty3, misbehave, ours};
use super::harness::{Ended, Lab, trackside};

tests! {
    a_failure_is_reported_with_node_call_and_time_and_leaves_a_usable_recording: Compiler,
    an_output_that_nobody_uses_is_not_asked_for: Compiler,
    a_warning_is_recorded_as_an_event: Compiler,
    an_fmu_may_end_the_run_early: Compiler,
    a_failed_instantiation_is_reported_with_its_reason: Compiler,
    a_guid_mismatch_is_rejected,
    a_library_with_a_missing_function_is_rejected: Compiler,
    a_crash_ends_only_its_own_scenario: Compiler,
    every_error_status_of_every_call_is_reported: Compiler,
    a_warning_of_any_call_is_an_event: Compiler,
    every_step_of_a_run_has_the_same_size: Compiler,
    a_crash_report_names_the_fmu_and_its_call: Compiler,
    a_hanging_call_is_reported_while_it_hangs: Compiler,
    each_function_of_fmi_3_may_do_wrong: Compiler,
}

/// A scenario of one node called `name` whose FMU has these start values.
fn scenario(name: &str, start: &str) -> String {
    Scenario::new()
        .time(0.1, 1.0)
        .fmu(name, "misbehave.fmu", &format!("u = 0.0, {start}"))
        .key("unit = { y = 's' }")
        .check("clock", &format!("abs({name}.y - time) < 1e-9"))
        .text()
}

/// A lab in which the scenario ran.
fn run(text: &str) -> (Lab, Ended) {
    let lab = Lab::new();
    lab.write("misbehave.fmu", misbehave());
    lab.write("case.toml", text);
    let ended = lab.trackside(&["run", "case.toml", "--out", "out", "--csv"]);
    (lab, ended)
}

/// Start values, the number of rows before the failure, and parts of the message.
type Failure = (&'static str, usize, &'static [&'static str]);

/// Failures before the first communication point.
#[rustfmt::skip]
const EARLY: &[Failure] = &[
    ("fault = 'fmi2EnterInitializationMode', status = 3", 0, &["node `tank`: fmi2EnterInitializationMode at t = 0 s", "fmi2Error"]),
    ("fault = 'fmi2ExitInitializationMode', status = 4", 0, &["node `tank`: fmi2ExitInitializationMode at t = 0 s", "fmi2Fatal"]),
    ("fault = 'fmi2GetReal', status = 2", 0, &["node `tank`: fmi2GetReal at t = 0 s", "fmi2Discard"]),
    ("fault = 'nan'", 0, &["node `tank`: fmi2GetReal at t = 0 s", "`y` is NaN"]),
];

/// Failures in the middle of a run.
#[rustfmt::skip]
const LATE: &[Failure] = &[
    ("fault = 'nan', at = 0.5", 5, &["node `tank`: fmi2GetReal at t = 0.5 s", "`y` is NaN"]),
    ("fault = 'fmi2DoStep', at = 0.5, status = 2", 6, &["node `tank`: fmi2DoStep at t = 0.5 s", "fmi2Discard", "fmi2DoStep: the tank is 42 % full at 0.50 s"]),
    ("fault = 'fmi2DoStep', at = 0.5, status = 3", 6, &["node `tank`: fmi2DoStep at t = 0.5 s", "fmi2Error", "fmi2DoStep: the tank is 42 % full at 0.50 s"]),
    ("fault = 'fmi2DoStep', at = 0.5, status = 4", 6, &["node `tank`: fmi2DoStep at t = 0.5 s", "fmi2Fatal", "fmi2DoStep: the tank is 42 % full at 0.50 s"]),
    ("fault = 'fmi2DoStep', at = 0.5, status = 5", 6, &["node `tank`: fmi2DoStep at t = 0.5 s", "fmi2Pending"]),
    ("fault = 'fmi2DoStep', at = 0.5, status = 17", 6, &["node `tank`: fmi2DoStep at t = 0.5 s", "17, which is no status"]),
    ("fault = 'fmi2DoStep', at = 0.5, status = -1", 6, &["node `tank`: fmi2DoStep at t = 0.5 s", "-1, which is no status"]),
    ("fault = 'fmi2GetReal', at = 0.5, status = 3", 5, &["node `tank`: fmi2GetReal at t = 0.5 s", "fmi2Error", "the tank is 42 % full"]),
    ("fault = 'fmi2Terminate', status = 3", 11, &["node `tank`: fmi2Terminate at t = 1 s", "fmi2Error"]),
];

fn a_failure_is_reported_with_node_call_and_time_and_leaves_a_usable_recording() {
    let failures = EARLY.iter().chain(LATE);
    let wrong: Vec<_> = failures.filter_map(|failure| look_at(*failure)).collect();
    assert!(wrong.is_empty(), "{}", wrong.join("\n\n"));
}

/// The deviation from the expected report of a failure, if any.
fn look_at((start, rows, says): Failure) -> Option<String> {
    let (lab, ended) = run(&scenario("tank", start));
    let message = ended.message();
    let silent: Vec<_> = says.iter().filter(|word| !message.contains(*word)).collect();
    if ended.code() != Some(3) || !silent.is_empty() || message.contains("panicked") {
        return Some(format!("{start}: {}, not said: {silent:?}\n{message}", ended.status));
    }
    let report = lab.report("out");
    let error = report["error"].as_str().unwrap_or_default();
    let recorded = recorded(&lab.path("out/run.mcap"), "/tank/outputs");
    let wrong = [
        (report["verdict"] != "error", "the verdict"),
        (!says.iter().all(|word| error.contains(word)), "the error in the report"),
        (lab.has("out/run.csv"), "a table that stops early and looks complete"),
        (recorded != rows, "the number of rows"),
        (report["steps"] != rows.saturating_sub(1), "the number of steps"),
    ];
    let wrong: Vec<_> = wrong.iter().filter(|(wrong, _)| *wrong).map(|(_, what)| what).collect();
    (!wrong.is_empty()).then(|| format!("{start}: {wrong:?}\n{recorded} rows, {report:#}"))
}

/// How many messages a topic of a closed recording has.
fn recorded(file: &Path, topic: &str) -> usize {
    let bytes = std::fs::read(file).expect("a recording");
    let summary = mcap::Summary::read(&bytes).expect("a closed recording");
    assert!(summary.is_some(), "no summary at the end");
    let messages = mcap::MessageStream::new(&bytes).expect("a recording");
    let messages = messages.map(|message| message.expect("a readable recording"));
    messages.filter(|message| message.channel.topic == topic).count()
}

fn an_output_that_nobody_uses_is_not_asked_for() {
    let unused = |start: &str| {
        let nodes = Scenario::new().time(0.1, 1.0).fmu("tank", "misbehave.fmu", start);
        nodes.key("unit = { y = 's' }").section("[record]\nexcept = [\"*.y\"]")
    };
    for start in ["u = 0.0, fault = 'nan'", "u = 0.0, fault = 'fmi2GetReal', status = 3"] {
        run(&unused(start).text()).1.expect(0);
        let (_, ended) = run(&unused(start).check("clock", "tank.y < 2").text());
        ended.expect(3).says(&["node `tank`: fmi2GetReal at t = 0 s"]);
    }
}

fn a_warning_is_recorded_as_an_event() {
    let start = "fault = 'fmi2DoStep', at = 0.5, status = 1";
    let (lab, ended) = run(&scenario("tank", start));
    ended.expect(0);
    // The first one, and how many there were.
    assert_eq!(recorded(&lab.path("out/run.mcap"), "/log"), 2);
    assert_eq!(lab.report("out")["messages"][0]["count"], 5);
}

fn an_fmu_may_end_the_run_early() {
    let text = scenario("tank", "fault = 'fmi2DoStep', at = 0.5, status = 2, terminated = true");
    let (lab, ended) = run(&text);
    ended.expect(0).says(&["`tank` ended the simulation at 0.5 s"]);
    let report = lab.report("out");
    assert_eq!((&report["verdict"], &report["steps"]), (&"pass".into(), &5.into()));
    let later = text.replace("name = \"clock\"", "name = \"clock\"\nduring = [0.8, 1.0]");
    let (lab, ended) = run(&later);
    assert!(ended.expect(1).stdout.contains("FAILED  clock"));
    assert_eq!(lab.report("out")["checks"][0]["samples"], 0);
    // One that fails leaves nothing passed.
    let (lab, ended) = run(&text.replace("status = 2, terminated = true", "status = 3"));
    ended.expect(3);
    let check = &lab.report("out")["checks"][0];
    assert_eq!(check["passed"], false, "{check}");
    assert!(check["reason"].as_str().is_some_and(|it| it.contains("before the window did")), "{check}");
}

fn a_failed_instantiation_is_reported_with_its_reason() {
    let (lab, ended) = run(&scenario("refused", "at = 0.0").replace("refused.y", "time"));
    ended.expect(3).says(&["node `refused`: fmi2Instantiate", "refused is not welcome"]);
    assert!(!lab.has("out"));
    let (lab, ended) = run(&scenario("unwilling", "at = 0.0").replace("unwilling.y", "time"));
    ended.expect(3).says(&["node `unwilling`: fmi2SetupExperiment at t = 0 s", "fmi2Error"]);
    assert!(!lab.has("out"));
}

fn a_guid_mismatch_is_rejected() {
    let lab = Lab::new();
    let other = |name: &str, bytes: Vec<u8>| {
        let mut text = String::from_utf8_lossy(&bytes).into_owned();
        if let Some(start) = text.find("guid=\"") {
            text.replace_range(start + 6..start + 10, "{xxx");
        }
        Some((name.to_owned(), if name.ends_with(".xml") { text.into_bytes() } else { bytes }))
    };
    lab.write("plant.fmu", changed(&ours().join("plant.fmu"), other));
    let scenario = Scenario::new().time(0.01, 0.1).fmu("plant", "plant.fmu", "F_x = 0.0, delta = 0.0");
    lab.write("case.toml", scenario.text());
    let ended = lab.trackside(&["run", "case.toml", "--out", "out"]).expect(3);
    ended.says(&["node `plant`: fmi2Instantiate", "it says:", "{xxx"]);
}

fn a_library_with_a_missing_function_is_rejected() {
    let lab = Lab::new();
    lab.write("case.toml", scenario("tank", "at = 0.0"));
    for function in NEEDED_FUNCTIONS.split_whitespace() {
        let symbol = format!("fmi2{function}");
        lab.write("misbehave.fmu", compile(&[&format!("-D{symbol}=absent")]));
        let ended = lab.trackside(&["run", "case.toml", "--out", "out"]).expect(3);
        ended.says(&["node `tank`", &format!("lacks the function `{symbol}`")]);
    }
    assert!(!lab.has("out"));
    let absent: Vec<_> =
        OPTIONAL_FUNCTIONS.split_whitespace().map(|it| format!("-Dfmi2{it}=absent_{it}")).collect();
    lab.write("misbehave.fmu", compile(&absent.iter().map(String::as_str).collect::<Vec<_>>()));
    lab.trackside(&["run", "case.toml", "--out", "out"]).expect(0);
}

/// The functions of a co-simulation library that a run calls, without the `fmi2` before each.
const NEEDED_FUNCTIONS: &str = "GetTypesPlatform GetVersion SetDebugLogging Instantiate FreeInstance \
    SetupExperiment EnterInitializationMode ExitInitializationMode Terminate Reset GetReal GetInteger \
    GetBoolean GetString SetReal SetInteger SetBoolean SetString \
    SetRealInputDerivatives GetRealOutputDerivatives DoStep CancelStep GetStatus GetRealStatus GetBooleanStatus";

/// Those that no run calls, or none of an FMU whose description promises nothing of them.
const OPTIONAL_FUNCTIONS: &str = "GetFMUstate SetFMUstate FreeFMUstate SerializedFMUstateSize SerializeFMUstate \
    DeSerializeFMUstate GetDirectionalDerivative GetIntegerStatus GetStringStatus";

fn a_crash_ends_only_its_own_scenario() {
    let lab = Lab::new();
    lab.write("misbehave.fmu", misbehave());
    lab.write("a_good.toml", scenario("tank", "at = 0.0"));
    lab.write("b_crash.toml", scenario("tank", "fault = 'crash', at = 0.5"));
    lab.write("c_good.toml", scenario("tank", "at = 0.0"));
    let ended = lab.trackside(&["test", ".", "--jobs", "1"]).expect(1);
    for line in ["ok       ./a_good.toml", "FAILED   ./b_crash.toml", "ok       ./c_good.toml"] {
        assert!(ended.stdout.contains(line), "{line}\n{}", ended.stdout);
    }
    assert!(ended.stdout.contains("SIGSEGV"), "{}", ended.stdout);
    assert!(ended.stdout.contains("2 passed, 1 failed, 0 skipped"), "{}", ended.stdout);
}

/// Each status that is none of success, from each call of a run.
fn every_error_status_of_every_call_is_reported() {
    let lab = Lab::new();
    lab.write("misbehave.fmu", misbehave());
    let early = ["EnterInitializationMode", "ExitInitializationMode", "GetReal"];
    let statuses =
        [(2, "fmi2Discard"), (3, "fmi2Error"), (4, "fmi2Fatal"), (5, "fmi2Pending"), (6, "6, which")];
    let late = ["SetReal", "DoStep", "GetReal", "Terminate"];
    for (at, calls) in [(0.0, &early[..]), (0.5, &late)] {
        for (call, (status, name)) in calls.iter().flat_map(|call| statuses.map(|it| (call, it))) {
            let start = format!("fault = 'fmi2{call}', status = {status}, at = {at:?}");
            lab.write("case.toml", scenario("tank", &start) + DRIVEN);
            let ended = lab.trackside(&["run", "case.toml", "--out", "out"]);
            let time = if *call == "Terminate" { 1.0 } else { at };
            let said = format!("node `tank`: fmi2{call} at t = {time} s returned {name}");
            assert!(ended.message().contains(&said), "{said}\n{}", ended.stderr);
            assert_eq!((ended.code(), &lab.report("out")["verdict"]), (Some(3), &"error".into()));
        }
    }
}

/// Makes the tank's input one that is set at each step.
const DRIVEN: &str = "[[signal]]\nname = \"driver.u\"\nconstant = 1.0\n\n\
    [[connect]]\nfrom = \"driver.u\"\nto = \"tank.u\"\n";

fn a_warning_of_any_call_is_an_event() {
    for call in ["ExitInitializationMode", "SetReal", "GetReal"] {
        let text = scenario("tank", &format!("fault = 'fmi2{call}', status = 1")) + DRIVEN;
        let (lab, ended) = run(&text);
        ended.expect(0);
        let events = recorded(&lab.path("out/run.mcap"), "/log");
        assert!(events > 0, "{call}");
    }
}

/// An FMU without canHandleVariableCommunicationStepSize may insist on the same step, to the bit, whatever
/// rounding does to the difference of two times; a shorter last step does not exist, see `bad_input`.
fn every_step_of_a_run_has_the_same_size() {
    let lab = Lab::new();
    let fmu = lab.write("misbehave.fmu", compile(&["-DONE_STEP=0.1"]));
    let flag = " canHandleVariableCommunicationStepSize=\"true\"";
    let fixed = |name: &str, bytes: Vec<u8>| match name.ends_with(".xml") {
        true => {
            let text = String::from_utf8(bytes).expect("a text");
            assert!(text.contains(flag));
            let own = " canNotUseMemoryManagementFunctions=\"true\"";
            Some((name.to_owned(), text.replace(flag, own).into_bytes()))
        }
        false => Some((name.to_owned(), bytes)),
    };
    lab.write("misbehave.fmu", changed(&fmu, fixed));
    lab.write("case.toml", scenario("tank", "at = 0.0").replace("stop = 1.0", "stop = 100.0"));
    lab.trackside(&["run", "case.toml", "--out", "out", "--rerun", "off"]).expect(0);
    assert_eq!(lab.report("out")["steps"], 1000);
}

fn a_crash_report_names_the_fmu_and_its_call() {
    for (fault, what) in [("crash", "SIGSEGV"), ("abort", "SIGABRT"), ("exit", "called exit")] {
        let (lab, ended) = run(&scenario("tank", &format!("fault = '{fault}', at = 0.5")));
        let said = "node `tank`: fmi2DoStep at t = 0.5 s ended this program: the FMU";
        assert!(ended.message().contains(said), "{fault}\n{}", ended.stderr);
        assert!(ended.message().contains(what), "{fault}\n{}", ended.stderr);
        assert_eq!(ended.code(), Some(3), "{}", ended.status);
        assert!(!lab.has("out/report.json") && !lab.has("out/run.csv"));
    }
}

fn a_hanging_call_is_reported_while_it_hangs() {
    use std::io::{BufRead as _, BufReader};
    let lab = Lab::new();
    lab.write("misbehave.fmu", misbehave());
    lab.write("case.toml", scenario("tank", "fault = 'sleep', at = 0.5"));
    let mut command = trackside(&lab.path(""));
    command.args(["run", "case.toml", "--out", "out", "--patience", "0.2"]);
    let mut child = command.stderr(Stdio::piped()).spawn().expect("it starts");
    let output = BufReader::new(child.stderr.take().expect("a pipe")).lines();
    let said = output.map_while(Result::ok).find(|line| line.contains("has been running for"));
    child.kill().expect("it runs");
    child.wait().expect("it ends");
    let said = said.expect("a message before the end");
    assert!(said.contains("node `tank`: fmi2DoStep at t = 0.5 s"), "{said}");
}

/// The functions of FMI 3.0 that a run with a structural parameter, events and a checkpoint calls.
const CALLED: [&str; 17] = [
    "fmi3InstantiateCoSimulation",
    "fmi3EnterConfigurationMode",
    "fmi3SetUInt64",
    "fmi3ExitConfigurationMode",
    "fmi3EnterInitializationMode",
    "fmi3ExitInitializationMode",
    "fmi3UpdateDiscreteStates",
    "fmi3EnterStepMode",
    "fmi3SetFloat64",
    "fmi3DoStep",
    "fmi3GetFloat64",
    "fmi3GetInt32",
    "fmi3GetString",
    "fmi3EnterEventMode",
    "fmi3GetFMUState",
    "fmi3SerializeFMUState",
    "fmi3Terminate",
];

/// What each of them does, in this program and in a process of its own: the run ends with the name of the function.
fn each_function_of_fmi_3_may_do_wrong() {
    let lab = Lab::new();
    lab.write("faulty.fmu", faulty3());
    let text = Scenario::new()
        .time(0.1, 1.0)
        .fmu("tank", "faulty.fmu", "n = 3")
        .key("unconnected = 'start'")
        .signal("driver.u", "constant = 1.0")
        .connect("driver.u", "tank.u");
    lab.write("case.toml", text.text());
    let run = |function: &str, fault: &str, more: &[&str]| {
        let mut command = trackside(lab.path("").as_path());
        command
            .args(["run", "case.toml", "--out", "out", "--rerun", "off", "--checkpoint", "0.5"])
            .args(more);
        Ended::of(command.env("FAULT_IN", function).env("FAULT", fault).output().expect("it starts"))
    };
    run("", "", &[]).expect(0);
    for function in CALLED {
        for (fault, more) in [
            ("memory", &[][..]),
            ("exit", &[]),
            ("3", &[]),
            ("memory", &["--isolate"]),
            ("stack", &["--isolate"]),
        ] {
            let ended = run(function, fault, more);
            let is_refused_start = function == "fmi3SetUInt64" && fault == "3";
            assert_eq!(
                ended.code(),
                Some(if is_refused_start { 2 } else { 3 }),
                "{fault} in {function}: {}",
                ended.stderr
            );
            assert!(ended.message().contains(function), "{fault} in {function}: {}", ended.stderr);
        }
        // Descriptors of its own process are its own matter; what belongs to the whole program is put back.
        run(function, "close", &["--isolate"]).expect(0);
        let moved = run(function, "move", &[]).expect(0);
        assert!(moved.message().contains("set the current folder"), "{function}: {}", moved.stderr);
    }
}
