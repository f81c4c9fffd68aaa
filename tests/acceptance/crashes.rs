//! Checks that each crash of foreign code ends the program with exit code 3, and says once whose it is: in a call or outside of one.

use super::fixture::Scenario;
use super::fmus::{compile, misbehave, resizable_with_wide_booleans};
use super::harness::{Ended, Lab};

tests! {
    a_crash_on_a_thread_of_an_fmu_names_the_node: Compiler,
    a_crash_on_a_thread_that_nobody_saw_begin_names_the_fmu: Compiler,
    a_stack_overflow_is_told_once: Compiler,
    a_crash_while_a_library_loads_or_goes_is_told: Compiler,
    a_text_that_is_none_names_the_call_that_gave_it: Compiler,
    values_past_the_end_of_an_array_are_an_error: Compiler,
    a_boolean_that_is_too_wide_is_an_error: Compiler,
    a_library_that_misses_a_symbol_is_refused: Compiler,
    a_process_of_an_fmu_ends_as_it_likes: Compiler,
    a_signal_from_outside_is_nobodys_crash: Compiler,
    all_of_them_end_a_run_with_a_report_from_a_process_of_their_own: Compiler,
}

fn scenario(fmu: &str, fault: &str, at: f64) -> String {
    let start = format!("u = 0.0, fault = '{fault}', at = {at:?}");
    Scenario::new().time(0.1, 1.0).fmu("tank", fmu, &start).check("clock", "tank.y < 2").text()
}

/// The end of a run with the FMU that was compiled with these arguments.
fn run_with(arguments: &[&str], fault: &str, at: f64) -> (Lab, Ended) {
    let lab = Lab::new();
    match arguments {
        [] => lab.write("odd.fmu", misbehave()),
        _ => lab.write("odd.fmu", compile(arguments)),
    };
    lab.write("case.toml", scenario("odd.fmu", fault, at));
    let ended = lab.trackside(&["run", "case.toml", "--out", "out", "--rerun", "off"]);
    (lab, ended)
}

/// Insists on exit code 3, these words and nothing else on the terminal, and no report.
fn told(arguments: &[&str], fault: &str, at: f64, words: &str) {
    let (lab, ended) = run_with(arguments, fault, at);
    let ended = ended.expect(3);
    assert_eq!(ended.stderr.trim(), words, "{fault}");
    assert!(!lab.has("out/report.json"), "{fault}");
}

const ENDED: &str = "ended this program: the FMU";
const CRASHED: &str = "touched memory that is not its own (SIGSEGV)";

fn a_crash_on_a_thread_of_an_fmu_names_the_node() {
    for (fault, what) in [
        ("crash on a thread", CRASHED),
        ("abort on a thread", "aborted (SIGABRT)"),
        ("exit on a thread", "called exit"),
    ] {
        let whose = "node `tank`: a thread that it started in fmi2DoStep at t = 0.5 s";
        told(&[], fault, 0.5, &format!("{whose} {ENDED} {what}"));
    }
}

fn a_crash_on_a_thread_that_nobody_saw_begin_names_the_fmu() {
    let whose = "the FMU odd.fmu: outside of the calls that it gets";
    told(&[], "crash on an unseen thread", 0.5, &format!("{whose} {ENDED} {CRASHED}"));
}

fn a_stack_overflow_is_told_once() {
    for (fault, which) in [("overflow", ""), ("overflow on a thread", "a thread that it started in ")] {
        let whose = format!("node `tank`: {which}fmi2DoStep at t = 0.5 s");
        told(&[], fault, 0.5, &format!("{whose} {ENDED} overflowed its stack (SIGSEGV)"));
    }
}

fn a_crash_while_a_library_loads_or_goes_is_told() {
    let whose = "the FMU odd.fmu: loading its library";
    told(&["-DAT_LOAD=crash()"], "", 0.0, &format!("{whose} {ENDED} {CRASHED}"));
    told(&["-DAT_LOAD=_exit(0)"], "", 0.0, &format!("{whose} {ENDED} called _exit"));
    let (lab, ended) = run_with(&["-DAT_UNLOAD=crash()"], "", 0.0);
    ended.expect(0).says(&["the FMU odd.fmu: unloading its library", CRASHED, "its verdict stands"]);
    assert_eq!(lab.report("out")["verdict"], "pass");
}

