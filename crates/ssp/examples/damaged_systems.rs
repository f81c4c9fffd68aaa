//! Opens many damaged systems and counts panics: `damaged_systems COUNT SEED`. Bytes, words, nesting, circles, missing files, and
//! hostile archives.

use std::io::{Cursor, Write as _};
use std::panic::catch_unwind;
use std::path::Path;
use std::time::Instant;

use rand::{RngExt as _, SeedableRng as _};
use rand_pcg::Pcg64;
use zip::write::SimpleFileOptions;

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

/// Names and bytes of the files of a system.
type Files = Vec<(String, Vec<u8>)>;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1);
    let count: u64 = arguments.next().unwrap_or_else(|| "1000".to_owned()).parse()?;
    let seed: u64 = arguments.next().unwrap_or_else(|| "1".to_owned()).parse()?;
    let folder = tempfile::tempdir()?;
    let mut random = Pcg64::seed_from_u64(seed);
    let (mut opened, mut refused, mut panics) = (0_u64, 0_u64, 0_u64);
    let (mut slowest, begin) = (0.0_f64, Instant::now());
    for case in 0..count {
        let damaged = damaged(&mut random)?;
        let path = folder.path().join("x.ssp");
        std::fs::write(&path, &damaged)?;
        let started = Instant::now();
        let outcome = catch_unwind(|| {
            let described = ssp::variants(&path).map_err(|error| error.to_string());
            let system = ssp::open(&path, None).map_err(|error| error.to_string());
            (described, system.map(|system| system.fingerprint()))
        });
        slowest = slowest.max(started.elapsed().as_secs_f64());
        match outcome {
            Ok((_, Ok(_))) => opened += 1,
            Ok(_) => refused += 1,
            Err(_) => {
                panics += 1;
                let kept = Path::new("target").join(format!("panic_{seed}_{case}.ssp"));
                std::fs::write(&kept, &damaged)?;
                println!("case {case} panics, kept as {}", kept.display());
            }
        }
    }
    let seconds = begin.elapsed().as_secs_f64();
    println!(
        "{count} systems: {opened} opened, {refused} refused, {panics} panics; slowest {slowest:.3} s, {seconds:.0} s in all"
    );
    if panics > 0 { Err("panics".into()) } else { Ok(()) }
}

fn damaged(random: &mut Pcg64) -> Result<Vec<u8>, Box<dyn std::error::Error>> {
    let text = |name: &str, text: &str| (name.to_owned(), text.as_bytes().to_vec());
    let packed = archive(&vec![text("SystemStructure.ssd", OTHER), text("resources/a.fmu", "")])?;
    let mut files: Files = vec![
        text("SystemStructure.ssd", SAMPLE),
        text("other.ssd", OTHER),
        text("values.ssv", VALUES),
        text("map.ssm", MAP),
        text("resources/a.fmu", ""),
        ("packed.ssp".to_owned(), packed),
    ];
    let which = random.random_range(0..4);
    for _ in 0..random.random_range(1..4) {
        match random.random_range(0..9) {
            0 | 1 => bytes(random, &mut files[which].1),
            2 | 3 => words(random, &mut files[which].1),
            4 | 5 => tags(random, &mut files[which].1),
            6 => nest(random, &mut files[0].1),
            7 => circle(random, &mut files),
            _ => entries(random, &mut files),
        }
    }
    let mut whole = archive(&files)?;
    if random.random_range(0..20) == 0 {
        bytes(random, &mut whole);
    }
    Ok(whole)
}

fn archive(files: &Files) -> zip::result::ZipResult<Vec<u8>> {
    let mut archive = zip::ZipWriter::new(Cursor::new(Vec::new()));
    for (name, bytes) in files {
        // A name that is there twice is refused by the writer, not by the reader.
        if archive.start_file(name.as_str(), SimpleFileOptions::default()).is_ok() {
            archive.write_all(bytes)?;
        }
    }
    Ok(archive.finish()?.into_inner())
}

