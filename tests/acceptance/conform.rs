//! Checks `trackside conform`: our FMUs keep every rule, and each broken rule is found.

use super::fixture::Scenario;
use super::fmus::{changed, deviate, example, ours};
use super::harness::{Ended, Lab, limit, trackside};
use super::python::python;

tests! {
    our_fmus_pass_every_rule,
    each_deviation_fails_exactly_the_rules_it_breaks: Compiler,
    a_crash_or_a_hang_fails_one_rule_and_the_others_continue: Compiler,
    vanished_temporary_files_are_no_fault_of_the_fmu: Compiler,
    what_the_standard_leaves_open_gives_a_warning: Compiler,
    an_unloadable_library_makes_the_other_rules_not_applicable: Compiler,
    an_invalid_model_description_is_explained: Compiler,
    rules_for_undeclared_capabilities_are_not_applicable: Compiler,
    a_single_instance_fmu_is_judged_and_run_with_one_instance: Compiler,
    a_file_other_than_an_fmu_is_rejected,
    inspect_prints_json: Compiler,
    an_fmu_made_in_python_fails_only_known_rules: PythonLibrary,
}

/// The findings about an FMU as (rule, outcome, detail), and the exit code.
pub fn conform(lab: &Lab, fmu: &str, limit: &str) -> (Vec<[String; 3]>, Option<i32>) {
    read(lab.trackside(&["conform", fmu, "--json", "--limit", limit]))
}

fn read(ended: Ended) -> (Vec<[String; 3]>, Option<i32>) {
    let json: serde_json::Value = serde_json::from_str(&ended.stdout)
        .unwrap_or_else(|error| panic!("{error}\n{}\n{}", ended.stdout, ended.stderr));
    let text = |finding: &serde_json::Value, key: &str| {
        finding[key].as_str().unwrap_or_else(|| panic!("{key} in {finding}")).to_owned()
    };
    let findings = json.as_array().expect("a list").iter();
    let of = |finding| ["rule", "outcome", "detail"].map(|key| text(finding, key));
    (findings.map(of).collect(), ended.code())
}

/// The names of the rules with this outcome.
pub fn rules<'a>(findings: &'a [[String; 3]], wanted: &str) -> Vec<&'a str> {
    let found = findings.iter().filter(|[_, outcome, _]| outcome == wanted);
    found.map(|[rule, ..]| rule.as_str()).collect()
}

fn our_fmus_pass_every_rule() {
    // Only the plant and the example say that they have directional derivatives.
    for (name, passed) in [("plant", 32), ("controller", 31), ("estimator", 31), ("spring_damper", 32)] {
        let lab = Lab::new();
        lab.add(&if name == "spring_damper" {
            example().to_owned()
        } else {
            ours().join(format!("{name}.fmu"))
        });
        let ended = lab.trackside(&["conform", &format!("{name}.fmu")]).expect(0);
        let counted = format!(
            "{passed} passed, 0 failed, {} not applicable\nThe FMU keeps FMI 2.0 for callers that do.\n",
            33 - passed
        );
        assert!(ended.stdout.ends_with(&counted), "{}", ended.stdout);
        assert!(!ended.stdout.contains("warning"), "{}", ended.stdout);
        assert!(ended.stdout.lines().any(|line| line.starts_with("pass  call-order ")));
    }
}

