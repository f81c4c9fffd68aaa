//! Opens hostile archives, and many archives with random damage.

use std::io::{Cursor, Write as _};

use rand::{RngExt as _, SeedableRng as _};
use rand_pcg::Pcg64;
use units::Unit;
use zip::write::SimpleFileOptions;

use super::*;

mod descriptions;

const XML: &str = r#"<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="2.0" modelName="m" guid="{1}">
  <CoSimulation modelIdentifier="m"/>
  <UnitDefinitions><Unit name="m/s"><BaseUnit m="1" s="-1"/></Unit></UnitDefinitions>
  <ModelVariables>
    <ScalarVariable name="u" valueReference="0" causality="input"><Real unit="m/s" start="1"/></ScalarVariable>
    <ScalarVariable name="y" valueReference="1" causality="output"><Real/></ScalarVariable>
    <ScalarVariable name="n" valueReference="2" causality="parameter" variability="fixed"><Integer start="3"/></ScalarVariable>
  </ModelVariables>
  <ModelStructure>
    <Outputs><Unknown index="2" dependencies="1"/></Outputs>
    <InitialUnknowns><Unknown index="2"/></InitialUnknowns>
  </ModelStructure>
</fmiModelDescription>
"#;

const XML_3: &str = r#"<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="3.0" modelName="m" instantiationToken="{1}">
  <CoSimulation modelIdentifier="m" canGetAndSetFMUState="1"/>
  <UnitDefinitions><Unit name="kph"><BaseUnit m="1" s="-1" factor="0.25"/></Unit></UnitDefinitions>
  <TypeDefinitions>
    <Float64Type name="Speed" unit="kph" min="-2"/>
    <EnumerationType name="Mode"><Item name="b" value="2"/><Item name="a" value="-1"/></EnumerationType>
  </TypeDefinitions>
  <ModelVariables>
    <Float64 name="time" valueReference="0" causality="independent"/>
    <UInt64 name="n" valueReference="1" causality="structuralParameter" variability="tunable" start="2"/>
    <Float32 name="A" valueReference="2" causality="parameter" variability="tunable" start="1 2 3 4 5 6">
      <Dimension valueReference="1"/><Dimension start="3"/></Float32>
    <Float64 name="v" valueReference="3" causality="input" declaredType="Speed" start="1"><Alias name="speed"/></Float64>
    <Float64 name="y" valueReference="4" causality="output"><Dimension valueReference="1"/></Float64>
    <Enumeration name="mode" valueReference="5" declaredType="Mode" causality="input" start="2"/>
    <String name="s" valueReference="6" causality="input"><Start value="a &lt; b"/></String>
    <Binary name="b" valueReference="7" causality="input"><Start value="C0ffee"/></Binary>
    <UInt64 name="u" valueReference="8" causality="parameter" start="18446744073709551615"/>
    <Clock name="c" valueReference="9" causality="input" intervalVariability="triggered"/>
  </ModelVariables>
  <ModelStructure><Output valueReference="4" dependencies="2 3"/><InitialUnknown valueReference="4"/></ModelStructure>
</fmiModelDescription>
"#;

