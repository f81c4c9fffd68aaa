//! Checks validations: they use the results of an analysis, count, and show mistakes before anything runs.

use super::fixture::Scenario;
use super::fmus::ours;
use super::harness::{Ended, Lab};
use super::plugins::compile;

tests! {
    the_result_of_an_analysis_is_validated_and_reported: Compiler,
    a_failing_or_broken_validation_decides_the_exit_code: Compiler,
    mistakes_are_reported_before_anything_runs: Compiler,
    missing_data_of_a_validation_is_no_failure: Compiler,
    an_analysis_replaces_files_of_runs_only: Compiler,
}

/// A car whose mass is "found" by a plugin.
fn case() -> String {
    let that = "pushed.checks[0].value < 1e-9 and pushed.verdict == 'pass' and odd.fine == 1";
    Scenario::new()
        .time(0.01, 0.1)
        .fmu("car", "plant.fmu", "start.v_x = 20.0, body.m = 900.0, F_x = 0.0, delta = 0.0")
        .section(ANALYSIS)
        .section(VALIDATION)
        .check("as found", that)
        .text()
}

const ANALYSIS: &str = r#"[[analysis]]
name = "odd"
path = "odd.so"
config = { mode = "finds" }
signals = { speed = "car.v_x" }"#;

const VALIDATION: &str = r#"[[validation]]
name = "pushed"
scenario = "manoeuvres/pushed.toml"
like = { plant = "car" }
set = ["@found.toml"]"#;

/// Two cars that are pushed with the same force.
fn pushed() -> Scenario {
    let start = "start.v_x = 30.0, F_x = 3000.0, delta = 0.0";
    Scenario::headed("title = \"Twins\"")
        .time(0.01, 0.1)
        .fmu("plant", "../plant.fmu", start)
        .fmu("twin", "../plant.fmu", start)
        .check("as fast", "rms(plant.v_x - twin.v_x) < 1e-6 * rms(plant.v_x)")
        .check("its own speed", "plant.v_x > 29")
}

fn lab() -> Lab {
    let lab = Lab::new();
    compile(&lab, plugin::abi::VERSION);
    lab.add(&ours().join("plant.fmu"));
    lab.write("manoeuvres/pushed.toml", pushed().text());
    lab
}

fn run(lab: &Lab, text: &str, more: &[&str]) -> Ended {
    lab.write("case.toml", text);
    lab.trackside(&[&["run", "case.toml", "--out", "out"], more].concat())
}

fn the_result_of_an_analysis_is_validated_and_reported() {
    let lab = lab();
    let ended = run(&lab, &case(), &[]).expect(0);
    for line in ["pushed  out/pushed", "ok      as fast", "the check passed, the validation passed"] {
        assert!(ended.stdout.contains(line), "{line}\n{}", ended.stdout);
    }
    let validation = lab.report("out")["validations"][0].clone();
    assert_eq!((&validation["name"], &validation["verdict"]), (&"pushed".into(), &"pass".into()));
    assert_eq!(validation["scenario"], "manoeuvres/pushed.toml");
    assert_eq!(validation["folder"], "out/pushed");
    assert!(validation["checks"][0]["value"].is_number(), "{validation}");
    assert_eq!(lab.report("out/pushed")["checks"], validation["checks"]);
    assert!(lab.has("out/pushed/run.mcap") && lab.has("out/pushed/run.rrd"));
    // Alone the twins are the same as well.
    lab.trackside(&["run", "manoeuvres/pushed.toml", "--out", "alone", "--rerun", "off"]).expect(0);
    // `--set` also reaches the validation, whose car then differs from the result of the analysis.
    let ended = run(&lab, &case(), &["--rerun", "off", "--set", "car.body.m=500"]).expect(1);
    assert!(ended.stdout.contains("FAILED  as fast") && !lab.has("out/pushed/run.rrd"));
    // The next run leaves nothing behind of a validation that it does not have.
    let case = case();
    let alone = case.split("[[validation]]").next().unwrap_or_default();
    run(&lab, alone, &[]).expect(0);
    assert!(!lab.has("out/pushed"));
}

fn a_failing_or_broken_validation_decides_the_exit_code() {
    let lab = lab();
    let ended = run(&lab, &case().replace("like = { plant = \"car\" }\n", ""), &[]).expect(1);
    for line in ["FAILED  as fast", "FAILED  as found", "1 of 1 checks failed, 1 of 1 validations failed"] {
        assert!(ended.stdout.contains(line), "{line}\n{}", ended.stdout);
    }
    let report = lab.report("out");
    assert_eq!((&report["verdict"], &report["validations"][0]["verdict"]), (&"fail".into(), &"fail".into()));

    run(&lab, &case().replace("finds", "errs"), &[])
        .expect(2)
        .says(&["twin.body.mm: unknown variable `body.mm`", "case.toml:20:"]);
    assert_eq!(lab.report("out")["validations"][0]["verdict"], "error");

    run(&lab, &case().replace("finds", "rests"), &[])
        .expect(2)
        .says(&["no analysis left `found.toml`", "case.toml:20:"]);

    run(&lab, &case().replace("\"@found.toml\"", "\"@found.toml\", \"twin.body.m=-1\""), &[])
        .expect(2)
        .says(&["validation `pushed`: `twin` refuses `body.m`", "body.m = -1", "case.toml:20:"]);
    assert_eq!(lab.report("out")["verdict"], "error");
}

