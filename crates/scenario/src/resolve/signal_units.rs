//! Looks up the units of signals for expressions and analyses, and says where a missing one is declared.

use std::collections::BTreeMap;

use expression::SignalUnit;
use fmu_import::description::FmiType;
use recording::{AllVariables, Column, Columns};
use units::Unit;

use super::node_draft::NodeDraft;
use super::ports::Port;
use crate::document::{Scenario, Table};

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
    if let Some(table) = document.table.iter().find(|table| table.name.get_ref() == node) {
        let advice = column_unit_advice(table, variable, example, None);
        return format!(
            "say which unit `{signal}` has: {advice} in the column `{variable}` of [[table]] `{node}`"
        );
    }
    format!("say which unit `{signal}` has: unit = \"{example}\" in [[signal]] `{signal}`")
}

/// The same for a column of a table, by its name in the file and its largest value.
pub(super) fn column_unit_advice(
    table: &Table,
    variable: &str,
    wanted: &str,
    largest: Option<f64>,
) -> String {
    let mut columns = table.columns.iter().filter(|(name, _)| name.get_ref() == variable);
    let column = columns.next().map_or(variable, |(_, it)| it.get_ref().column.get_ref());
    unit_advice(column, wanted, largest)
}

/// Units of one dimension that numbers without a unit are usually in.
const USUAL: [(&str, &str); 8] = [
    ("rad", "deg"),
    ("rad/s", "deg/s"),
    ("m/s", "km/h"),
    ("m/s2", "g0"),
    ("m", "mm"),
    ("N", "kN"),
    ("Pa", "bar"),
    ("K", "degC"),
];

/// Beyond this no angle of a car is in rad: a steering wheel goes round three times.
const LARGEST_ANGLE: f64 = 20.0;

/// The key that says the unit of a column which meets a variable in `wanted`: the unit that its name has, or that its largest value
/// asks for; else the usual ones, since nobody but the user knows.
pub(super) fn unit_advice(column: &str, wanted: &str, largest: Option<f64>) -> String {
    let key = |unit: &str| format!("unit = \"{unit}\"");
    if let Some(named) = unit_in_name(column, wanted) {
        return key(&named);
    }
    if wanted == "rad" && largest.is_some_and(|largest| largest.abs() > LARGEST_ANGLE) {
        return key("deg");
    }
    let other = USUAL.iter().find_map(|(one, other)| match wanted {
        _ if wanted == *one => Some(other),
        _ if wanted == *other => Some(one),
        _ => None,
    });
    other.map_or(key(wanted), |other| {
        format!("{}, or \"{other}\" if its numbers are in {other},", key(wanted))
    })
}

/// The unit of the dimension of `wanted` that a name ends with: `deg` of `steer_deg` and of `Steer [deg]`.
fn unit_in_name(name: &str, wanted: &str) -> Option<String> {
    let wanted = Unit::parse(wanted).ok()?;
    let separators = |c: char| c.is_whitespace() || "_.[](),:;".contains(c);
    let parts: Vec<_> = name.split(separators).filter(|part| !part.is_empty()).collect();
    // A name that is one word is a quantity: `T` is a torque more often than a tesla.
    let (last, _) = parts.split_last().filter(|(_, before)| !before.is_empty())?;
    let unit = units::unit_for_spelling(last).unwrap_or(last);
    Unit::parse(unit).is_ok_and(|it| it.same_dimension(&wanted)).then(|| unit.to_owned())
}

/// A name as a key of TOML.
pub(super) fn toml_key(name: &str) -> String {
    let is_bare = |c: char| c.is_ascii_alphanumeric() || matches!(c, '_' | '-');
    if !name.is_empty() && name.chars().all(is_bare) {
        return name.to_owned();
    }
    format!("\"{name}\"")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_in_degrees_is_not_said_to_be_in_radians() {
        let both = "unit = \"rad\", or \"deg\" if its numbers are in deg,";
        for (column, wanted, largest, advice) in [
            ("steer_deg", "rad", None, "unit = \"deg\""),
            ("Steering Angle [deg]", "rad", Some(0.1), "unit = \"deg\""),
            ("steer", "rad", Some(-114.0), "unit = \"deg\""),
            ("steer", "rad", Some(3.0), both),
            ("steer_kmh", "rad", None, both),
            ("speed_kmh", "m/s", None, "unit = \"km/h\""),
            ("v", "m/s", None, "unit = \"m/s\", or \"km/h\" if its numbers are in km/h,"),
            ("yaw", "N.m", None, "unit = \"N.m\""),
        ] {
            assert_eq!(unit_advice(column, wanted, largest), advice, "{column}");
        }
    }
}