#[test]
fn arrays_become_elements_of_the_size_that_is_asked_for() {
    let names = |description: &FmuDescription| -> Vec<String> {
        description.variables.iter().map(|variable| variable.name.clone()).collect()
    };
    let found =
        fmi3::parse(XML_3, &fmi3::StructuralSizes::new(), FmiInterface::CoSimulation).expect("a description");
    assert_eq!(found.problems, [""; 0]);
    assert!(found.state && !found.serialised_state);
    let scalars = ["mode", "s", "b", "u", "c", "speed"];
    let first =
        ["time", "n", "A[1,1]", "A[1,2]", "A[1,3]", "A[2,1]", "A[2,2]", "A[2,3]", "v", "y[1]", "y[2]"];
    assert_eq!(names(&found), [first.as_slice(), &scalars].concat());
    let of = |name: &str| &found.variables[found.find_variable(name).expect("a variable")];
    assert_eq!((of("A[2,1]").element, of("A[2,1]").start.as_deref()), ((3, 6), Some("4")));
    // Of both: the matrix as a whole, and the speed.
    assert_eq!(of("y[2]").dependencies.as_deref(), Some([2, 3, 4, 5, 6, 7, 8].as_slice()));
    let second = Unit::parse("m/s").expect("a unit");
    let speed = of("v").dimension.expect("a unit of the file");
    assert_eq!(Unit::conversion(&speed, &second), Some((0.25, 0.0)));
    assert_eq!((of("v").min, of("speed").causality), (Some(-2.0), Causality::Local));
    assert_eq!(description::describe_items(&of("mode").items), "a = -1, b = 2");
    assert_eq!(of("s").start_value(), Some(Value::String("a < b".to_owned())));
    assert_eq!(of("b").start_value(), Some(Value::Binary(vec![0xc0, 0xff, 0xee])));
    assert_eq!(of("u").start_value(), Some(Value::Integer(u64::MAX.into())));
    assert_eq!((of("u").variability, of("c").kind), (Variability::Fixed, FmiType::Clock));

    let small = fmi3::parse(XML_3, &[(1, 1)].into(), FmiInterface::CoSimulation).expect("a description");
    // The list of six start values belongs to another size.
    let first = ["time", "n", "A[1,1]", "A[1,2]", "A[1,3]", "v", "y[1]"];
    assert_eq!(names(&small), [first.as_slice(), &scalars].concat());
    assert!(small.variables[2..5].iter().all(|variable| variable.start.is_none()));
    let none = fmi3::parse(XML_3, &[(1, 0)].into(), FmiInterface::CoSimulation).expect("a description");
    assert_eq!(names(&none), [["time", "n", "v"].as_slice(), &scalars].concat());
}

#[test]
fn an_entry_that_is_there_twice_with_the_same_contents_is_one() {
    let xml = XML.as_bytes();
    let same: [(&str, &[u8]); 3] = [("modelDescription.xml", xml), ("aa", b"1"), ("ab", b"1")];
    assert_eq!(open(&renamed(&same, "ab", "aa")).expect("an archive").description.name, "m");
}

#[test]
fn declared_types_and_units_are_read_all_of_them() {
    let types = "<TypeDefinitions><SimpleType name='First'><Real unit='N'/></SimpleType>\
                 <SimpleType name='Speed'><Real unit='kph' min='-2'/></SimpleType>\
                 <SimpleType name='Mode'><Enumeration><Item name='b' value='2'/><Item name='a' value='-1'/>\
                 </Enumeration></SimpleType></TypeDefinitions>\n  <ModelVariables>";
    let kph = "<Unit name='kph'><BaseUnit m='1' s='-1' factor='0.25'/></Unit></UnitDefinitions>";
    let xml = XML
        .replace("</UnitDefinitions>", kph)
        .replace("<ModelVariables>", types)
        .replace("<Real unit=\"m/s\" start=\"1\"/>", "<Real declaredType=\"Speed\"/>")
        .replace("<Integer start=\"3\"/>", "<Enumeration declaredType=\"Mode\" start=\"2\"/>");
    let variables = fmi2::parse(&xml, FmiInterface::CoSimulation).expect("a description").variables;
    let speed = variables[0].dimension.expect("a unit of the file");
    let second = Unit::parse("m/s").expect("a unit");
    assert_eq!(Unit::conversion(&speed, &second), Some((0.25, 0.0)));
    assert_eq!((variables[0].unit.as_deref(), variables[0].min), (Some("kph"), Some(-2.0)));
    assert_eq!(description::describe_items(&variables[2].items), "a = -1, b = 2");
    let broken = fmi2::parse(&xml.replace("value='2'", "value='two'"), FmiInterface::CoSimulation);
    assert!(broken.is_err_and(|error| error.contains("value=\"two\" of <Item>")));
}

