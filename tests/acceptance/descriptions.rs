//! Runs FMUs whose descriptions break the standard where they have one safe meaning, and tells what was read and what to write.

use super::fixture::Scenario;
use super::fmus::{changed, compile, deviate, misbehave, ours};
use super::harness::{Ended, Lab};
use super::requirement::cases;

tests! {
    a_description_against_the_standard_runs_with_a_warning: Compiler,
    what_has_no_meaning_is_refused_with_its_line: Compiler,
    descriptions_in_old_encodings_are_read: Compiler,
    a_start_time_that_is_not_used_is_told: Compiler,
    an_fmu_of_one_step_says_which: Compiler,
    an_fmu_that_refuses_the_event_mode_it_declares_runs_without,
    outputs_that_no_node_takes_are_not_read_before_the_first_step: Compiler,
    an_fmu_without_a_library_says_what_it_has: Compiler,
    conform_tells_that_nothing_ran: Compiler,
    descriptions_of_others_run_or_name_the_cause: Cases,
}

/// The FMU with its description changed by hand.
fn described(fmu: &[u8], change: impl Fn(String) -> Vec<u8>) -> Vec<u8> {
    let lab = Lab::new();
    let path = lab.write("x.fmu", fmu);
    changed(&path, |name, bytes| {
        let text = || String::from_utf8_lossy(&bytes).into_owned();
        let bytes = if name.ends_with(".xml") { change(text()) } else { bytes.clone() };
        Some((name.to_owned(), bytes))
    })
}

/// `misbehave` with a part of its description replaced.
fn replaced(from: &str, to: &str) -> Vec<u8> {
    described(misbehave(), |text| {
        assert!(text.contains(from), "{from}");
        text.replacen(from, to, 1).into_bytes()
    })
}

fn scenario() -> Scenario {
    let nodes = Scenario::new().time(0.1, 1.0).fmu("tank", "tank.fmu", "u = 0.0");
    nodes.key("unit = { y = 's' }").check("clock", "abs(tank.y - time) < 1e-9")
}

fn run(fmu: Vec<u8>, text: &str) -> (Lab, Ended) {
    let lab = Lab::new();
    lab.write("tank.fmu", fmu);
    lab.write("case.toml", text);
    let ended = lab.trackside(&["run", "case.toml", "--out", "out"]);
    (lab, ended)
}

/// A part of the description of `misbehave`, what takes its place, and what the run says.
#[rustfmt::skip]
const READ: &[(&str, &str, &str)] = &[
    ("causality=\"parameter\" variability=\"fixed\"><Real", "causality=\"parameter\"><Real", "`at` in line 6: causality=\"parameter\" excludes variability=\"continuous\", which counts where none is written: read as \"fixed\""),
    ("causality=\"input\"", "causality=\"Input\"", "`u` in line 10: causality=\"Input\" is no word of FMI 2.0: read as \"input\""),
    ("dependencies=\"\"", "dependencies=\"6\" dependenciesKind=\"independent\"", "`y` in line 13: dependenciesKind: \"independent\" is no word of FMI 2.0: the kinds are left out"),
    ("dependencies=\"\"", "dependencies=\"6 5\" dependenciesKind=\"fixed\"", "`y` in line 13: the words of dependenciesKind are 1, of dependencies 2"),
    ("dependencies=\"\"", "dependencies=\"0\"", "`y` in line 13: the dependency \"0\" is none of the 6 variables: it is taken to follow all inputs"),
    ("dependencies=\"\"", "dependencies=\"99999\"", "the dependency \"99999\" is none of the 6 variables"),
    ("index=\"1\"", "index=\"0\"", "line 13: index=\"0\" is none of the 6 variables: it is left out"),
    ("index=\"1\"", "index=\"77\"", "line 13: index=\"77\" is none of the 6 variables: it is left out"),
    ("<ModelStructure>", "<!-- ", "it lacks <ModelStructure>: each output is taken to follow all inputs"),
    ("<ModelVariables>", "<!-- <!DOCTYPE html> --><ModelVariables>", ""),
    ("dependencies=\"\"", "dependencies=\"6&#10; 5\"", ""),
    ("<ModelVariables>", "<TypeDefinitions><SimpleType name=\"z\"><Integer min=\"1e3\"/></SimpleType></TypeDefinitions><ModelVariables>", "`z` in line 4: min=\"1e3\" is no value of <Integer>, and no variable has this type: left out"),
];

fn a_description_against_the_standard_runs_with_a_warning() {
    for (from, to, told) in READ {
        let fmu = match *to {
            "<!-- " => described(misbehave(), |text| {
                text.replace(from, "<!--").replace("</ModelStructure>", "-->").into_bytes()
            }),
            to => replaced(from, to),
        };
        let (lab, ended) = run(fmu, &scenario().text());
        ended.expect(0).says(&[told]);
        let warnings = lab.report("out")["warnings"].clone();
        let count = usize::from(!told.is_empty());
        assert_eq!(warnings.as_array().map(Vec::len), Some(count), "{to}: {warnings}");
        let shown = lab.trackside(&["inspect", "tank.fmu"]).expect(0).stdout;
        assert!(shown.contains(told) && shown.contains("read otherwise: ") != told.is_empty());
    }
}

