//! Writes `modelDescription.xml` from the table of variables.

use std::collections::BTreeSet;
use std::fmt::{self, Display, Write};

use crate::unit::{self, Unit};
use crate::variable::{Access, Causality, Depends, Initial, Row, Variability, Variable};
use crate::{Info, Model};

/// The log categories of every unit, with what they carry.
pub const LOG_CATEGORIES: [(&str, &str); 5] = [
    ("logEvents", "Instantiation, initialisation, reset and termination"),
    ("logStatusWarning", "Results to look at"),
    ("logStatusDiscard", "Steps that were not completed"),
    ("logStatusError", "Calls that failed"),
    ("logStatusFatal", "Failures that no call recovers from"),
];

/// Units in which people read what is computed in the unit on the left.
const DISPLAY_UNITS: [(&str, &str); 4] =
    [("rad", "deg"), ("rad/s", "deg/s"), ("rad/s2", "deg/s2"), ("m/s", "km/h")];

/// The identity of a model: a hash of its whole description, so that a library and a description of
/// different builds do not fit together.
#[must_use]
pub fn guid<M: Model>() -> String {
    let mut hash = Fnv::default();
    // Hashing cannot fail, and so neither can writing into the hash.
    let _ = write::<M>(&mut hash, "");
    format!("{{{:016x}{:016x}}}", hash.0[0], hash.0[1])
}

/// The text of `modelDescription.xml`.
#[must_use]
pub fn xml<M: Model>() -> String {
    let mut text = String::new();
    // Writing into a string cannot fail.
    let _ = write::<M>(&mut text, &guid::<M>());
    text
}

/// What is wrong with a table of variables: names that are no C identifier or stand twice, units that
/// are not understood, start values outside of their limits, dependencies on what is no input.
#[must_use]
pub fn problems<M: Model>() -> Vec<String> {
    let mut problems = Vec::new();
    let identifier = |name: &str| {
        name.starts_with(|first: char| first.is_ascii_alphabetic() || first == '_')
            && name.chars().all(|letter| letter.is_ascii_alphanumeric() || letter == '_')
    };
    if !identifier(M::INFO.name) {
        problems.push(format!("the model's name `{}` is no C identifier", M::INFO.name));
    }
    let rows = || M::VARIABLES.iter().map(|variable| variable.row);
    let mut start = M::default();
    for (place, Variable { row, access }) in M::VARIABLES.iter().enumerate() {
        let Row { name, unit, .. } = *row;
        if rows().take(place).any(|other| other.name == name) {
            problems.push(format!("there are two variables called `{name}`"));
        }
        if !unit.is_empty()
            && let Err(error) = Unit::parse(unit)
        {
            problems.push(format!("`{name}`: {error}"));
        }
        let value = match access {
            Access::Real(at) => *at(&mut start),
            Access::Integer(at) => f64::from(*at(&mut start)),
            Access::Boolean(_) | Access::String(_) => continue,
        };
        if value < row.min.unwrap_or(value) || value > row.max.unwrap_or(value) {
            problems.push(format!("`{name}` starts at {value}, outside of its limits"));
        }
        let Depends::On(inputs) = row.depends else { continue };
        for input in inputs {
            if !rows().any(|row| row.causality == Causality::Input && row.name == *input) {
                problems.push(format!("`{name}` depends on `{input}`, which is no input"));
            }
        }
    }
    problems
}

/// Two FNV-1a hashes with different offset bases, 128 bits in all.
struct Fnv([u64; 2]);

impl Default for Fnv {
    fn default() -> Self {
        Fnv([0xcbf2_9ce4_8422_2325, 0x6c62_272e_07bb_0142])
    }
}

impl Write for Fnv {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        for byte in text.bytes() {
            for half in &mut self.0 {
                *half = (*half ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01b3);
            }
        }
        Ok(())
    }
}

