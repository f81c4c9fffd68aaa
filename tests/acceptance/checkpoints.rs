//! Goes on from checkpoints: the rows, verdicts and recordings of a run in parts are those of the whole one, bit for bit.

use super::clocks;
use super::fixture::Scenario;
use super::fmus::{changed, clocked, forgetful, ours};
use super::harness::{Ended, Lab};
use super::requirement::reference_fmus;

tests! {
    a_run_goes_on_bit_for_bit_with_effects_faults_and_tables,
    reference_fmus_go_on_bit_for_bit: ReferenceFmus,
    clocks_and_events_go_on_bit_for_bit: Compiler,
    a_warm_up_has_many_ends,
    parameters_change_at_the_checkpoint: Compiler,
    ends_go_on_in_one_process: Compiler,
    a_scenario_in_one_fmu_goes_on_with_its_effects: Compiler,
    an_fmu_that_has_failed_goes_on_being_held: Compiler,
    verdicts_are_those_of_the_whole_run,
}

/// Runs a scenario without a replay.
pub fn run(lab: &Lab, scenario: &str, out: &str, more: &[&str]) -> Ended {
    let arguments = ["run", scenario, "--out", out, "--csv", "--rerun", "off"];
    lab.trackside(&[&arguments, more].concat())
}

/// The lines of a table from a time [s] on.
pub fn from(lab: &Lab, out: &str, time: f64) -> Vec<String> {
    let table = lab.table(&format!("{out}/run.csv"));
    let late = |line: &&str| {
        let cell = line.split(',').next().and_then(|cell| cell.parse::<f64>().ok());
        cell.is_some_and(|cell| cell > time - 1e-9)
    };
    table.lines().filter(late).map(str::to_owned).collect()
}

/// The messages of a recording from a time [s] on that are rows: channel, time and bytes.
fn messages(lab: &Lab, out: &str, time: f64) -> Vec<(String, u64, Vec<u8>)> {
    let bytes = std::fs::read(lab.path(&format!("{out}/run.mcap"))).expect("a recording");
    let all = mcap::MessageStream::new(&bytes).expect("a recording");
    let all = all.map(|message| message.expect("a message"));
    let rows =
        all.filter(|it| !it.channel.topic.starts_with("/log") && it.log_time as f64 > time * 1e9 - 1.0);
    let rows = rows.filter(|it| ["/inputs", "/outputs"].iter().any(|end| it.channel.topic.ends_with(end)));
    rows.map(|it| (it.channel.topic.clone(), it.log_time, it.data.to_vec())).collect()
}

/// The events of a recording.
fn log(lab: &Lab, out: &str) -> String {
    let bytes = std::fs::read(lab.path(&format!("{out}/run.mcap"))).expect("a recording");
    let all = mcap::MessageStream::new(&bytes).expect("a recording");
    let events = all.map(|message| message.expect("a message")).filter(|it| it.channel.topic == "/log");
    events.map(|it| String::from_utf8_lossy(&it.data).into_owned()).collect()
}

/// Insists on the rows of the run in `whole` from a time [s] on.
fn same(lab: &Lab, whole: &str, resumed: &str, time: f64) {
    let rows = from(lab, whole, time);
    assert!(rows.len() > 3, "{whole} has {} rows from {time} s on", rows.len());
    assert_eq!(from(lab, resumed, 0.0), rows, "{resumed} from {time} s on");
    let recorded = messages(lab, whole, time);
    assert!(recorded.len() > 3 && messages(lab, resumed, time) == recorded, "{resumed}: its recording");
}

