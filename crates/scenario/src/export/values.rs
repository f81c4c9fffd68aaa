//! Writes the start values of an SSP export, with the first values of signals and tables that lead to inputs.

use std::collections::BTreeMap;

use cosim::system::{NodeBody, NodePlan};
use fmu_import::description::FmiType;
use fmu_import::{Value, Variable};
use ssp::write::{DraftConnector, DraftValue};

use super::connectors::{ElementConnection, SystemLookup};
use crate::document::ssp_value;

/// The start values of an FMU, by the order of its connectors.
pub(super) fn ssp_start_values(
    variables: &SystemLookup,
    node: &NodePlan,
    connectors: &[DraftConnector],
    connections: &[ElementConnection],
    notes: &mut Vec<String>,
) -> Vec<DraftValue> {
    let NodeBody::Fmu { fmu, starts, .. } = &node.body else { return Vec::new() };
    let mut given: BTreeMap<&str, Value> = BTreeMap::new();
    for connection in connections.iter().filter(|connection| connection.to.node == node.name) {
        given
            .extend(first_value(variables, connection).map(|value| (connection.to.variable.as_str(), value)));
    }
    given.extend(starts.iter().map(|start| (start.name.as_str(), start.value.clone())));
    let all = &fmu.description.variables;
    let values = connectors.iter().filter_map(|connector| {
        let mut elements: Vec<&Variable> =
            all.iter().filter(|variable| variable.array_name() == connector.name).collect();
        elements.sort_by_key(|variable| variable.element.0);
        if !elements.iter().any(|variable| given.contains_key(variable.name.as_str())) {
            return None;
        }
        let value = |variable: &&Variable| {
            let value = given.get(variable.name.as_str()).cloned();
            value.or_else(|| variable.start_value()).map(|value| ssp_value(&value, variable))
        };
        let Some(mut written) = elements.iter().map(value).collect::<Option<Vec<_>>>() else {
            notes.push(format!(
                "start values of some elements of `{}.{}` are in the annotation only: the description of the FMU has none for the others",
                node.name, connector.name
            ));
            return None;
        };
        let dimensions = connector.dimensions.clone();
        let value = match dimensions.is_empty() {
            true => written.pop()?,
            false => ssp::SspValue::Array { dimensions, elements: written },
        };
        let (name, data_type) = (connector.name.clone(), connector.data_type.clone());
        Some(DraftValue { name, data_type, value })
    });
    values.collect()
}

/// The first value of an input that a signal or a table leads to: tools without signals keep it.
fn first_value(variables: &SystemLookup, connection: &ElementConnection) -> Option<Value> {
    let target = variables.find_variable(&connection.to.node, &connection.to.variable)?;
    let (source, time) = (variables.find_node(&connection.from.node)?, variables.system.clock.start);
    let own = |column: &&recording::Column| column.node == source.name;
    let place = variables.system.columns.iter().filter(own);
    let place = place.take_while(|column| column.variable != connection.from.variable).count();
    let value = match &source.body {
        NodeBody::Signals(signals) => signals.get(place)?.value_at(time),
        NodeBody::Table(table) if place < table.column_names().count() => table.clone().value_at(place, time),
        NodeBody::Table(_) => return None,
        NodeBody::Fmu { .. } | NodeBody::Driver(_) | NodeBody::Own | NodeBody::Inlet | NodeBody::Outlet => {
            return None;
        }
    };
    let value = connection.chain.as_ref()?.convert_and_map(value);
    let whole = || (value.fract() == 0.0 && value.abs() < 9e15).then_some(value as i128);
    match target.kind {
        FmiType::Real => value.is_finite().then_some(Value::Real(value)),
        FmiType::Integer | FmiType::Enumeration => whole().map(Value::Integer),
        FmiType::Boolean => Some(Value::Boolean(value != 0.0)),
        FmiType::String | FmiType::Binary | FmiType::Clock => None,
    }
}
