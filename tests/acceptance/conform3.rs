//! Checks `trackside conform` for FMI 3.0, for references in archives, and for descriptions that cannot be read.

use super::conform::{conform, rules};
use super::fmus::{changed, deviate3, ours};
use super::harness::Lab;
use super::requirement::reference_fmus;

tests! {
    our_fmus_of_fmi_3_pass_every_rule,
    each_deviation_of_fmi_3_fails_exactly_the_rules_it_breaks: Compiler,
    each_mistake_in_a_description_of_fmi_3_fails_its_rule: Compiler,
    an_fmu_that_has_no_event_mode_refuses_it: Compiler,
    terminals_name_variables: Compiler,
    references_in_the_archive_are_run_and_compared: Compiler,
    a_description_that_cannot_be_read_is_judged_by_its_text: Compiler,
    reference_fmus_of_fmi_3_get_their_verdicts: ReferenceFmus,
    an_fmu_without_co_simulation_is_no_failed_rule: ReferenceFmus,
}

fn our_fmus_of_fmi_3_pass_every_rule() {
    for (name, passed) in [("plant", 36), ("controller", 35), ("estimator", 35)] {
        let lab = Lab::new();
        lab.add(&ours().join(format!("{name}_fmi3.fmu")));
        let ended = lab.trackside(&["conform", &format!("{name}_fmi3.fmu")]).expect(0);
        let counted = format!(
            "{passed} passed, 0 failed, {} not applicable\nThe FMU keeps FMI 3.0 for callers that do.\n",
            41 - passed
        );
        assert!(ended.stdout.ends_with(&counted), "{}", ended.stdout);
    }
}

/// A deviation, the rules it breaks, and a part of the finding on the first of them.
#[rustfmt::skip]
const DEVIATIONS: &[(&str, &[&str], &str)] = &[
    ("nothing", &[], ""),
    ("another version", &["version"], "expected \"3.0\", found \"2.0\""),
    ("any token is accepted", &["guid"], "{deviate3}"),
    ("illegal calls are accepted", &["call-order", "illegal-access"], "expected fmi3Error, found success: fmi3ExitConfigurationMode in Instantiated"),
    ("another start value", &["start-values"], "`gain` before the initialization: expected 2, found 2.5"),
    ("no number", &["finite"], "`y` is NaN at t = 4.1 s"),
    ("an output can be set", &["illegal-access"], "found success: `y` (Continuous Output) in Instantiated"),
    ("a fixed parameter moves", &["illegal-access"], "found success: `gain` (Fixed Parameter) in StepMode"),
    ("an input is refused", &["variable-access"], "`u` (Continuous Input) in InitializationMode returned fmi3Error; it says: not this input"),
    ("an unknown reference is read", &["unknown-references", "wrong-type"], "ended with exit code 3 during fmi3GetFloat64 of the reference 9"),
    ("an unknown reference is accepted", &["unknown-references", "wrong-type"], "found success: fmi3GetFloat64 of 9"),
    ("another type is read", &["wrong-type"], "found success: fmi3GetFloat32 of `y`, a Float64"),
    ("another number of values is accepted", &["wrong-count"], "found success: reading 2 values of `y`, which has 1"),
    ("the stop time is passed", &["stop-time"], "3.050000 s as the stop time"),
    ("the last step is refused", &["whole-experiment"], "this is too close to the stop time"),
    ("no derivative", &["directional-derivative", "adjoint-derivative"], "none of 9 derivatives is given"),
    ("a wrong derivative", &["directional-derivative"], "found 6.0"),
    ("a wrong adjoint derivative", &["adjoint-derivative"], "found 6.0"),
    ("no slope", &["time-derivative"], "fmi3GetOutputDerivatives returned fmi3Error"),
    ("the step size is ignored", &["step-size"], "the size of the step is ignored"),
    ("chance", &[], ""),
    ("a reset forgets to reset", &["reset"], "t = 1 s"),
    ("state is shared", &["instances", "state-restore", "state-serialise", "state-after-error"], "`y`"),
    ("a state forgets", &["state-restore", "state-serialise", "state-after-error"], "t = 3 s"),
    ("bytes forget", &["state-serialise"], "`y`"),
    ("an error is for ever", &["state-after-error"], "with a state from before an error"),
    ("no state before the first step", &["state-anywhere"], "InitializationMode"),
    ("one step size only", &["step-size"], "I step by 0.1 s"),
    ("a category is refused", &["log-categories"], "fmi3SetDebugLogging of \"logAll\" returned fmi3Error"),
    ("a category that is not declared", &[], ""),
    ("logging that nobody wants", &[], ""),
    ("a kilobyte is lost", &["memory"], "bytes per instance over 10000 instances"),
    ("arrays keep their size", &["configuration"], "expected `v` to have 3 values in place of 2"),
    ("event mode is refused", &["event-mode"], "fmi3InstantiateCoSimulation returned no instance"),
    ("event mode never rests", &["event-mode"], "more than 1000 updates"),
];

