//! Writes `modelDescription.xml` of FMI 2.0 from the table of variables.

mod fmi3;
mod problems;
mod terminals;
mod units;

use std::fmt::{self, Display, Write};

use crate::info::Info;
use crate::log::LOG_CATEGORIES;
use crate::model::Model;
pub use crate::table::model_problems;
use crate::variable::{
    Causality, Initial, OutputDependencies, Variability, Variable, VariableAccess, VariableKind, VariableRow,
};
use units::{display_unit, has_unit, write_units};

/// A variable as a description has it; its place in the list is its value reference.
#[derive(Debug, Clone)]
pub struct DescribedVariable {
    /// Its attributes.
    pub row: VariableRow,
    /// Its type.
    pub kind: VariableKind,
    /// Its start value, if it has one.
    pub start: Option<String>,
}

/// What an FMU can do besides steps.
#[derive(Debug, Clone, Copy, Default)]
pub struct FmuCapabilities {
    /// Steps of any size.
    pub variable_step: bool,
    /// Derivatives of inputs.
    pub interpolates: bool,
    /// Copies of the state.
    pub state: bool,
    /// The state as bytes.
    pub serialized_state: bool,
    /// Directional derivatives.
    pub differentiable: bool,
    /// Not more than one instance in a process.
    pub only_once: bool,
    /// Needs another program on the machine, such as an interpreter.
    pub needs_tool: bool,
}

/// The source of a description.
#[derive(Debug, Clone)]
pub struct DescriptionTable {
    /// The FMU as a whole.
    pub info: Info,
    /// Its variables.
    pub variables: Vec<DescribedVariable>,
    /// Its capabilities.
    pub capabilities: FmuCapabilities,
    /// Whether rows `x[1]`, `x[2]`, ... are an array of FMI 3.0.
    pub arrays: bool,
}

impl DescriptionTable {
    fn of_model<M: Model>() -> Self {
        Self::of_variables(M::INFO, M::VARIABLES, &mut M::default(), M::DERIVATIVES.is_some())
    }

    fn of_variables<M>(info: Info, variables: &[Variable<M>], start: &mut M, differentiable: bool) -> Self {
        let variables = variables.iter().map(|Variable { row, access }| DescribedVariable {
            row: *row,
            kind: access.kind(),
            start: row.has_start().then(|| match access {
                VariableAccess::Real(at) => at(start).to_string(),
                VariableAccess::Integer(at) => at(start).to_string(),
                VariableAccess::Boolean(at) => at(start).to_string(),
                VariableAccess::String(at) => at(start).clone(),
            }),
        });
        let capabilities = FmuCapabilities {
            variable_step: true,
            interpolates: true,
            state: true,
            serialized_state: true,
            differentiable,
            only_once: false,
            needs_tool: false,
        };
        DescriptionTable { info, variables: variables.collect(), capabilities, arrays: true }
    }

    /// The text of the `modelDescription.xml` of FMI 2.0 with an identity.
    #[must_use]
    pub fn fmi2_description_xml(&self, guid: &str) -> String {
        let mut text = String::new();
        // Writing into a string cannot fail.
        let _ = write_fmi2_description(&mut text, guid, self);
        text
    }

    /// The same of FMI 3.0. Both may have one identity if they are one library.
    #[must_use]
    pub fn fmi3_description_xml(&self, token: &str) -> String {
        let mut text = String::new();
        // Writing into a string cannot fail.
        let _ = fmi3::write_fmi3_description(&mut text, token, self);
        text
    }

    /// The text of `terminalsAndIcons.xml` of FMI 3.0; nothing without terminals.
    #[must_use]
    pub fn terminals_xml(&self) -> String {
        let mut text = String::new();
        if !self.info.terminals.is_empty() {
            // Writing into a string cannot fail.
            let _ = terminals::write_terminals(&mut text, self.info.terminals);
        }
        text
    }

    /// An identity: a hash of the whole description, so that a library and a description of different builds do not fit together.
    #[must_use]
    pub fn guid(&self) -> String {
        let mut hash = FnvHash128::default();
        // Hashing cannot fail, and so neither can writing into the hash.
        let _ = write_fmi2_description(&mut hash, "", self);
        format!("{{{:016x}{:016x}}}", hash.0[0], hash.0[1])
    }
}

/// The identity of a model.
#[must_use]
pub fn model_guid<M: Model>() -> String {
    DescriptionTable::of_model::<M>().guid()
}

/// The text of `modelDescription.xml`.
#[must_use]
pub fn fmi2_model_xml<M: Model>() -> String {
    let table = DescriptionTable::of_model::<M>();
    table.fmi2_description_xml(&table.guid())
}