fn a_text_that_is_none_names_the_call_that_gave_it() {
    let whose = "node `tank`: reading the text of fmi2GetString at t = 0 s";
    told(&[], "dangling text", 0.0, &format!("{whose} {ENDED} {CRASHED}"));
}

fn values_past_the_end_of_an_array_are_an_error() {
    let (lab, ended) = run_with(&[], "writes past the end", 0.5);
    let says = "node `tank`: fmi2GetReal at t = 0.5 s wrote past the end of the array";
    ended.expect(3).says(&[says, "expected 1 value, found more"]);
    assert_eq!(lab.report("out")["verdict"], "error");
}

fn a_boolean_that_is_too_wide_is_an_error() {
    let lab = Lab::new();
    lab.write("wide.fmu", resizable_with_wide_booleans());
    let one = Scenario::new().time(0.1, 0.3).fmu("tank", "wide.fmu", "");
    lab.write("case.toml", one.key("unconnected = \"start\"").text());
    let ended = lab.trackside(&["run", "case.toml", "--out", "out", "--rerun", "off"]).expect(3);
    ended.says(&["node `tank`: fmi3DoStep at t = 0.2 s wrote past the end", "expected 1 value"]);
}

fn a_library_that_misses_a_symbol_is_refused() {
    let call = "-DAT_LOAD={extern void absent_function(void); if (environ == NULL) absent_function();}";
    let (lab, ended) = run_with(&[call], "", 0.0);
    ended.expect(3).says(&["node `tank`", "does not load", "undefined symbol: absent_function"]);
    assert!(!lab.has("out"));
}

fn a_process_of_an_fmu_ends_as_it_likes() {
    for fault in ["child exits", "child _exits", "child aborts", "child crashes"] {
        let (lab, ended) = run_with(&[], fault, 0.5);
        assert_eq!(ended.expect(0).stderr, "", "{fault}");
        assert_eq!(lab.report("out")["verdict"], "pass", "{fault}");
    }
}

fn a_signal_from_outside_is_nobodys_crash() {
    let lab = Lab::new();
    lab.write("misbehave.fmu", misbehave());
    lab.write("case.toml", scenario("misbehave.fmu", "sleep", 0.5));
    let child = super::signals::start(&lab, &["run", "case.toml", "--out", "out"], "sleeping.pid");
    super::harness::signal(&child, "ABRT");
    let ended = Ended::of(child.wait_with_output().expect("it ends"));
    assert_eq!(ended.code(), None, "{}", ended.stderr);
    assert!(!ended.stderr.contains("node `tank`"), "{}", ended.stderr);
}

/// The same faults, isolated: the run has a report and whole recordings.
fn all_of_them_end_a_run_with_a_report_from_a_process_of_their_own() {
    for (fault, at, what) in [
        ("crash on a thread", 0.5, CRASHED),
        ("abort on a thread", 0.5, "aborted (SIGABRT)"),
        ("crash on an unseen thread", 0.5, CRASHED),
        ("overflow", 0.5, "overflowed its stack (SIGSEGV)"),
        ("overflow on a thread", 0.5, "overflowed its stack (SIGSEGV)"),
        ("dangling text", 0.0, CRASHED),
        ("writes past the end", 0.5, "wrote past the end of the array"),
        ("exit on a thread", 0.5, "called exit"),
        ("nan", 0.5, "`y` is NaN"),
    ] {
        let lab = Lab::new();
        lab.write("odd.fmu", misbehave());
        lab.write("case.toml", scenario("odd.fmu", fault, at));
        let arguments = ["run", "case.toml", "--out", "out", "--rerun", "off", "--isolate"];
        let ended = lab.trackside(&arguments).expect(3);
        ended.says(&["node `tank`", &format!("at t = {at} s"), what]);
        let report = lab.report("out");
        assert_eq!(report["verdict"], "error", "{fault}");
        if at == 0.0 {
            continue;
        }
        let steps = usize::try_from(report["steps"].as_u64().expect("a number")).expect("a count");
        assert!((4..=5).contains(&steps), "{fault}: {steps}");
        assert_eq!(super::ending::recorded(&lab.path("out/run.mcap")), steps + 1, "{fault}");
    }
    for fault in ["rounds", "flushes", "traps", "sets the locale", "uses a locale"] {
        let lab = Lab::new();
        lab.write("odd.fmu", misbehave());
        lab.write("case.toml", scenario("odd.fmu", fault, 0.5));
        lab.trackside(&["run", "case.toml", "--rerun", "off", "--isolate"]).expect(0);
    }
}