/// A deviation, the rules it breaks, and parts of the finding on the first of them.
#[rustfmt::skip]
const DEVIATIONS: &[(&str, &[&str], &[&str])] = &[
    ("nothing", &[], &[]),
    ("history is dropped when it may be", &[], &[]),
    ("another version", &["version"], &["fmi2GetVersion", "expected \"2.0\", found \"1.0\""]),
    ("any GUID is accepted", &["guid"], &["{deviate}"]),
    ("illegal calls are accepted", &["call-order", "illegal-access"], &["expected fmi2Error, found success: fmi2ExitInitializationMode in Instantiated", "fmi2DoStep in Terminated"]),
    ("another start value", &["start-values"], &["`gain` in initialization mode: expected 2, found 2.5"]),
    ("no number", &["finite"], &["`y` is NaN at t = 4.1 s"]),
    ("an output can be set", &["illegal-access", "unknown-references"], &["found success: `y` (Continuous Output) in Instantiated"]),
    ("a fixed parameter moves", &["illegal-access"], &["found success: `gain` (Fixed Parameter) in StepComplete"]),
    ("an input is refused", &["variable-access"], &["expected success", "`u` (Continuous Input) in InitializationMode", "not this input"]),
    ("an unknown reference is read", &["unknown-references"], &["ended with exit code 3 during fmi2GetReal of the reference 3"]),
    ("an unknown reference is written", &["unknown-references"], &["after fmi2SetReal of 3"]),
    ("the stop time is passed", &["stop-time"], &["fmi2DoStep of 0.1 s from t = 3 s", "3.050000 s as the stop time"]),
    ("no state before the first step", &["state-anywhere"], &["fmi2GetFMUstate", "InitializationMode"]),
    ("an error is for ever", &["state-after-error"], &["this call is not allowed now", "from before an error"]),
    ("no derivative", &["directional-derivative"], &["none of 1 derivatives is given"]),
    ("a wrong derivative", &["directional-derivative"], &["expected the derivative of `y` with respect to `u` to be 5.0", "found 6.0"]),
    ("a slope is refused", &["time-derivative"], &["fmi2SetRealInputDerivatives", "not supported"]),
    ("the step size is ignored", &["step-size"], &["the size of the step is ignored", "`y`"]),
    ("chance", &[], &[]),
    ("a reset forgets to reset", &["reset"], &["`y`", "t = 1 s"]),
    ("state is shared", &["instances", "state-restore", "state-serialise", "state-after-error"], &["`y`"]),
    ("a state forgets", &["state-restore", "state-serialise", "state-after-error"], &["`y`", "t = 3 s"]),
    ("bytes forget", &["state-serialise"], &["`y`"]),
    ("one step size only", &["step-size"], &["fmi2DoStep of 0.05 s from t = 1 s returned fmi2Error", "I step by 0.1 s"]),
    ("a GUID as a format", &["guid"], &[]),
    ("a name as a format", &["logger"], &[]),
    ("a category that is not declared", &[], &[]),
    ("an unknown reference is accepted", &["unknown-references"], &["expected fmi2Error, found success: fmi2GetReal of"]),
    ("the component is the environment of messages", &["logger"], &["`componentEnvironment`"]),
    ("the run ends early", &[], &[]),
    ("a step is discarded", &["whole-experiment"], &["fmi2DoStep of 0.1 s from t = 2.2 s returned fmi2Discard"]),
    ("logging that nobody wants", &[], &[]),
    ("a category is refused", &["log-categories"], &["\"logAll\" returned fmi2Error"]),
    ("a kilobyte is lost", &["memory"], &["bytes per instance over 10000 instances"]),
];

fn each_deviation_fails_exactly_the_rules_it_breaks() {
    let wrong: Vec<_> = DEVIATIONS.iter().filter_map(|deviation| look_at(*deviation)).collect();
    assert!(wrong.is_empty(), "{}", wrong.join("\n\n"));
}

/// The rules that only wrong callers notice.
const ROBUST: [&str; 5] = ["guid", "call-order", "illegal-access", "unknown-references", "stop-time"];

/// The difference from the expected findings, if any.
fn look_at((deviation, broken, says): (&str, &[&str], &[&str])) -> Option<String> {
    let lab = Lab::new();
    lab.write("deviate.fmu", deviate(&[&format!("-DBREAKS=\"{deviation}\"")]));
    let (findings, code) = conform(&lab, "deviate.fmu", "60");
    let failed = findings.iter().filter(|[_, outcome, _]| outcome == "fail").collect::<Vec<_>>();
    let detail = failed.first().map(|[.., detail]| detail.as_str()).unwrap_or_default();
    let right = rules(&findings, "fail") == broken
        && code == Some(i32::from(broken.iter().any(|rule| !ROBUST.contains(rule))))
        && says.iter().all(|word| detail.contains(word));
    (!right).then(|| format!("{deviation}: expected {broken:?} with {says:?}, found {failed:#?}"))
}

fn a_crash_or_a_hang_fails_one_rule_and_the_others_continue() {
    let limit = limit(1.0).to_string();
    let hangs = format!("did not end within {limit} s during fmi2DoStep at t = 1 s");
    for (deviation, says) in [
        ("a crash", "during reading the outputs at t = 1 s; it printed: node `"),
        ("a step takes for ever", &hangs),
    ] {
        let lab = Lab::new();
        lab.write("deviate.fmu", deviate(&[&format!("-DBREAKS=\"{deviation}\"")]));
        let (findings, code) = conform(&lab, "deviate.fmu", &limit);
        assert_eq!(code, Some(1));
        let finite = findings.iter().find(|[rule, ..]| rule == "finite").expect("the rule");
        assert!(finite[1] == "fail" && finite[2].contains(says), "{finite:?}");
        let passed = rules(&findings, "pass");
        assert!(["version", "guid", "log-categories"].iter().all(|rule| passed.contains(rule)));
    }
}