/// The text of the `modelDescription.xml` of FMI 3.0. Its token is the GUID of that of FMI 2.0: both are one library.
#[must_use]
pub fn fmi3_model_xml<M: Model>() -> String {
    let table = DescriptionTable::of_model::<M>();
    table.fmi3_description_xml(&table.guid())
}

/// The text of `terminalsAndIcons.xml` of FMI 3.0; nothing without terminals.
#[must_use]
pub fn model_terminals_xml<M: Model>() -> String {
    DescriptionTable::of_model::<M>().terminals_xml()
}

/// Two FNV-1a hashes with different offset bases, 128 bits in all.
struct FnvHash128([u64; 2]);

impl Default for FnvHash128 {
    fn default() -> Self {
        FnvHash128([0xcbf2_9ce4_8422_2325, 0x6c62_272e_07bb_0142])
    }
}

impl Write for FnvHash128 {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        for byte in text.bytes() {
            for half in &mut self.0 {
                *half = (*half ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01b3);
            }
        }
        Ok(())
    }
}

fn write_fmi2_description(out: &mut dyn Write, guid: &str, table: &DescriptionTable) -> fmt::Result {
    let DescriptionTable { info, variables, capabilities, .. } = table;
    let Info { name, description, version, author, log_categories, .. } = *info;
    writeln!(out, r#"<?xml version="1.0" encoding="UTF-8"?>"#)?;
    write!(
        out,
        r#"<fmiModelDescription fmiVersion="2.0" modelName="{}" guid="{guid}" description="{}""#,
        XmlEscaped(name),
        XmlEscaped(description),
    )?;
    if let Some(author) = author {
        write!(out, r#" author="{}""#, XmlEscaped(author))?;
    }
    writeln!(
        out,
        r#" version="{}" generationTool="Trackside" variableNamingConvention="structured" numberOfEventIndicators="0">"#,
        XmlEscaped(version),
    )?;
    write_capabilities(out, name, *capabilities)?;
    write_units(out, variables)?;
    write_categories(out, log_categories)?;
    write_experiment(out, info)?;
    writeln!(out, "  <ModelVariables>")?;
    for (reference, variable) in variables.iter().enumerate() {
        write_variable(out, reference, variable)?;
    }
    writeln!(out, "  </ModelVariables>")?;
    write_structure(out, variables)?;
    writeln!(out, "</fmiModelDescription>")
}

/// The capabilities of the library. Its outputs have no time derivatives: `maxOutputDerivativeOrder` is 0, as
/// when it is absent.
fn write_capabilities(out: &mut dyn Write, name: &str, can: FmuCapabilities) -> fmt::Result {
    write!(out, r#"  <CoSimulation modelIdentifier="{}""#, XmlEscaped(name))?;
    for (flag, set) in [
        ("needsExecutionTool", can.needs_tool),
        ("canHandleVariableCommunicationStepSize", can.variable_step),
        ("canInterpolateInputs", can.interpolates),
        ("canBeInstantiatedOnlyOncePerProcess", can.only_once),
        ("canNotUseMemoryManagementFunctions", true),
        ("canGetAndSetFMUstate", can.state),
        ("canSerializeFMUstate", can.serialized_state),
        ("providesDirectionalDerivative", can.differentiable),
    ] {
        if set {
            write!(out, r#" {flag}="true""#)?;
        }
    }
    writeln!(out, "/>")
}

fn write_experiment(out: &mut dyn Write, info: &Info) -> fmt::Result {
    write!(out, r#"  <DefaultExperiment startTime="{}""#, info.start)?;
    for (name, value) in [("stopTime", info.stop), ("tolerance", info.tolerance)] {
        if let Some(value) = value {
            write!(out, r#" {name}="{value}""#)?;
        }
    }
    writeln!(out, r#" stepSize="{}"/>"#, info.step)
}

fn write_categories(out: &mut dyn Write, own: &[(&str, &str)]) -> fmt::Result {
    writeln!(out, "  <LogCategories>")?;
    for (name, description) in LOG_CATEGORIES.iter().chain(own) {
        let (name, description) = (XmlEscaped(name), XmlEscaped(description));
        writeln!(out, r#"    <Category name="{name}" description="{description}"/>"#)?;
    }
    writeln!(out, "  </LogCategories>")
}

/// The beginning of the element of a variable, with the attributes that all types have.
fn write_variable_start_tag(
    out: &mut dyn Write,
    element: &str,
    reference: usize,
    name: &str,
    about: &str,
    row: &VariableRow,
) -> fmt::Result {
    write!(
        out,
        r#"    <{element} name="{}" valueReference="{reference}" description="{}" causality="{}" variability="{}""#,
        XmlEscaped(name),
        XmlEscaped(about),
        causality_word(row.causality),
        variability_word(row.variability),
    )?;
    match row.initial {
        Some(initial) => write!(out, r#" initial="{}""#, self::initial_word(initial)),
        None => Ok(()),
    }
}

/// Unit, limits and usual size of a variable.
fn write_quantity(out: &mut dyn Write, variable: &DescribedVariable) -> fmt::Result {
    let row = &variable.row;
    if has_unit(variable) {
        write!(out, r#" unit="{}""#, XmlEscaped(row.unit))?;
        if let Some(display) = display_unit(row) {
            write!(out, r#" displayUnit="{}""#, XmlEscaped(display))?;
        }
        if row.relative {
            out.write_str(r#" relativeQuantity="true""#)?;
        }
    }
    for (name, value) in [("min", row.min), ("max", row.max), ("nominal", row.nominal)] {
        if let Some(value) = value {
            write!(out, r#" {name}="{value}""#)?;
        }
    }
    Ok(())
}

fn write_variable(out: &mut dyn Write, reference: usize, variable: &DescribedVariable) -> fmt::Result {
    let row = &variable.row;
    write_variable_start_tag(out, "ScalarVariable", reference, row.name, row.description, row)?;
    write!(out, "><{:?}", variable.kind)?;
    write_quantity(out, variable)?;
    if let Some(start) = &variable.start {
        write!(out, r#" start="{}""#, XmlEscaped(start))?;
    }
    let annotations = if row.optional {
        r#"<Annotations><Tool name="Trackside"><Optional/></Tool></Annotations>"#
    } else {
        ""
    };
    writeln!(out, "/>{annotations}</ScalarVariable>")
}

fn write_structure(out: &mut dyn Write, rows: &[DescribedVariable]) -> fmt::Result {
    let indices = |selected: &dyn Fn(&VariableRow) -> bool| -> Vec<usize> {
        (0..rows.len()).filter(|&i| selected(&rows[i].row)).map(|i| i + 1).collect()
    };
    writeln!(out, "  <ModelStructure>")?;
    let outputs = indices(&|row| row.causality == Causality::Output);
    if !outputs.is_empty() {
        writeln!(out, "    <Outputs>")?;
        for i in outputs {
            write!(out, r#"      <Unknown index="{i}""#)?;
            if let OutputDependencies::On(names) = rows[i - 1].row.depends {
                let inputs = indices(&|row| names.contains(&row.name));
                write!(out, r#" dependencies="{}""#, SpaceSeparated(&inputs))?;
            }
            writeln!(out, "/>")?;
        }
        writeln!(out, "    </Outputs>")?;
    }
    let unknowns = indices(&VariableRow::is_initial_unknown);
    if !unknowns.is_empty() {
        writeln!(out, "    <InitialUnknowns>")?;
        for i in unknowns {
            writeln!(out, r#"      <Unknown index="{i}"/>"#)?;
        }
        writeln!(out, "    </InitialUnknowns>")?;
    }
    writeln!(out, "  </ModelStructure>")
}

fn causality_word(causality: Causality) -> &'static str {
    match causality {
        Causality::Parameter => "parameter",
        Causality::CalculatedParameter => "calculatedParameter",
        Causality::Input => "input",
        Causality::Output => "output",
        Causality::Local => "local",
        Causality::Independent => "independent",
    }
}

fn variability_word(variability: Variability) -> &'static str {
    match variability {
        Variability::Constant => "constant",
        Variability::Fixed => "fixed",
        Variability::Tunable => "tunable",
        Variability::Discrete => "discrete",
        Variability::Continuous => "continuous",
    }
}

fn initial_word(initial: Initial) -> &'static str {
    match initial {
        Initial::Exact => "exact",
        Initial::Approx => "approx",
        Initial::Calculated => "calculated",
    }
}

/// Text inside an XML attribute.
struct XmlEscaped<'a>(&'a str);

impl Display for XmlEscaped<'_> {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        for character in self.0.chars() {
            match character {
                '&' => out.write_str("&amp;")?,
                '<' => out.write_str("&lt;")?,
                '>' => out.write_str("&gt;")?,
                '"' => out.write_str("&quot;")?,
                '\n' | '\r' | '\t' => write!(out, "&#{};", character as u32)?,
                // XML 1.0 has no way to write these.
                '\0'..' ' | '\u{fffe}' | '\u{ffff}' => out.write_char('\u{fffd}')?,
                other => out.write_char(other)?,
            }
        }
        Ok(())
    }
}

/// Numbers with spaces between them.
struct SpaceSeparated<'a>(&'a [usize]);

impl Display for SpaceSeparated<'_> {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (i, number) in self.0.iter().enumerate() {
            write!(out, "{}{number}", if i == 0 { "" } else { " " })?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests;