fn what_has_no_meaning_is_refused_with_its_line() {
    for (from, to, told) in [
        ("\"input\"", "\"inlet\"", "`u` in line 10: causality=\"inlet\" is no word of FMI 2.0"),
        ("<Real start=\"0\"/></Sc", "</Sc", "`at` in line 6: missing variable type element"),
        ("<fmiM", "<!DOCTYPE a><fmiM", "line 2: expected no document type declaration"),
    ] {
        let (lab, ended) = run(replaced(from, to), &scenario().text());
        ended.expect(2).says(&[told]);
        assert!(!lab.has("out"));
        lab.trackside(&["inspect", "tank.fmu"]).expect(2).says(&[told]);
    }
}

fn descriptions_in_old_encodings_are_read() {
    let text = |text: String, encoding: &str| {
        text.replace("UTF-8", encoding).replace("<Real/>", "<Real quantity=\"Höhe\"/>")
    };
    let latin =
        described(misbehave(), |it| text(it, "ISO-8859-1").chars().map(|letter| letter as u8).collect());
    let wide = described(misbehave(), |it| {
        let text = "\u{feff}".to_owned() + &text(it, "UTF-16");
        text.encode_utf16().flat_map(u16::to_le_bytes).collect()
    });
    for (fmu, encoding) in [(latin, "ISO-8859-1"), (wide, "UTF-16")] {
        let (lab, ended) = run(fmu, &scenario().text());
        let told = format!("line 1: expected the encoding UTF-8, found {encoding}: read as {encoding}");
        ended.expect(0).says(&[&told]);
        let judged = lab.trackside(&["conform", "tank.fmu"]);
        assert!(judged.stdout.contains(&told), "{}", judged.stdout);
    }
}

/// The description of `deviate` starts at 1 s.
fn a_start_time_that_is_not_used_is_told() {
    let case = |start: &str| {
        let text = format!("[time]\nstep = 0.1\nstop = 2.0\n{start}");
        let nodes = Scenario::headed(&text).fmu("tank", "tank.fmu", "u = 0.0, on = false");
        run(deviate(&[]), &nodes.text())
    };
    let (lab, ended) = case("");
    let told = "`tank`: the run starts at 0 s, and the description of tank.fmu at 1 s: write `start = 1` in [time], with a `stop` after it, to start there";
    ended.expect(0).says(&[told]);
    assert_eq!(lab.report("out")["warnings"], serde_json::json!([told]));
    let (lab, ended) = case("start = 1.0");
    ended.expect(0);
    assert_eq!(lab.report("out")["warnings"], serde_json::json!([]));
}

fn an_fmu_of_one_step_says_which() {
    let one = |fixed: &str| {
        described(&compile(&["-DONE_STEP=0.02"]), |text| {
            let experiment = "<DefaultExperiment stepSize=\"0.02\"/><ModelVariables>";
            let text = text.replace("<ModelVariables>", experiment);
            text.replace("StepSize=\"true\"", fixed).into_bytes()
        })
    };
    let text = scenario().text();
    let told = "its description proposes steps of 0.02 s and allows no others (canHandleVariableCommunicationStepSize): write `step = 0.02` in its [[fmu]], or in [time]";
    let (_, ended) = run(one("StepSize=\"false\""), &text);
    ended.expect(3).says(&["node `tank`: fmi2DoStep at t = 0 s returned fmi2Error", told]);
    let (_, ended) = run(one("StepSize=\"true\""), &text);
    assert!(!ended.expect(3).stderr.contains("its description proposes"));
    let (_, ended) = run(one("StepSize=\"false\""), &text.replace("step = 0.1", "step = 0.02"));
    ended.expect(0);
}

fn an_fmu_that_refuses_the_event_mode_it_declares_runs_without() {
    let fmu = std::fs::read(ours().join("plant_fmi3.fmu")).expect("an FMU");
    let declared = described(&fmu, |text| {
        text.replace("<CoSimulation ", "<CoSimulation hasEventMode=\"true\" ").into_bytes()
    });
    let nodes = Scenario::new().time(0.01, 0.1).fmu("plant", "tank.fmu", "delta = 0.1, F_x = 0.0");
    let (plain, ended) = run(fmu, &nodes.clone().text());
    ended.expect(0);
    let (lab, ended) = run(declared, &nodes.text());
    ended.expect(0);
    let rows = |lab: &Lab| lab.report("out")["steps"].clone();
    assert_eq!(rows(&lab), rows(&plain));
}

