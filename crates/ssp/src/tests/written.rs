//! Systems that are written and read back.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use crate::write::{
    ArchiveEntryContent, DraftAnnotation, DraftComponent, DraftConnection, DraftConnector, DraftValue,
    SspVersion, SystemDraft, pack_archive, parameter_set, system_structure_xml,
};
use crate::{
    ArrayDimension, BaseUnit, ConnectorKind, Enumeration, IntegerWidth, SspType, SspUnit, SspValue,
    SystemExperiment, ValueTransformation,
};

const INT16: SspType = SspType::Integer(IntegerWidth { bits: 16, signed: true });
const INT32: SspType = SspType::Integer(IntegerWidth { bits: 32, signed: true });

fn connector(name: &str, kind: ConnectorKind, data_type: SspType) -> DraftConnector {
    DraftConnector { name: name.to_owned(), kind, data_type, unit: None, dimensions: Vec::new() }
}

fn colours() -> SspType {
    let items = vec![("red & <green>".to_owned(), 1), ("\"blue\"".to_owned(), -2)];
    SspType::Enumeration(Some(Arc::new(Enumeration { name: "colours".to_owned(), items })))
}

fn draft() -> SystemDraft {
    let base = BaseUnit { exponents: [0, 1, -1, 0, 0, 0, 0, 0], factor: 1.0 / 3.6, offset: 0.0 };
    let speed = DraftConnector {
        unit: Some("km/h".to_owned()),
        ..connector("v", ConnectorKind::Output, SspType::Float64)
    };
    let names = [("x", ConnectorKind::Output), ("u", ConnectorKind::Input)];
    let other = names.map(|(name, kind)| connector(name, kind, SspType::Boolean)).to_vec();
    let mut other = [other, vec![connector("c", ConnectorKind::Parameter, colours())]].concat();
    other.push(connector("w", ConnectorKind::Input, SspType::Float64));
    let component = |name: &str, values: Option<&str>, connectors| DraftComponent {
        name: name.to_owned(),
        implementation: "CoSimulation".to_owned(),
        source: "resources/a.fmu".to_owned(),
        values: values.map(str::to_owned),
        connectors,
    };
    let end = |of: &str, name: &str| (Some(of.to_owned()), name.to_owned());
    let swap = ValueTransformation::Boolean(BTreeMap::from([(true, false), (false, true)]));
    SystemDraft {
        name: "a system".to_owned(),
        components: vec![
            component("first", Some("resources/first.ssv"), vec![speed]),
            component("second", Some("resources/second.ssv"), other),
        ],
        connectors: vec![connector("driver.go", ConnectorKind::Input, SspType::Boolean)],
        connections: vec![
            DraftConnection {
                from: end("first", "v"),
                to: end("second", "w"),
                transformation: Some(ValueTransformation::Linear { factor: 0.1 + 0.2, offset: -1e-300 }),
            },
            DraftConnection {
                from: (None, "driver.go".to_owned()),
                to: end("second", "u"),
                transformation: Some(swap),
            },
        ],
        units: vec![Arc::new(SspUnit { name: "km/h".to_owned(), base: Some(base) })],
        experiment: SystemExperiment { start: Some(0.1), stop: Some(4.0) },
        step: Some(0.01),
        annotation: Some(DraftAnnotation {
            kind: "org.example".to_owned(),
            namespace: "http://example.org".to_owned(),
            element: "Note".to_owned(),
            attributes: vec![("digest".to_owned(), "a \"b\"\n\t".to_owned())],
            text: "x = \"1 < 2 & 3 > 2\"\n\n  [[a]]\n]]>\r\n".to_owned(),
        }),
    }
}

fn value(name: &str, data_type: SspType, value: SspValue) -> DraftValue {
    DraftValue { name: name.to_owned(), data_type, value }
}

fn packed(draft: &SystemDraft, second: &[DraftValue]) -> (tempfile::TempDir, Vec<u8>) {
    let folder = tempfile::tempdir().expect("a folder");
    let fmu = folder.path().join("a.fmu");
    std::fs::write(&fmu, "fmu").expect("a file");
    let first = [value("m", SspType::Float64, SspValue::Real(0.1 + 0.2))];
    let text = |name: &str, values: &[DraftValue]| {
        ArchiveEntryContent::Text(parameter_set(name, draft.required_version(), values))
    };
    let entries = BTreeMap::from([
        ("SystemStructure.ssd".to_owned(), ArchiveEntryContent::Text(system_structure_xml(draft))),
        ("resources/a.fmu".to_owned(), ArchiveEntryContent::File(fmu)),
        ("resources/first.ssv".to_owned(), text("first", &first)),
        ("resources/second.ssv".to_owned(), text("second", second)),
    ]);
    let path = folder.path().join("a.ssp");
    pack_archive(&path, &entries).expect("an archive");
    let bytes = std::fs::read(&path).expect("bytes");
    (folder, bytes)
}

