//! Checks that tunable parameters take values during a run: of connections and faults, in FMI 2.0 and 3.0.

use super::fixture::Scenario;
use super::fmus::{example, forgetful, ours};
use super::harness::{Ended, Lab, ROOT, trackside};

tests! {
    a_tunable_parameter_follows_a_signal: Compiler,
    it_takes_faults: Compiler,
    both_versions_of_fmi_take_the_same_values: Compiler,
    a_fixed_parameter_is_refused: Compiler,
    a_packed_scenario_has_it_inside_and_as_an_input: Compiler,
    a_run_goes_on_with_it: Compiler,
    inspect_shows_it: Compiler,
}

/// An adder whose gain is 1 for 0.5 s and then 4; its sum grows by twice as much.
fn adder(more: &str) -> String {
    Scenario::new()
        .time(0.1, 1.0)
        .fmu("adder", "forgetful.fmu", "u = 2.0")
        .key("observe = ['gain']")
        .signal("s.gain", "step = { after = 4.0, before = 1.0, at = 0.5 }")
        .connect("s.gain", "adder.gain")
        .section(more)
        .text()
}

fn lab() -> Lab {
    let lab = Lab::new();
    lab.write("forgetful.fmu", forgetful(&[]));
    lab
}

fn run(lab: &Lab, text: &str, arguments: &[&str]) -> Ended {
    lab.write("case.toml", text);
    let given = ["run", "case.toml", "--out", "out", "--csv", "--rerun", "off"];
    lab.trackside(&[&given, arguments].concat())
}

fn last(lab: &Lab, column: &str) -> f64 {
    let table = lab.table("out/run.csv");
    let mut lines = table.lines();
    let place = lines.next().expect("titles").split(',').position(|title| title == column);
    let cell = lines.last().expect("a row").split(',').nth(place.expect("the column"));
    cell.and_then(|cell| cell.parse().ok()).expect("a number")
}

fn a_tunable_parameter_follows_a_signal() {
    for isolate in ["--isolate=none", "--isolate=all"] {
        let lab = lab();
        run(&lab, &adder(""), &[isolate]).expect(0);
        assert!((last(&lab, "adder.sum") - 5.0).abs() < 1e-9, "{isolate}");
        assert!((last(&lab, "adder.gain") - 4.0).abs() < 1e-9, "{isolate}");
    }
}

fn it_takes_faults() {
    let lab = lab();
    let fault = "[[fault]]\ninput = 'adder.gain'\nfrom = 0.5\nvalue = 0.0";
    run(&lab, &adder(fault), &[]).expect(0);
    assert!((last(&lab, "adder.sum") - 1.0).abs() < 1e-9);
    let alone = Scenario::new().time(0.1, 1.0).fmu("adder", "forgetful.fmu", "u = 2.0").section(fault);
    run(&lab, &alone.text(), &[])
        .expect(2)
        .says(&["nothing is connected to `adder.gain`", "lead a signal to it"]);
}

fn both_versions_of_fmi_take_the_same_values() {
    let mass = |version: &str| {
        let lab = Lab::new();
        lab.add(example());
        let folder = lab.path("");
        let mut pack = trackside(std::path::Path::new(ROOT));
        pack.args(["pack", "--example", "spring_damper", "--fmi", "3", "--out"]).arg(&folder);
        Ended::of(pack.output().expect("it starts")).expect(0);
        let text = Scenario::new()
            .time(0.01, 2.0)
            .fmu("mass", &format!("spring_damper{version}.fmu"), "F = 0.0")
            .signal("s.d", "unit = 'N.s/m'\nstep = { after = 40.0, before = 0.1, at = 0.5 }")
            .connect("s.d", "mass.d");
        run(&lab, &text.text(), &[]).expect(0);
        lab.table("out/run.csv")
    };
    let (two, three) = (mass(""), mass("_fmi3"));
    assert_eq!(two, three);
    // It is damped out.
    let end = two.lines().last().expect("a row").split(',').nth(2).and_then(|it| it.parse::<f64>().ok());
    assert!(end.expect("a speed").abs() < 0.05, "{end:?}");
}

