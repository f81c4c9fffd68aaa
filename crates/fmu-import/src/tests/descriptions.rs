//! Reads descriptions that break the standard: what has one meaning is corrected and told, what has none is refused.

use super::*;

/// What the description of `XML` with a part replaced was corrected by.
fn corrections(from: &str, to: &str) -> Vec<String> {
    assert!(XML.contains(from), "{from}");
    let found = parse_description(&XML.replacen(from, to, 1), &fmi3::StructuralSizes::new(), None);
    found.expect("a description that is read").corrections
}

/// A part of `XML`, what takes its place, and how the correction begins; none where nothing is wrong.
#[rustfmt::skip]
const CORRECTED: &[(&str, &str, &str)] = &[
    ("variability=\"fixed\"", "", "`n` in line 8: causality=\"parameter\" excludes variability=\"continuous\", which counts where none is written: read as \"fixed\"; the exporter has to write \"fixed\" or \"tunable\""),
    ("\"fixed\"", "\"discrete\"", "`n` in line 8: causality=\"parameter\" excludes variability=\"discrete\": read as \"fixed\""),
    ("\"fixed\"", "\"parameter\"", "`n` in line 8: variability=\"parameter\" is no word of FMI 2.0: read as \"fixed\""),
    ("\"fixed\"", "\"now and then\"", "`n` in line 8: variability=\"now and then\" is no word of FMI 2.0: left out; write one of constant, fixed, "),
    ("causality=\"input\"", "causality=\"Input\"", "`u` in line 6: causality=\"Input\" is no word of FMI 2.0: read as \"input\""),
    ("causality=\"input\"", "causality=\"input\" variability=\"tunable\"", "`u` in line 6: causality=\"input\" excludes variability=\"tunable\": read as \"continuous\"; the exporter has to write \"discrete\" or \"continuous\""),
    ("causality=\"output\"", "causality=\"output\" initial=\"guess\"", "`y` in line 7: initial=\"guess\" is no word of FMI 2.0: left out"),
    ("dependencies=\"1\"", "dependencies=\"1\" dependenciesKind=\"independent\"", "`y` in line 11: dependenciesKind: \"independent\" is no word of FMI 2.0: the kinds are left out"),
    ("dependencies=\"1\"", "dependencies=\"1\" dependenciesKind=\"fixed fixed\"", "`y` in line 11: the words of dependenciesKind are 2, of dependencies 1"),
    ("dependencies=\"1\"", "dependencies=\"0\"", "`y` in line 11: the dependency \"0\" is none of the 3 variables: it is taken to follow all inputs"),
    ("dependencies=\"1\"", "dependencies=\"1 99\" dependenciesKind=\"fixed fixed\"", "`y` in line 11: the dependency \"99\" is none of the 3 variables"),
    ("dependencies=\"1\"", "dependencies=\"1&#10; 3\"", ""),
    ("<Unknown index=\"2\" dep", "<Unknown index=\"0\" dep", "line 11: index=\"0\" is none of the 3 variables: it is left out"),
    ("<Unknown index=\"2\" dep", "<Unknown index=\"-2\" dep", "line 11: index=\"-2\" is none of the 3 variables: it is left out"),
    ("<ModelVariables>", "<TypeDefinitions><SimpleType name=\"Count\"><Integer max=\"4294967295\"/></SimpleType></TypeDefinitions><ModelVariables>", "`Count` in line 5: max=\"4294967295\" is beyond all integers of FMI 2.0: read as no limit"),
    ("<UnitDefinitions>", "<!-- <!DOCTYPE html> --><UnitDefinitions>", ""),
    ("<ModelVariables>", "<VendorAnnotations><Tool name=\"x\"><![CDATA[<!DOCTYPE html><!ENTITY a 'a'>]]></Tool></VendorAnnotations><ModelVariables>", ""),
];

#[test]
fn what_has_one_meaning_is_corrected_and_told() {
    for (from, to, expected) in CORRECTED {
        let told = corrections(from, to);
        match expected.is_empty() {
            true => assert_eq!(told, [""; 0], "{to}"),
            false => assert!(told.len() == 1 && told[0].starts_with(expected), "{to}: {told:#?}"),
        }
    }
}