fn write<M: Model>(out: &mut dyn Write, guid: &str) -> fmt::Result {
    let Info { name, description, step } = M::INFO;
    writeln!(out, r#"<?xml version="1.0" encoding="UTF-8"?>"#)?;
    writeln!(
        out,
        r#"<fmiModelDescription fmiVersion="2.0" modelName="{name}" guid="{guid}" description="{}" version="{}" generationTool="Trackside" variableNamingConvention="structured" numberOfEventIndicators="0">"#,
        Escaped(description),
        env!("CARGO_PKG_VERSION"),
    )?;
    writeln!(
        out,
        r#"  <CoSimulation modelIdentifier="{name}" canHandleVariableCommunicationStepSize="true" canNotUseMemoryManagementFunctions="true" canGetAndSetFMUstate="true" canSerializeFMUstate="true"/>"#
    )?;
    write_units(out, M::VARIABLES)?;
    writeln!(out, "  <LogCategories>")?;
    for (name, description) in LOG_CATEGORIES {
        writeln!(out, r#"    <Category name="{name}" description="{description}"/>"#)?;
    }
    writeln!(out, "  </LogCategories>")?;
    writeln!(out, r#"  <DefaultExperiment startTime="0" stepSize="{step}"/>"#)?;
    writeln!(out, "  <ModelVariables>")?;
    let mut start = M::default();
    for (reference, variable) in M::VARIABLES.iter().enumerate() {
        write_variable(out, reference, variable, &mut start)?;
    }
    writeln!(out, "  </ModelVariables>")?;
    write_structure(out, M::VARIABLES)?;
    writeln!(out, "</fmiModelDescription>")
}

fn write_units<M>(out: &mut dyn Write, rows: &[Variable<M>]) -> fmt::Result {
    let names: BTreeSet<_> =
        rows.iter().map(|variable| variable.row.unit).filter(|unit| !unit.is_empty()).collect();
    if names.is_empty() {
        return Ok(());
    }
    writeln!(out, "  <UnitDefinitions>")?;
    for name in names {
        writeln!(out, r#"    <Unit name="{}">"#, Escaped(name))?;
        // A name that is not understood is written without base unit; `problems` tells of it.
        if let Ok(unit) = Unit::parse(name) {
            write!(out, "      <BaseUnit")?;
            for (base, exponent) in unit::BASE.iter().zip(unit.exponents) {
                if exponent != 0 {
                    write!(out, r#" {base}="{exponent}""#)?;
                }
            }
            if unit.factor != 1.0 {
                write!(out, r#" factor="{}""#, unit.factor)?;
            }
            if unit.offset != 0.0 {
                write!(out, r#" offset="{}""#, unit.offset)?;
            }
            writeln!(out, "/>")?;
        }
        if let Some(display) = display_unit(name)
            && let (Ok(from), Ok(to)) = (Unit::parse(name), Unit::parse(display))
            && let Some((factor, _)) = Unit::conversion(&from, &to)
        {
            writeln!(out, r#"      <DisplayUnit name="{display}" factor="{factor}"/>"#)?;
        }
        writeln!(out, "    </Unit>")?;
    }
    writeln!(out, "  </UnitDefinitions>")
}

fn display_unit(unit: &str) -> Option<&'static str> {
    DISPLAY_UNITS.iter().find(|(from, _)| *from == unit).map(|(_, to)| *to)
}

fn write_variable<M>(
    out: &mut dyn Write,
    reference: usize,
    Variable { row, access }: &Variable<M>,
    start: &mut M,
) -> fmt::Result {
    write!(
        out,
        r#"    <ScalarVariable name="{}" valueReference="{reference}" description="{}" causality="{}" variability="{}""#,
        Escaped(row.name),
        Escaped(row.description),
        causality(row.causality),
        variability(row.variability),
    )?;
    if let Some(initial) = row.initial {
        write!(out, r#" initial="{}""#, self::initial(initial))?;
    }
    write!(out, "><{}", kind(access))?;
    if !row.unit.is_empty() {
        write!(out, r#" unit="{}""#, Escaped(row.unit))?;
        if let Some(display) = display_unit(row.unit) {
            write!(out, r#" displayUnit="{display}""#)?;
        }
    }
    for (name, value) in [("min", row.min), ("max", row.max), ("nominal", row.nominal)] {
        if let Some(value) = value {
            write!(out, r#" {name}="{value}""#)?;
        }
    }
    if row.has_start() {
        match access {
            Access::Real(at) => write!(out, r#" start="{}""#, *at(start))?,
            Access::Integer(at) => write!(out, r#" start="{}""#, *at(start))?,
            Access::Boolean(at) => write!(out, r#" start="{}""#, *at(start))?,
            Access::String(at) => write!(out, r#" start="{}""#, Escaped(at(start)))?,
        }
    }
    writeln!(out, "/></ScalarVariable>")
}

fn write_structure<M>(out: &mut dyn Write, rows: &[Variable<M>]) -> fmt::Result {
    let index = |wanted: &dyn Fn(&Row) -> bool| -> Vec<usize> {
        (0..rows.len()).filter(|&i| wanted(&rows[i].row)).map(|i| i + 1).collect()
    };
    writeln!(out, "  <ModelStructure>")?;
    let outputs = index(&|row| row.causality == Causality::Output);
    if !outputs.is_empty() {
        writeln!(out, "    <Outputs>")?;
        for i in outputs {
            write!(out, r#"      <Unknown index="{i}""#)?;
            if let Depends::On(names) = rows[i - 1].row.depends {
                let inputs = index(&|row| names.contains(&row.name));
                write!(out, r#" dependencies="{}""#, Joined(&inputs))?;
            }
            writeln!(out, "/>")?;
        }
        writeln!(out, "    </Outputs>")?;
    }
    let unknowns = index(&|row| {
        row.causality == Causality::CalculatedParameter
            || row.causality == Causality::Output
                && matches!(row.initial, Some(Initial::Calculated | Initial::Approx))
    });
    if !unknowns.is_empty() {
        writeln!(out, "    <InitialUnknowns>")?;
        for i in unknowns {
            writeln!(out, r#"      <Unknown index="{i}"/>"#)?;
        }
        writeln!(out, "    </InitialUnknowns>")?;
    }
    writeln!(out, "  </ModelStructure>")
}

fn kind<M>(access: &Access<M>) -> &'static str {
    match access {
        Access::Real(_) => "Real",
        Access::Integer(_) => "Integer",
        Access::Boolean(_) => "Boolean",
        Access::String(_) => "String",
    }
}

fn causality(causality: Causality) -> &'static str {
    match causality {
        Causality::Parameter => "parameter",
        Causality::CalculatedParameter => "calculatedParameter",
        Causality::Input => "input",
        Causality::Output => "output",
        Causality::Local => "local",
    }
}

fn variability(variability: Variability) -> &'static str {
    match variability {
        Variability::Constant => "constant",
        Variability::Fixed => "fixed",
        Variability::Tunable => "tunable",
        Variability::Discrete => "discrete",
        Variability::Continuous => "continuous",
    }
}

fn initial(initial: Initial) -> &'static str {
    match initial {
        Initial::Exact => "exact",
        Initial::Approx => "approx",
        Initial::Calculated => "calculated",
    }
}

/// Text inside an XML attribute.
struct Escaped<'a>(&'a str);

impl Display for Escaped<'_> {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        for character in self.0.chars() {
            match character {
                '&' => out.write_str("&amp;")?,
                '<' => out.write_str("&lt;")?,
                '>' => out.write_str("&gt;")?,
                '"' => out.write_str("&quot;")?,
                '\n' | '\r' | '\t' => write!(out, "&#{};", character as u32)?,
                other => out.write_char(other)?,
            }
        }
        Ok(())
    }
}

/// Numbers with spaces between them.
struct Joined<'a>(&'a [usize]);

impl Display for Joined<'_> {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (i, number) in self.0.iter().enumerate() {
            write!(out, "{}{number}", if i == 0 { "" } else { " " })?;
        }
        Ok(())
    }
}
