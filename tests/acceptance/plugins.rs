//! Checks the inputs of analyses, and the messages about mistakes of plugins and of their users.

use std::path::Path;
use std::process::Command;

use super::harness::{Ended, Lab, ROOT, trackside};

tests! {
    a_plugin_of_twenty_lines_gets_signals_in_its_units_and_its_result_is_checked,
    an_analysis_of_a_file_needs_no_run_and_what_it_leaves_goes_with_the_next_run: Compiler,
    what_does_not_fit_is_pointed_at: Compiler,
    a_plugin_for_another_interface_or_none_is_refused: Compiler,
    a_plugin_that_fails_is_told_and_the_recording_stays: Compiler,
}

/// A ramp, and the analysis that `more` completes.
fn scenario(more: &str) -> String {
    format!(
        "[time]\nstep = 0.5\nstop = 1.0\n\n[[signal]]\nname = \"car.v\"\nunit = \"km/h\"\nramp = \
         {{ start = 0.0, end = 1.0, before = 0.0, after = 36.0 }}\n\n[[analysis]]\nname = \"odd\"\npath = \"odd.so\"\n{more}"
    )
}

const SPEED: &str = "signals = { speed = \"car.v\" }\n";

/// Compiles the plugin of `plugin/odd.c` for this version of the interface.
pub fn compile(lab: &Lab, version: u32) {
    let mut cc = Command::new("cc");
    cc.args(["-shared", "-fPIC", "-D_GNU_SOURCE"]).arg(format!("-DVERSION={version}"));
    cc.arg(Path::new(ROOT).join("tests/acceptance/plugin/odd.c"));
    let output = cc.arg("-o").arg(lab.path("odd.so")).arg("-lm").output();
    Ended::of(output.expect("a C compiler")).expect(0);
}

fn lab() -> Lab {
    let lab = Lab::new();
    compile(&lab, plugin::abi::VERSION);
    lab.write("log.csv", "t,v\n5,1\n6,2\n");
    lab
}

fn run(lab: &Lab, text: &str) -> Ended {
    lab.write("case.toml", text);
    lab.trackside(&["run", "case.toml", "--out", "out", "--csv"])
}

fn a_plugin_of_twenty_lines_gets_signals_in_its_units_and_its_result_is_checked() {
    let lab = Lab::new();
    let text = scenario(
        "config = {}\n[analysis.signals]\nx = \"car.v\"\n\n[[check]]\nname = \"mean speed\"\n\
         that = \"average.mean == 18 and average.mean < 19\"\n\n[[check]]\nname = \"too high\"\n\
         that = \"average.mean > 20\"\n\n[[check]]\nname = \"misspelled\"\nthat = \"average.maen > 1\"\n",
    );
    let text = text.replace("path = \"odd.so\"", "crate = \"plugin\"\nexample = \"mean\"");
    let file = lab.write("case.toml", text.replace("\"odd\"", "\"average\""));
    let mut command = trackside(Path::new(ROOT));
    let output = command.arg("run").arg(file).arg("--out").arg(lab.path("out")).output();
    let ended = Ended::of(output.expect("it starts")).expect(1);
    let report = lab.report("out");
    assert_eq!(report["analyses"]["average"]["mean"], 18.0, "{report}");
    let passed: Vec<_> = (0..3).map(|check| report["checks"][check]["passed"].clone()).collect();
    assert_eq!(passed, [true, false, false]);
    assert!(ended.stdout.contains("did you mean `mean`?"), "{}", ended.stdout);
    let recording = std::fs::read(lab.path("out/run.mcap")).expect("a recording");
    let topic = b"/average/deviation";
    assert!(recording.windows(topic.len()).any(|bytes| bytes == topic));
}

fn an_analysis_of_a_file_needs_no_run_and_what_it_leaves_goes_with_the_next_run() {
    let lab = lab();
    let head = "[[analysis]]\nname = \"odd\"\npath = \"odd.so\"\nconfig = { mode = \"writes\" }\n";
    let table = "[analysis.table]\npath = \"log.csv\"\ntime = \"t\"\ncolumns = { speed = { column = \
                 \"v\", unit = \"km/h\" } }\n";
    let check = "[[check]]\nname = \"second\"\nthat = \"odd.list[1] == 2.5 and odd.fine == 1\"\n";
    run(&lab, &format!("{head}{table}{check}")).expect(0);
    assert_eq!(lab.read("out/note.txt"), "a note");
    assert_eq!(lab.report("out")["files"], serde_json::json!(["note.txt"]));
    // A shape and a role that nobody knows are drawn as a plain line; an axis may end where the layers do.
    for mode in ["draws", "draws open"] {
        run(&lab, &format!("{}{table}", head.replace("writes", mode))).expect(0);
    }
    assert!(!lab.has("out/note.txt"));
}

