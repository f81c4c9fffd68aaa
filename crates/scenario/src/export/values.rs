//! Writes start values, and the first values of signals and tables that lead to inputs.

use std::collections::BTreeMap;

use fmu_import::description::Type;
use fmu_import::{Value, Variable};
use ssp::write::{DraftConnector, DraftValue};

use super::ends::{Ends, Link, array_name};
use crate::plan::{Body, NodePlan};

/// The start values of an FMU, by the order of its connectors.
pub(super) fn values(
    ends: &Ends,
    node: &NodePlan,
    connectors: &[DraftConnector],
    links: &[Link],
    notes: &mut Vec<String>,
) -> Vec<DraftValue> {
    let Body::Fmu { fmu, starts, .. } = &node.body else { return Vec::new() };
    let mut given: BTreeMap<&str, Value> = BTreeMap::new();
    for link in links.iter().filter(|link| link.to.node == node.name) {
        given.extend(first_value(ends, link).map(|value| (link.to.variable.as_str(), value)));
    }
    given.extend(starts.iter().map(|start| (start.name.as_str(), start.value.clone())));
    let variables = &fmu.description.variables;
    let values = connectors.iter().filter_map(|connector| {
        let mut elements: Vec<&Variable> =
            variables.iter().filter(|variable| array_name(variable) == connector.name).collect();
        elements.sort_by_key(|variable| variable.element.0);
        if !elements.iter().any(|variable| given.contains_key(variable.name.as_str())) {
            return None;
        }
        let value = |variable: &&Variable| {
            let value = given.get(variable.name.as_str()).cloned();
            value.or_else(|| variable.start_value()).map(|value| written(&value, variable))
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
            false => ssp::Value::Array { dimensions, elements: written },
        };
        let (name, data_type) = (connector.name.clone(), connector.data_type.clone());
        Some(DraftValue { name, data_type, value })
    });
    values.collect()
}

/// The first value of an input that a signal or a table leads to: tools without signals keep it.
fn first_value(ends: &Ends, link: &Link) -> Option<Value> {
    let target = ends.variable(&link.to.node, &link.to.variable)?;
    let (source, time) = (ends.node(&link.from.node)?, ends.system.clock.start);
    let own = |column: &&recording::Column| column.node == source.name;
    let place = ends.system.columns.iter().filter(own);
    let place = place.take_while(|column| column.variable != link.from.variable).count();
    let value = match &source.body {
        Body::Signals(signals) => signals.get(place)?.value(time),
        Body::Table(table) if place < table.names().count() => table.clone().value(place, time),
        Body::Table(_) => return None,
        Body::Fmu { .. } | Body::Driver(_) | Body::Inlet | Body::Outlet => return None,
    };
    let value = link.chain.as_ref()?.convert(value);
    let whole = || (value.fract() == 0.0 && value.abs() < 9e15).then_some(value as i128);
    match target.kind {
        Type::Real => value.is_finite().then_some(Value::Real(value)),
        Type::Integer | Type::Enumeration => whole().map(Value::Integer),
        Type::Boolean => Some(Value::Boolean(value != 0.0)),
        Type::String | Type::Binary | Type::Clock => None,
    }
}

fn written(value: &Value, variable: &Variable) -> ssp::Value {
    match value {
        Value::Real(real) => ssp::Value::Real(*real),
        Value::Integer(integer) => {
            let named = |item: &&fmu_import::description::EnumerationItem| {
                i128::from(item.value) == *integer
            };
            let item = variable.items.iter().find(named);
            let item = item.filter(|_| variable.kind == Type::Enumeration);
            item.map_or(ssp::Value::Integer(*integer), |item| {
                ssp::Value::Enumeration(item.name.clone())
            })
        }
        Value::Boolean(truth) => ssp::Value::Boolean(*truth),
        Value::String(text) => ssp::Value::String(text.clone()),
        Value::Binary(bytes) => ssp::Value::Binary(bytes.clone()),
    }
}
