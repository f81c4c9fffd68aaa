//! Checks that texts of others are shown wherever people read them, and obeyed nowhere.

use super::fixture::Scenario;
use super::fmus::misbehave;
use super::harness::Lab;

tests! {
    texts_of_an_fmu_are_shown_and_not_obeyed: Compiler,
    texts_of_a_scenario_are_shown_and_not_obeyed: Compiler,
    a_mistake_in_a_file_with_escapes_is_underlined,
    json_with_escapes_stays_json: Compiler,
}

/// What a terminal, or who lays out text, would obey.
fn obeyed(text: &str) -> Vec<char> {
    let lines = |it: &char| !matches!(it, '\n' | '\t');
    let turns = |it: &char| matches!(it, '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}');
    text.chars().filter(|it| it.is_control() && lines(it) || turns(it)).collect()
}

#[track_caller]
fn harmless(text: &str, shows: &[&str]) {
    assert!(obeyed(text).is_empty(), "{text:?}");
    for part in shows {
        assert!(text.contains(part), "expected {part:?} in:\n{text}");
    }
}

const ESCAPED: [&str; 3] = ["\\u{1b}[2Jgone", "\\u{9b}31m", "\\u{202e}"];

fn texts_of_an_fmu_are_shown_and_not_obeyed() {
    let lab = Lab::new();
    lab.write("misbehave.fmu", misbehave());
    let start = "u = 0.0, fault = 'escapes', at = 0.5";
    let text = Scenario::new().time(0.1, 1.0).fmu("tank", "misbehave.fmu", start);
    lab.write("case.toml", text.check("clock", "time >= 0").text());
    let ended = lab.trackside(&["run", "case.toml", "--out", "out", "--rerun", "off"]).expect(3);
    harmless(&ended.stderr, &ESCAPED);
    harmless(&lab.read("out/report.html"), &ESCAPED);
    let ended = lab.trackside(&["test", "case.toml", "--junit", "junit.xml"]).expect(1);
    harmless(&ended.stdout, &ESCAPED);
    harmless(&lab.read("junit.xml"), &ESCAPED);
}

fn texts_of_a_scenario_are_shown_and_not_obeyed() {
    let lab = Lab::new();
    lab.write("misbehave.fmu", misbehave());
    let head = "title = \"\\u001b[2Jgone \\u009b31m \\u202e\"";
    let text = Scenario::headed(head).time(0.1, 1.0).fmu("tank", "misbehave.fmu", "u = 0.0");
    let name = "\\u001b[2Jgone\\u009b31m\\u202e\\uffff";
    lab.write("ca\u{1b}se.toml", text.check(name, "time < 0").text());
    let ended = lab.trackside(&["run", "ca\u{1b}se.toml", "--out", "out", "--rerun", "off"]);
    let ended = ended.expect(1);
    harmless(&ended.stdout, &ESCAPED);
    harmless(&ended.stderr, &[]);
    harmless(&lab.read("out/report.html"), &ESCAPED);
    let ended = lab.trackside(&["test", "ca\u{1b}se.toml", "--junit", "junit.xml"]).expect(1);
    harmless(&ended.stdout, &["ca\\u{1b}se.toml"]);
    harmless(&lab.read("junit.xml"), &["ca\\u{1b}se", "\\u{9b}31m\\u{202e}\\u{ffff}"]);
}

fn a_mistake_in_a_file_with_escapes_is_underlined() {
    let lab = Lab::new();
    lab.write("case.toml", "# \u{202e}\u{9b}31m\ntitle = \"\u{202e}\"\nstop = 1.0\n");
    let ended = lab.trackside(&["run", "case.toml"]).expect(2);
    harmless(&ended.stderr, &["case.toml:3:1", "stop = 1.0"]);
}

fn json_with_escapes_stays_json() {
    let lab = Lab::new();
    let fmu = lab.write("misbehave.fmu", misbehave());
    let odd = super::fmus::changed(&fmu, |name, bytes| {
        let text = String::from_utf8_lossy(&bytes);
        let other = text.replace("modelName=\"misbehave\"", "modelName=\"\u{9b}31m\u{202e}\"");
        let described = name.ends_with(".xml");
        Some((name.to_owned(), if described { other.into_bytes() } else { bytes }))
    });
    lab.write("odd.fmu", odd);
    let ended = lab.trackside(&["inspect", "odd.fmu", "--json"]).expect(0);
    harmless(&ended.stdout, &["\\u009b31m\\u202e"]);
    let found: serde_json::Value = serde_json::from_str(&ended.stdout).expect("JSON");
    assert!(found.to_string().contains("\u{9b}31m\u{202e}"), "{found}");
    harmless(&lab.trackside(&["inspect", "odd.fmu"]).expect(0).stdout, &["\\u{9b}31m\\u{202e}"]);
}