fn a_fixed_parameter_is_refused() {
    let lab = lab();
    let fixed = adder("").replace("to = \"adder.gain\"", "to = \"adder.at\"");
    run(&lab, &fixed, &[]).expect(2).says(&[
        "`adder.at` is a fixed parameter, which keeps its start value during a run",
        "only inputs and tunable parameters",
        "start = { \"at\" = ... }",
        "case.toml:",
    ]);
    let misspelt = adder("").replace("to = \"adder.gain\"", "to = \"adder.gian\"");
    run(&lab, &misspelt, &[]).expect(2).says(&["unknown input `adder.gian`"]);
    // The plant has none that is tunable.
    lab.add(&ours().join("plant.fmu"));
    let plant = Scenario::new()
        .time(0.1, 0.2)
        .fmu("plant", "plant.fmu", "F_x = 0.0, delta = 0.0")
        .signal("s.m", "unit = 'kg'\nconstant = 900.0")
        .connect("s.m", "plant.body.m");
    run(&lab, &plant.text(), &[]).expect(2).says(&["`plant.body.m` is a fixed parameter"]);
}

fn a_packed_scenario_has_it_inside_and_as_an_input() {
    let lab = lab();
    lab.write("case.toml", adder(""));
    lab.trackside(&["pack", "case.toml", "--fmu", "outer", "--out", "."]).expect(0);
    let outer = Scenario::new().time(0.1, 1.0).fmu("outer", "outer.fmu", "");
    run(&lab, &outer.text(), &[]).expect(0);
    assert!((last(&lab, "outer.adder.sum") - 5.0).abs() < 1e-9);
    lab.write("case.toml", adder(""));
    let pack = ["pack", "case.toml", "--fmu", "open", "--out", ".", "--inputs", "adder.gain"];
    lab.trackside(&pack).expect(0);
    let open = Scenario::new().time(0.1, 1.0).fmu("open", "open.fmu", "adder.gain = 3.0");
    run(&lab, &open.text(), &[]).expect(0);
    assert!((last(&lab, "open.adder.sum") - 6.0).abs() < 1e-9);
}

fn a_run_goes_on_with_it() {
    let lab = lab();
    run(&lab, &adder(""), &["--checkpoint", "0.3"]).expect(0);
    let whole = last(&lab, "adder.sum");
    for isolate in ["--isolate=none", "--isolate=all"] {
        let resume = ["--resume", "out/checkpoint_0.3.state", isolate];
        let given = ["run", "case.toml", "--out", "end", "--csv", "--rerun", "off"];
        lab.trackside(&[&given[..], &resume].concat()).expect(0);
        let table = lab.table("end/run.csv");
        let row = table.lines().last().expect("a row").to_owned();
        let whole_row = lab.table("out/run.csv").lines().last().expect("a row").to_owned();
        assert_eq!(row, whole_row, "{isolate}");
    }
    assert!((whole - 5.0).abs() < 1e-9);
}

fn inspect_shows_it() {
    let lab = lab();
    lab.write("case.toml", adder(""));
    let fmu = lab.trackside(&["inspect", "forgetful.fmu"]).expect(0).stdout;
    let line = |name: &str| fmu.lines().find(|it| it.contains(name)).expect("a line").to_owned();
    assert!(line(" gain ").contains("tunable") && !line(" at ").contains("tunable"), "{fmu}");
    let scenario = lab.trackside(&["inspect", "case.toml"]).expect(0).stdout;
    let line = scenario.lines().find(|it| it.contains("s.gain -> adder.gain"));
    assert!(line.is_some_and(|it| it.contains("to a tunable parameter")), "{scenario}");
}
