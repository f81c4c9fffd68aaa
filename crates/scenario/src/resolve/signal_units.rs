//! Looks up the units of signals for expressions and analyses, and says where a missing one is declared.

use std::collections::BTreeMap;

use expression::SignalUnit;
use fmu_import::description::FmiType;
use recording::{AllVariables, Column, Columns};
use units::Unit;

use super::node_draft::NodeDraft;
use super::ports::Port;
use crate::document::Scenario;

/// The units of variables by their names, `node.variable`.
#[derive(Debug, Default)]
pub(super) struct SignalUnits(BTreeMap<String, SignalUnit>);

/// The columns of the run and their units: what expressions and analyses look signals up in.
#[derive(Clone, Copy)]
pub(super) struct RunSignals<'a> {
    pub columns: &'a Columns<AllVariables>,
    pub units: &'a SignalUnits,
}

impl SignalUnits {
    /// Those of all inputs and outputs.
    pub(super) fn from_nodes(nodes: &[NodeDraft]) -> Self {
        let ports = nodes.iter().flat_map(|node| {
            let ports = node.outputs.iter().chain(&node.inputs);
            ports.map(|port| (format!("{}.{}", node.name, port.name), port_unit(port)))
        });
        SignalUnits(ports.collect())
    }

    /// Those of all inputs and outputs, for expressions: differences are none on a scale with a shifted zero.
    pub(super) fn from_nodes_for_expressions(nodes: &[NodeDraft]) -> Self {
        let ports = nodes.iter().flat_map(|node| {
            let ports = node.outputs.iter().chain(&node.inputs);
            ports.map(|port| (format!("{}.{}", node.name, port.name), port))
        });
        let units = ports.map(|(name, port)| match port_unit(port) {
            SignalUnit::Known(unit, text) if port.relative.is_some() => {
                (name, SignalUnit::Difference(unit, text))
            }
            other => (name, other),
        });
        SignalUnits(units.collect())
    }

    /// Those of a recording. The run has judged them already: what is not known takes any.
    pub(super) fn from_recorded_columns<S>(columns: &Columns<S>) -> Self {
        let unit = |column: &Column| {
            let name = column.unit.clone()?;
            Some((column.qualified_name(), SignalUnit::Known(Unit::parse(&name).ok()?, name)))
        };
        SignalUnits(columns.iter().filter_map(unit).collect())
    }

    pub(super) fn unit_of_signal(&self, name: &str) -> SignalUnit {
        self.0.get(name).cloned().unwrap_or(SignalUnit::Plain)
    }
}

/// The unit of a port. Only Real numbers have one.
pub(super) fn port_unit(port: &Port) -> SignalUnit {
    match (port.kind, port.dimension, &port.unit) {
        _ if port.wrong_unit => SignalUnit::Plain,
        (FmiType::Real, Some(unit), Some(name)) => SignalUnit::Known(unit, name.clone()),
        (FmiType::Real, ..) => SignalUnit::Missing,
        _ => SignalUnit::Plain,
    }
}

/// The remedy for a variable without a unit: the line that declares it, with an example.
pub(super) fn unit_help(scenario: &Scenario, signal: &str, example: &str) -> String {
    let document = &scenario.document;
    let (node, variable) = signal.split_once('.').unwrap_or((signal, ""));
    if document.fmu.iter().any(|fmu| fmu.name.get_ref() == node) {
        let key = toml_key(variable);
        return format!(
            "say which unit `{signal}` has: unit = {{ {key} = \"{example}\" }} in [[fmu]] `{node}`"
        );
    }
    if document.table.iter().any(|table| table.name.get_ref() == node) {
        return format!(
            "say which unit `{signal}` has: unit = \"{example}\" in the column `{variable}` of [[table]] `{node}`"
        );
    }
    format!("say which unit `{signal}` has: unit = \"{example}\" in [[signal]] `{signal}`")
}

/// A name as a key of TOML.
pub(super) fn toml_key(name: &str) -> String {
    let is_bare = |c: char| c.is_ascii_alphanumeric() || matches!(c, '_' | '-');
    if !name.is_empty() && name.chars().all(is_bare) {
        return name.to_owned();
    }
    format!("\"{name}\"")
}
