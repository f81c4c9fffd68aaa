//! Checks what is told of checkpoints that do not fit, are damaged, or of FMUs that forget a part of their state.

use fmu_import::sha256_hex;

use super::checkpoints::{from, run};
use super::fixture::Scenario;
use super::fmus::{changed, forgetful, misbehave};
use super::harness::Lab;

tests! {
    an_fmu_that_forgets_is_told_and_not_disturbed: Compiler,
    what_does_not_fit_is_told: Compiler,
    fmus_that_cannot_are_named_with_what_works: Compiler,
    times_of_checkpoints_are_communication_points: Compiler,
    damaged_checkpoints_are_errors: Compiler,
    a_checkpoint_is_safe_from_the_run_that_it_begins: Compiler,
}

fn adder(fmu: &str, keys: &str) -> Scenario {
    Scenario::new()
        .time(0.1, 2.0)
        .fmu("adder", fmu, "gain = 1.0")
        .fmu("other", fmu, "")
        .signal("s.u", "constant = 2.0")
        .signal("s.v", "constant = 3.0")
        .connect("s.u", "adder.u")
        .key(keys)
        .connect("adder.sum", "other.u")
}

fn lab() -> Lab {
    let lab = Lab::new();
    lab.write("adder.fmu", forgetful(&[]));
    lab.write("forgets.fmu", forgetful(&["-DFORGETS"]));
    lab.write("case.toml", adder("adder.fmu", "").text());
    lab
}

fn an_fmu_that_forgets_is_told_and_not_disturbed() {
    let lab = lab();
    // The other node knows nothing but its state.
    let [both, one] = ["forgets", "adder"].map(|it| format!("name = \"other\"\npath = \"{it}.fmu\""));
    let forgets = &adder("forgets.fmu", "").text().replace(&both, &one);
    assert!(forgets.contains(&one), "{forgets}");
    lab.write("case.toml", forgets);
    run(&lab, "case.toml", "plain", &[]).expect(0);
    let told = run(&lab, "case.toml", "whole", &["--checkpoint", "1"]).expect(0);
    let warning = "`adder` does not go on bit for bit from the checkpoint at 1 s: at 1.1 s `adder.count` was 11.0 and is 1.0";
    assert!(told.stderr.contains(warning), "{}", told.stderr);
    assert!(!told.stderr.contains("other.") && !told.stderr.contains("sum"), "{}", told.stderr);
    assert_eq!(lab.read("whole/run.csv"), lab.read("plain/run.csv"), "the run is as without");
    let told = run(&lab, "case.toml", "part", &["--resume", "whole/checkpoint_1.state"]).expect(0);
    assert!(told.stderr.contains(warning), "{}", told.stderr);
    let warnings = lab.report("part")["warnings"].to_string();
    assert!(warnings.contains("does not go on bit for bit"), "{warnings}");
    // In one process, too; the warm-up is over by then.
    lab.write("end.toml", forgets);
    let told = run(&lab, "case.toml", "one", &["--checkpoint", "1", "--branch", "end.toml"]).expect(0);
    let warning = "`adder.count` was 11.0 and is 21.0";
    assert!(told.stderr.contains(warning), "{}", told.stderr);
    assert_eq!(from(&lab, "one", 0.0), from(&lab, "plain", 0.0));
    // An end that does not fit takes nothing from the next one.
    lab.write("wrong.toml", forgets.replace("gain = 1.0", "at = 5.0"));
    let ends = ["--checkpoint", "1", "--branch", "wrong.toml", "--branch", "end.toml"];
    run(&lab, "case.toml", "two", &ends).expect(2).says(&["`adder.at` is -1.0 there and 5.0 here"]);
    assert!(lab.has("two/end/run.csv") && !lab.has("two/wrong/run.csv"));
}