#[test]
fn differences_have_no_offset_and_limits_have_64_bits() {
    let types = "<TypeDefinitions><SimpleType name='First'><Real max='1e300'/></SimpleType>\
                 <SimpleType name='Share'><Real min='0' max='0.7' nominal='1e-300'/></SimpleType>\
                 <SimpleType name='Difference'><Real unit='degC' relativeQuantity='1'/></SimpleType>\
                 </TypeDefinitions>\n  <ModelVariables>";
    let read = |real: &str| {
        let real = format!("<Real {real} start=\"0\"/>");
        let xml = XML.replace("<ModelVariables>", types).replace("<Real unit=\"m/s\" start=\"1\"/>", &real);
        fmi2::parse(&xml, FmiInterface::CoSimulation).expect("a description").variables.swap_remove(0)
    };
    let share = read("declaredType='Share'");
    assert_eq!((share.min, share.max, share.nominal), (Some(0.0), Some(0.7), Some(1e-300)));
    assert_eq!(read("declaredType='First'").max, Some(1e300));
    assert_eq!(read("declaredType='Share' max='0.6'").max, Some(0.6));
    for (real, relative, offset, plain) in [
        ("declaredType='Difference'", Some(273.15), 0.0, "K"),
        ("unit='degC' relativeQuantity='true'", Some(273.15), 0.0, "K"),
        ("declaredType='Difference' relativeQuantity='false'", None, 273.15, "degC"),
        ("unit='K' relativeQuantity='true'", Some(0.0), 0.0, "K"),
        ("unit='degC'", None, 273.15, "degC"),
    ] {
        let found = read(real);
        assert_eq!(
            (found.relative, found.offset_free_unit_name().as_deref()),
            (relative, Some(plain)),
            "{real}"
        );
        assert_eq!(found.dimension.map(|it| it.offset), Some(offset), "{real}");
    }
    for (own, relative) in [("", None), ("relativeQuantity='true'", Some(273.15))] {
        let xml = XML_3.replace("unit=\"kph\" min", &format!("unit=\"degC\" {own} min"));
        let found = fmi3::parse(&xml, &fmi3::StructuralSizes::new(), FmiInterface::CoSimulation)
            .expect("a description");
        assert_eq!(found.variables[found.find_variable("v").expect("a variable")].relative, relative);
    }
}

#[test]
fn an_annotation_calls_an_input_optional() {
    let annotations = "<Annotations><Tool name=\"Trackside\"><Optional/></Tool></Annotations>";
    let xml = XML.replacen(
        "<Real unit=\"m/s\" start=\"1\"/>",
        &format!("<Real unit=\"m/s\" start=\"1\"/>{annotations}"),
        1,
    );
    let found = fmi2::parse(&xml, FmiInterface::CoSimulation).expect("a description").variables;
    assert!(found[0].optional && !found[1].optional);
    let of_another_tool = xml.replace("Trackside", "Other");
    assert!(
        !fmi2::parse(&of_another_tool, FmiInterface::CoSimulation).expect("a description").variables[0]
            .optional
    );

    let of_3 =
        "start=\"2\"><Annotations><Annotation type=\"trackside.optional\"/></Annotations></Enumeration>";
    let xml_3 =
        XML_3.replacen("causality=\"input\" start=\"2\"/>", &format!("causality=\"input\" {of_3}"), 1);
    let found = fmi3::parse(&xml_3, &fmi3::StructuralSizes::new(), FmiInterface::CoSimulation)
        .expect("a description")
        .variables;
    let optional: Vec<_> = found.iter().filter(|it| it.optional).map(|it| &it.name).collect();
    assert_eq!(optional, ["mode"]);
}

fn archive(entries: &[(&str, &[u8])]) -> Vec<u8> {
    let mut archive = zip::ZipWriter::new(Cursor::new(Vec::new()));
    for (name, content) in entries {
        archive.start_file(*name, SimpleFileOptions::default()).expect("an entry");
        archive.write_all(content).expect("a content");
    }
    archive.finish().expect("an archive").into_inner()
}

/// What opening an archive of these bytes says.
fn open(bytes: &[u8]) -> Result<Fmu, String> {
    let folder = tempfile::TempDir::new().expect("a folder");
    let path = folder.path().join("x.fmu");
    std::fs::write(&path, bytes).expect("a file");
    Fmu::open(&path).map_err(|error| error.to_string())
}