/// The FMU removes them itself, so that they vanish at the same time in every run; then it ends the process.
fn vanished_temporary_files_are_no_fault_of_the_fmu() {
    let lab = Lab::new();
    lab.write("deviate.fmu", deviate(&["-DBREAKS=\"the temporary files vanish\""]));
    let (findings, code) = conform(&lab, "deviate.fmu", "60");
    assert_eq!((code, rules(&findings, "fail")), (Some(3), Vec::new()), "{findings:#?}");
    let unknown = rules(&findings, "not_judged");
    assert!(["finite", "state-restore", "memory"].iter().all(|rule| unknown.contains(rule)));
    let passed = rules(&findings, "pass");
    assert!(["version", "start-values"].iter().all(|rule| passed.contains(rule)), "{findings:#?}");
    let ended = lab.trackside(&["conform", "deviate.fmu"]).expect(3);
    let memory = "ERR   memory                  could not be judged: the temporary folder was removed";
    assert!(ended.stdout.contains(memory), "{}", ended.stdout);
}

/// What the standard does not forbid.
fn what_the_standard_leaves_open_gives_a_warning() {
    for (deviation, of, told) in [
        ("a gap in time is accepted", "step-start", "warning: after t = 3 s a step from 4 s was accepted"),
        ("chance", "deterministic", "warning: `y` differ between two fresh instances"),
        ("logging that nobody wants", "logger", "warning: loggingOn is false, and it logs"),
    ] {
        let lab = Lab::new();
        lab.write("deviate.fmu", deviate(&[&format!("-DBREAKS=\"{deviation}\"")]));
        let (findings, code) = conform(&lab, "deviate.fmu", "60");
        assert_eq!((code, rules(&findings, "fail")), (Some(0), Vec::new()));
        let warned = findings.iter().filter(|[rule, _, detail]| rule == of && detail.contains(told));
        assert_eq!(warned.count(), 1, "{findings:#?}");
    }
}

fn an_unloadable_library_makes_the_other_rules_not_applicable() {
    let lab = Lab::new();
    lab.write("deviate.fmu", deviate(&["-Dfmi2Reset=absent", "-Dfmi2GetStatus=too"]));
    let (findings, code) = conform(&lab, "deviate.fmu", "60");
    assert_eq!((code, rules(&findings, "fail")), (Some(1), vec!["symbols"]));
    let symbols = findings.iter().find(|[rule, ..]| rule == "symbols").expect("the rule");
    assert_eq!(symbols[2], "the library lacks fmi2Reset, fmi2GetStatus");
    assert_eq!(rules(&findings, "not_applicable").len(), 27);

    let fmu = lab.write("deviate.fmu", deviate(&[]));
    let elsewhere = |name: &str, bytes| Some((name.replace("linux64", "win64"), bytes));
    lab.write("other.fmu", changed(&fmu, elsewhere));
    let (findings, code) = conform(&lab, "other.fmu", "60");
    let read = ["schema", "description", "capabilities", "cross-references"];
    assert_eq!((code, rules(&findings, "pass")), (Some(1), read.to_vec()));
    assert!(
        findings.iter().any(|it| it[2].contains("found binaries/win64/deviate.so; export")),
        "{findings:#?}"
    );
}

/// The FMU with a text of its description replaced.
fn described(lab: &Lab, from: &str, to: &str) {
    let fmu = lab.write("deviate.fmu", deviate(&[]));
    let replace = |name: &str, bytes: Vec<u8>| match name.ends_with(".xml") {
        true => {
            let text = String::from_utf8(bytes).expect("a text");
            assert!(text.contains(from), "{from}");
            Some((name.to_owned(), text.replace(from, to).into_bytes()))
        }
        false => Some((name.to_owned(), bytes)),
    };
    lab.write("changed.fmu", changed(&fmu, replace));
}

fn an_invalid_model_description_is_explained() {
    let lab = Lab::new();
    described(&lab, "<Boolean start=\"false\"/>", "<Boolean/>");
    let (findings, code) = conform(&lab, "changed.fmu", "60");
    assert_eq!((code, rules(&findings, "fail")), (Some(1), vec!["description"]));
    assert!(findings[1][2].contains("`on` in line 13: it needs a start value"), "{findings:#?}");
    described(&lab, "<Real start=\"0\" min=\"-1\"", "<Real start=\"7\" min=\"-1\"");
    let (findings, code) = conform(&lab, "changed.fmu", "60");
    assert_eq!((code, rules(&findings, "fail")), (Some(1), vec!["description"]));
    assert!(findings[1][2].contains("`u` in line 12: its start value 7 is above its max 1"), "{findings:#?}");
    // `y` follows `u` at once.
    described(&lab, "<Outputs><Unknown index=\"1\"/>", "<Outputs><Unknown index=\"1\" dependencies=\"\"/>");
    let (findings, code) = conform(&lab, "changed.fmu", "60");
    assert_eq!((code, rules(&findings, "fail")), (Some(1), vec!["dependencies"]));
    assert!(findings.iter().any(|it| it[2].contains("`y` follows `u`")), "{findings:#?}");
}