fn mistakes_are_reported_before_anything_runs() {
    let lab = lab();
    lab.write("car.toml", "[twin]\nbody.m = 900.0\n");
    lab.write("wrong.toml", "[twin]\nbody.m = \"heavy\"\n");
    let extending = "extends = \"case.toml\"\n";
    lab.write("manoeuvres/back.toml", extending.replace("case", "../case"));
    #[rustfmt::skip]
    let cases = [
        ("manoeuvres/pushed.toml", "manoeuvres/pulled.toml", "case.toml:18:", "cannot read the scenario manoeuvres/pulled.toml"),
        ("manoeuvres/pushed.toml", "case.toml", "case.toml:18:", "validated by itself: case.toml -> case.toml"),
        ("manoeuvres/pushed.toml", "manoeuvres/back.toml", "case.toml:18:", "validated by itself"),
        ("\"pushed\"", "\"../pushed\"", "case.toml:17:", "expected a name that a folder can have"),
        ("\"pushed\"", "\"run.mcap\"", "case.toml:17:", "expected a name that a folder can have"),
        ("\"pushed\"", "\"car\"", "case.toml:17:", "something else is called `car`"),
        ("\"pushed\"", "\"odd\"", "case.toml:17:", "something else is called `odd`"),
        ("plant = \"car\"", "plant = \"cat\"", "case.toml:19:", "did you mean `car`?"),
        ("plant = \"car\"", "plnt = \"car\"", "case.toml:19:", "unknown node `plnt`"),
        ("like =", "likes =", "case.toml:19:", "did you mean `like`?"),
        ("\"@found.toml\"", "\"@wrong.toml\"", "case.toml:20:", "twin.body.m: `body.m` is Real, found string"),
        ("\"@found.toml\"", "\"@case.toml\"", "case.toml:20:", "expected a table"),
        ("\"@found.toml\"", "\"twin.body.m\"", "case.toml:20:", "expected node.variable=value"),
        ("\"@found.toml\"", "\"twin.body.mm=3\"", "case.toml:20:", "did you mean `body.m`?"),
        ("\"@found.toml\"", "\"tvin.body.m=3\"", "case.toml:20:", "unknown node `tvin`"),
    ];
    let mut wrong = Vec::new();
    for (old, new, line, says) in cases {
        let text = case().replacen(old, new, 1);
        assert_ne!(text, case(), "{old}");
        let ended = run(&lab, &text, &[]);
        let message = ended.message();
        let reported = message.contains(line) && message.contains(says);
        if ended.code() != Some(2) || !reported || lab.has("out") {
            wrong.push(format!("{line} {says}: {}\n{}", ended.status, ended.stderr));
        }
    }
    assert!(wrong.is_empty(), "{} mistakes:\n\n{}", wrong.len(), wrong.join("\n\n"));
    // In the scenario that validates.
    lab.write("manoeuvres/pushed.toml", pushed().text().replace("twin.v_x)", "twin.v_z)"));
    run(&lab, &case(), &[]).expect(2).says(&["manoeuvres/pushed.toml:19:", "did you mean `twin.v_x`?"]);
    // Without an analysis nothing will leave the file.
    lab.write("manoeuvres/pushed.toml", pushed().text());
    let case = case();
    let (head, tail) = case.split_once("[[analysis]]").expect("it has one");
    let tail = tail.split_once("[[validation]]").expect("it has one").1;
    let tail = tail.replace(" and odd.fine == 1", "");
    let text = format!("{head}[[validation]]{tail}");
    run(&lab, &text, &[]).expect(2).says(&["found.toml", "case.toml:14:"]);
    assert!(!lab.has("out"));
    run(&lab, &text.replace("found.toml", "car.toml"), &[]).expect(0);
}

fn missing_data_of_a_validation_is_no_failure() {
    let lab = lab();
    lab.write("manoeuvres/pushed.toml", pushed().table("log", "log.csv", "").text());
    lab.write("case.toml", case());
    let ended = lab.trackside(&["test", "case.toml"]).expect(0);
    assert!(ended.stdout.contains("data file manoeuvres/log.csv is not there"), "{}", ended.stdout);
}

fn an_analysis_replaces_files_of_runs_only() {
    let lab = lab();
    lab.write("out/found.toml", "mine");
    run(&lab, &case(), &["--rerun", "off"])
        .expect(2)
        .says(&["out/found.toml", "there is such a file already, and no run wrote it"]);
    assert_eq!(lab.read("out/found.toml"), "mine");
    std::fs::remove_file(lab.path("out/found.toml")).expect("a file");
    run(&lab, &case(), &["--rerun", "off"]).expect(0);
    // What a run leaves that is killed after its analysis.
    std::fs::remove_file(lab.path("out/report.json")).expect("a report");
    let noted = serde_json::json!({
        "scenario": "case", "verdict": "error", "versions": {"trackside": "0.1.0"}, "files": ["found.toml"]
    });
    lab.write("out/report.json.partial", noted.to_string());
    run(&lab, &case(), &["--rerun", "off"]).expect(0);
}
