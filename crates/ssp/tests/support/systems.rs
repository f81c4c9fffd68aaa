//! What tries damaged systems: bytes, words, nesting, circles, missing files, and hostile archives.

use std::io::{Cursor, Write as _};
use std::path::Path;

use damage::{FuzzTarget, Pcg64};
use rand::RngExt as _;
use zip::write::SimpleFileOptions;

pub const TARGET: FuzzTarget = FuzzTarget {
    name: "systems",
    corpus: concat!(env!("CARGO_MANIFEST_DIR"), "/../ssp/tests/corpus/systems"),
    sound,
    words: &[
        "",
        "../../etc/passwd",
        "/etc/passwd",
        "a%00b",
        "#whole",
        "other.ssd#deep",
        "\u{1f980}",
        "file:///etc/passwd",
        "packed.ssp",
        "resources/a.fmu",
        "input",
        "output",
        "inout",
        "parameter",
        "calculatedParameter",
        "root",
        "inner",
        "lines",
        "modes",
        "startElement",
        "endElement",
        "startConnector",
        "endConnector",
        "suppressUnitConversion",
        "<ssc:Real/>",
        "<ssc:Boolean/>",
        "<ssc:String/>",
        "<ssc:Dimension size=\"2\"/>",
        "<ssc:Dimension sizeConnector=\"p\"/>",
        "<ssc:LinearTransformation factor=\"2\"/>",
        "<ssc:BooleanMappingTransformation/>",
        "factor",
        "offset",
        "m/s",
        "km/h",
        "application/x-ssp-package",
        "application/x-ssp-definition",
        "\n=== ../out.txt\n",
        "\n=== resources/a.fmu/b\n",
    ],
    own: Some(own),
    attempt,
};

