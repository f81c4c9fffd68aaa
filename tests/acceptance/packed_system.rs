//! Packs scenarios as one FMU and runs it elsewhere and here: the same numbers as the scenario itself.

use std::path::Path;

use super::fmus::relay;
use super::harness::{Ended, Lab, ROOT, trackside};
use super::python::python;

tests! {
    a_closed_loop_in_one_fmu_has_the_bits_of_its_run: Python,
    the_state_of_a_scenario_without_effects_goes_through_bytes: Python,
    an_input_takes_the_place_of_a_signal_or_a_connection: Compiler,
    mistakes_about_an_fmu_of_a_scenario_are_told: Compiler,
}

fn a_closed_loop_in_one_fmu_has_the_bits_of_its_run() {
    let lab = Lab::new();
    let scenario = "scenarios/double_lane_change.toml";
    let run = |arguments: &[&str]| {
        let mut program = trackside(Path::new(ROOT));
        program.args(arguments).arg("--out").arg(lab.path("out"));
        Ended::of(program.output().expect("it starts")).expect(0)
    };
    run(&["run", scenario, "--csv", "--rerun", "off"]);
    for (version, name) in [("2", "lane_change.fmu"), ("3", "lane_change_fmi3.fmu")] {
        run(&["pack", scenario, "--fmu", "lane_change", "--fmi", version]);
        let fmu = lab.path("out").join(name);
        assert_eq!(python().run("validate.py", &[&fmu]).stdout.trim(), "[]");
        python().run("system.py", &[&fmu, &lab.path("out/run.csv")]);
    }
    // Sensor effects of the scenario go back, too, also from bytes.
    let ended = python().run("state.py", &[&lab.path("out/lane_change.fmu")]);
    assert!(ended.stdout.contains("restored from bytes"), "{}", ended.stdout);
}

fn the_state_of_a_scenario_without_effects_goes_through_bytes() {
    let lab = Lab::new();
    let mut pack = trackside(Path::new(ROOT));
    pack.args(["pack", "scenarios/step_steer.toml", "--fmu", "steer", "--out"]).arg(lab.path("out"));
    Ended::of(pack.output().expect("it starts")).expect(0);
    let ended = python().run("state.py", &[&lab.path("out/steer.fmu")]);
    assert!(ended.stdout.contains("restored from bytes"), "{}", ended.stdout);
}

/// Two relays: a signal and a connection with a sensor effect that a state has to keep.
const SCENARIO: &str = "seed = 3\n[time]\nstep = 0.25\nstop = 2.0\n[[fmu]]\nname = \"a\"\npath = \"relay.fmu\"\nunconnected = \"start\"\n[[fmu]]\nname = \"b\"\npath = \"relay.fmu\"\nunconnected = \"start\"\n[[signal]]\nname = \"drive.x\"\nsine = { amplitude = 2.0, frequency = 0.7 }\n[[signal]]\nname = \"drive.n\"\nconstant = 4\n[[connect]]\nfrom = \"drive.x\"\nto = \"a.x\"\n[[connect]]\nfrom = \"drive.n\"\nto = \"a.n\"\n[[connect]]\nfrom = \"a.x_out\"\nto = \"b.x\"\nnoise = { std = 0.1 }\n[[check]]\nname = \"never\"\nthat = \"1 > 2\"\n";

/// The cells of a column of a CSV, whose title may have a unit.
fn column(csv: &str, name: &str) -> Vec<String> {
    let mut lines = csv.lines();
    let titles = lines.next().unwrap_or_default();
    let place = titles.split(',').position(|title| title.split(" [").next() == Some(name));
    let place = place.unwrap_or_else(|| panic!("no {name} in {titles}"));
    lines.map(|line| line.split(',').nth(place).unwrap_or_default().to_owned()).collect()
}

fn an_input_takes_the_place_of_a_signal_or_a_connection() {
    let lab = Lab::new();
    lab.write("relay.fmu", relay());
    lab.write("case.toml", SCENARIO);
    lab.trackside(&["run", "case.toml", "--csv", "--rerun", "off", "--out", "run"]).expect(1);
    // As the signal, the input leads through its connection; as the input of an FMU, it has no way to it.
    for (choice, inner) in [("drive.x", "drive.x"), ("a.x", "a.x")] {
        let pack = ["pack", "case.toml", "--fmu", "case", "--out", "out", "--inputs", choice, "a.n"];
        lab.trackside(&pack).expect(0);
        lab.write("outer.toml", format!("[time]\nstep = 0.25\nstop = 2.0\n[[fmu]]\nname = \"box\"\npath = \"out/case.fmu\"\n[[signal]]\nname = \"drive.x\"\nsine = {{ amplitude = 2.0, frequency = 0.7 }}\n[[signal]]\nname = \"drive.n\"\nconstant = 4\n[[connect]]\nfrom = \"drive.x\"\nto = \"box.{inner}\"\n[[connect]]\nfrom = \"drive.n\"\nto = \"box.a.n\"\n"));
        let run = ["run", "outer.toml", "--csv", "--rerun", "off", "--out", "outer"];
        lab.trackside(&run).expect(0);
        for output in ["a.x_out", "a.n_out", "b.x_out"] {
            let direct = column(&lab.read("run/run.csv"), output);
            let nested = column(&lab.read("outer/run.csv"), &format!("box.{output}"));
            assert_eq!(nested, direct, "{output}");
            assert!(output == "a.n_out" || direct.windows(2).any(|pair| pair[0] != pair[1]));
        }
    }
}

fn mistakes_about_an_fmu_of_a_scenario_are_told() {
    let lab = Lab::new();
    lab.write("relay.fmu", relay());
    lab.write("case.toml", SCENARIO);
    let pack = |rest: &[&str]| lab.trackside(&[&["pack", "case.toml", "--fmu"], rest].concat());
    pack(&["case", "--inputs", "a.y"]).expect(2).says(&["--inputs", "`a.y`", "a.x"]);
    pack(&["case", "--outputs", "b.x_aut"]).expect(2).says(&["--outputs", "b.x_out"]);
    pack(&["a case"]).expect(2).says(&["--fmu", "expected letters, digits and `_`", "a case"]);
    lab.trackside(&["pack", "--fmu", "case"]).expect(2).says(&["expected one scenario, found 0"]);
    lab.trackside(&["pack", "case.toml"]).expect(2).says(&["--ssp", "--fmu NAME"]);
    assert!(!lab.path("target/fmu/case.fmu").exists());
}