/// A drive with everything that connections and sources remember.
fn drive(version: &str, stop: f64) -> Scenario {
    Scenario::headed("seed = 7")
        .time(0.01, stop)
        .fmu("plant", &format!("plant{version}.fmu"), "start.v_x = 25.0")
        .fmu("estimator", &format!("estimator{version}.fmu"), "")
        .key("unconnected = 'start'")
        .signal("driver.delta", "unit = 'rad'\nsine = { amplitude = 0.02, frequency = 0.7 }")
        .table("log", "log.csv", "force = { column = 'F', unit = 'N' }")
        .connect("driver.delta", "plant.delta")
        .key("hold = 0.03")
        .connect("log.force", "plant.F_x")
        .connect("log.force", "estimator.F_x")
        .connect("driver.delta", "estimator.delta")
        .key("delay = 0.025")
        .connect("plant.v_x", "estimator.v_x_meas")
        .key("noise = { std = 0.1 }\ndropout = 0.2")
        .connect("plant.v_y", "estimator.v_y_meas")
        .key("noise = { std = 0.01 }\nquantise = 0.001")
        .connect("plant.r", "estimator.r_meas")
        .key("bias = 0.001\nnoise = { std = 0.002 }\ndelay = 0.02")
        .section("[[fault]]\ninput = 'estimator.r_meas'\nfrom = 0.7\nuntil = 1.4\nfreeze = true")
        .check("slow", "max(plant.v_x) < 100")
        .check("near", "abs(plant.v_x - estimator.v_x) < 0.08")
}

fn lab_of_a_drive(version: &str) -> Lab {
    let lab = Lab::new();
    for name in ["plant", "estimator"] {
        lab.add(&ours().join(format!("{name}{version}.fmu")));
    }
    lab.write("log.csv", "t,F\n0,0\n0.5,300\n1.2,-200\n2.5,100\n");
    lab
}

fn a_run_goes_on_bit_for_bit_with_effects_faults_and_tables() {
    for version in ["", "_fmi3"] {
        let lab = lab_of_a_drive(version);
        lab.write("drive.toml", drive(version, 2.0).text());
        run(&lab, "drive.toml", "plain", &[]).completes();
        run(&lab, "drive.toml", "whole", &["--checkpoint", "0.5,1", "--checkpoint", "1.7"]).completes();
        assert_eq!(lab.read("whole/run.csv"), lab.read("plain/run.csv"), "checkpoints disturb nothing");
        for (time, more) in
            [(0.5, "--isolate=none"), (1.0, "--isolate=none"), (1.0, "--isolate"), (1.7, "--isolate")]
        {
            let file = format!("whole/checkpoint_{time}.state");
            let ended = run(&lab, "drive.toml", "part", &["--resume", &file, more]).completes();
            assert!(!ended.stderr.contains("from 0"), "{}", ended.stderr);
            assert!(!ended.stderr.contains("bit for bit"), "{}", ended.stderr);
            same(&lab, "whole", "part", time);
            let (whole, part) = (lab.report("whole"), lab.report("part"));
            assert_eq!(part["checks"], whole["checks"], "verdicts from {time} s on");
            assert_eq!(part["resumed"]["checkpoint"], file.as_str());
            assert_eq!(part["resumed"]["changes"], serde_json::json!([]));
            let acts = (0.7..1.4).contains(&time);
            assert_eq!(log(&lab, "part").contains("the fault of estimator.r_meas goes on"), acts);
        }
        // In processes of their own they leave the same.
        run(&lab, "drive.toml", "apart", &["--checkpoint", "1", "--isolate"]).completes();
        let bytes =
            |out: &str| std::fs::read(lab.path(&format!("{out}/checkpoint_1.state"))).expect("a file");
        assert!(bytes("apart") == bytes("whole"), "a checkpoint of isolated FMUs is another one");
        // A part leaves what the whole leaves.
        let more = ["--resume", "whole/checkpoint_1.state", "--checkpoint", "1.7"];
        run(&lab, "drive.toml", "middle", &more).completes();
        run(&lab, "drive.toml", "part", &["--resume", "middle/checkpoint_1.7.state"]).completes();
        same(&lab, "whole", "part", 1.7);
    }
}