fn what_does_not_fit_is_told() {
    let lab = lab();
    run(&lab, "case.toml", "whole", &["--checkpoint", "1"]).expect(0);
    let text = |scenario: Scenario| scenario.text();
    let node = adder("adder.fmu", "").fmu("third", "adder.fmu", "u = 1.0");
    let unconnected = text(adder("adder.fmu", ""))
        .replace("[[connect]]\nfrom = \"adder.sum\"\nto = \"other.u\"", "")
        .replace("name = \"other\"\n", "name = \"other\"\nunconnected = 'start'\n");
    let fixed = "`adder.at` is -1.0 there and 5.0 here; the FMU calls it fixed";
    let cases: [(String, &[&str], &[&str]); 9] = [
        (
            text(adder("forgets.fmu", "")),
            &[],
            &["the FMU of `adder` is another file", "both have one GUID", "the FMU of `other`"],
        ),
        (text(adder("adder.fmu", "")), &["--set", "adder.at=5"], &[fixed]),
        (text(node), &[], &["it has no node `third`"]),
        (
            text(adder("adder.fmu", "")).replace("adder", "sum_up").replace("sum_up.fmu", "adder.fmu"),
            &[],
            &["it has a node `adder`"],
        ),
        (
            text(adder("adder.fmu", "")).replace("from = \"s.u\"", "from = \"s.v\""),
            &[],
            &["`adder.u` is connected to `s.u` there, and to `s.v` here"],
        ),
        (unconnected, &[], &["`other.u` is connected to `adder.sum` there, and to nothing here"]),
        (text(adder("adder.fmu", "at = 'start'")), &[], &[]),
        (
            text(adder("adder.fmu", "")).replace("step = 0.1", "step = 0.05"),
            &[],
            &["its communication step is 0.1 s, here it is 0.05 s"],
        ),
        (
            text(adder("adder.fmu", "")).replace("stop = 2.0", "stop = 0.5"),
            &[],
            &["at 1 s", "after the end of this run at 0.5 s"],
        ),
    ];
    for (text, more, says) in cases {
        lab.write("other.toml", &text);
        let ended =
            run(&lab, "other.toml", "other", &[&["--resume", "whole/checkpoint_1.state"], more].concat());
        match says {
            [] => drop(ended.expect(0)),
            says => drop(ended.expect(2).says(&["checkpoint of `case` at 1 s", "does not fit"]).says(says)),
        }
    }
}

fn fmus_that_cannot_are_named_with_what_works() {
    let lab = lab();
    let fmu = changed(&lab.path("adder.fmu"), |name, bytes| {
        let text = String::from_utf8_lossy(&bytes).replace(" canSerializeFMUstate=\"true\"", "");
        let bytes = if name.ends_with(".xml") { text.into_bytes() } else { bytes };
        Some((name.to_owned(), bytes))
    });
    lab.write("adder.fmu", fmu);
    let ended = run(&lab, "case.toml", "out", &["--checkpoint", "1"]).expect(2);
    ended.says(&[
        "`adder`, `other`".replace(", ", "`, `").replace("``", "`").as_str(),
        "canSerializeFMUstate",
        "--branch",
    ]);
    assert!(!lab.has("out"), "nothing began");
    lab.write("adder.fmu", misbehave());
    lab.write("end.toml", "");
    lab.write("case.toml", Scenario::new().time(0.1, 1.0).fmu("tank", "adder.fmu", "u = 0.0").text());
    for more in [&["--checkpoint", "1"][..], &["--checkpoint", "1", "--branch", "end.toml"]] {
        let ended = run(&lab, "case.toml", "out", more);
        ended.says(&["tank", "canGetAndSetFMUstate", "from its beginning"]);
    }
}

fn times_of_checkpoints_are_communication_points() {
    let lab = lab();
    let ended = run(&lab, "case.toml", "out", &["--checkpoint", "0,0.55,0.3,2"]).expect(0);
    let warning = "--checkpoint 0.55: it is taken at 0.6 s, the next communication point";
    assert!(ended.stderr.contains(warning), "{}", ended.stderr);
    assert_eq!(ended.stderr.matches("--checkpoint").count(), 1, "{}", ended.stderr);
    let whole = from(&lab, "out", 0.0);
    for (time, row) in [("0", 0), ("0.3", 3), ("0.6", 6), ("2", 20)] {
        let file = format!("out/checkpoint_{time}.state");
        run(&lab, "case.toml", "part", &["--resume", &file]).expect(0);
        assert_eq!(from(&lab, "part", 0.0), whole[row..], "from {time} s on");
    }
    for wrong in ["-0.1", "2.05", "nan", "1e300"] {
        let ended = run(&lab, "case.toml", "wrong", &[&format!("--checkpoint={wrong}")]).expect(2);
        ended.says(&["expected a time from 0 s to 2 s"]);
    }
    let two = ["--checkpoint", "1,1.5", "--branch", "end.toml"];
    run(&lab, "case.toml", "wrong", &two).expect(2).says(&["one --checkpoint"]);
    let early = ["--resume", "out/checkpoint_0.6.state", "--checkpoint", "0.3"];
    run(&lab, "case.toml", "wrong", &early).expect(2).says(&["the run begins at 0.6 s"]);
    let bless = ["--resume", "out/checkpoint_0.6.state", "--bless"];
    run(&lab, "case.toml", "wrong", &bless).expect(2).says(&["--bless"]);
}

