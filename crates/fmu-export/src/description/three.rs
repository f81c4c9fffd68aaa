//! Writes `modelDescription.xml` of FMI 3.0 from the same table of variables.

use std::fmt::{self, Write};

use super::{
    Escaped, Joined, Table, guid, write_categories, write_experiment, write_head, write_quantity,
    write_units,
};
use crate::model::Model;
use crate::variable::{Access, Causality, Depends, Row, Variable};

/// The text of the `modelDescription.xml` of FMI 3.0. Its token is the GUID of that of FMI 2.0: both are one library.
#[must_use]
pub fn xml3<M: Model>() -> String {
    let mut text = String::new();
    // Writing into a string cannot fail.
    let _ = write(&mut text, &guid::<M>(), &mut Table::<M>::of_model());
    text
}

fn write<M>(out: &mut dyn Write, token: &str, table: &mut Table<M>) -> fmt::Result {
    let Table { info, variables, start, differentiable } = table;
    writeln!(out, r#"<?xml version="1.0" encoding="UTF-8"?>"#)?;
    write!(
        out,
        r#"<fmiModelDescription fmiVersion="3.0" modelName="{}" instantiationToken="{token}" description="{}""#,
        Escaped(info.name),
        Escaped(info.description),
    )?;
    if let Some(author) = info.author {
        write!(out, r#" author="{}""#, Escaped(author))?;
    }
    writeln!(
        out,
        r#" version="{}" generationTool="Trackside" variableNamingConvention="structured">"#,
        Escaped(info.version),
    )?;
    write!(
        out,
        r#"  <CoSimulation modelIdentifier="{}" canGetAndSetFMUState="true" canSerializeFMUState="true" canHandleVariableCommunicationStepSize="true""#,
        Escaped(info.name),
    )?;
    if *differentiable {
        write!(out, r#" providesDirectionalDerivatives="true""#)?;
    }
    writeln!(out, "/>")?;
    write_units(out, variables)?;
    write_categories(out, info.log_categories)?;
    write_experiment(out, info)?;
    writeln!(out, "  <ModelVariables>")?;
    for (reference, variable) in variables.iter().enumerate() {
        write_variable(out, reference, variable, start)?;
    }
    if !variables.iter().any(|it| it.row.causality == Causality::Independent) {
        let (name, reference) = (time_name(variables), variables.len());
        writeln!(
            out,
            r#"    <Float64 name="{name}" valueReference="{reference}" causality="independent" variability="continuous" description="Simulation time"/>"#,
        )?;
    }
    writeln!(out, "  </ModelVariables>")?;
    write_structure(out, variables)?;
    writeln!(out, "</fmiModelDescription>")
}

/// A name for the time, which FMI 3.0 wants to be a variable.
fn time_name<M>(variables: &[Variable<M>]) -> String {
    let mut name = "time".to_owned();
    while variables.iter().any(|it| it.row.name == name) {
        name.push('_');
    }
    name
}

fn write_variable<M>(
    out: &mut dyn Write,
    reference: usize,
    variable: &Variable<M>,
    start: &mut M,
) -> fmt::Result {
    let Variable { row, access } = variable;
    let kind = match access {
        Access::Real(_) => "Float64",
        Access::Integer(_) => "Int32",
        Access::Boolean(_) => "Boolean",
        Access::String(_) => "String",
    };
    write_head(out, kind, reference, row)?;
    write_quantity(out, variable)?;
    if row.has_start() {
        match access {
            Access::Real(at) => write!(out, r#" start="{}""#, *at(start))?,
            Access::Integer(at) => write!(out, r#" start="{}""#, *at(start))?,
            Access::Boolean(at) => write!(out, r#" start="{}""#, *at(start))?,
            Access::String(at) => {
                return writeln!(out, r#"><Start value="{}"/></{kind}>"#, Escaped(at(start)));
            }
        }
    }
    writeln!(out, "/>")
}

fn write_structure<M>(out: &mut dyn Write, rows: &[Variable<M>]) -> fmt::Result {
    let references = |selected: &dyn Fn(&Row) -> bool| -> Vec<usize> {
        (0..rows.len()).filter(|&i| selected(&rows[i].row)).collect()
    };
    writeln!(out, "  <ModelStructure>")?;
    for i in references(&|row| row.causality == Causality::Output) {
        write!(out, r#"    <Output valueReference="{i}""#)?;
        if let Depends::On(names) = rows[i].row.depends {
            let inputs = references(&|row| names.contains(&row.name));
            write!(out, r#" dependencies="{}""#, Joined(&inputs))?;
        }
        writeln!(out, "/>")?;
    }
    for i in references(&Row::is_initial_unknown) {
        writeln!(out, r#"    <InitialUnknown valueReference="{i}"/>"#)?;
    }
    writeln!(out, "  </ModelStructure>")
}