fn what_does_not_fit_is_pointed_at() {
    let lab = lab();
    lab.write("text.so", "no library");
    let signals = |signals: &str| scenario(&format!("signals = {{ {signals} }}\n"));
    let columns = |columns: &str| {
        let table = "[analysis.table]\npath = \"log.csv\"\ntime = \"t\"\n";
        scenario(&format!("{table}columns = {{ {columns} }}\n"))
    };
    let during = |stretch: &str| {
        let during = format!("time = \"t\"\nduring = [{stretch}]");
        columns("speed = { column = \"v\", unit = \"m/s\" }").replace("time = \"t\"", &during)
    };
    #[rustfmt::skip]
    let cases = [
        (during("[2.0, 5.0]"), "[2.0, 5.0]", "found none of `speed`, which goes from 0 s to 1 s"),
        (during("[1.0, 0.0]"), "[1.0, 0.0]", "expected two rising times [s], found 1 and 0"),
        (scenario(""), "\"odd\"", "needs a signal `speed`: how fast"),
        (signals("sped = \"car.v\""), "sped", "did you mean `speed`?"),
        (signals("speed = \"car.w\""), "\"car.w\"", "did you mean `car.v`?"),
        (signals("speed = \"car.v\"").replace("km/h", "kg"), "= \"car.v\" }", "wanted in [m/s], and `car.v` is in [kg]"),
        (columns("speed = { column = \"w\" }"), "\"w\"", "log.csv"),
        (columns("speed = { column = \"v\", unit = \"kg\" }"), "\"kg\" }", "wanted in [m/s], and `v` is in [kg]"),
        (columns("speed = { column = \"v\" }").replace("path = \"odd.so\"\n", &format!("path = \"odd.so\"\n{SPEED}")), "speed = {", "comes from the run already"),
        (scenario(SPEED).replace("odd.so", "none.so"), "none.so", "cannot load the plugin"),
        (scenario(SPEED).replace("odd.so", "text.so"), "text.so", "cannot load the plugin"),
        (scenario(SPEED).replace("path =", "crate = \"x\"\npath ="), "\"odd\"", "either `path` or `crate`"),
        (scenario(SPEED).replace("\"odd\"", "\"car\""), "\"car\"", "something else is called `car`"),
        (scenario(&format!("{SPEED}config = {{ mode = \"wrong\" }}")), "mode", "`odd`: expected anything else, found \"wrong\""),
        (scenario(&format!("{SPEED}[[check]]\nname = \"c\"\nthat = \"odd.x > car.v\"\n")), "\"odd.x", "results of analyses have no time"),
        (scenario(&format!("{SPEED}[[check]]\nname = \"c\"\nthat = \"odd.x > 1\"\nduring = [0.0, 1.0]\n")), "[0.0, 1.0]", "results of analyses have no time"),
    ];
    for (text, at, says) in cases {
        let offset = text.find(at).unwrap_or_else(|| panic!("no {at:?} in {text}"));
        let line = format!("case.toml:{}:", 1 + text[..offset].matches('\n').count());
        run(&lab, &text).expect(2).says(&[says, &line]);
        assert!(!lab.has("out"), "{text}");
    }
}

fn a_plugin_for_another_interface_or_none_is_refused() {
    let lab = Lab::new();
    compile(&lab, 77);
    let own = plugin::abi::VERSION;
    let both = format!("built for version 77 of the plugin interface, this program has version {own}");
    run(&lab, &scenario(SPEED)).expect(2).says(&[&both, "case.toml:"]);
    let source = lab.write("empty.c", "int nothing;");
    let mut cc = Command::new("cc");
    let output = cc.args(["-shared", "-fPIC", "-o"]).arg(lab.path("odd.so")).arg(source).output();
    Ended::of(output.expect("a C compiler")).expect(0);
    run(&lab, &scenario(SPEED)).expect(2).says(&["is no plugin", "`trackside_plugin`"]);
}

fn a_plugin_that_fails_is_told_and_the_recording_stays() {
    let lab = lab();
    for (mode, says) in [
        ("fails", "analysis `odd`: no tire in sight"),
        ("silent", "returned without a result"),
        ("babbles", "expected a result in JSON"),
        ("escapes", "expected the name of a file of its own"),
        ("overwrites", "found `report.json`"),
        ("backwards", "rising times"),
        ("draws half", "layers with columns of equal length in the diagram `x over y`"),
        ("draws flat", "two different, finite ends"),
    ] {
        let text = scenario(&format!("{SPEED}config = {{ mode = \"{mode}\" }}\n"));
        run(&lab, &text).expect(3).says(&[says]);
        let report = lab.report("out");
        assert_eq!(report["verdict"], "error", "{mode}");
        assert!(lab.has("out/run.mcap") && !lab.has("escaped.txt"), "{mode}");
    }
}
