//! Lets calls of FMUs fail on demand: discarded, late and crashing steps, outputs that are no numbers.

use std::time::Instant;

use super::checkpoints::{from, run};
use super::fixture::Scenario;
use super::fmus::{clocked, forgetful};
use super::harness::{Lab, limit};

tests! {
    a_discarded_step_ends_the_run_as_that_of_an_fmu: Compiler,
    a_node_crashes_on_demand: Compiler,
    an_isolated_node_loses_its_process: Compiler,
    outputs_are_no_numbers_on_demand: Compiler,
    a_late_step_meets_its_limit: Compiler,
    chance_is_the_same_on_every_run_and_in_every_part: Compiler,
    faults_of_calls_are_in_recording_and_report: Compiler,
    wrong_words_about_faults_of_calls_are_told: Compiler,
}

fn adder(keys: &str, fault: &str) -> String {
    let nodes = Scenario::new()
        .time(0.1, 2.0)
        .fmu("adder", "adder.fmu", "")
        .key(keys)
        .fmu("other", "adder.fmu", "")
        .signal("s.u", "constant = 2.0")
        .connect("s.u", "adder.u")
        .connect("adder.sum", "other.u");
    nodes.section(&format!("[[fault]]\nnode = 'adder'\n{fault}")).text()
}

fn lab(keys: &str, fault: &str) -> Lab {
    let lab = Lab::new();
    lab.write("adder.fmu", forgetful(&[]));
    lab.write("case.toml", adder(keys, fault));
    lab
}

fn a_discarded_step_ends_the_run_as_that_of_an_fmu() {
    let lab = lab("", "from = 0.5\nuntil = 0.6\ndiscard = true");
    let says = "node `adder`: fmi2DoStep at t = 0.5 s returned fmi2Discard: a fault of the scenario";
    run(&lab, "case.toml", "out", &[]).expect(3).says(&[says]);
    assert_eq!(lab.report("out")["steps"], 5);
    let three = Lab::new();
    three.write("clocked.fmu", clocked());
    let node = Scenario::new().time(0.1, 1.0).fmu("one", "clocked.fmu", "").key("unconnected = 'start'");
    three.write("case.toml", node.section("[[fault]]\nnode = 'one'\nfrom = 0.5\ndiscard = true").text());
    run(&three, "case.toml", "out", &[]).expect(3).says(&["fmi3DoStep at t = 0.5 s returned fmi3Discard"]);
}

fn a_node_crashes_on_demand() {
    let lab = lab("", "from = 0.5\ncrash = true");
    let says = "node `adder`: fmi2DoStep at t = 0.5 s crashed: a fault of the scenario";
    run(&lab, "case.toml", "out", &[]).expect(3).says(&[says]);
    let report = lab.report("out");
    assert_eq!((&report["steps"], &report["verdict"]), (&5.into(), &"error".into()));
}

/// Its outputs keep their values, or it starts again and counts from there on.
fn an_isolated_node_loses_its_process() {
    let crash = "from = 0.5\nuntil = 0.6\ncrash = true";
    let lab = lab("isolate = true", crash);
    run(&lab, "case.toml", "out", &[]).expect(3).says(&[
        "adder",
        "crashed, a fault of the scenario",
        "SIGABRT",
    ]);
    lab.write("case.toml", adder("isolate = true\non_failure = 'hold'", crash));
    let ended = run(&lab, "case.toml", "out", &["--checkpoint", "1"]).expect(0);
    assert!(ended.stderr.contains("its outputs keep their values"), "{}", ended.stderr);
    assert!(!ended.stderr.contains("checkpoint"), "{}", ended.stderr);
    let counts = |out: &str| -> Vec<String> {
        let rows = from(&lab, out, 0.0);
        rows.iter().map(|row| row.split(',').nth(3).expect("a cell").to_owned()).collect()
    };
    assert_eq!(counts("out")[4..8], ["4", "5", "5", "5"]);
    lab.write("case.toml", adder("isolate = true\non_failure = 'restart'", crash));
    run(&lab, "case.toml", "again", &[]).expect(0);
    assert_eq!(counts("again")[4..8], ["4", "5", "1", "2"]);
}

fn outputs_are_no_numbers_on_demand() {
    for (which, output) in [("['sum']", "sum"), ("['*']", "sum"), ("['c*']", "count")] {
        let lab = lab("", &format!("from = 0.5\nnan = {which}"));
        let says = format!("fmi2GetReal at t = 0.6 s the output `{output}` is NaN");
        run(&lab, "case.toml", "out", &[]).expect(3).says(&["adder", &says]);
    }
    // What nobody uses harms nobody.
    let lab = lab("", "from = 0.5\nnan = ['count']");
    let unused = format!("{}\n[record]\nexcept = ['*.count']\n", adder("", "from = 0.5\nnan = ['count']"));
    lab.write("case.toml", unused);
    run(&lab, "case.toml", "out", &[]).expect(0);
}