/// The rules that only wrong callers notice.
const ROBUST: [&str; 8] = [
    "guid",
    "call-order",
    "illegal-access",
    "unknown-references",
    "wrong-type",
    "wrong-count",
    "stop-time",
    "event-mode-refused",
];

fn each_deviation_of_fmi_3_fails_exactly_the_rules_it_breaks() {
    let wrong = DEVIATIONS.iter().filter_map(|(deviation, broken, says)| {
        let lab = Lab::new();
        lab.write("deviate3.fmu", deviate3(&[&format!("-DBREAKS=\"{deviation}\"")]));
        let (findings, code) = conform(&lab, "deviate3.fmu", "60");
        let failed: Vec<_> = findings.iter().filter(|it| it[1] == "fail").collect();
        let grave = broken.iter().any(|rule| !ROBUST.contains(rule));
        let right = rules(&findings, "fail") == *broken
            && code == Some(i32::from(grave))
            && failed.first().is_none_or(|first| first[2].contains(says));
        (!right).then(|| format!("{deviation}: expected {broken:?} with {says:?}, found {failed:#?}"))
    });
    let wrong: Vec<_> = wrong.collect();
    assert!(wrong.is_empty(), "{}", wrong.join("\n\n"));
}

/// The FMU with its description changed, and with files added.
fn described(lab: &Lab, (from, to): (&str, &str), files: &[(&str, &str)]) {
    let fmu = lab.write("deviate3.fmu", deviate3(&[]));
    let bytes = changed(&fmu, |name, bytes| match name {
        "modelDescription.xml" => {
            let text = String::from_utf8(bytes).expect("a text");
            assert!(text.contains(from), "{from}");
            Some((name.to_owned(), text.replace(from, to).into_bytes()))
        }
        _ => Some((name.to_owned(), bytes)),
    });
    let mut zip = zip::ZipWriter::new_append(std::io::Cursor::new(bytes)).expect("an archive");
    for (name, text) in files {
        zip.start_file(*name, zip::write::SimpleFileOptions::default()).expect("an entry");
        std::io::Write::write_all(&mut zip, text.as_bytes()).expect("an entry");
    }
    lab.write("changed.fmu", zip.finish().expect("an archive").into_inner());
}

