//! Checks that each mistake of a user ends with an exit code and the wrong word, and leaves nothing half written.

use std::path::Path;

use super::fixture::Scenario;
use super::fmus::{ours, relay};
use super::harness::{Ended, Lab, ROOT, trackside};

tests! {
    the_unedited_scenarios_pass: Compiler,
    an_error_message_points_at_the_wrong_line: Compiler,
    all_mistakes_are_told_at_once: Compiler,
    an_invalid_argument_is_rejected: Compiler,
    a_start_value_that_the_fmu_refuses_is_pointed_at: Compiler,
    an_unknown_package_is_rejected,
}

/// A scenario with nothing wrong, which each case edits.
fn good() -> String {
    let start = "mode = 0, v_x = 20.0, v_y = 0.0, r = 0.0, xi_x = 0.0, xi_y = 0.0, xi_psi = 0.0, \
                 psi = 0.0, psi_ref = 0.0, r_ref = 0.0";
    Scenario::headed("title = \"Good\"")
        .time(0.01, 0.1)
        .fmu("plant", "plant.fmu", "start.v_x = 20.0, F_x = 0.0")
        .fmu("controller", "controller.fmu", start)
        .signal("driver.v", "unit = \"m/s\"\nconstant = 20.0")
        .table("log", "log.csv", "delta = { column = \"steer\", unit = \"rad\" }")
        .connect("driver.v", "controller.v_ref")
        .connect("log.delta", "plant.delta")
        .check("drives on", "plant.v_x > 10 and plant.v_x < 30")
        .text()
}