/// Whatever the bytes are, the run begins or says what is wrong.
fn damaged_checkpoints_are_errors() {
    let lab = lab();
    lab.write(
        "case.toml",
        adder("adder.fmu", "delay = 0.15\nnoise = { std = 0.1 }\nhold = 0.2\ndropout = 0.1")
            .check("mean", "mean(adder.sum) > 0")
            .text(),
    );
    run(&lab, "case.toml", "whole", &["--checkpoint", "1"]).expect(0);
    let bytes = std::fs::read(lab.path("whole/checkpoint_1.state")).expect("a file");
    let head = bytes.iter().position(|byte| *byte == b'\n').expect("a line") + 1;
    let resume = |bytes: &[u8]| {
        lab.write("damaged.state", bytes);
        run(&lab, "case.toml", "part", &["--resume", "damaged.state"])
    };
    resume(&bytes[..bytes.len() - 1]).expect(2).says(&["damaged.state", "cut short or changed"]);
    resume(&bytes[..head + 3]).expect(2).says(&["cut short or changed"]);
    resume(b"").expect(2).says(&["it is no checkpoint"]);
    resume(b"trackside checkpoint 99\nxxx").expect(2).says(&["another version"]);
    let mut flipped = bytes.clone();
    flipped[head + 200] ^= 1;
    resume(&flipped).expect(2).says(&["cut short or changed"]);
    run(&lab, "case.toml", "part", &["--resume", "absent.state"]).expect(2).says(&["absent.state"]);
    // With the right hash of the wrong bytes.
    let content = &bytes[head + 64..];
    let signed = |content: &[u8]| [&bytes[..head], sha256_hex(content).as_bytes(), content].concat();
    resume(&signed(content)).expect(0);
    resume(&signed(&content[..content.len() / 2])).expect(2).says(&["no checkpoint that a run wrote"]);
    let mut random = 1_u64;
    for _ in 0..60 {
        let mut wrong = content.to_vec();
        for _ in 0..3 {
            random = random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            let place = (random >> 33) as usize % wrong.len();
            wrong[place] = [0xff, 0x00, (random >> 8) as u8][(random >> 20) as usize % 3];
        }
        let ended = resume(&signed(&wrong));
        assert!(matches!(ended.code(), Some(0..=3)), "{:?}\n{}", ended.status, ended.stderr);
        assert!(!ended.stderr.contains("panicked"), "{}", ended.stderr);
    }
}

fn a_checkpoint_is_safe_from_the_run_that_it_begins() {
    let lab = lab();
    run(&lab, "case.toml", "out", &["--checkpoint", "1"]).expect(0);
    let ended = run(&lab, "case.toml", "out", &["--resume", "out/checkpoint_1.state"]);
    ended.expect(2).says(&["whose files this run replaces", "--out"]);
    // Where nobody names a folder, it is another one.
    lab.trackside(&["run", "case.toml", "--rerun", "off", "--checkpoint", "1"]).expect(0);
    let file = "target/runs/case/checkpoint_1.state";
    lab.trackside(&["run", "case.toml", "--rerun", "off", "--resume", file]).expect(0);
    assert!(lab.has(file) && lab.has("target/runs/case_resumed/report.json"));
    // What nobody accounts for stays.
    lab.write("out/checkpoint_0.5.state", "mine");
    let ended = run(&lab, "case.toml", "out", &["--checkpoint", "0.5"]);
    ended.expect(2).says(&["it holds checkpoint_0.5.state, and no report says that a run wrote it"]);
    assert_eq!(lab.read("out/checkpoint_0.5.state"), "mine");
    assert!(lab.has("out/checkpoint_1.state") && lab.has("out/report.json"), "all is as it was");
    // The next run takes what belongs to the last one.
    lab.trackside(&["run", "case.toml", "--rerun", "off"]).expect(0);
    assert!(!lab.has(file));
}