fn outputs_that_no_node_takes_are_not_read_before_the_first_step() {
    let start = "u = 0.0, fault = 'shows nothing before the first step'";
    let text = scenario().text().replace("u = 0.0", start);
    run(misbehave().to_vec(), &text).1.expect(0);
    let other = Scenario::new().fmu("other", "tank.fmu", "").key("unit = { u = 's' }").text();
    let led = format!("{text}\n{other}\n[[connect]]\nfrom = 'tank.y'\nto = 'other.u'\n");
    let (_, ended) = run(misbehave().to_vec(), &led);
    ended.expect(3).says(&["node `tank`: fmi2GetReal at t = 0 s returned fmi2Error"]);
}

fn an_fmu_without_a_library_says_what_it_has() {
    let moved = |to: &'static str| {
        let lab = Lab::new();
        let path = lab.write("x.fmu", misbehave());
        changed(&path, |name, bytes| {
            let name = if name.ends_with(".so") { to } else { name };
            Some((name.to_owned(), bytes))
        })
    };
    let (lab, ended) = run(moved("binaries/linux32/misbehave.so"), &scenario().text());
    let told = [
        "expected binaries/linux64/misbehave.so, found binaries/linux32/misbehave.so",
        "export the FMU for this platform",
    ];
    ended.expect(2).says(&told);
    let conform = lab.trackside(&["conform", "tank.fmu"]).expect(1).stdout;
    assert!(told.iter().all(|part| conform.contains(part)), "{conform}");
    assert!(conform.contains("Nothing of the FMU ran"), "{conform}");
    let (_, ended) = run(moved("binaries/darwin64/misbehave.dylib"), &scenario().text());
    ended.expect(2).says(&["found binaries/darwin64/misbehave.dylib; export the FMU for this platform"]);
}

fn conform_tells_that_nothing_ran() {
    let lab = Lab::new();
    lab.write("x.fmu", replaced("\"input\"", "\"inlet\""));
    let told = lab.trackside(&["conform", "x.fmu"]).expect(1).stdout;
    assert!(told.contains("Nothing of the FMU ran"), "{told}");
    assert!(!told.contains("The FMU runs"), "{told}");
    // One cause of many failures stands in the conclusion.
    let stranger = |text: String| text.replace("{deviate}", "{another}").into_bytes();
    lab.write("x.fmu", described(&deviate(&[]), stranger));
    let told = lab.trackside(&["conform", "x.fmu"]).expect(1).stdout;
    let conclusion = told.lines().last().expect("a conclusion");
    assert!(conclusion.contains("rules have one cause: fmi2Instantiate"), "{conclusion}");
}

/// A scenario of a folder of `cases`, its exit code, and what it says.
#[rustfmt::skip]
const CASES: &[(&str, i32, &str)] = &[
    ("bad_structure/dep0.toml", 0, "`y` in line 13: the dependency \"0\" is none of the 3 variables"),
    ("bad_structure/dep_far.toml", 0, "`y` in line 13: the dependency \"99999\" is none of the 3 variables"),
    ("bad_structure/dep_kind.toml", 0, "`y` in line 13: the words of dependenciesKind are 1, of dependencies 2"),
    ("bad_structure/dep_newline.toml", 0, ""),
    ("bad_structure/index0.toml", 0, "line 13: index=\"0\" is none of the 3 variables"),
    ("bad_structure/index_far.toml", 0, "line 13: index=\"77\" is none of the 3 variables"),
    ("bad_structure/kind_unknown.toml", 0, "`y` in line 13: dependenciesKind: \"independent\" is no word of FMI 2.0"),
    ("bad_structure/no_structure.toml", 0, "line 2: it lacks <ModelStructure>"),
    ("dead_letters/vendor_ns.toml", 0, ""),
    ("dead_letters/ns_root.toml", 0, ""),
    ("dead_letters/comment_doctype.toml", 0, ""),
    ("dead_letters/cdata_html.toml", 0, ""),
    ("fixed_step/case.toml", 3, "its description proposes steps of 0.02 s"),
    ("illegal_variability/case.toml", 0, "`gain` in line 12: causality=\"parameter\" excludes variability=\"continuous\""),
    ("latin1/case.toml", 0, "found ISO-8859-1: read as ISO-8859-1"),
    ("utf16/case.toml", 0, "found UTF-16: read as UTF-16"),
    ("sources_only/case.toml", 0, "sources_only.fmu: its sources were compiled "),
    ("start_time/case.toml", 0, ""),
    ("start_time/without.toml", 0, "the run starts at 0 s, and the description of start_time.fmu at 100.2 s"),
];

fn descriptions_of_others_run_or_name_the_cause() {
    for (case, code, told) in CASES {
        let (folder, scenario) = case.split_once('/').expect("a folder and a file");
        let lab = Lab::new();
        for entry in std::fs::read_dir(cases().join(folder)).expect("a folder") {
            lab.add(&entry.expect("a file").path());
        }
        let ended = lab.trackside(&["run", scenario, "--out", "out"]);
        assert_eq!(ended.code(), Some(*code), "{case}: {}\n{}", ended.stdout, ended.stderr);
        ended.says(&[told]);
    }
}