fn reference_fmus_go_on_bit_for_bit() {
    let all = [
        ("2.0", "BouncingBall", 0.01, 2.0),
        ("2.0", "Dahlquist", 0.1, 5.0),
        ("2.0", "VanDerPol", 0.01, 2.0),
        ("2.0", "Feedthrough", 0.1, 1.0),
        ("3.0", "BouncingBall", 0.01, 2.0),
        ("3.0", "Dahlquist", 0.1, 5.0),
        ("3.0", "VanDerPol", 0.01, 2.0),
        ("3.0", "StateSpace", 0.5, 4.0),
        ("3.0", "Feedthrough", 0.1, 1.0),
    ];
    for (version, name, step, time) in all {
        let lab = Lab::new();
        lab.add(&reference_fmus().join(format!("{version}/{name}.fmu")));
        let fmu = Scenario::new().time(step, 2.0 * time).fmu("it", &format!("{name}.fmu"), "");
        lab.write("case.toml", fmu.key("unconnected = 'start'").text());
        let at = time.to_string();
        let whole = run(&lab, "case.toml", "whole", &["--checkpoint", &at]).expect(0);
        assert!(!whole.stderr.contains("bit for bit"), "{name}: {}", whole.stderr);
        let file = format!("whole/checkpoint_{at}.state");
        run(&lab, "case.toml", "part", &["--resume", &file]).expect(0);
        same(&lab, "whole", "part", time);
    }
}

/// Ticks, kept values of clocked variables, and a countdown that runs go over the checkpoint.
fn clocks_and_events_go_on_bit_for_bit() {
    let lab = Lab::new();
    lab.write("clocked.fmu", clocked());
    lab.write("case.toml", clocks::scenario().text());
    let times = [0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8];
    let list = times.map(|time: f64| time.to_string()).join(",");
    let whole = run(&lab, "case.toml", "whole", &["--checkpoint", &list]).expect(0);
    assert!(!whole.stderr.contains("bit for bit"), "{}", whole.stderr);
    for time in times {
        let file = format!("whole/checkpoint_{time}.state");
        for more in ["--isolate=none", "--isolate"] {
            let ended = run(&lab, "case.toml", "part", &["--resume", &file, more]).expect(0);
            assert!(!ended.stderr.contains("bit for bit"), "{}", ended.stderr);
            same(&lab, "whole", "part", time);
        }
    }
}

/// What changes after the checkpoint only may change at the checkpoint: the run in parts is the whole run with that change.
fn a_warm_up_has_many_ends() {
    let lab = lab_of_a_drive("");
    lab.write("warm.toml", drive("", 1.0).text());
    run(&lab, "warm.toml", "warm", &["--checkpoint", "1"]).completes();
    let fault = "[[fault]]\ninput = 'estimator.v_x_meas'\nfrom = 1.0\nuntil = 1.2\nfreeze = true";
    let signal = "unit = 'rad'\npart = [{ sine = { amplitude = 0.02, frequency = 0.7 } }, { from = 1.3, constant = 0.01 }]";
    let other =
        drive("", 2.0).text().replace("unit = 'rad'\nsine = { amplitude = 0.02, frequency = 0.7 }", signal);
    let ends = [
        ("longer", drive("", 2.5).text(), "[]"),
        ("fault", drive("", 2.0).section(fault).text(), "[\"the faults of `estimator.v_x_meas`\"]"),
        ("signal", other, "[\"the values of `driver`\"]"),
    ];
    for (name, text, changes) in ends {
        lab.write("end.toml", text);
        run(&lab, "end.toml", "whole", &[]).completes();
        run(&lab, "end.toml", name, &["--resume", "warm/checkpoint_1.state"]).completes();
        assert_eq!(from(&lab, name, 0.0)[1..], from(&lab, "whole", 1.0)[1..], "{name}");
        assert_eq!(lab.report(name)["resumed"]["changes"].to_string(), changes);
        assert_eq!(lab.report(name)["resumed"]["scenario"], "warm");
    }
    // Other noise from here on.
    run(&lab, "end.toml", "other", &["--resume", "warm/checkpoint_1.state", "--seed", "8"]).completes();
    assert_ne!(from(&lab, "other", 1.1), from(&lab, "signal", 1.1));
}

