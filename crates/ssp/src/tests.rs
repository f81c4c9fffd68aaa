//! Reads small systems whose values can be computed by hand.

mod bindings;
mod chains;
mod connections;
mod damage;
mod nested;
mod published;
mod refusals;
mod written;

use std::io::{Cursor, Write as _};
use std::path::Path;

use tempfile::TempDir;
use zip::write::SimpleFileOptions;

use crate::{Error, SspSystem, SspValue, StartValue, SteppingTool, ValueTransformation, open_system};

/// Namespaces of the standard.
const SPACES: &str = r#"xmlns:ssd="http://ssp-standard.org/SSP1/SystemStructureDescription"
 xmlns:ssc="http://ssp-standard.org/SSP1/SystemStructureCommon"
 xmlns:ssv="http://ssp-standard.org/SSP1/SystemStructureParameterValues"
 xmlns:ssm="http://ssp-standard.org/SSP1/SystemStructureParameterMapping"
 xmlns:ssb="http://ssp-standard.org/SSP1/SystemStructureSignalDictionary""#;

const UNITS: &str = r#"<ssd:Units>
 <ssc:Unit name="m"><ssc:BaseUnit m="1"/></ssc:Unit>
 <ssc:Unit name="mm"><ssc:BaseUnit m="1" factor="0.001"/></ssc:Unit>
 <ssc:Unit name="km"><ssc:BaseUnit m="1" factor="1000"/></ssc:Unit>
 <ssc:Unit name="s"><ssc:BaseUnit s="1"/></ssc:Unit>
 <ssc:Unit name="K"><ssc:BaseUnit K="1"/></ssc:Unit>
 <ssc:Unit name="degC"><ssc:BaseUnit K="1" offset="273.15"/></ssc:Unit>
</ssd:Units>"#;

/// A description with these contents of the outermost system.
fn description(system: &str) -> String {
    format!(
        r#"<?xml version="1.0" encoding="UTF-8"?>
<ssd:SystemStructureDescription version="2.0" name="test" {SPACES}>
<ssd:System name="root">{system}</ssd:System>{UNITS}
<ssd:DefaultExperiment startTime="1" stopTime="2.5"/>
</ssd:SystemStructureDescription>"#
    )
}