const SAMPLE: &str = r#"<?xml version="1.0" encoding="UTF-8"?>
<ssd:SystemStructureDescription version="2.0" name="sample"
    xmlns:ssd="http://ssp-standard.org/SSP1/SystemStructureDescription"
    xmlns:ssv="http://ssp-standard.org/SSP1/SystemStructureParameterValues"
    xmlns:ssm="http://ssp-standard.org/SSP1/SystemStructureParameterMapping"
    xmlns:ssb="http://ssp-standard.org/SSP1/SystemStructureSignalDictionary"
    xmlns:ssc="http://ssp-standard.org/SSP1/SystemStructureCommon">
  <ssd:System name="root" id="whole">
    <ssd:Connectors>
      <ssd:Connector name="u" kind="input"><ssc:Real unit="km/h"/></ssd:Connector>
      <ssd:Connector name="y" kind="output"><ssc:Real unit="m/s"/></ssd:Connector>
      <ssd:Connector name="p" kind="parameter"><ssc:Float64/><ssc:Dimension size="3"/></ssd:Connector>
    </ssd:Connectors>
    <ssd:ParameterBindings>
      <ssd:ParameterBinding prefix="inner." source="values.ssv"><ssd:ParameterMapping source="map.ssm"/></ssd:ParameterBinding>
      <ssd:ParameterBinding><ssd:ParameterValues><ssv:ParameterSet version="1.0" name="set"><ssv:Parameters>
        <ssv:Parameter name="inner.a.k"><ssv:Real value="2.5" unit="m/s"/></ssv:Parameter>
        <ssv:Parameter name="p"><ssv:Float64 value="1 2 3"/><ssc:Dimension size="3"/></ssv:Parameter>
        <ssv:Parameter name="c.mode"><ssv:Enumeration value="on"/></ssv:Parameter>
      </ssv:Parameters></ssv:ParameterSet></ssd:ParameterValues></ssd:ParameterBinding>
    </ssd:ParameterBindings>
    <ssd:Elements>
      <ssd:System name="inner">
        <ssd:Connectors><ssd:Connector name="u" kind="input"><ssc:Real/></ssd:Connector><ssd:Connector name="y" kind="output"/></ssd:Connectors>
        <ssd:Elements>
          <ssd:Component name="a" source="resources/a.fmu"><ssd:Connectors><ssd:Connector name="x" kind="input"><ssc:Real unit="m/s"/></ssd:Connector><ssd:Connector name="z" kind="output"><ssc:Real/></ssd:Connector></ssd:Connectors></ssd:Component>
        </ssd:Elements>
        <ssd:Connections>
          <ssd:Connection startConnector="u" endElement="a" endConnector="x"><ssc:LinearTransformation factor="2" offset="-1"/></ssd:Connection>
          <ssd:Connection startElement="a" startConnector="z" endConnector="y"/>
        </ssd:Connections>
      </ssd:System>
      <ssd:Component name="other" type="application/x-ssp-definition" source="other.ssd"/>
      <ssd:Component name="packed" type="application/x-ssp-package" source="packed.ssp"/>
      <ssd:Component name="c" source="resources/a.fmu" implementation="CoSimulation"><ssd:Connectors><ssd:Connector name="mode" kind="parameter"><ssc:Enumeration name="modes"/></ssd:Connector><ssd:Connector name="w" kind="input"><ssc:Real/></ssd:Connector></ssd:Connectors></ssd:Component>
      <ssd:SignalDictionaryReference name="bus" dictionary="lines"><ssd:Connectors><ssd:Connector name="s" kind="inout"/></ssd:Connectors></ssd:SignalDictionaryReference>
    </ssd:Elements>
    <ssd:Connections>
      <ssd:Connection startConnector="u" endElement="inner" endConnector="u"/>
      <ssd:Connection startElement="inner" startConnector="y" endElement="bus" endConnector="s" suppressUnitConversion="true"/>
      <ssd:Connection startElement="bus" startConnector="s" endElement="c" endConnector="w"/>
    </ssd:Connections>
    <ssd:SignalDictionaries><ssd:SignalDictionary name="lines"><ssb:SignalDictionary version="1.0"><ssb:DictionaryEntry name="s"><ssc:Real/></ssb:DictionaryEntry></ssb:SignalDictionary></ssd:SignalDictionary></ssd:SignalDictionaries>
  </ssd:System>
  <ssd:Enumerations><ssc:Enumeration name="modes"><ssc:Item name="on" value="1"/></ssc:Enumeration></ssd:Enumerations>
  <ssd:Units><ssc:Unit name="m/s"><ssc:BaseUnit m="1" s="-1"/></ssc:Unit><ssc:Unit name="km/h"><ssc:BaseUnit m="1" s="-1" factor="0.25"/></ssc:Unit></ssd:Units>
  <ssd:DefaultExperiment startTime="0" stopTime="1"><ssd:Annotations><ssc:Annotation type="org.example"><x xmlns="urn:x" step="1">text</x></ssc:Annotation></ssd:Annotations></ssd:DefaultExperiment>
</ssd:SystemStructureDescription>"#;

const OTHER: &str = r#"<ssd:SystemStructureDescription version="1.0" name="other" xmlns:ssd="http://ssp-standard.org/SSP1/SystemStructureDescription"><ssd:System name="deep"><ssd:Elements><ssd:Component name="a" source="resources/a.fmu"/></ssd:Elements></ssd:System></ssd:SystemStructureDescription>"#;
const VALUES: &str = r#"<ssv:ParameterSet version="1.0" name="v" xmlns:ssv="http://ssp-standard.org/SSP1/SystemStructureParameterValues"><ssv:Parameters><ssv:Parameter name="from"><ssv:Real value="7"/></ssv:Parameter></ssv:Parameters></ssv:ParameterSet>"#;
const MAP: &str = r#"<ssm:ParameterMapping version="1.0" xmlns:ssm="http://ssp-standard.org/SSP1/SystemStructureParameterMapping"><ssm:MappingEntry source="from" target="a.k"/></ssm:ParameterMapping>"#;