fn a_late_step_meets_its_limit() {
    let late = "from = 0.5\nuntil = 0.6\nlate = 0.3";
    let lab = lab("", late);
    let begin = Instant::now();
    run(&lab, "case.toml", "out", &[]).expect(0);
    assert!(begin.elapsed().as_secs_f64() >= 0.3, "nobody waited");
    let seconds = lab.report("out")["nodes"]
        .as_array()
        .expect("a list")
        .iter()
        .find(|it| it["name"] == "adder")
        .and_then(|it| it["seconds"].as_f64())
        .expect("a number");
    assert!(seconds >= 0.3, "the node's own time has it: {seconds} s");
    let keys = format!("isolate = true\ncall_limit = {:?}", limit(0.05));
    lab.write("case.toml", adder(&keys, "from = 0.5\nlate = 600"));
    let says = "did not return within `call_limit`";
    run(&lab, "case.toml", "out", &[]).expect(3).says(&["adder", "0.5 s", says]);
    lab.write("case.toml", adder(&format!("{keys}\non_failure = 'hold'"), "from = 0.5\nlate = 600"));
    run(&lab, "case.toml", "out", &[]).expect(0);
}

fn chance_is_the_same_on_every_run_and_in_every_part() {
    let fault = "from = 0.3\nprobability = 0.3\ncrash = true";
    let keys = "isolate = true\non_failure = 'restart'";
    let lab = lab(keys, fault);
    run(&lab, "case.toml", "one", &["--checkpoint", "0.9"]).completes();
    run(&lab, "case.toml", "two", &[]).completes();
    assert_eq!(lab.read("one/run.csv"), lab.read("two/run.csv"));
    run(&lab, "case.toml", "part", &["--resume", "one/checkpoint_0.9.state"]).completes();
    assert_eq!(from(&lab, "part", 0.0), from(&lab, "one", 0.9));
    run(&lab, "case.toml", "three", &["--seed", "5"]).completes();
    assert_ne!(lab.read("one/run.csv"), lab.read("three/run.csv"));
    // A fault of another node changes nothing here.
    let more = format!(
        "{}\n[[fault]]\nnode = 'other'\nfrom = 0.1\nprobability = 0.5\nlate = 0.0\n",
        adder(keys, fault)
    );
    lab.write("more.toml", more);
    run(&lab, "more.toml", "four", &[]).completes();
    assert_eq!(lab.read("one/run.csv"), lab.read("four/run.csv"));
}

fn faults_of_calls_are_in_recording_and_report() {
    let lab = lab("", "from = 0.5\nuntil = 0.7\nlate = 0.0");
    run(&lab, "case.toml", "out", &["--checkpoint", "0.3"]).expect(0);
    let bytes = std::fs::read(lab.path("out/run.mcap")).expect("a recording");
    let log = mcap::MessageStream::new(&bytes).expect("a recording");
    let log = log.map(|message| message.expect("a message")).filter(|it| it.channel.topic == "/log");
    let text: String = log.map(|it| String::from_utf8_lossy(&it.data).into_owned()).collect();
    for words in ["the fault of adder begins", "the fault of adder ends", "a fault lets its step last longer"]
    {
        assert!(text.contains(words), "{words}");
    }
    // An end has other faults of calls, and a fault that the warm-up does not have.
    lab.write("end.toml", adder("", "from = 0.5\ndiscard = true"));
    let ended = run(&lab, "end.toml", "end", &["--resume", "out/checkpoint_0.3.state"]).expect(3);
    ended.says(&["t = 0.5 s returned fmi2Discard"]);
    assert_eq!(lab.report("end")["resumed"]["changes"].to_string(), "[\"the faults of `adder`\"]");
    let text = adder("", "").split("[[fault]]").next().expect("the rest").to_owned();
    lab.write("warm.toml", text);
    let branch = ["--checkpoint", "0.3", "--branch", "end.toml", "--branch", "case.toml"];
    let ended = run(&lab, "warm.toml", "one", &branch).expect(3);
    ended.says(&["t = 0.5 s returned fmi2Discard"]);
    assert_eq!(from(&lab, "one/case", 0.0), from(&lab, "out", 0.3));
}

fn wrong_words_about_faults_of_calls_are_told() {
    for (words, says) in [
        ("node = 'adder'\nfrom = 1.0", "expected exactly one of `discard`, `late`, `nan`, `crash`"),
        ("node = 'adder'\nfrom = 1.0\ncrash = true\ndiscard = true", "expected exactly one of"),
        ("node = 'adder'\nfrom = 1.0\nfreeze = true", "expected one of `discard`"),
        ("node = 'ader'\nfrom = 1.0\ncrash = true", "adder"),
        ("node = 's'\nfrom = 1.0\ncrash = true", "`s` is no FMU"),
        ("from = 1.0\ncrash = true", "either the `input` or the `node`"),
        ("input = 'adder.u'\nnode = 'adder'\nfrom = 1.0\ncrash = true", "either the `input` or the `node`"),
        (
            "input = 'adder.u'\nfrom = 1.0\nvalue = 1.0\nprobability = 0.5",
            "`probability` is for the calls of a node",
        ),
        ("node = 'adder'\nfrom = 1.0\nnan = ['total']", "`adder` has no output `total`"),
        ("node = 'adder'\nfrom = 1.0\nlate = -1.0", "expected a time of at least 0 s, found -1 s"),
        (
            "node = 'adder'\nfrom = 1.0\ncrash = true\nprobability = 1.5",
            "expected a probability from 0 to 1, found 1.5",
        ),
        (
            "node = 'adder'\nfrom = 1.0\nuntil = 0.5\ncrash = true",
            "the fault begins at 1 s and ends at 0.5 s",
        ),
    ] {
        let lab = lab("", "from = 0.5\ncrash = true");
        let text = adder("", "").split("[[fault]]").next().expect("the rest").to_owned();
        lab.write("case.toml", format!("{text}[[fault]]\n{words}\n"));
        run(&lab, "case.toml", "out", &[]).expect(2).says(&[says]);
    }
}