fn bytes(random: &mut Pcg64, bytes: &mut Vec<u8>) {
    for _ in 0..random.random_range(1..6) {
        if bytes.len() < 2 {
            return;
        }
        let at = random.random_range(0..bytes.len());
        match random.random_range(0..4) {
            0 => bytes[at] = random.random(),
            1 => drop(bytes.drain(at..(at + 20).min(bytes.len()))),
            2 => bytes.insert(at, random.random()),
            _ => bytes.extend_from_within(at..(at + 30).min(bytes.len())),
        }
    }
}

/// Puts words of the sample and hostile ones into attributes.
fn words(random: &mut Pcg64, bytes: &mut Vec<u8>) {
    const HOSTILE: [&str; 14] = [
        "",
        "-1",
        "1e999",
        "NaN",
        "18446744073709551616",
        "../../etc/passwd",
        "/etc/passwd",
        "a%00b",
        "#whole",
        "other.ssd#deep",
        "\u{1f980}",
        "0",
        "file:///etc/passwd",
        "packed.ssp",
    ];
    let text = String::from_utf8_lossy(bytes).into_owned();
    let mut parts: Vec<&str> = text.split('"').collect();
    if parts.len() < 3 {
        return;
    }
    let known: Vec<&str> = SAMPLE.split('"').skip(1).step_by(2).collect();
    for _ in 0..random.random_range(1..5) {
        let at = 2 * random.random_range(0..parts.len() / 2) + 1;
        parts[at] = match random.random_range(0..3) {
            0 => HOSTILE[random.random_range(0..HOSTILE.len())],
            _ => known[random.random_range(0..known.len())],
        };
    }
    *bytes = parts.join("\"").into_bytes();
}

/// Moves, doubles and drops lines, which are whole elements mostly.
fn tags(random: &mut Pcg64, bytes: &mut Vec<u8>) {
    let text = String::from_utf8_lossy(bytes).into_owned();
    let mut lines: Vec<&str> = text.lines().collect();
    if lines.is_empty() {
        return;
    }
    let (from, to) = (random.random_range(0..lines.len()), random.random_range(0..lines.len()));
    match random.random_range(0..3) {
        0 => lines.swap(from, to),
        1 => lines.insert(to, lines[from]),
        _ => drop(lines.remove(from)),
    }
    *bytes = lines.join("\n").into_bytes();
}

/// Puts systems into each other, a few or very many.
fn nest(random: &mut Pcg64, bytes: &mut Vec<u8>) {
    let depth = [3, 99, 101, 2_000][random.random_range(0..4)];
    let text = String::from_utf8_lossy(bytes).into_owned();
    let open = "<ssd:System name=\"n\"><ssd:Elements>".repeat(depth);
    let close = "</ssd:Elements></ssd:System>".repeat(depth);
    *bytes =
        text.replacen("<ssd:Elements>", &format!("<ssd:Elements>{open}{close}"), 1).into_bytes();
}

/// Lets systems lead to each other.
fn circle(random: &mut Pcg64, files: &mut Files) {
    let target =
        ["SystemStructure.ssd", "other.ssd", "packed.ssp", "#whole"][random.random_range(0..4)];
    let place = random.random_range(0..2);
    let text = String::from_utf8_lossy(&files[place].1).into_owned();
    let mime = if target.ends_with(".ssp") { "x-ssp-package" } else { "x-ssp-definition" };
    let twin = format!(
        "<ssd:Elements><ssd:Component name=\"t\" type=\"application/{mime}\" source=\"{target}\"/><ssd:Component name=\"t2\" type=\"application/{mime}\" source=\"{target}\"/>"
    );
    files[place].1 = text.replacen("<ssd:Elements>", &twin, 1).into_bytes();
}

/// Drops entries, and adds some that lead out of the archive.
fn entries(random: &mut Pcg64, files: &mut Files) {
    let at = random.random_range(0..files.len());
    match random.random_range(0..3) {
        0 => files[at].1.clear(),
        1 => files[at].0 += ".gone",
        _ => {
            let names = [
                "../out.txt",
                "/abs.txt",
                "C:\\x",
                "resources/../../up",
                "a\0b",
                "resources",
                "resources/a.fmu/b",
                "con",
            ];
            files.push((names[random.random_range(0..names.len())].to_owned(), vec![b'x'; 10]));
        }
    }
}
