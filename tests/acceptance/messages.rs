//! Checks that what FMUs log reaches whoever runs them: counted by node and kind, without `log = true`, and at little cost.

use serde_json::{Value, json};

use super::fixture::Scenario;
use super::fmus::talkative;
use super::harness::{Ended, Lab};
use super::sweeps::{numbers, results};

tests! {
    warnings_are_counted_by_kind_everywhere: Compiler,
    a_warning_of_a_call_is_told_with_its_name: Compiler,
    an_isolated_fmu_tells_the_same: Compiler,
    a_packed_scenario_hands_messages_on: Compiler,
    a_check_can_ask_for_none: Compiler,
    a_million_messages_leave_two_events_and_a_line: Compiler,
    texts_of_any_kind_are_told: Compiler,
    what_is_logged_at_the_end_is_told: Compiler,
    summaries_are_shown_under_the_name_of_the_node: Compiler,
    a_sweep_can_collect_the_counts: Compiler,
}

/// A scenario of one node `a` whose FMU logs this, over ten steps.
fn scenario(start: &str) -> Scenario {
    Scenario::new().time(0.1, 1.0).fmu("a", "talkative.fmu", start)
}

fn run(scenario: Scenario, arguments: &[&str]) -> (Lab, Ended) {
    let lab = Lab::new();
    lab.write("talkative.fmu", talkative());
    lab.write("case.toml", scenario.text());
    let given = ["run", "case.toml", "--out", "out", "--rerun", "off"];
    let ended = lab.trackside(&[&given, arguments].concat());
    (lab, ended)
}

/// The messages of the report without their texts: node, level, count and time.
fn messages(lab: &Lab) -> Vec<Value> {
    serde_json::from_value(lab.report("out")["messages"].clone()).expect("a list")
}

fn message(level: &str, text: &str, count: u64, first: f64) -> Value {
    json!({ "node": "a", "level": level, "text": text, "count": count, "first": first })
}

/// Events of the recording.
fn events(lab: &Lab) -> Vec<String> {
    let bytes = std::fs::read(lab.path("out/run.mcap")).expect("a recording");
    let messages = mcap::MessageStream::new(&bytes).expect("a recording");
    messages
        .map(|message| message.expect("a readable recording"))
        .filter(|message| message.channel.topic == "/log")
        .map(|message| String::from_utf8_lossy(&message.data).into_owned())
        .collect()
}

fn warnings_are_counted_by_kind_everywhere() {
    let (lab, ended) = run(scenario("what = 'repeats', count = 3"), &[]);
    let told = "`a` warns, 30 times, first at 0.1 s: residual 0";
    ended.expect(0).says(&[&format!("warning: {told}")]);
    assert_eq!(messages(&lab), [message("warning", "residual 0", 30, 0.1)]);
    let page = lab.read("out/report.html");
    assert!(page.contains("residual 0") && page.contains("<td class=\"number\">30</td>"), "{page}");
    // The first one, and how many there were.
    let told_once = events(&lab);
    assert_eq!(told_once.len(), 2, "{told_once:?}");
    assert!(told_once[1].contains("30 times in all, first at 0.1 s: residual 0"), "{told_once:?}");
    let ended = lab.trackside(&["test", "case.toml", "--junit", "junit.xml"]).expect(0);
    assert!(ended.stdout.contains(&format!("warning: {told}")), "{}", ended.stdout);
    let junit = lab.read("junit.xml");
    let (_, out) = junit.split_once("<system-out>").expect("an output");
    assert!(out.contains(told), "{junit}");
    // All of them, where that is asked for.
    let (lab, _) = run(scenario("what = 'repeats', count = 3").key("log = true"), &[]);
    assert_eq!(messages(&lab), [message("warning", "residual 0", 30, 0.1)]);
    assert_eq!(events(&lab).len(), 30);
}