fn adder(start: &str, stop: f64) -> Scenario {
    Scenario::new()
        .time(0.1, stop)
        .fmu("adder", "forgetful.fmu", start)
        .signal("s.u", "constant = 2.0")
        .connect("s.u", "adder.u")
        .check("all", "max(adder.sum) < 100")
}

/// The sum after 1 s is 2, and then grows by four times as much.
fn parameters_change_at_the_checkpoint() {
    let lab = Lab::new();
    lab.write("forgetful.fmu", forgetful(&[]));
    lab.write("case.toml", adder("gain = 1.0", 2.0).text());
    run(&lab, "case.toml", "warm", &["--checkpoint", "1"]).expect(0);
    for more in ["--isolate=none", "--isolate"] {
        let set = ["--resume", "warm/checkpoint_1.state", "--set", "adder.gain=4", more];
        run(&lab, "case.toml", "end", &set).expect(0);
        let rows = from(&lab, "end", 0.0);
        assert_eq!(rows[0], from(&lab, "warm", 1.0)[0], "the checkpoint itself is what it was");
        let last = rows[10].split(',').nth(2).and_then(|cell| cell.parse::<f64>().ok());
        assert!((last.expect("a number") - 10.0).abs() < 1e-9, "{}", rows[10]);
        let changes = &lab.report("end")["resumed"]["changes"];
        assert_eq!(changes.to_string(), "[\"`adder.gain`: 4.0 instead of 1.0\"]");
    }
}

/// An FMU that saves its state but has no bytes for it.
fn without_bytes(lab: &Lab) -> Vec<u8> {
    changed(&lab.write("whole.fmu", forgetful(&[])), |name, bytes| {
        let text = || String::from_utf8(bytes.clone()).expect("text");
        let lacks = || text().replace(" canSerializeFMUstate=\"true\"", "").into_bytes();
        let bytes = if name == "modelDescription.xml" { lacks() } else { bytes.clone() };
        Some((name.to_owned(), bytes))
    })
}

fn ends_go_on_in_one_process() {
    let lab = Lab::new();
    let fmu = without_bytes(&lab);
    lab.write("forgetful.fmu", fmu);
    lab.write("warm.toml", adder("gain = 1.0", 1.5).text());
    lab.write("one.toml", adder("gain = 1.0", 3.0).text());
    lab.write("two.toml", adder("gain = 3.0", 2.0).text());
    lab.write("three.toml", adder("gain = 1.0", 1.5).text());
    let ends = ["--branch", "one.toml", "--branch", "two.toml", "--branch", "three.toml"];
    for more in ["--isolate=none", "--isolate"] {
        let ended =
            run(&lab, "warm.toml", "out", &[&["--checkpoint", "1", more], &ends[..]].concat()).expect(0);
        assert!(!ended.stderr.contains("bit for bit"), "{}", ended.stderr);
        run(&lab, "one.toml", "alone", &[]).expect(0);
        assert_eq!(from(&lab, "out/one", 0.0), from(&lab, "alone", 1.0));
        assert_eq!(from(&lab, "out/three", 0.0), from(&lab, "out", 1.0));
        let last = from(&lab, "out/two", 2.0)[0].split(',').nth(2).and_then(|cell| cell.parse::<f64>().ok());
        assert!((last.expect("a number") - 8.0).abs() < 1e-9);
        assert_eq!(lab.report("out/one")["checks"][0]["samples"], 31, "also those before the checkpoint");
        assert_eq!(lab.report("out/two")["resumed"]["checkpoint"], "warm");
    }
}