#[rustfmt::skip]
const MISTAKES: &[(&str, &str, &str, &str)] = &[
    ("canGetAndSetFMUState=\"true\"", "", "capabilities", "canSerializeFMUState without canGetAndSetFMUState"),
    ("stepSize=\"0.1\"", "stepSize=\"-0.1\"", "capabilities", "line 9: <DefaultExperiment> has a stepSize that is not positive"),
    ("unit=\"m\"/>", "unit=\"ft\"/>", "cross-references", "line 11: <Float64> `y` has the unit \"ft\""),
    ("unit=\"m\"/>", "declaredType=\"T\"/>", "cross-references", "has the type \"T\", which TypeDefinitions lack"),
    ("unit=\"m\"/>", "clocks=\"5\"/>", "cross-references", "has the clock 5, which is no Clock"),
    ("unit=\"m\"/>", "derivative=\"77\"/>", "cross-references", "has derivative 77, which no variable has"),
    ("<Dimension valueReference=\"3\"/></Float64>\n    <Float64 name=\"w\"", "<Dimension start=\"2\" valueReference=\"3\"/></Float64>\n    <Float64 name=\"w\"", "dimensions", "line 15: <Dimension> has both start and valueReference"),
    ("name=\"w\" valueReference=\"8\" causality=\"input\" start=\"0\"", "name=\"w\" valueReference=\"8\" causality=\"input\" start=\"0 0 0\"", "dimensions", "<Float64> `w` has 3 start values for 2 elements"),
    ("valueReference=\"5\" causality=\"output\"", "valueReference=\"0\" causality=\"output\"", "description", "duplicate value reference: 0"),
    ("<Output valueReference=\"0\"/>", "", "description", "`y` in line 11: it is missing in <Outputs> of <ModelStructure>"),
    ("causality=\"input\" start=\"false\"", "causality=\"input\"", "description", "`on` in line 18: it needs a start value"),
    ("<Boolean ", "<Boolean colour=\"red\" ", "schema", "line 18: <Boolean> has no attribute \"colour\""),
];

fn each_mistake_in_a_description_of_fmi_3_fails_its_rule() {
    for (from, to, rule, says) in MISTAKES {
        let lab = Lab::new();
        described(&lab, (from, to), &[]);
        let (findings, _) = conform(&lab, "changed.fmu", "60");
        let finding = findings.iter().find(|it| it[0] == *rule).expect("the rule");
        assert!(finding[1] == "fail" && finding[2].contains(says), "{from}: {finding:?}");
    }
    let lab = Lab::new();
    lab.write("a.fmu", deviate3(&["-Dfmi3GetClock=absent"]));
    let (findings, code) = conform(&lab, "a.fmu", "60");
    assert_eq!((code, rules(&findings, "fail")), (Some(1), vec!["functions"]));
    lab.write("a.fmu", deviate3(&["-Dfmi3Terminate=absent"]));
    let (findings, _) = conform(&lab, "a.fmu", "60");
    assert_eq!(rules(&findings, "fail"), ["symbols"]);
}

fn an_fmu_that_has_no_event_mode_refuses_it() {
    let lab = Lab::new();
    described(&lab, ("hasEventMode=\"true\"", ""), &[]);
    let (findings, code) = conform(&lab, "changed.fmu", "60");
    assert_eq!((code, rules(&findings, "fail")), (Some(0), vec!["event-mode-refused"]));
}

fn terminals_name_variables() {
    for (variable, failed) in [("y", &[][..]), ("z", &["terminals"])] {
        let xml = format!(
            "<fmiTerminalsAndIcons fmiVersion=\"3.0\"><Terminals><Terminal name=\"t\" matchingRule=\"bus\">\
             <TerminalMemberVariable variableName=\"{variable}\" memberName=\"m\" variableKind=\"signal\"/></Terminal></Terminals>\
             </fmiTerminalsAndIcons>"
        );
        let lab = Lab::new();
        described(&lab, ("m", "m"), &[("terminalsAndIcons/terminalsAndIcons.xml", &xml)]);
        let (findings, _) = conform(&lab, "changed.fmu", "60");
        assert_eq!(rules(&findings, "fail"), failed);
    }
}