fn a_warning_of_a_call_is_told_with_its_name() {
    let (lab, ended) = run(scenario("what = 'returns'"), &[]);
    let text = "fmi2DoStep returned fmi2Warning: steep at 0.1 s";
    ended.expect(0).says(&[&format!("`a` warns, 10 times, first at 0.1 s: {text}")]);
    assert_eq!(messages(&lab), [message("warning", text, 10, 0.1)]);
    let (_, ended) = run(scenario("what = 'silent'"), &[]);
    ended.expect(0).says(&[
        "`a` warns, 10 times, first at 0.1 s: fmi2DoStep returned fmi2Warning, and logs nothing about it",
        "`log = true`",
    ]);
    let (lab, ended) = run(scenario("what = 'initialised'"), &[]);
    let text = "fmi2ExitInitializationMode returned fmi2Warning: the start is odd";
    ended.expect(0).says(&[&format!("`a` warns at 0 s: {text}")]);
    assert_eq!(messages(&lab), [message("warning", text, 1, 0.0)]);
}

fn an_isolated_fmu_tells_the_same() {
    for start in ["what = 'repeats', count = 3", "what = 'returns'", "what = 'terminated'"] {
        let [here, apart] = ["--isolate=none", "--isolate=all"].map(|isolate| {
            let (lab, ended) = run(scenario(start), &[isolate]);
            ended.expect(0);
            messages(&lab)
        });
        assert_eq!(here, apart, "{start}");
        assert_eq!(here.len(), 1, "{start}");
    }
    let (_, ended) = run(scenario("what = 'freed'"), &["--isolate=all"]);
    ended.expect(0).says(&["node `a`: fmi2FreeInstance logs: a file stays open"]);
}

fn a_packed_scenario_hands_messages_on() {
    let (lab, _) = run(scenario("what = 'returns'"), &[]);
    lab.trackside(&["pack", "case.toml", "--fmu", "outer", "--out", "."]).expect(0);
    let outer = Scenario::new().time(0.1, 1.0).fmu("outer", "outer.fmu", "");
    lab.write("outer.toml", outer.text());
    let ended = lab.trackside(&["run", "outer.toml", "--out", "out", "--rerun", "off"]).expect(0);
    ended.says(&[
        "`outer` warns at 0.1 s:",
        "a: fmi2DoStep returned fmi2Warning: steep at 0.1 s",
        "9 times more",
    ]);
}

fn a_check_can_ask_for_none() {
    for (start, that, code) in [
        ("", "messages.a.warnings == 0", 0),
        ("", "messages.warnings + messages.errors == 0", 0),
        ("what = 'returns'", "messages.a.warnings == 0", 1),
        ("what = 'returns'", "messages.warnings == 10 and messages.a.errors == 0", 0),
        ("what = 'lines'", "messages.a.errors == 0", 1),
        ("what = 'terminated'", "messages.errors == 1", 0),
    ] {
        let (_, ended) = run(scenario(start).check("calm", that), &[]);
        ended.expect(code);
    }
    let (_, ended) = run(scenario("what = 'returns'").check("calm", "messages.a.warnings == 0"), &[]);
    assert!(ended.stdout.contains("messages.a.warnings is 10, limit 0"), "{}", ended.stdout);
    for (that, says) in [
        ("messages.b.warnings == 0", &["case.toml", "`messages.b.warnings`", "did you mean"][..]),
        ("messages.a.warning == 0", &["did you mean `messages.a.warnings`"]),
        ("messages.a == 0", &["unknown number of messages `messages.a`"]),
        ("messages.a.warnings == 0 and a.y < 2 s", &["have no time"]),
    ] {
        let (_, ended) = run(scenario("").check("calm", that), &[]);
        ended.expect(2).says(says);
    }
    // A node of that name is one.
    let own = scenario("").signal("messages.warnings", "constant = 3").check("own", "messages.warnings == 3");
    run(own, &[]).1.expect(0);
}