/// A mistake: the replaced text, its replacement, a text on the line of the error, and parts of the
/// message. The exit code is 2.
type Mistake = (&'static str, &'static str, &'static str, &'static [&'static str]);

/// One mistake for each stage, and those that only a run finds: all others are in `crates/scenario/src/tests`.
#[rustfmt::skip]
const MISTAKES: &[Mistake] = &[
    ("title = \"Good\"", "title = \"Good", "title", &["invalid"]),
    ("plant.fmu", "plan.fmu", "plan.fmu", &["cannot read plan.fmu"]),
    ("start.v_x", "start.v_xx", "start.v_xx", &["unknown variable `start.v_xx`", "did you mean `start.v_x`?"]),
    ("[[check]]", "[[baseline]]\nname = \"b\"\nrecording = \"none.mcap\"\n[[check]]", "recording =", &["there is no baseline none.mcap", "`trackside run case.toml --bless` writes it"]),
    ("[[check]]", "[[baseline]]\nname = \"b\"\nrecording = \"log.mcap\"\n[[check]]", "recording =", &["log.mcap"]),
    ("plant.v_x < 30", "plant.v_z < 30", "plant.v_z", &["plant.v_z", "did you mean `plant.v_x`?"]),
    ("[[check]]", "[view]\ndistance = \"plant.s\"\n\n[[check]]", "distance =", &["unknown recorded signal `plant.s`"]),
];

/// The same with values of all types.
fn types() -> String {
    let a = r#"x = 0.0, n = 0, on = false, text = "", mode = "off", gear = "drive""#;
    Scenario::headed("title = \"Types\"")
        .time(0.01, 0.1)
        .signal("driver.v", "constant = 1")
        .fmu("a", "relay.fmu", a)
        .fmu("b", "relay.fmu", "gear = 1, x = 0.0, n = 0, mode = 1, on = false")
        .fmu("c", "relay.fmu", "text = \"\", n = 0, on = true, mode = 2, gear = 1")
        .connect("driver.v", "c.x")
        .connect("a.text_out", "b.text")
        .text()
}

/// A lab with the files of the good scenario.
fn lab() -> Lab {
    let lab = Lab::new();
    lab.add(&ours().join("plant.fmu"));
    lab.add(&ours().join("controller.fmu"));
    lab.write("relay.fmu", relay());
    lab.write("log.csv", "t,steer\n0,0\n1,0.01\n");
    lab.write("log.mcap", "no recording");
    lab
}

fn run(lab: &Lab, text: &str) -> Ended {
    lab.write("case.toml", text);
    lab.trackside(&["run", "case.toml", "--out", "out", "--csv"])
}

fn the_unedited_scenarios_pass() {
    let lab = lab();
    run(&lab, &types()).expect(0);
    run(&lab, &good()).expect(0);
    assert!(lab.has("out/report.json"));
}

fn an_error_message_points_at_the_wrong_line() {
    let lab = lab();
    let good = good();
    let wrong = MISTAKES.iter().filter_map(|mistake| look_at(&lab, &good, *mistake));
    let wrong: Vec<_> = wrong.collect();
    assert!(wrong.is_empty(), "{} mistakes:\n\n{}", wrong.len(), wrong.join("\n\n"));
}

/// The deviation from the expected message, if any.
fn look_at(lab: &Lab, good: &str, (old, new, at, says): Mistake) -> Option<String> {
    let text = good.replacen(old, new, 1);
    assert_ne!(text, good, "the edit of {old:?} changes nothing");
    let offset = text.find(at).unwrap_or_else(|| panic!("no {at:?} in the edited scenario"));
    let line = format!("case.toml:{}:", 1 + text[..offset].matches('\n').count());
    let ended = run(lab, &text);
    let message = ended.message();
    let mut missing: Vec<_> = says.iter().filter(|word| !message.contains(*word)).copied().collect();
    missing.extend((!message.contains(&line)).then_some(line.as_str()));
    let clean = ended.code() == Some(2) && !message.contains("panicked") && !lab.has("out");
    if clean && missing.is_empty() {
        return None;
    }
    let (code, left) = (ended.code(), lab.has("out"));
    let _ = std::fs::remove_dir_all(lab.path("out"));
    Some(format!(
        "{old:?} -> {new:?}: exit code {code:?}, not said: {missing:?}, something written: {left}\n{}",
        ended.stderr
    ))
}

/// Mistakes of the syntax, of the form, and of the meaning: what is replaced, and by what; each is one mistake.
#[rustfmt::skip]
const TOGETHER: [&[(&str, &str)]; 4] = [
    &[("title = \"Good\"", "title = \"Good"), ("step = 0.01", "step = 0.0.1")],
    &[("stop =", "stpo ="), ("unit = \"m/s\"", "unit = 5"), ("that =", "tht =")],
    &[
        ("stop = 0.1", "stop = 0.105"), ("start.v_x = 20.0", "start.v_xx = 20.0"), ("F_x = 0.0", "F_x = 'none'"),
        ("controller.fmu", "controler.fmu"), ("unit = \"m/s\"", "unit = \"fortnight\""), ("log.delta", "log.dleta"),
        ("plant.v_x > 10", "plant.v_y > 10 and plant.v_z > 10"),
        ("[[check]]", "[[fault]]\ninput = \"plant.F_y\"\nfrom = 0.0\nfreeze = true\n\n[[check]]"),
        ("[[check]]", "[view]\ndistance = \"plant.s\"\n\n[[check]]"),
        ("[[check]]", "[[check]]\nname = \"drives on\"\nthat = \"time > -1\"\n\n[[check]]"),
    ],
    &[
        ("column = \"steer\"", "column = \"stear\""), ("unit = \"rad\"", "unit = \"radians\""),
        ("columns = { ", "columns = { other = { column = \"nothing\" }, "),
    ],
];

fn all_mistakes_are_told_at_once() {
    let lab = lab();
    for mistakes in TOGETHER {
        let mut text = good();
        for (old, new) in mistakes {
            assert!(text.contains(old), "{old:?}");
            text = text.replacen(old, new, 1);
        }
        let ended = run(&lab, &text).expect(2);
        ended.says(&[&format!("{} mistakes", mistakes.len())]);
        assert!(!lab.has("out"));
    }
    // What nothing can be said about because of a node that is not there is no mistake.
    let text = good().replace("plant.fmu", "plan.fmu");
    let ended = run(&lab, &text).expect(2).says(&["cannot read plan.fmu"]);
    assert!(!ended.stderr.contains("mistakes"), "{}", ended.stderr);
    // The end of a long list is counted.
    let more = (0..22).map(|k| format!("[[check]]\nname = \"{k}\"\nthat = \"plant.q > {k}\"\n\n"));
    let ended = run(&lab, &(good() + "\n" + &more.collect::<String>())).expect(2);
    ended.says(&["check `19`", "and 2 more, 22 mistakes"]);
}

fn an_invalid_argument_is_rejected() {
    let lab = lab();
    lab.write("case.toml", good());
    for (arguments, says) in [
        (&["nowhere.toml"][..], &["cannot read the scenario nowhere.toml", "`trackside examples` lists"][..]),
        (&["case"], &["cannot read the scenario case", "did you mean `case.toml`?"]),
        (&["limit_handlin"], &["`trackside examples limit_handling` copies"]),
        (&["case.toml", "--set", "plnt.body.m=1"], &["unknown node `plnt`", "did you mean `plant`?"]),
        (&["case.toml", "--set", "plant=1"], &["expected node.variable=value", "plant=1"]),
        (&["case.toml", "--realtime", "0"], &["--realtime", "above 0"]),
    ] {
        let arguments = [&["run", "--out", "out"], arguments].concat();
        lab.trackside(&arguments).expect(2).says(says);
        assert!(!lab.has("out"), "{arguments:?}");
    }
}

fn a_start_value_that_the_fmu_refuses_is_pointed_at() {
    let lab = lab();
    let text = good().replace("F_x = 0.0", "F_x = 0.0, body.m = -5.0");
    let ended = run(&lab, &text).expect(2);
    ended.says(&["`plant` refuses `body.m`", "body.m = -5 is outside of 1 .. inf", "case.toml:10:"]);
    lab.write("case.toml", good());
    lab.trackside(&["run", "case.toml", "--out", "out", "--set", "plant.body.m=-3"])
        .expect(2)
        .says(&["--set plant.body.m: the FMU refuses it", "body.m = -3 is outside of 1 .. inf"]);
    assert!(!lab.has("out"));
}

fn an_unknown_package_is_rejected() {
    let lab = Lab::new();
    let plant = "[[fmu]]\nname = \"plant\"\ncrate = \"plant-fum\"";
    let run = |scenario: Scenario| {
        let file = lab.write("case.toml", scenario.text());
        let mut command = trackside(Path::new(ROOT));
        let output = command.arg("run").arg(file).arg("--out").arg(lab.path("out")).output();
        let ended = Ended::of(output.expect("it starts")).expect(2);
        ended.says(&["no package `plant-fum`", "did you mean `plant-fmu`?", "case.toml:7:"])
    };
    let scenario = Scenario::new().time(0.01, 0.1).section(plant);
    assert!(!run(scenario.clone()).stderr.contains("mistakes"));
    // What has nothing to do with the package is told, too.
    let signal = scenario.signal("driver.v", "unit = \"fortnight\"\nconstant = 1.0");
    let ended = run(signal.check("fast", "plant.v_x > 1 m/s").check("slow", "drvr.v < 1"));
    ended.says(&["fortnight", "unknown signal `drvr.v`", "3 mistakes"]);
    assert!(!lab.has("out"));
}
