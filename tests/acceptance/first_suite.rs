//! Makes suites from folders of FMUs and reference results, and takes runs as right.

use super::fixture::Scenario;
use super::fmus::{archive, changed, drifting_relay, relay};
use super::harness::{Ended, Lab};

tests! {
    fmus_and_references_become_scenarios_that_pass: Compiler,
    fmus_of_a_folder_are_connected_by_name_type_and_unit: Compiler,
    what_cannot_run_is_told_and_no_code_runs_unasked,
    blessing_says_what_changes_before_it_writes: Compiler,
    tubes_that_hold_a_run_are_shown_and_written: Compiler,
}

fn fmus_and_references_become_scenarios_that_pass() {
    let lab = Lab::new();
    lab.write("meine fälle/Relais ü.fmu", relay());
    lab.write("meine fälle/Relais ü_in.csv", "Zeit;x;n;on\n0;0;0;0\n0,5;1,5;2;1\n1;1,5;2;1\n");
    // Another delimiter and decimal mark; an output is the input of the step before. Nobody has `noise`.
    let rows = "0;0;0;false;0\n0,25;0;0;false;0\n0,5;0,75;0;false;0\n0,75;1,5;2;true;0\n1;1,5;2;true;0\n";
    lab.write("meine fälle/relais ü_ref.csv", format!("Zeit;x_out;n_out;on_out;noise\n{rows}"));
    lab.write("meine fälle/Relais ü_ref.opt", "StepSize,0.25\nStartTime,0\nStopTime,1\nRelTol,1e-4\n");
    let first = lab.trackside(&["init", "meine fälle"]).expect(0);
    for part in [
        "wrote  suite/Relais_ü.toml  Relais ü.fmu as relais ü_ref.csv: 3 signals, 0 to 1 s in steps of 0.25 s, inputs of Relais ü_in.csv",
        "not compared: noise: the FMU has no such variable",
        "1 passed, 0 failed",
    ] {
        assert!(first.stdout.contains(part), "no {part:?} in {}", first.stdout);
    }
    let text = lab.read("suite/Relais_ü.toml");
    for part in [
        "step = 0.25 # StepSize of Relais ü_ref.opt",
        "path = \"../meine fälle/Relais ü.fmu\"",
        "unconnected = \"start\" # no table has text, mode, gear",
        "interpolation = \"hold\"",
        "from = \"held_inputs.n\"\nto = \"Relais ü.n\"",
        "recording = \"reference/Relais_ü.csv\"",
    ] {
        assert!(text.contains(part), "no {part:?} in {text}");
    }
    lab.trackside(&["test", "suite"]).expect(0);
    // What is there stays, whoever wrote it.
    let again = lab.trackside(&["init", "meine fälle", "--no-run"]).expect(0);
    assert!(again.stdout.starts_with("there  suite/Relais_ü.toml"), "{}", again.stdout);
    lab.write("suite/Relais_ü.toml", text.replace("relative = 0.002", "relative = 0.003"));
    let kept = lab.trackside(&["init", "meine fälle"]).expect(0);
    assert!(kept.stdout.contains("(it was there with another text, and stays)"), "{}", kept.stdout);
    assert!(lab.read("suite/Relais_ü.toml").contains("relative = 0.003"));
    // A reference that the FMU does not keep to is told with its case.
    lab.write("other/relay.fmu", relay());
    lab.write("other/relay_out.csv", "time,x_out\n0,0\n1,7\n");
    let wrong = lab.trackside(&["init", "other", "--out", "wrong"]).expect(1);
    assert!(wrong.stdout.contains("FAILED   wrong/relay.toml"), "{}", wrong.stdout);
    assert!(wrong.stdout.contains("`relay.x_out`: 0.0 outside of"), "{}", wrong.stdout);
}

/// The relay with other names for some of its variables.
fn renamed(names: &[(&str, &str)]) -> Vec<u8> {
    let lab = Lab::new();
    let path = lab.write("relay.fmu", relay());
    changed(&path, |file, bytes| {
        let named = |text: String, (from, to): &(&str, &str)| {
            text.replace(&format!("name=\"{from}\""), &format!("name=\"{to}\""))
        };
        let bytes = match file {
            "modelDescription.xml" => {
                let text = String::from_utf8(bytes).expect("a text");
                names.iter().fold(text, named).into_bytes()
            }
            _ => bytes,
        };
        Some((file.to_owned(), bytes))
    })
}

