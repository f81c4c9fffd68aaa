//! Says what is wrong, where, and what to do.

use super::*;

/// The message about a description whose text was changed.
fn changed(from: &str, to: &str) -> String {
    let text = sample();
    assert!(text.contains(from), "{from}");
    let folder = folder(&[("SystemStructure.ssd", &text.replace(from, to))]);
    open_system(folder.path(), None).expect_err("an error").to_string()
}

/// A small system that uses most of the standard.
pub(super) fn sample() -> String {
    let entry =
        format!(r#"<ssm:MappingEntry source="v" target="sub.c.k">{}</ssm:MappingEntry>"#, linear("2", "1"));
    description(&format!(
        r#"
{}
{}
<ssd:Elements>
{}
<ssd:System name="sub">
{}
<ssd:Elements>{}</ssd:Elements>
<ssd:Connections>{}</ssd:Connections>
</ssd:System>
</ssd:Elements>
<ssd:Connections>
{}
{}
</ssd:Connections>"#,
        connectors(&[("w", "input", "km")]),
        bindings(&[binding("", &set(&[("v", &real("1"))]), &entry)]),
        component("d", &[("u", "input", "mm"), ("y", "output", "m")], ""),
        connectors(&[("u", "input", "m")]),
        component("c", &[("u", "input", "m"), ("k", "parameter", "m")], ""),
        connection("u", "c.u", &linear("3", "4")),
        connection("d.y", "sub.u", ""),
        connection("w", "d.u", ""),
    ))
}

#[test]
fn mistakes_have_places_expectations_and_cures() {
    let cases = [
        (r#"factor="3""#, r#"factor="three""#, "a finite number such as 1.5e-3, found `three`"),
        (r#"factor="3""#, r#"factor="inf""#, "a finite number"),
        ("ssc:LinearTransformation", "ssc:CubicTransformation", "<CubicTransformation>"),
        (r#"endElement="c""#, r#"endElement="e""#, "`e`, the system has `c`"),
        (r#"endConnector="u""#, r#"endConnector="v""#, "`v`, it has"),
        (r#"kind="output""#, r#"kind="outlet""#, "one of input, output"),
        (r#"source="a.fmu""#, r#"source="b.fmu""#, "no such file"),
        (r#"source="a.fmu""#, r#"source="../a.fmu""#, "leaves that folder"),
        (r#"source="a.fmu""#, r#"source="x/..%2F../a.fmu""#, "leaves that folder"),
        (r#"source="a.fmu""#, r#"source="/etc/passwd""#, "`/etc/passwd`"),
        (r#"source="a.fmu""#, r#"source="https://example.com/a.fmu""#, "https"),
        (r#"source="a.fmu""#, r#"source="a.fmu" type="text/x-modelica""#, "`text/x-modelica`"),
        (r#" source="a.fmu""#, "", "the attribute source"),
        (r#"source="a.fmu""#, r#"source="a.fmu" implementation="other""#, "ScheduledExecution"),
        (r#"version="2.0""#, r#"version="3.0""#, "version 1.0 or 2.0"),
        (r#"startTime="1""#, r#"startTime="now""#, "`now`"),
        (r#"name="sub""#, r#"name="d""#, "a second `d`"),
        (r#"name="sub""#, r#"name="""#, "a name of 1 to"),
        (r#"name="k""#, r#"name="u""#, "a name of its own"),
        (r#"value="1""#, r#"value="one""#, "a number"),
        (r#"value="1""#, r#"value="1 2""#, "expected one value, found 2 values"),
        (r#"m="1""#, r#"m="1.5""#, "a whole number"),
        ("<ssd:System name=\"root\">", "<ssd:Box name=\"root\">", "well-formed"),
        (r#"startElement="d""#, r#"startElement="d" startIndices="1""#, "whole connectors"),
        ("encoding=\"UTF-8\"?>", "encoding=\"UTF-8\"?><!DOCTYPE x [<!ENTITY a 'b'>]>", "<!DOCTYPE"),
    ];
    for (from, to, part) in cases {
        let message = changed(from, to);
        assert!(message.contains(part), "{to}: {message}");
        assert!(message.contains("SystemStructure.ssd:") && message.contains("expected"), "{message}");
    }
    let message = changed(r#"factor="3""#, r#"factor="three""#);
    let line = sample().lines().position(|line| line.contains("factor=\"3\"")).expect("a line") + 1;
    assert!(message.contains(&format!("SystemStructure.ssd:{line}:")), "{message}");
}

#[test]
fn what_the_standard_does_not_know_is_noted() {
    let text = sample()
        .replace("<ssd:System name=\"sub\">", "<ssd:System name=\"sub\" color=\"red\" xmlns:o=\"http://o\" o:x=\"1\"><ssd:Wheel/>")
        .replace("</ssd:SystemStructureDescription>", r#"<ssd:Annotations><ssc:Annotation type="net.x"><y xmlns="http://y" timeStep="3"/></ssc:Annotation></ssd:Annotations></ssd:SystemStructureDescription>"#);
    let folder = folder(&[("SystemStructure.ssd", &text)]);
    let notes = open_system(folder.path(), None).expect("a system").notes;
    for part in ["<Wheel> is not used", "color of <System>", "net.x is ignored; it says y.timeStep = 3"] {
        assert!(notes.iter().any(|note| note.contains(part)), "{part}: {notes:?}");
    }
    assert!(!notes.iter().any(|note| note.contains("attribute x")), "{notes:?}");
}

#[test]
fn steps_are_those_that_tools_noted() {
    let osp = |step: &str| {
        format!(
            r#"<ssd:Annotations><ssc:Annotation type="com.opensimulationplatform"><o:Algorithm xmlns:o="http://o"><o:FixedStepAlgorithm baseStepSize="{step}"/></o:Algorithm></ssc:Annotation></ssd:Annotations>"#
        )
    };
    let oms = r#"<ssd:Annotations><ssc:Annotation type="org.openmodelica"><o:A xmlns:o="http://o"><o:FixedStepMaster description="oms-ma" stepSize="0.001000"/></o:A></ssc:Annotation></ssd:Annotations>"#;
    let read = |system: &str, experiment: &str| {
        let text = description(system)
            .replace("stopTime=\"2.5\"/>", &format!("stopTime=\"2.5\">{experiment}</ssd:DefaultExperiment>"));
        let folder = folder(&[("SystemStructure.ssd", &text)]);
        let system = open_system(folder.path(), None).expect("a system");
        let ignored = system.notes.iter().filter(|note| note.contains("is ignored")).count();
        (system.stepping.map(|it| (it.master, it.step)), ignored)
    };
    let inner = format!("<ssd:Elements><ssd:System name=\"sub\">{oms}</ssd:System></ssd:Elements>");
    assert_eq!(read("", &osp("1e-4")), (Some((SteppingTool::Osp, 1e-4)), 0));
    assert_eq!(read(oms, ""), (Some((SteppingTool::OmSimulator, 1e-3)), 0));
    assert_eq!(read(oms, &osp("0.5")), (Some((SteppingTool::Osp, 0.5)), 0));
    // A system inside is not the outermost one, and a step is above 0.
    assert_eq!(read(&inner, ""), (None, 1));
    assert_eq!(read("", &osp("0")), (None, 1));
    assert_eq!(read("", &osp("soon")), (None, 1));
}

#[test]
fn prefixes_and_versions_of_namespaces_do_not_matter() {
    let text = sample().replace("ssd:", "q:").replace(":ssd=", ":q=").replace("SSP1", "SSP2");
    let folder = folder(&[("SystemStructure.ssd", &text)]);
    let system = open_system(folder.path(), None).expect("a system");
    assert_eq!(names(&system), ["d.y -> sub.c.u"]);
    assert_eq!(number(&system, "sub.c", "k"), 3.0);
    let other = text.replace("SSP2/SystemStructureDescription", "SSP2/Something");
    let path = written(folder.path(), "other.ssd", other.as_bytes());
    let message = open_system(&path, None).expect_err("an error").to_string();
    assert!(message.contains("SSP2/Something"), "{message}");
}

#[test]
fn deep_and_endless_systems_are_refused() {
    let deep = |depth: usize| {
        let open = r#"<ssd:Elements><ssd:System name="s">"#.repeat(depth);
        format!("{open}{}", "</ssd:System></ssd:Elements>".repeat(depth))
    };
    assert!(good(&deep(99)).components.is_empty());
    let deep = |depth| wrong(&deep(depth));
    assert!(deep(100).contains("at most 100 systems"));
    assert!(deep(60_000).contains("at most 100 systems"));
    // Each of 30 systems holds the next one twice: more than a thousand million elements.
    let mut files: Vec<(String, String)> = Vec::new();
    for index in 0..30 {
        let part = |name: &str| {
            format!(
                r#"<ssd:Component name="{name}" type="application/x-ssp-definition" source="{}.ssd"/>"#,
                index + 1
            )
        };
        let text = description(&format!("<ssd:Elements>{}{}</ssd:Elements>", part("a"), part("b")));
        files.push((format!("{index}.ssd"), text));
    }
    files.push(("30.ssd".to_owned(), description("")));
    let files: Vec<_> = files.iter().map(|(name, text)| (name.as_str(), text.as_str())).collect();
    let folder = folder(&files);
    let message = open_system(&folder.path().join("0.ssd"), None).expect_err("an error").to_string();
    assert!(message.contains("at most 100000 elements"), "{message}");
}

#[test]
fn connections_in_a_circle_are_refused() {
    let through = |name: &str| {
        format!(
            r#"<ssd:System name="{name}">{}<ssd:Connections>{}</ssd:Connections></ssd:System>"#,
            connectors(&[("u", "input", ""), ("y", "output", "")]),
            connection("u", "y", "")
        )
    };
    let contents = format!(
        "{}<ssd:Elements>{}{}</ssd:Elements><ssd:Connections>{}{}{}</ssd:Connections>",
        connectors(&[("y", "output", "")]),
        through("a"),
        through("b"),
        connection("a.y", "b.u", ""),
        connection("b.y", "a.u", ""),
        connection("b.y", "y", ""),
    );
    assert!(wrong(&contents).contains("a circle through"), "{}", wrong(&contents));
}

#[test]
fn hostile_archives_are_refused() {
    let folder = TempDir::new().expect("a folder");
    let message = |name: &str, bytes: &[u8]| {
        let path = written(folder.path(), name, bytes);
        open_system(&path, None).expect_err("an error")
    };
    assert!(matches!(message("a.ssp", b"no archive"), Error::Archive(archive::Error::Zip { .. })));
    let text = sample();
    let escaping = archive(&[("SystemStructure.ssd", text.as_bytes()), ("../a.fmu", b"")]);
    assert!(matches!(message("b.ssp", &escaping), Error::Archive(archive::Error::Escapes { .. })));
    let mut writer = zip::ZipWriter::new(Cursor::new(Vec::new()));
    writer.add_symlink("a.fmu", "/etc/passwd", SimpleFileOptions::default()).expect("a link");
    let linked = writer.finish().expect("an archive").into_inner();
    assert!(matches!(message("c.ssp", &linked), Error::Archive(archive::Error::Link { .. })));
    assert!(matches!(message("d.ssp", &archive(&[("x", b"")])), Error::Read { .. }));
    assert!(matches!(open_system(&folder.path().join("none.ssp"), None), Err(Error::Read { .. })));
    // The limit is counted over what is written, not over what an entry claims.
    let path = written(folder.path(), "e.ssp", &archive(&[("x", &[0; 5_000])]));
    let into = folder.path().join("into");
    let mut left = 4_999;
    let found = crate::read_archive::unpack_archive(&path, &path, &into, &mut left);
    assert!(matches!(found, Err(Error::Archive(archive::Error::TooLarge { .. }))));
}

#[test]
fn descriptions_without_end_are_refused() {
    let folder = folder(&[]);
    let path = folder.path().join("SystemStructure.ssd");
    let file = std::fs::File::create(&path).expect("a file");
    file.set_len(crate::limits::LONGEST + 1).expect("a long file");
    assert!(matches!(open_system(&path, None), Err(Error::TooLong { .. })));
}

#[test]
fn crowds_of_attributes_are_refused_at_once() {
    let many =
        |prefix: &str| -> String { (0..300_000).map(|index| format!(" {prefix}{index} = 'a>=<'")).collect() };
    for prefix in ["a", "xmlns:a"] {
        let message = changed(
            r#"<ssd:System name="sub""#,
            &format!(r#"<!-- {} --><ssd:System name="sub"{}"#, "=".repeat(500), many(prefix)),
        );
        assert!(message.contains("at most 200 attributes"), "{}", &message[..200]);
    }
    // One namespace for each of many elements, each in the one before.
    let deep: String = (0..50_000).map(|index| format!("<ssd:a xmlns:a{index}='b'>")).collect();
    assert!(changed("<ssd:Elements>", &deep).contains("at most 200"));
}

#[test]
fn texts_that_are_no_utf_8_have_a_place() {
    let folder = folder(&[]);
    let path = written(folder.path(), "SystemStructure.ssd", b"<a>\n \xff</a>");
    let message = open_system(&path, None).expect_err("an error").to_string();
    assert!(message.contains("SystemStructure.ssd:2:2: expected UTF-8"), "{message}");
}
