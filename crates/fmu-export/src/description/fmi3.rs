//! Writes `modelDescription.xml` of FMI 3.0 from the same table of variables.

use std::fmt::{self, Write};

use super::{
    DescribedVariable, DescriptionTable, SpaceSeparated, XmlEscaped, write_categories, write_experiment,
    write_quantity, write_units, write_variable_start_tag,
};
use crate::array::{self, VariableRowSpan};
use crate::variable::{Causality, OutputDependencies, VariableKind, VariableRow};

pub(super) fn write_fmi3_description(
    out: &mut dyn Write,
    token: &str,
    table: &DescriptionTable,
) -> fmt::Result {
    let DescriptionTable { info, variables, capabilities, .. } = table;
    writeln!(out, r#"<?xml version="1.0" encoding="UTF-8"?>"#)?;
    write!(
        out,
        r#"<fmiModelDescription fmiVersion="3.0" modelName="{}" instantiationToken="{token}" description="{}""#,
        XmlEscaped(info.name),
        XmlEscaped(info.description),
    )?;
    if let Some(author) = info.author {
        write!(out, r#" author="{}""#, XmlEscaped(author))?;
    }
    writeln!(
        out,
        r#" version="{}" generationTool="Trackside" variableNamingConvention="structured">"#,
        XmlEscaped(info.version),
    )?;
    write!(out, r#"  <CoSimulation modelIdentifier="{}""#, XmlEscaped(info.name))?;
    for (flag, set) in [
        ("needsExecutionTool", capabilities.needs_tool),
        ("canBeInstantiatedOnlyOncePerProcess", capabilities.only_once),
        ("canGetAndSetFMUState", capabilities.state),
        ("canSerializeFMUState", capabilities.serialized_state),
        ("canHandleVariableCommunicationStepSize", capabilities.variable_step),
        ("providesDirectionalDerivatives", capabilities.differentiable),
    ] {
        if set {
            write!(out, r#" {flag}="true""#)?;
        }
    }
    writeln!(out, "/>")?;
    write_units(out, variables)?;
    write_categories(out, info.log_categories)?;
    write_experiment(out, info)?;
    writeln!(out, "  <ModelVariables>")?;
    let spans = variable_row_spans(table);
    for span in &spans {
        write_variable(out, *span, variables)?;
    }
    if !variables.iter().any(|it| it.row.causality == Causality::Independent) {
        let (name, reference) = (time_name(variables), variables.len());
        writeln!(
            out,
            r#"    <Float64 name="{name}" valueReference="{reference}" causality="independent" variability="continuous" description="Simulation time"/>"#,
        )?;
    }
    writeln!(out, "  </ModelVariables>")?;
    write_structure(out, &spans, variables)?;
    writeln!(out, "</fmiModelDescription>")
}

/// A name for the time, which FMI 3.0 wants to be a variable.
fn time_name(variables: &[DescribedVariable]) -> String {
    let mut name = "time".to_owned();
    while variables.iter().any(|it| it.row.name == name) {
        name.push('_');
    }
    name
}

/// The variables that the rows make.
fn variable_row_spans(table: &DescriptionTable) -> Vec<VariableRowSpan> {
    let rows = table.variables.iter().map(|it| (&it.row, it.kind));
    match table.arrays {
        true => array::group_rows_into_variables(rows),
        false => (0..table.variables.len()).map(|first| VariableRowSpan { first, elements: 1 }).collect(),
    }
}

fn write_variable(
    out: &mut dyn Write,
    span: VariableRowSpan,
    variables: &[DescribedVariable],
) -> fmt::Result {
    let elements = &variables[span.first..span.first + span.elements];
    let variable = &variables[span.first];
    let kind = match variable.kind {
        VariableKind::Real => "Float64",
        VariableKind::Integer => "Int32",
        VariableKind::Boolean => "Boolean",
        VariableKind::String => "String",
    };
    let mut about: Vec<_> = elements.iter().map(|it| it.row.description).collect();
    about.dedup();
    let name = span.array_name(variable.row.name);
    write_variable_start_tag(out, kind, span.first, name, &about.join("; "), &variable.row)?;
    write_quantity(out, variable)?;
    let starts: Vec<_> = elements.iter().filter_map(|it| it.start.as_deref()).collect();
    let text = variable.kind == VariableKind::String;
    if !starts.is_empty() && !text {
        write!(out, r#" start="{}""#, starts.join(" "))?;
    }
    let mut inside = String::new();
    if variable.row.optional {
        inside.push_str(r#"<Annotations><Annotation type="trackside.optional"/></Annotations>"#);
    }
    if span.elements > 1 {
        write!(inside, r#"<Dimension start="{}"/>"#, span.elements)?;
    }
    for start in starts.iter().filter(|_| text) {
        write!(inside, r#"<Start value="{}"/>"#, XmlEscaped(start))?;
    }
    match inside.as_str() {
        "" => writeln!(out, "/>"),
        inside => writeln!(out, ">{inside}</{kind}>"),
    }
}

fn write_structure(
    out: &mut dyn Write,
    spans: &[VariableRowSpan],
    rows: &[DescribedVariable],
) -> fmt::Result {
    let references = |selected: &dyn Fn(&VariableRow) -> bool| -> Vec<usize> {
        let rows_of = |span: &VariableRowSpan| span.first..span.first + span.elements;
        let chosen = spans.iter().filter(|span| rows_of(span).any(|i| selected(&rows[i].row)));
        chosen.map(|span| span.first).collect()
    };
    writeln!(out, "  <ModelStructure>")?;
    for i in references(&|row| row.causality == Causality::Output) {
        write!(out, r#"    <Output valueReference="{i}""#)?;
        if let OutputDependencies::On(names) = rows[i].row.depends {
            let inputs = references(&|row| names.contains(&row.name));
            write!(out, r#" dependencies="{}""#, SpaceSeparated(&inputs))?;
        }
        writeln!(out, "/>")?;
    }
    for i in references(&VariableRow::is_initial_unknown) {
        writeln!(out, r#"    <InitialUnknown valueReference="{i}"/>"#)?;
    }
    writeln!(out, "  </ModelStructure>")
}