/// y = x + u / 2 and x' = gain * u: with u = t - 1 held over each step, a gain of 4, and steps of 0.5 s.
fn references_in_the_archive_are_run_and_compared() {
    let folder = "extra/org.fmi-standard.fmi-ls-ref/";
    let path = |name: &str| format!("{folder}{name}");
    let manifest = "<fmiReferences><Experiment name='ramp' startTime='1' stopTime='2' stepSize='0.5'>\
                    <Parameters source='set.ssv'/><Stimuli source='in.csv'/><References source='out.csv'/></Experiment>\
                    <Experiment name='other'><Stimuli source='in.csv'/><References source='bad.csv'/></Experiment>\
                    <Related role='result' source='absent.csv' type='text/csv'/></fmiReferences>";
    let set = "<ParameterSet><Parameters><Parameter name='gain'><Real value='4'/></Parameter></Parameters></ParameterSet>";
    let files = [
        (path("fmi-ls-manifest.xml"), manifest.to_owned()),
        (path("set.ssv"), set.to_owned()),
        (path("in.csv"), "time,u\n1,0\n2,1\n".to_owned()),
        // x is 0, 0, 1; u at the last step is 0.5.
        (
            path("out.csv"),
            "time,y,v,steps,label\n1,0,0 0,0,tank\n1.5,0.0,0 0,1,tank\n2,1.25,1 1,2,tank\n".to_owned(),
        ),
        (path("bad.csv"), "time,y\n1,0\n1.1,3\n".to_owned()),
    ];
    let files: Vec<_> = files.iter().map(|it| (it.0.as_str(), it.1.as_str())).collect();
    let lab = Lab::new();
    described(&lab, ("m", "m"), &files);
    let (findings, code) = conform(&lab, "changed.fmu", "60");
    let found: Vec<_> = findings.iter().filter(|it| it[0] == "reference-results").collect();
    assert_eq!((found.len(), code), (3, Some(1)), "{found:#?}");
    for (finding, outcome, says) in [
        (found[0], "pass", "ramp: 3 of 3 rows"),
        (found[1], "fail", "other: expected `y` = 3.0 at t = 1.1 s, found 0.0"),
        (found[2], "not_applicable", "\"absent.csv\", which is not in the archive"),
    ] {
        assert!(finding[1] == outcome && finding[2].contains(says), "{finding:?}");
    }
}

fn a_description_that_cannot_be_read_is_judged_by_its_text() {
    for (from, to, says) in [
        (
            "modelIdentifier=\"deviate3\"",
            "",
            "line 3: <CoSimulation> lacks the attribute \"modelIdentifier\"",
        ),
        (
            "valueReference=\"5\"",
            "valueReference=\"five\"",
            "line 17: valueReference of <Int32>: expected a natural number of 32 bits, found \"five\"",
        ),
        ("</ModelVariables>", "", "line "),
    ] {
        let lab = Lab::new();
        described(&lab, (from, to), &[]);
        let (findings, code) = conform(&lab, "changed.fmu", "60");
        assert_eq!((code, rules(&findings, "fail")), (Some(1), vec!["schema", "description"]));
        assert!(findings[0][2].contains(says), "{}", findings[0][2]);
    }
}

/// Names with the rules that they break: those of callers apart, and each is what the sources of the FMU do.
const REFERENCE: [(&str, &[&str]); 7] = [
    ("BouncingBall", &[]),
    ("Dahlquist", &[]),
    ("Feedthrough", &[]),
    // It claims event mode and refuses it.
    ("Roberts", &["event-mode"]),
    ("Stair", &[]),
    // It counts the one value of a structural parameter as two, and refuses it.
    ("StateSpace", &["configuration"]),
    ("VanDerPol", &[]),
];

fn reference_fmus_of_fmi_3_get_their_verdicts() {
    for (name, broken) in REFERENCE {
        let lab = Lab::new();
        lab.add(&reference_fmus().join(format!("3.0/{name}.fmu")));
        let (findings, code) = conform(&lab, &format!("{name}.fmu"), "60");
        let mut failed = rules(&findings, "fail");
        failed.retain(|rule| !ROBUST.contains(rule));
        assert_eq!((code, failed), (Some(i32::from(!broken.is_empty())), broken.to_vec()), "{name}");
        let compared = findings.iter().filter(|it| it[0] == "reference-results" && it[1] == "pass");
        assert_eq!(compared.count(), usize::from(name != "Roberts"), "{name}");
    }
}

fn an_fmu_without_co_simulation_is_no_failed_rule() {
    let lab = Lab::new();
    lab.add(&reference_fmus().join("3.0/Clocks.fmu"));
    let ended = lab.trackside(&["conform", "Clocks.fmu"]).expect(2);
    ended.says(&["found ScheduledExecution: export the model for co-simulation"]);
}