fn rules_for_undeclared_capabilities_are_not_applicable() {
    for (flag, rules_of_it, broken) in [
        ("canHandleVariableCommunicationStepSize", &["step-size"][..], &[][..]),
        // A state that is turned into bytes is one that can be taken.
        (
            "canGetAndSetFMUstate",
            &["state-restore", "state-anywhere", "state-after-error"],
            &["capabilities"],
        ),
        ("providesDirectionalDerivative", &["directional-derivative"], &[]),
        ("canInterpolateInputs", &["time-derivative"], &[]),
        ("canSerializeFMUstate", &["state-serialise"], &[]),
    ] {
        let lab = Lab::new();
        described(&lab, &format!("{flag}=\"true\""), "");
        let (findings, code) = conform(&lab, "changed.fmu", "60");
        assert_eq!((code, rules(&findings, "fail")), (Some(i32::from(!broken.is_empty())), broken.to_vec()));
        let expected = [rules_of_it, &["reference-results"]].concat();
        assert_eq!(rules(&findings, "not_applicable"), expected);
    }
}

fn a_single_instance_fmu_is_judged_and_run_with_one_instance() {
    let lab = Lab::new();
    let once = "canBeInstantiatedOnlyOncePerProcess";
    described(&lab, &format!("{once}=\"false\""), &format!("{once}=\"true\""));
    let (findings, code) = conform(&lab, "changed.fmu", "60");
    let several = [
        "call-order",
        "variable-access",
        "illegal-access",
        "unknown-references",
        "deterministic",
        "instances",
        "state-anywhere",
        "step-size",
        "logger",
        "memory",
        "reference-results",
    ];
    assert_eq!((code, rules(&findings, "not_applicable")), (Some(0), several.to_vec()));

    let one = Scenario::new().time(0.1, 1.0).fmu("a", "changed.fmu", "u = 0.1, on = true");
    let two = one.clone().fmu("b", "changed.fmu", "u = 0.1, on = true");
    lab.write("one.toml", one.text());
    lab.trackside(&["run", "one.toml", "--out", "one"]).expect(0);
    lab.write("two.toml", two.text());
    let ended = lab.trackside(&["run", "two.toml", "--out", "two"]).expect(2);
    ended.says(&["`a` and `b`", once, "two.toml:"]);
}

fn a_file_other_than_an_fmu_is_rejected() {
    let lab = Lab::new();
    lab.write("no.fmu", "no archive");
    lab.trackside(&["conform", "no.fmu"]).expect(2).says(&["no.fmu is not an .fmu archive"]);
    lab.trackside(&["conform", "absent.fmu"]).expect(2).says(&["cannot read absent.fmu"]);
}

fn inspect_prints_json() {
    let lab = Lab::new();
    lab.write("deviate.fmu", deviate(&[]));
    let ended = lab.trackside(&["inspect", "deviate.fmu", "--json"]).expect(0);
    let json: serde_json::Value = serde_json::from_str(&ended.stdout).expect("JSON");
    assert_eq!((&json["model"], &json["default_step"]), (&"deviate".into(), &0.1.into()));
    let input = &json["variables"][2];
    for (key, value) in [("name", "u"), ("type", "Real"), ("causality", "input"), ("start", "0")] {
        assert_eq!(input[key], value, "{input:#}");
    }
    assert_eq!((&input["min"], &input["max"]), (&(-1.0).into(), &1.0.into()));
}

/// An FMU of another tool computes correctly but hardly checks its calls: only the rules on calls may fail.
fn an_fmu_made_in_python_fails_only_known_rules() {
    let python = python();
    let lab = Lab::new();
    let [_, _, archive] = python.fmus(&lab.path("made"));
    let mut command = trackside(&lab.path(""));
    command.args(["conform", &archive, "--json"]).env("TRACKSIDE_PYTHON", python.program());
    let (findings, code) = read(Ended::of(command.output().expect("it starts")));
    let broken = [
        "description",        // no InitialUnknowns
        "guid",               // not looked at
        "call-order",         // neither is the state of the instance
        "illegal-access",     // so that an output can be set
        "unknown-references", // fmi2Fatal, for something that concerns nobody else
        "stop-time",          // not looked at
        "memory",             // some kilobytes for each instance
    ];
    assert_eq!((code, rules(&findings, "fail")), (Some(1), broken.to_vec()), "{findings:#?}");
    let unclaimed = [
        "state-restore",
        "state-serialise",
        "state-anywhere",
        "state-after-error",
        "directional-derivative",
        "time-derivative",
        "reference-results",
    ];
    assert_eq!(rules(&findings, "not_applicable"), unclaimed);
}