/// The FMU holds a scenario whose connection has noise, a delay and a fault.
fn a_scenario_in_one_fmu_goes_on_with_its_effects() {
    let lab = Lab::new();
    lab.write("forgetful.fmu", forgetful(&[]));
    let inner = Scenario::headed("seed = 3")
        .time(0.1, 3.0)
        .fmu("adder", "forgetful.fmu", "u = 0.0")
        .fmu("second", "forgetful.fmu", "")
        .connect("adder.count", "second.u")
        .key("noise = { std = 0.5 }\ndelay = 0.25\ndropout = 0.3\nhold = 0.2")
        .section("[[fault]]\ninput = 'second.u'\nfrom = 0.8\nuntil = 1.4\nfreeze = true");
    lab.write("inner.toml", inner.text());
    lab.trackside(&["pack", "inner.toml", "--fmu", "box", "--out", "packed"]).expect(0);
    let outer = Scenario::new().time(0.1, 3.0).fmu("box", "packed/box.fmu", "");
    lab.write("case.toml", outer.key("unconnected = 'start'").text());
    let whole = run(&lab, "case.toml", "whole", &["--checkpoint", "1,1.6"]).expect(0);
    assert!(!whole.stderr.contains("checkpoint"), "{}", whole.stderr);
    for time in [1.0, 1.6] {
        let file = format!("whole/checkpoint_{time}.state");
        run(&lab, "case.toml", "part", &["--resume", &file]).expect(0);
        same(&lab, "whole", "part", time);
    }
}

fn an_fmu_that_has_failed_goes_on_being_held() {
    let lab = Lab::new();
    lab.write("forgetful.fmu", forgetful(&[]));
    let held = adder("at = 0.45", 2.0)
        .text()
        .replace("[[signal]]", "isolate = true\non_failure = 'hold'\n\n[[signal]]");
    lab.write("case.toml", held);
    run(&lab, "case.toml", "whole", &["--checkpoint", "1"]).completes();
    run(&lab, "case.toml", "part", &["--resume", "whole/checkpoint_1.state"]).completes();
    same(&lab, "whole", "part", 1.0);
    let here = adder("at = 0.45", 2.0).text();
    lab.write("here.toml", here);
    let ended = run(&lab, "here.toml", "here", &["--resume", "whole/checkpoint_1.state"]);
    ended.expect(3).says(&["adder", "isolate"]);
}

fn verdicts_are_those_of_the_whole_run() {
    let lab = lab_of_a_drive("");
    let scenario = |late: &str| {
        drive("", 2.0)
            .check("mean", "mean(plant.v_x) > 0")
            .check("quantile", "quantile(estimator.v_x, 0.9) < 24.9")
            .check("window", "rms(estimator.r) < 1")
            .key("during = [0.3, 1.6]")
            .check("over", "max(plant.r) < 0.01")
            .key("during = [0.2, 0.9]")
            .check("late", late)
    };
    lab.write("warm.toml", scenario("std(plant.r) > 0").text());
    lab.write("end.toml", scenario("std(plant.r) > 0.0001").text());
    run(&lab, "warm.toml", "whole", &["--checkpoint", "1"]).completes();
    let ended = run(&lab, "warm.toml", "part", &["--resume", "whole/checkpoint_1.state"]).completes();
    assert!(!ended.stderr.contains("judged from"), "{}", ended.stderr);
    assert_eq!(lab.report("part")["checks"], lab.report("whole")["checks"]);
    let ended = run(&lab, "end.toml", "end", &["--resume", "whole/checkpoint_1.state"]).completes();
    let warning = "the check `late` is judged from 1 s on";
    assert_eq!(ended.stderr.matches("judged from").count(), 1, "{}", ended.stderr);
    assert!(ended.stderr.contains(warning), "{}", ended.stderr);
    let whole = lab.report("whole");
    for (place, check) in lab.report("end")["checks"].as_array().expect("a list").iter().enumerate() {
        match check["name"] == "late" {
            true => assert_eq!(check["samples"], 101),
            false => {
                let mut check = check.clone();
                check["file"] = whole["checks"][place]["file"].clone();
                assert_eq!(check, whole["checks"][place]);
            }
        }
    }
}