/// A component with connectors `name kind unit`, and anything else in it.
fn component(name: &str, ports: &[(&str, &str, &str)], rest: &str) -> String {
    let ports = connectors(ports);
    format!(r#"<ssd:Component name="{name}" source="a.fmu">{ports}{rest}</ssd:Component>"#)
}

fn connectors(ports: &[(&str, &str, &str)]) -> String {
    let ports: String = ports
        .iter()
        .map(|(name, kind, unit)| {
            format!(r#"<ssd:Connector name="{name}" kind="{kind}"><ssc:Real unit="{unit}"/></ssd:Connector>"#)
        })
        .collect();
    format!("<ssd:Connectors>{ports}</ssd:Connectors>")
}

/// A connection `element.connector -> element.connector`; without an element, a connector of the system itself.
fn connection(from: &str, to: &str, rest: &str) -> String {
    let side = |text: &str, which: &str| match text.rsplit_once('.') {
        None => format!(r#"{which}Connector="{text}""#),
        Some((element, name)) => {
            format!(r#"{which}Element="{element}" {which}Connector="{name}""#)
        }
    };
    let (attributes, inner) =
        rest.split_once('<').map_or((rest, String::new()), |(a, b)| (a, format!("<{b}")));
    format!(
        "<ssd:Connection {} {} {attributes}>{inner}</ssd:Connection>",
        side(from, "start"),
        side(to, "end")
    )
}

fn linear(factor: &str, offset: &str) -> String {
    format!(r#"<ssc:LinearTransformation factor="{factor}" offset="{offset}"/>"#)
}

/// Values for parameters: `name <ssv:Real value="1"/>`.
fn set(parameters: &[(&str, &str)]) -> String {
    let parameters: String = parameters
        .iter()
        .map(|(name, value)| format!(r#"<ssv:Parameter name="{name}">{value}</ssv:Parameter>"#))
        .collect();
    let units = UNITS.replace("ssd:", "ssv:");
    format!(
        r#"<ssv:ParameterSet version="1.0" name="p" {SPACES}><ssv:Parameters>{parameters}</ssv:Parameters>{units}</ssv:ParameterSet>"#
    )
}

fn real(value: &str) -> String {
    format!(r#"<ssv:Real value="{value}"/>"#)
}

/// A binding with values and a mapping in the file.
fn binding(attributes: &str, set: &str, mapping: &str) -> String {
    let mapping = if mapping.is_empty() {
        String::new()
    } else {
        format!(
            r#"<ssd:ParameterMapping><ssm:ParameterMapping version="1.0">{mapping}</ssm:ParameterMapping></ssd:ParameterMapping>"#
        )
    };
    format!(
        "<ssd:ParameterBinding {attributes}><ssd:ParameterValues>{set}</ssd:ParameterValues>{mapping}</ssd:ParameterBinding>"
    )
}

fn bindings(all: &[String]) -> String {
    format!("<ssd:ParameterBindings>{}</ssd:ParameterBindings>", all.concat())
}

/// A folder with these files, and an empty `a.fmu`.
fn folder(files: &[(&str, &str)]) -> TempDir {
    let folder = TempDir::new().expect("a folder");
    for (name, text) in files.iter().copied().chain([("a.fmu", "")]) {
        let path = folder.path().join(name);
        std::fs::create_dir_all(path.parent().expect("a parent")).expect("a folder");
        std::fs::write(path, text).expect("a file");
    }
    folder
}

/// Opens the system whose outermost system has these contents.
fn system(contents: &str) -> Result<SspSystem, Error> {
    let folder = folder(&[("SystemStructure.ssd", &description(contents))]);
    open_system(folder.path(), None)
}

fn good(contents: &str) -> SspSystem {
    system(contents).expect("a system")
}

/// What is wrong with such a system.
fn wrong(contents: &str) -> String {
    system(contents).expect_err("an error").to_string()
}

/// The start value of a variable, by the name of its component.
fn start<'a>(system: &'a SspSystem, component: &str, variable: &str) -> &'a StartValue {
    let component = system.components.iter().find(|x| x.name == component).expect("a component");
    component.start_values.iter().find(|x| x.variable == variable).expect("a start value")
}

/// A start value that is a number without anything left to do.
fn number(system: &SspSystem, component: &str, variable: &str) -> f64 {
    let start = start(system, component, variable);
    assert!(start.transformation.is_identity(), "{start:?}");
    match start.value {
        SspValue::Real(value) => value,
        ref other => panic!("{other:?}"),
    }
}

/// Names of the connections: `from.variable -> to.variable`.
fn names(system: &SspSystem) -> Vec<String> {
    let port =
        |port: &crate::FmuPort| format!("{}.{}", system.components[port.component].name, port.variable);
    system.connections.iter().map(|x| format!("{} -> {}", port(&x.from), port(&x.to))).collect()
}

fn factors(transformation: &ValueTransformation) -> (f64, f64) {
    match transformation {
        ValueTransformation::Linear { factor, offset } => (*factor, *offset),
        other => panic!("{other:?}"),
    }
}

fn archive(files: &[(&str, &[u8])]) -> Vec<u8> {
    let mut writer = zip::ZipWriter::new(Cursor::new(Vec::new()));
    for (name, bytes) in files {
        writer.start_file(*name, SimpleFileOptions::default()).expect("an entry");
        writer.write_all(bytes).expect("an entry");
    }
    writer.finish().expect("an archive").into_inner()
}

fn written(folder: &Path, name: &str, bytes: &[u8]) -> std::path::PathBuf {
    let path = folder.join(name);
    std::fs::write(&path, bytes).expect("a file");
    path
}