fn fmus_of_a_folder_are_connected_by_name_type_and_unit() {
    let lab = Lab::new();
    // `force` goes from one to the other, `gear` has two sources, and of the name `mode` there is one of another type.
    lab.write(
        "fmus/source.fmu",
        renamed(&[("x_out", "force"), ("n_out", "n2"), ("gear", "gear1"), ("mode_out", "gear")]),
    );
    let second = [("x", "x2"), ("gear", "gear2"), ("mode", "mode2"), ("x_out", "mode"), ("mode_out", "gear")];
    lab.write("fmus/second.fmu", renamed(&second));
    lab.write("fmus/sink.fmu", renamed(&[("x", "force"), ("n", "n2")]));
    let ended = lab.trackside(&["init", "fmus"]).expect(0);
    for part in [
        "wrote  suite/fmus_system.toml  2 FMUs of fmus: 2 connections by name, type and unit",
        "not connected: sink.on: no output has this name",
        "not connected: sink.mode: second.mode is Real and this one Enumeration",
        "not connected: sink.gear: second.gear, source.gear all fit",
        "left out: second, which nothing connects",
        "no     second.fmu: no reference beside it",
        "ok       suite/fmus_system.toml",
        "baseline `as the first run`, suite/reference/fmus_system.csv: new",
    ] {
        assert!(ended.stdout.contains(part), "no {part:?} in {}", ended.stdout);
    }
    let text = lab.read("suite/fmus_system.toml");
    assert!(text.contains("from = \"source.force\"\nto = \"sink.force\"\n"), "{text}");
    assert!(text.contains("#   sink.on: no output has this name\n"), "{text}");
    lab.trackside(&["test", "suite"]).expect(0);
}

fn what_cannot_run_is_told_and_no_code_runs_unasked() {
    let lab = Lab::new();
    lab.write("empty/readme.txt", "");
    lab.trackside(&["init", "empty"]).expect(2).says(&["expected FMUs in empty, found none"]);
    lab.trackside(&["init", "absent"]).expect(2).says(&["expected a folder of FMUs, found absent"]);
    let description = |interface: &str| {
        format!(
            "<fmiModelDescription fmiVersion=\"2.0\" modelName=\"m\" guid=\"g\"><{interface} modelIdentifier=\"m\"/><ModelVariables>\
             <ScalarVariable name=\"y\" valueReference=\"0\" causality=\"output\"><Real/></ScalarVariable></ModelVariables><ModelStructure/>\
             </fmiModelDescription>"
        )
    };
    let fmu = |interface: &str, library: &str| {
        archive(&[("modelDescription.xml", description(interface).as_bytes()), (library, b"no library")])
    };
    lab.write("fmus/me/m.fmu", fmu("ScheduledExecution", "binaries/linux64/m.so"));
    lab.write("fmus/mac/m.fmu", fmu("CoSimulation", "binaries/darwin64/m.dylib"));
    lab.write("fmus/other/m.fmu", fmu("CoSimulation", "binaries/linux64/m.so"));
    lab.write("fmus/other/m_ref.csv", "time,z\n0,1\n1,1\n");
    lab.write("fmus/broken.fmu", "no archive");
    let none = lab
        .trackside(&["init", "fmus"])
        .expect(2)
        .says(&["no scenario could be made of fmus and its 4 FMUs"]);
    for part in [
        "no     me/m.fmu: modelDescription.xml: expected the interface CoSimulation or ModelExchange, found ScheduledExecution",
        "no     mac/m.fmu: has no library for linux64",
        "no     other/m.fmu: its reference other/m_ref.csv: nothing in it can be compared; not compared: z: the FMU has no such variable",
        "no     broken.fmu: ",
    ] {
        assert!(none.stdout.contains(part), "no {part:?} in {}", none.stdout);
    }
    assert!(!lab.has("suite"));
    // Its library is none: whoever loads it notices.
    lab.write("fmus/other/m_ref.csv", "time,y\n0,1\n1,1\n");
    let written = lab.trackside(&["init", "fmus", "--no-run"]).expect(0);
    assert!(written.stdout.contains("wrote  suite/other_m.toml"), "{}", written.stdout);
    assert!(!lab.has("target"));
    lab.trackside(&["init", "fmus"]).expect(1);
    lab.trackside(&["init", "fmus", "--out", "fmus/broken.fmu"]).expect(2);
}