/// The same archive with a name in it replaced by one of the same length.
fn renamed(entries: &[(&str, &[u8])], from: &str, to: &str) -> Vec<u8> {
    assert_eq!(from.len(), to.len());
    let mut bytes = archive(entries);
    for start in 0..bytes.len() - from.len() {
        if bytes[start..].starts_with(from.as_bytes()) {
            bytes[start..start + to.len()].copy_from_slice(to.as_bytes());
        }
    }
    bytes
}

#[test]
fn harm_is_refused_with_a_reason() {
    let xml = XML.as_bytes();
    let good = archive(&[("modelDescription.xml", xml)]);
    assert_eq!(open(&good).expect("a good archive").description.variables.len(), 3);
    let described = |xml: &str| archive(&[("modelDescription.xml", xml.as_bytes())]);
    let bomb = XML.replace("<fmi", "<!DOCTYPE x [<!ENTITY a 'aaaa'><!ENTITY b '&a;&a;'>]>\n<fmi");
    let long = XML.to_owned() + &" ".repeat(100 << 20);
    let deep = XML.replace("<UnitDefinitions>", &("<a>".repeat(100_000) + "<UnitDefinitions>"));
    let entries: [(&str, &[u8]); 2] = [("modelDescription.xml", xml), ("resources/aa/aa", b"1")];
    let twice: [(&str, &[u8]); 3] = [("modelDescription.xml", xml), ("aa", b"1"), ("ab", b"2")];
    for (what, bytes, reason) in [
        ("leaves the folder", renamed(&entries, "resources/aa/aa", "../../../../aaa"), "leaves the folder"),
        ("absolute path", renamed(&entries, "resources/aa/aa", "/tmp/trackside/"), ""),
        ("a name twice", renamed(&twice, "ab", "aa"), "different names"),
        ("cut off", good[..good.len() / 2].to_vec(), "not an .fmu archive"),
        ("no description", archive(&[("a", b"")]), "modelDescription.xml"),
        ("no text", archive(&[("modelDescription.xml", &[b'<', 0xff, 0xfe])]), "UTF-8"),
        ("entities", described(&bomb), "document type"),
        ("very long", described(&long), "expected at most"),
        ("very deep", described(&deep), "modelDescription.xml"),
        ("value reference", described(&XML.replace("\"1\" causality", "\"99999999999\" causality")), ""),
        ("index", described(&XML.replace("index=\"2\"", "index=\"-2\"")), ""),
        ("a path as name", described(&XML.replace("Identifier=\"m", "Identifier=\"../../m")), "not a name"),
        ("FMI 1.1", described(&XML.replace("fmiVersion=\"2.0", "fmiVersion=\"1.1")), "2.0 or 3.0"),
        (
            "another version than it says",
            described(&XML.replace("fmiVersion=\"2", "fmiVersion=\"3")),
            "instantiationToken",
        ),
    ] {
        match open(&bytes) {
            Err(error) => assert!(error.contains(reason), "{what}: {error}"),
            // What leaves nothing outside of the folder may as well be unpacked.
            Ok(_) => assert!(reason.is_empty() && !Path::new("/tmp/trackside").exists(), "{what}"),
        }
    }
}

#[test]
fn harm_in_a_description_of_fmi_3_is_refused_with_a_reason() {
    let described = |xml: &str| archive(&[("modelDescription.xml", xml.as_bytes())]);
    for (what, bytes, reason) in [
        ("no co-simulation", described(&XML_3.replace("CoSim", "Scheduled")), "CoSimulation"),
        ("too large", described(&XML_3.replace("start=\"2\"", "start=\"9999999\"")), "at most"),
        ("immense", described(&XML_3.replace("start=\"2\"", "start=\"18446744073709551615\"")), "at most"),
        (
            "no such size",
            described(&XML_3.replace("Dimension valueReference=\"1\"", "Dimension valueReference=\"9\"")),
            "UInt64",
        ),
        (
            "unknown type",
            described(&XML_3.replace("<Binary", "<Complex").replace("</Binary", "</Complex")),
            "Complex",
        ),
        ("unknown word", described(&XML_3.replace("\"structuralP", "\"p")), ""),
        ("unknown causality", described(&XML_3.replace("\"structuralP", "\"structuredP")), "causality"),
    ] {
        match open(&bytes) {
            Err(error) => assert!(error.contains(reason), "{what}: {error}"),
            Ok(_) => assert!(reason.is_empty(), "{what}"),
        }
    }
}