#[test]
fn an_output_without_known_dependencies_follows_all_inputs() {
    let of = |xml: &str| {
        let found = parse_description(xml, &fmi3::StructuralSizes::new(), None).expect("a description");
        (found.variables[1].dependencies.clone(), found.corrections)
    };
    assert_eq!(of(XML), (Some(vec![0].into()), Vec::new()));
    for wrong in ["0", "4", "x", "1 4"] {
        let (follows, told) = of(&XML.replace("dependencies=\"1\"", &format!("dependencies=\"{wrong}\"")));
        assert!(follows.is_none() && told.len() == 1, "{wrong}: {told:?}");
    }
    let start = XML.find("  <ModelStructure>").expect("it is there");
    let (follows, told) = of(&(XML[..start].to_owned() + "</fmiModelDescription>"));
    assert!(follows.is_none());
    assert_eq!(told, ["line 2: it lacks <ModelStructure>: each output is taken to follow all inputs"]);
}

#[test]
fn a_kind_of_mistake_is_told_once_with_its_count() {
    let variable = |index: usize| {
        format!(
            "<ScalarVariable name=\"p{index}\" valueReference=\"9\" causality=\"parameter\"><Real start=\"1\"/></ScalarVariable>\n"
        )
    };
    let many: String = (0..20_000).map(variable).collect();
    let told = corrections("  </ModelVariables>", &format!("{many}</ModelVariables>"));
    assert_eq!(told.len(), 1);
    let expected = "`p0` in line 9, `p1` in line 10, `p2` in line 11, `p3` in line 12, `p4` in line 13 and 19995 more: causality";
    assert!(told[0].starts_with(expected), "{told:?}");
}

#[test]
fn descriptions_of_fmi_3_are_corrected_alike() {
    let told = |from: &str, to: &str| {
        assert!(XML_3.contains(from), "{from}");
        let found = parse_description(&XML_3.replacen(from, to, 1), &fmi3::StructuralSizes::new(), None)
            .expect("it is read");
        (found.corrections, found.problems)
    };
    let (corrected, _) = told("dependencies=\"2 3\"", "dependencies=\"2 77\"");
    assert_eq!(
        corrected,
        [
            "`y` in line 22: the dependency \"77\" is none of the 10 variables: it is taken to follow all inputs"
        ]
    );
    let (corrected, _) =
        told("<InitialUnknown valueReference=\"4\"/>", "<InitialUnknown valueReference=\"44\"/>");
    assert_eq!(corrected, ["line 22: valueReference=\"44\" is none of the 10 variables: it is left out"]);
    let (corrected, _) = told("variability=\"tunable\" start=\"2\"", "variability=\"discrete\" start=\"2\"");
    assert!(
        corrected[0].starts_with("`n` in line 11: causality=\"structuralParameter\" excludes"),
        "{corrected:?}"
    );
    let (corrected, _) = told("<Clock name=\"c\"", "<Clock initial=\"\" name=\"c\"");
    assert!(corrected[0].starts_with("`c` in line 20: initial=\"\" is no word"), "{corrected:?}");
    let (_, problems) = told("<Output valueReference=\"4\" dependencies=\"2 3\"/>", "");
    assert_eq!(problems, ["`y` in line 15: it is missing in <Outputs> of <ModelStructure>"]);
}

#[test]
fn what_breaks_the_rules_is_told_by_names_in_order() {
    let outputs: String = ["c", "a", "b"]
        .map(|name| format!("<ScalarVariable name=\"{name}\" valueReference=\"9\" causality=\"output\"><Integer/></ScalarVariable>\n"))
        .concat();
    let xml = XML.replace("  </ModelVariables>", &format!("{outputs}</ModelVariables>"));
    let found = parse_description(&xml, &fmi3::StructuralSizes::new(), None).expect("a description");
    let all = "`c` in line 9, `a` in line 10, `b` in line 11";
    assert_eq!(found.corrections, [""; 0]);
    assert_eq!(
        found.problems,
        [
            format!(
                "{all}: only Real variables can be continuous, which counts where no variability is written: write variability=\"discrete\""
            ),
            format!("{all}: it is missing in <Outputs> of <ModelStructure>"),
            format!("{all}: it is missing in <InitialUnknowns> of <ModelStructure>"),
        ]
    );
    let problems = |from: &str, to: &str| {
        parse_description(&XML.replace(from, to), &fmi3::StructuralSizes::new(), None)
            .expect("it is read")
            .problems
    };
    assert_eq!(problems(" start=\"1\"", ""), ["`u` in line 6: it needs a start value"]);
    assert_eq!(
        problems(
            "causality=\"output\"",
            "causality=\"output\" initial=\"calculated\" variability=\"constant\""
        ),
        [
            "`y` in line 7: illegal combination of causality 'Output', variability 'Constant', and initial 'Calculated'"
        ]
    );
}

