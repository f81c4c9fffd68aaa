//! Descriptions of FMUs of FMI 2.0 that scenarios are resolved against. Their libraries do not work: resolving loads none.

use std::fmt::Write as _;
use std::io::{Cursor, Write as _};

use zip::ZipWriter;
use zip::write::SimpleFileOptions;

/// Values of all types, each with an output that follows its input.
pub const RELAY: &str = include_str!("../../../../tests/acceptance/fmu/relay.xml");

/// A single-track car: causality, name, and unit or type of each variable.
const PLANT: &str = "
    input F_x N
    input delta rad
    output X m
    output Y m
    output psi rad
    output v_x m/s
    output v_y m/s
    output r rad/s
    output a_x m/s2
    output a_y m/s2
    output alpha_f rad
    output alpha_r rad
    parameter body.m kg
    parameter body.I_zz kg.m2
    parameter tire_f.B 1/rad
    parameter tire_f.D 1
    parameter start.v_x m/s
    parameter start.v_y m/s
";

/// A controller of speed and yaw rate.
const CONTROLLER: &str = "
    input v_ref m/s
    input psi_ref rad
    input r_ref rad/s
    input v_x m/s
    input v_y m/s
    input r rad/s
    input xi_x N
    input xi_y N
    input xi_psi N.m
    input psi rad
    input mode Integer
    output F_x N
    output delta rad
    output r_cmd rad/s
";

/// A mass on a spring and a damper.
const SPRUNG_MASS: &str = "
    input F N
    input x_below m
    input v_below m/s
    output x m
    output v m/s
    output F_below N
    parameter k N/m
    parameter d N.s/m
";

pub fn plant() -> String {
    description("plant", PLANT)
}

pub fn controller() -> String {
    description("controller", CONTROLLER)
}

pub fn sprung_mass() -> String {
    description("sprung_mass", SPRUNG_MASS)
}

/// The modelDescription.xml of these variables. Each output may follow each input.
fn description(model: &str, variables: &str) -> String {
    let mut xml = format!(
        "<fmiModelDescription fmiVersion=\"2.0\" modelName=\"{model}\" guid=\"{model}\">\n\
         <CoSimulation modelIdentifier=\"{model}\"/>\n<ModelVariables>\n"
    );
    let mut outputs = String::new();
    let lines = variables.lines().map(str::trim).filter(|line| !line.is_empty());
    for (index, line) in lines.enumerate() {
        let words: Vec<_> = line.split(' ').collect();
        let [causality, name, kind] = words[..] else { panic!("{line}") };
        let value = match (kind, causality) {
            ("Integer", _) => "<Integer start=\"0\"/>".to_owned(),
            (unit, "output") => format!("<Real unit=\"{unit}\"/>"),
            (unit, _) => format!("<Real unit=\"{unit}\" start=\"0\"/>"),
        };
        let variability = match (kind, causality) {
            (_, "parameter") => "fixed",
            ("Integer", _) => "discrete",
            _ => "continuous",
        };
        let _ = writeln!(
            xml,
            "<ScalarVariable name=\"{name}\" valueReference=\"{index}\" causality=\"{causality}\" variability=\"{variability}\">{value}</ScalarVariable>"
        );
        if causality == "output" {
            let _ = writeln!(outputs, "<Unknown index=\"{}\"/>", index + 1);
        }
    }
    xml + "</ModelVariables>\n<ModelStructure>\n<Outputs>\n"
        + &outputs
        + "</Outputs>\n<InitialUnknowns>\n"
        + &outputs
        + "</InitialUnknowns>\n</ModelStructure>\n</fmiModelDescription>\n"
}

/// The FMU of a description, with a library for Linux.
pub fn archive(description: &str) -> Vec<u8> {
    let model = description.split("modelIdentifier=\"").nth(1).and_then(|it| it.split('"').next());
    let library = format!("binaries/linux64/{}.so", model.unwrap_or("model"));
    zipped(&[("modelDescription.xml", description.as_bytes()), (&library, b"no library")])
}

pub fn zipped(entries: &[(&str, &[u8])]) -> Vec<u8> {
    let mut zip = ZipWriter::new(Cursor::new(Vec::new()));
    for (name, bytes) in entries {
        zip.start_file(*name, SimpleFileOptions::default()).expect("an entry");
        zip.write_all(bytes).expect("an entry");
    }
    zip.finish().expect("an archive").into_inner()
}