#[test]
fn a_system_is_read_as_it_was_written() {
    let values = [
        value("c", colours(), SspValue::Enumeration("red & <green>".to_owned())),
        value("text", SspType::String, SspValue::String(" a\n\"b\"\t".to_owned())),
        value("n", INT32, SspValue::Integer(-7)),
        value("b", SspType::Binary { mime: "a/b".to_owned() }, SspValue::Binary(vec![0, 255])),
    ];
    let draft = draft();
    assert_eq!(draft.required_version(), SspVersion::One);
    let (folder, bytes) = packed(&draft, &values);
    let system = crate::open_system(&folder.path().join("a.ssp"), None).expect("a system");
    assert_eq!(system.name, "a system");
    assert_eq!(system.experiment, draft.experiment);
    let [first, second] = &system.components[..] else { panic!("two components") };
    assert_eq!(first.start_values[0].value, SspValue::Real(0.1 + 0.2));
    assert_eq!(first.connectors[0].unit.as_deref(), Some(&*draft.units[0]));
    let read: Vec<_> = second.start_values.iter().map(|it| (&*it.variable, &it.value)).collect();
    let mut written: Vec<_> = values.iter().map(|it| (&*it.name, &it.value)).collect();
    written.sort_by_key(|(name, _)| *name);
    assert_eq!(read, written);
    let enumeration = second.connectors.iter().find(|it| it.name == "c").map(|it| &it.data_type);
    assert_eq!(enumeration, Some(&Some(colours())));
    let conversion = &system.connections[0].conversion;
    assert!(conversion.suppress_unit_conversion);
    assert_eq!(Some(&conversion.transformation), draft.connections[0].transformation.as_ref());
    let (_, conversion) = &system.inputs[0].to[0];
    assert_eq!(Some(&conversion.transformation), draft.connections[1].transformation.as_ref());
    let (read, written) = (&system.annotations[0], draft.annotation.as_ref().expect("one"));
    assert_eq!((&read.kind, &read.text), (&written.kind, &written.text));
    assert_eq!(read.attributes, written.attributes);

    let (_, again) = packed(&draft, &values);
    assert!(bytes == again, "the same files make the same bytes");
    let names: BTreeSet<_> = std::fs::read_dir(folder.path())
        .expect("a folder")
        .map(|entry| entry.expect("an entry").file_name())
        .collect();
    assert_eq!(names, BTreeSet::from(["a.fmu".into(), "a.ssp".into()]), "nothing is left over");
}

#[test]
fn arrays_and_types_of_fmi_3_make_version_2() {
    let mut draft = draft();
    let array = DraftConnector {
        dimensions: vec![2, 3],
        ..connector("k", ConnectorKind::Parameter, SspType::Float64)
    };
    draft.components[1].connectors.extend([array, connector("i", ConnectorKind::Parameter, INT16)]);
    assert_eq!(draft.required_version(), SspVersion::Two);
    let reals = (0..6).map(|k| SspValue::Real(f64::from(k) * 0.1)).collect();
    let texts = ["a b", "", "c"].map(|text| SspValue::String(text.to_owned())).to_vec();
    let values = [
        value("i", INT16, SspValue::Integer(-7)),
        value("k", SspType::Float64, SspValue::Array { dimensions: vec![2, 3], elements: reals }),
        value("s", SspType::String, SspValue::Array { dimensions: vec![3], elements: texts }),
    ];
    let (folder, _) = packed(&draft, &values);
    let system = crate::open_system(&folder.path().join("a.ssp"), None).expect("a system");
    let read: Vec<_> = system.components[1].start_values.iter().map(|it| it.value.clone()).collect();
    assert_eq!(read, values.map(|it| it.value));
    let found = system.components[1].connectors.iter().find(|it| it.name == "k");
    let dimensions = found.map(|it| it.dimensions.clone());
    assert_eq!(dimensions, Some(vec![ArrayDimension::Fixed(2), ArrayDimension::Fixed(3)]));
}

#[test]
fn an_archive_is_written_whole_or_not_at_all() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("a.ssp");
    std::fs::write(&path, "before").expect("a file");
    let missing = ArchiveEntryContent::File(folder.path().join("missing.fmu"));
    let entries = BTreeMap::from([("resources/missing.fmu".to_owned(), missing)]);
    let error = pack_archive(&path, &entries).expect_err("the file is missing");
    assert!(error.to_string().contains("missing.fmu"), "{error}");
    assert_eq!(std::fs::read_to_string(&path).expect("a file"), "before");
    assert_eq!(std::fs::read_dir(folder.path()).expect("a folder").count(), 1);
}