/// The files of a system in one text, each behind a line with its name.
fn sound() -> Vec<Vec<u8>> {
    let files = [
        ("SystemStructure.ssd", SAMPLE),
        ("other.ssd", OTHER),
        ("values.ssv", VALUES),
        ("map.ssm", MAP),
        ("resources/a.fmu", ""),
    ];
    let text: String = files.map(|(name, text)| format!("\n=== {name}\n{text}")).concat();
    vec![text.into_bytes()]
}

/// Names and bytes of the files of a text.
fn files(text: &[u8]) -> Vec<(String, Vec<u8>)> {
    const MARK: &[u8] = b"\n=== ";
    let starts = text.windows(MARK.len()).enumerate().filter(|(_, it)| *it == MARK);
    let starts: Vec<_> = starts.map(|(at, _)| at).chain([text.len()]).collect();
    let file = |pair: &[usize]| {
        let file = &text[pair[0] + MARK.len()..pair[1].max(pair[0] + MARK.len())];
        let line = file.iter().position(|byte| *byte == b'\n')?;
        Some((String::from_utf8_lossy(&file[..line]).into_owned(), file[line + 1..].to_vec()))
    };
    starts.windows(2).filter_map(file).collect()
}

fn archive(files: &[(String, Vec<u8>)]) -> zip::result::ZipResult<Vec<u8>> {
    let mut archive = zip::ZipWriter::new(Cursor::new(Vec::new()));
    let stored = SimpleFileOptions::default().compression_method(zip::CompressionMethod::Stored);
    for (name, bytes) in files {
        // A name that is there twice is refused by the writer, not by the reader.
        if archive.start_file(name.as_str(), stored).is_ok() {
            archive.write_all(bytes)?;
        }
    }
    Ok(archive.finish()?.into_inner())
}

/// Systems in each other, or such that lead to each other.
fn own(random: &mut Pcg64, bytes: &mut Vec<u8>) {
    let text = String::from_utf8_lossy(bytes).into_owned();
    let inside = if random.random() {
        let depth = [3, 99, 101, 2_000][random.random_range(0..4)];
        let open = "<ssd:System name=\"n\"><ssd:Elements>".repeat(depth);
        open + &"</ssd:Elements></ssd:System>".repeat(depth)
    } else {
        let targets = ["SystemStructure.ssd", "other.ssd", "packed.ssp", "#whole"];
        let target = targets[random.random_range(0..targets.len())];
        let mime = if target.ends_with(".ssp") { "x-ssp-package" } else { "x-ssp-definition" };
        let twin = |name: &str| {
            format!("<ssd:Component name=\"{name}\" type=\"application/{mime}\" source=\"{target}\"/>")
        };
        twin("t") + &twin("t2")
    };
    let positions: Vec<_> = text.match_indices("<ssd:Elements>").map(|(at, word)| at + word.len()).collect();
    if positions.is_empty() {
        return;
    }
    let position = positions[random.random_range(0..positions.len())];
    *bytes = [&text[..position], &inside, &text[position..]].concat().into_bytes();
}

/// Opens the system in an archive, which has another one inside.
fn attempt(bytes: &[u8], folder: &Path) -> bool {
    let mut files = files(bytes);
    let inner = [("SystemStructure.ssd", OTHER), ("resources/a.fmu", "")];
    let inner = inner.map(|(name, text)| (name.to_owned(), text.as_bytes().to_vec()));
    files.push(("packed.ssp".to_owned(), archive(&inner).expect("an archive")));
    let path = folder.join("x.ssp");
    let Ok(packed) = archive(&files) else { return false };
    std::fs::write(&path, packed).expect("it can be written");
    let _ = ssp::list_variants(&path).map_err(|error| assert!(!error.to_string().is_empty()));
    match ssp::open_system(&path, None) {
        Ok(system) => {
            let (first, again) = (system.fingerprint(), ssp::open_system(&path, None));
            assert_eq!(Some(first), again.ok().map(|it| it.fingerprint()), "it is the same system");
            true
        }
        Err(error) => {
            assert!(!error.to_string().is_empty());
            false
        }
    }
}