/// A part of `XML`, what takes its place, and parts of the refusal.
#[rustfmt::skip]
const REFUSED: &[(&str, &str, &[&str])] = &[
    ("causality=\"input\"", "causality=\"inputs\"", &["`u` in line 6: causality=\"inputs\" is no word of FMI 2.0", "one of parameter, calculatedParameter, input, output"]),
    ("<Integer start=\"3\"/>", "", &["`n` in line 8: missing variable type element"]),
    ("valueReference=\"1\"", "valueReference=\"y\"", &["`y` in line 7: illegal value 'y' for attribute 'valueReference'"]),
    ("valueReference=\"1\"", "", &["`y` in line 7: missing required attribute 'valueReference'"]),
    ("<CoSimulation", "<CoSimulation canInterpolateInputs=\"maybe\"", &["line 3: illegal value 'maybe' for attribute 'canInterpolateInputs'"]),
    ("m=\"1\"", "m=\"one\"", &["`m/s` in line 4", "m=\"one\" of <BaseUnit>"]),
    ("<fmiModel", "<!DOCTYPE x>\n<fmiModel", &["line 2: expected no document type declaration", "remove it"]),
    ("</ModelVariables>", "", &["line 14"]),
    ("?>", "?><!-- -- --><", &["line 1"]),
];

#[test]
fn what_can_mean_anything_is_refused_with_its_line() {
    for (from, to, expected) in REFUSED {
        assert!(XML.contains(from), "{from}");
        let refused = parse_description(&XML.replacen(from, to, 1), &fmi3::StructuralSizes::new(), None);
        let Err(ParseError::Broken(what)) = refused else { panic!("{to}: {refused:?}") };
        for part in *expected {
            assert!(what.contains(part), "{to}: {what}");
        }
    }
}

#[test]
fn encodings_are_read_as_declared() {
    let text =
        |declared: &str| XML.replace("UTF-8", declared).replace("modelName=\"m\"", "modelName=\"Höhe €\"");
    let wide = |bytes: fn(u16) -> [u8; 2], mark: &str| -> Vec<u8> {
        (mark.to_owned() + &text("UTF-16")).encode_utf16().flat_map(bytes).collect()
    };
    let narrow = |declared: &str| -> Vec<u8> {
        let byte = |letter: char| if letter == '€' { 0x80 } else { letter as u8 };
        text(declared).chars().map(byte).collect()
    };
    let latin = "line 1: expected the encoding UTF-8, found ISO-8859-1: read as ISO-8859-1";
    let utf16 = "line 1: expected the encoding UTF-8, found UTF-16: read as UTF-16";
    for (bytes, told) in [
        (text("UTF-8").into_bytes(), None),
        (text("utf8").into_bytes(), None),
        (["\u{feff}".as_bytes(), text("UTF-8").as_bytes()].concat(), None),
        (
            text("UTF-16").into_bytes(),
            Some("line 1: it declares UTF-16, and its bytes are UTF-8: read as UTF-8"),
        ),
        (narrow("ISO-8859-1"), Some(latin)),
        (wide(u16::to_le_bytes, "\u{feff}"), Some(utf16)),
        (wide(u16::to_be_bytes, "\u{feff}"), Some(utf16)),
        (wide(u16::to_le_bytes, ""), Some(utf16)),
        (wide(u16::to_be_bytes, ""), Some(utf16)),
    ] {
        let opened = open(&archive(&[("modelDescription.xml", &bytes)])).expect("it is read");
        assert_eq!(opened.description.name, "Höhe €");
        assert_eq!(opened.description.corrections.first().map(String::as_str), told);
        assert!(opened.description_text().expect("a text").contains("Höhe €"));
    }
    let ascii = open(&archive(&[("modelDescription.xml", XML.replace("UTF-8", "ISO-8859-1").as_bytes())]));
    let ascii = ascii.expect("it is read").description;
    assert_eq!(ascii.corrections, [""; 0]);
    assert_eq!(ascii.problems, ["line 1: expected the encoding UTF-8, found ISO-8859-1"]);
    let undeclared = open(&archive(&[("modelDescription.xml", &narrow("UTF-8"))]));
    let expected =
        "line 2: expected UTF-8, found the byte 0xF6, which is `ö` in ISO-8859-1: export the FMU with UTF-8";
    assert!(undeclared.is_err_and(|error| error.contains(expected)));
    let unknown = open(&archive(&[("modelDescription.xml", text("KOI8-R").as_bytes())]));
    assert!(unknown.is_err_and(|error| error.contains("found KOI8-R, which is not read here")));
    let mut half = wide(u16::to_le_bytes, "");
    half.pop();
    let half = open(&archive(&[("modelDescription.xml", &half)]));
    assert!(half.is_err_and(|error| error.contains("UTF-16")));
}