fn a_million_messages_leave_two_events_and_a_line() {
    let (lab, ended) = run(scenario("what = 'repeats', count = 100000"), &[]);
    ended.expect(0);
    assert_eq!(messages(&lab), [message("warning", "residual 0", 1_000_000, 0.1)]);
    let size = std::fs::metadata(lab.path("out/run.mcap")).expect("a recording").len();
    assert!(size < 100_000, "{size} bytes");
    // As many texts as no memory should hold.
    let (lab, ended) = run(scenario("what = 'kinds', count = 100000"), &[]);
    ended.expect(0);
    let found = messages(&lab);
    assert_eq!(found.len(), 101);
    let count = |it: &Value| it["count"].as_u64().expect("a count");
    assert_eq!(found.iter().map(count).sum::<u64>(), 1_000_000);
    let size = std::fs::metadata(lab.path("out/report.json")).expect("a report").len();
    assert!(size < 100_000, "{size} bytes");
}

fn texts_of_any_kind_are_told() {
    let (lab, ended) = run(scenario("what = 'lines'"), &[]);
    ended.expect(0).says(&["`a` logs an error, 10 times, first at 0.1 s: first <b>line</b> second line"]);
    assert_eq!(messages(&lab)[0]["text"], "first <b>line</b>\nsecond line");
    assert!(lab.read("out/report.html").contains("first &lt;b&gt;line&lt;/b&gt;<br/>second line"));
    let (lab, ended) = run(scenario("what = 'bytes'"), &[]);
    ended.expect(0).says(&["Gr\u{f6}\u{df}e \u{e4} \\u{1b}[2J"]);
    assert_eq!(messages(&lab)[0]["text"], "Gr\u{f6}\u{df}e \u{e4} \u{1b}[2J");
    let (lab, ended) = run(scenario("what = 'long'"), &[]);
    ended.expect(0).says(&["x ... (1000000 bytes in all)"]);
    let text = messages(&lab)[0]["text"].as_str().expect("a text").len();
    assert!((4096..4200).contains(&text), "{text}");
    let (lab, ended) = run(scenario("what = 'threads', count = 1000"), &[]);
    ended.expect(0);
    assert_eq!(messages(&lab)[0]["count"], 40_000);
}

fn what_is_logged_at_the_end_is_told() {
    let (lab, ended) = run(scenario("what = 'terminated'"), &[]);
    ended.expect(0).says(&["`a` logs an error at 1 s: too late"]);
    assert_eq!(messages(&lab), [message("error", "too late", 1, 1.0)]);
    let (_, ended) = run(scenario("what = 'freed'"), &[]);
    ended.expect(0).says(&["warning: node `a`: fmi2FreeInstance logs: a file stays open"]);
    // A run that fails tells what was said before.
    let failing = scenario("what = 'returns'")
        .fmu("b", "talkative.fmu", "")
        .section("[[fault]]\nnode = 'b'\nfrom = 0.5\ncrash = true");
    let (_, ended) = run(failing, &[]);
    ended.expect(3).says(&["`a` warns, 6 times, first at 0.1 s: fmi2DoStep returned fmi2Warning"]);
}

fn summaries_are_shown_under_the_name_of_the_node() {
    let (lab, ended) = run(scenario("what = 'summary'"), &[]);
    let ended = ended.expect(0);
    assert!(ended.stdout.contains("\n  a: a model that talks\n"), "{}", ended.stdout);
    assert_eq!(messages(&lab), [message("summary", "a model that talks", 1, 0.0)]);
    assert!(lab.read("out/report.html").contains("a model that talks"));
}

fn a_sweep_can_collect_the_counts() {
    let sweep = "[[sweep.vary]]\nname = 'a.count'\nvalues = [1, 2, 3]
        [sweep.collect]\nwarnings = 'messages.a.warnings'\nerrors = 'messages.errors'";
    let lab = Lab::new();
    lab.write("talkative.fmu", talkative());
    let checked = scenario("what = 'repeats'").check("few", "messages.warnings < 25");
    lab.write("case.toml", checked.section(sweep).text());
    lab.trackside(&["sweep", "case.toml", "--out", "sweep", "--jobs", "1"]).expect(1);
    let table = results(&lab, "sweep");
    assert_eq!(numbers(&table, "collect.warnings"), [10.0, 20.0, 30.0]);
    assert_eq!(numbers(&table, "collect.errors"), [0.0; 3]);
}