/// References are any numbers of 32 bits, and any number of variables may share one: they are aliases.
#[test]
fn references_at_the_limit_and_thousands_of_aliases_are_read() {
    let alias = |index: usize| {
        format!(
            "<ScalarVariable name=\"alias[{index}]\" valueReference=\"4294967295\" \
             causality=\"local\"><Real/></ScalarVariable>\n"
        )
    };
    let aliases: String = (0..20_000).map(alias).collect();
    let found = fmi2::parse(
        &XML.replace("</ModelVariables>", &(aliases + "</ModelVariables>")),
        FmiInterface::CoSimulation,
    );
    let found = found.expect("a legal description");
    assert_eq!((found.variables.len(), found.problems), (20_003, Vec::new()));
    assert_eq!(found.variables.last().map(|variable| variable.reference), Some(u32::MAX));

    let twice = fmi2::parse(&XML.replace("name=\"y\"", "name=\"u\""), FmiInterface::CoSimulation)
        .expect_err("a name twice");
    assert!(twice.contains("found `u` in lines 6 and 7"), "{twice}");
}

#[test]
fn a_path_is_a_uri_whatever_is_in_it() {
    assert_eq!(
        location::file_uri(Path::new("/tmp/a b%\u{e9}/x-1_y.z~")),
        "file:///tmp/a%20b%25%C3%A9/x-1_y.z~"
    );
}

/// Opens so many descriptions and archives with random damage; none may panic or hang.
fn damage(cases: usize) {
    let mut random = Pcg64::seed_from_u64(7);
    let archive = archive(&[("modelDescription.xml", XML.as_bytes()), ("binaries/linux64/m.so", b"ELF")]);
    for case in 0..cases {
        // Archives cost files, so they get a tenth of the cases.
        let whole = case % 10 == 0;
        let text = if case % 2 == 0 { XML } else { XML_3 };
        let mut bytes = if whole { archive.clone() } else { text.as_bytes().to_vec() };
        for _ in 0..random.random_range(1..8) {
            let offset = random.random_range(0..bytes.len());
            match random.random_range(0..4) {
                0 => bytes[offset] = random.random(),
                1 => drop(bytes.drain(offset..(offset + 20).min(bytes.len() - 1))),
                2 => bytes.insert(offset, random.random()),
                _ => bytes.extend_from_within(offset..(offset + 30).min(bytes.len())),
            }
        }
        if whole {
            let _ = open(&bytes);
        } else {
            let _ = parse_description(&String::from_utf8_lossy(&bytes), &fmi3::StructuralSizes::new(), None);
        }
    }
}

#[test]
fn random_damage_is_survived() {
    damage(5_000);
}

/// Structured names are checked by a parser that is not made for threads.
#[test]
fn descriptions_are_read_by_many_threads_at_once() {
    let named = |index: usize| {
        format!(
            "<ScalarVariable name=\"der(body.wheel[{index}].x,2)\" valueReference=\"{}\" \
             causality=\"local\"><Real/></ScalarVariable>\n",
            index + 3
        )
    };
    let names: String = (0..200).map(named).collect();
    let text = XML
        .replace("modelName=\"m\"", "modelName=\"m\" variableNamingConvention=\"structured\"")
        .replace("</ModelVariables>", &(names + "</ModelVariables>"));
    std::thread::scope(|scope| {
        for _ in 0..4 {
            scope.spawn(|| {
                for _ in 0..50 {
                    let found = fmi2::parse(&text, FmiInterface::CoSimulation).expect("a legal description");
                    assert_eq!((found.variables.len(), &found.problems), (203, &Vec::new()));
                }
            });
        }
    });
}