#[test]
fn a_library_that_is_missing_is_told_with_what_there_is() {
    let xml = XML.as_bytes();
    let missing = |others: &[&str]| {
        let others: Vec<_> = others.iter().map(|name| (*name, &b"1"[..])).collect();
        let entries = [&[("modelDescription.xml", xml)], others.as_slice()].concat();
        let opened = open(&archive(&entries)).expect("it is read");
        opened.library_origin().expect_err("no library").to_string()
    };
    for (others, expected) in [
        (&[][..], "found none; export the FMU for this platform"),
        (
            &["binaries/darwin64/m.dylib", "binaries/darwin64/m.a", "binaries/darwin64/a.dylib"],
            "found binaries/darwin64/m.dylib; export",
        ),
        (&["binaries/darwin64/other.dylib"], "found binaries/darwin64/other.dylib; export"),
    ] {
        let told = missing(others);
        assert!(told.contains("expected binaries/") && told.contains(expected), "{told}");
    }
    let sources =
        [("modelDescription.xml", xml), ("sources/m.c", b""), ("sources/m.h", b""), ("sources/a/b.c", b"")];
    let opened = open(&archive(&sources)).expect("it is read");
    let origin = opened.library_origin().expect("a compiler, which this test was built with");
    let LibraryOrigin::Sources(build) = origin else { panic!("{origin:?}") };
    assert!(build.to_string().starts_with("2 files in sources, by "), "{build}");
}

#[test]
fn the_only_library_is_taken_whatever_its_name() {
    let platform = platform::platform_folder(FmiVersion::Two);
    let [one, other] = ["a", "b"].map(|name| format!("binaries/{platform}/{name}.so"));
    let opened = |names: &[&str]| {
        let xml = [("modelDescription.xml", XML.as_bytes())];
        let libraries: Vec<_> = names.iter().map(|name| (*name, &b"1"[..])).collect();
        open(&archive(&[xml.as_slice(), libraries.as_slice()].concat())).expect("it is read")
    };
    let found = opened(&[&one]);
    assert!(found.library_path().expect("a library").ends_with(&one));
    let told = format!(
        "modelIdentifier=\"m\" asks for binaries/{platform}/m.so: {one} is taken, the only library there"
    );
    assert_eq!(found.description.corrections, [told]);
    assert!(opened(&[&one, &other]).library_path().is_err());
}

#[test]
fn an_empty_unit_and_a_dash_are_no_unit() {
    for none in ["", " ", "-"] {
        let own = parse_description(
            &XML.replace("unit=\"m/s\"", &format!("unit=\"{none}\"")),
            &fmi3::StructuralSizes::new(),
            None,
        );
        assert_eq!(own.expect("it is read").variables[0].unit, None, "{none:?}");
        let three = XML_3.replace("name=\"y\"", &format!("name=\"y\" unit=\"{none}\""));
        let three = parse_description(&three, &fmi3::StructuralSizes::new(), None).expect("it is read");
        assert_eq!(three.variables[three.find_variable("y").expect("it is there")].unit, None);
    }
    // A file may define what a dash is.
    let defined = XML.replace("name=\"m/s\"", "name=\"-\"").replace("unit=\"m/s\"", "unit=\"-\"");
    let defined = parse_description(&defined, &fmi3::StructuralSizes::new(), None).expect("it is read");
    assert!(defined.variables[0].dimension.is_some());
}