/// The relay with a ramp at its input, and a baseline in the file.
fn ramp(baseline: &str) -> String {
    let start = "n = 0, on = false, text = \"\", mode = 1, gear = 1";
    Scenario::headed("# A comment")
        .time(0.1, 1.0)
        .fmu("relay", "relay.fmu", start)
        .signal("input.x", "ramp = { start = 0.0, end = 1.0, before = 0.0, after = 1.0 }")
        .connect("input.x", "relay.x")
        .check("it runs", "relay.x_out < 100")
        .section(&format!(
            "[[baseline]] # mine\nname = \"as before\"\nrecording = \"golden.csv\"\n{baseline}"
        ))
        .text()
}

fn run(lab: &Lab, more: &[&str]) -> Ended {
    lab.trackside(&[&["run", "case.toml", "--out", "out", "--rerun", "off"], more].concat())
}

fn blessing_says_what_changes_before_it_writes() {
    let lab = Lab::new();
    lab.write("relay.fmu", relay());
    lab.write("case.toml", ramp(""));
    let new = run(&lab, &["--bless"]).expect(0);
    let [told, wrote] = ["baseline `as before`, golden.csv: new\n", "wrote the baseline golden.csv"];
    assert!(new.stdout.find(told) < new.stdout.find(wrote) && new.stdout.contains(told), "{}", new.stdout);
    let same = run(&lab, &["--bless"]).expect(0);
    assert!(same.stdout.contains("golden.csv: nothing changes"), "{}", same.stdout);
    lab.write("relay.fmu", drifting_relay(0.01));
    let ended = lab.trackside(&["test", "case.toml", "--bless"]).expect(0);
    for part in [
        "  baseline `as before`, golden.csv: 1 of ",
        " signals leave the old one",
        "    `relay.x_out` leaves its tube at 0.1 s; largest deviation 0.100 at 1 s, the old tube is ±0.00180",
    ] {
        assert!(ended.stdout.contains(part), "no {part:?} in {}", ended.stdout);
    }
    run(&lab, &[]).expect(0);
    // A finished run becomes the baseline without another run.
    lab.write("relay.fmu", relay());
    run(&lab, &[]).expect(1);
    let blessed = lab.trackside(&["bless", "out"]).expect(0);
    assert!(blessed.stdout.contains("`relay.x_out` leaves its tube at 0.1 s"), "{}", blessed.stdout);
    assert!(blessed.stdout.ends_with("wrote the baseline golden.csv\n"), "{}", blessed.stdout);
    run(&lab, &[]).expect(0);
    // Not one whose other checks fail, and not one that was compared with nothing.
    lab.write("case.toml", ramp("").replace("< 100", "< 0.5"));
    run(&lab, &[]).expect(1);
    let refused = lab.trackside(&["bless", "out"]).expect(1);
    assert!(refused.stderr.contains("not written: the check `it runs` failed"), "{}", refused.stderr);
    lab.trackside(&["bless", "."]).expect(2).says(&["expected the folder of a finished run"]);
}

fn tubes_that_hold_a_run_are_shown_and_written() {
    let lab = Lab::new();
    lab.write("relay.fmu", relay());
    lab.write("case.toml", ramp("relative = 0.002 # kept\n"));
    run(&lab, &["--bless"]).expect(0);
    lab.write("relay.fmu", drifting_relay(0.01));
    run(&lab, &[]).expect(1);
    let line = "  { signals = [\"relay.x_out\"], absolute = 0.099 },";
    let page = lab.read("out/report.html");
    assert!(page.contains("If these deviations are right") && page.contains("absolute = 0.099"), "{page}");
    let written = lab.trackside(&["bless", "out", "--tube"]).expect(0);
    assert!(written.stdout.contains(line), "{}", written.stdout);
    assert!(written.stdout.ends_with("wrote 1 tube of the baseline `as before` into case.toml\n"));
    let text = lab.read("case.toml");
    assert_eq!(text, ramp(&format!("relative = 0.002 # kept\ntubes = [\n{line}\n]\n")));
    run(&lab, &[]).expect(0);
    let nothing = lab.trackside(&["bless", "out", "--tube"]).expect(0);
    assert!(nothing.stdout.contains("there is nothing to write"), "{}", nothing.stdout);
    // The lines are about the file that the run has read.
    lab.write("relay.fmu", drifting_relay(0.02));
    run(&lab, &[]).expect(1);
    lab.write("case.toml", text + "\n# later\n");
    lab.trackside(&["bless", "out", "--tube"])
        .expect(2)
        .says(&["case.toml is another one than when the run was made"]);
}
