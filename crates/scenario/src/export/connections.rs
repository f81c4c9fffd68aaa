//! Writes the connections of a scenario as those of SSP, with their transformations.

use cosim::system::InputChain;
use fmu_import::Variable;
use fmu_import::description::FmiType;
use ssp::write::{DraftComponent, DraftConnection};
use ssp::{SspUnit, ValueTransformation};

use super::connectors::{ConnectorElement, ElementConnection, SystemLookup};
use super::definitions::SspDefinitions;

/// The connections between components. What has no words in the standard is left out, with a note. So are signals and tables,
/// since tools refuse connectors of the system itself; their first values are start values.
pub(super) fn ssp_connections(
    variables: &SystemLookup,
    element_connections: &[ElementConnection],
    components: &[DraftComponent],
    definitions: &SspDefinitions,
    notes: &mut Vec<String>,
) -> Vec<DraftConnection> {
    let unit = |end: &ConnectorElement| {
        let component = components.iter().find(|it| it.name == end.component)?;
        let connector = component.connectors.iter().find(|it| it.name == end.connector)?;
        definitions.find_unit(connector.unit.as_deref())
    };
    let mut connections = Vec::new();
    for group in by_target(variables, element_connections) {
        let Some(ElementConnectionEnds { connection, from, to }) = group.first() else { continue };
        let transformation = match connects_whole_arrays(&group) {
            true => ssp_transformation(variables, connection, unit(from), unit(to)),
            false => Err("it connects elements of arrays"),
        };
        match transformation {
            Ok(transformation) => connections.push(DraftConnection {
                from: (Some(from.component.clone()), from.connector.clone()),
                to: (Some(to.component.clone()), to.connector.clone()),
                transformation,
            }),
            Err(reason) => notes.push(format!(
                "the connection from `{}` to `{}` is in the annotation only: {reason}, which SSP has no words for",
                connection.from.qualified_name(),
                connection.to.qualified_name()
            )),
        }
    }
    connections
}

/// A connection of elements, with the connectors at its ends.
struct ElementConnectionEnds<'l, 'a> {
    connection: &'l ElementConnection<'a>,
    from: ConnectorElement,
    to: ConnectorElement,
}

/// The connections between components, those to elements of one array together.
fn by_target<'l, 'a>(
    variables: &SystemLookup,
    connections: &'l [ElementConnection<'a>],
) -> Vec<Vec<ElementConnectionEnds<'l, 'a>>> {
    let mut groups: Vec<Vec<ElementConnectionEnds>> = Vec::new();
    for connection in connections {
        let from = variables.connector_element(connection.from);
        let (Some(from), Some(to)) = (from, variables.connector_element(connection.to)) else {
            continue;
        };
        let group = groups.iter_mut().find(|group| group.iter().any(|it| it.to.is_same_connector(&to)));
        let ends = ElementConnectionEnds { connection, from, to };
        match group {
            Some(group) => group.push(ends),
            None => groups.push(vec![ends]),
        }
    }
    groups
}

/// Whether the connections connect one whole connector to another, each element to that in the same place.
fn connects_whole_arrays(group: &[ElementConnectionEnds]) -> bool {
    let change = |it: &ElementConnectionEnds| {
        it.connection.chain.as_ref().map(|it| (it.factor, it.offset, it.map.clone()))
    };
    let Some(first) = group.first() else { return false };
    group.len() == first.to.element.1
        && first.from.element.1 == first.to.element.1
        && group.iter().enumerate().all(|(index, ends)| {
            ends.from.is_same_connector(&first.from)
                && (ends.from.element.0, ends.to.element.0) == (index, index)
                && change(ends) == change(first)
        })
}

/// What happens on the way in place of a conversion of units. None where a tool that converts units and one that does not
/// do the same.
fn ssp_transformation(
    variables: &SystemLookup,
    connection: &ElementConnection,
    from_unit: Option<&SspUnit>,
    to_unit: Option<&SspUnit>,
) -> Result<Option<ValueTransformation>, &'static str> {
    let Some(chain) = &connection.chain else { return Ok(None) };
    if connection.is_mixed {
        return Err("it has a map before another change");
    }
    let target = variables.find_variable(&connection.to.node, &connection.to.variable);
    let source = variables.find_variable(&connection.from.node, &connection.from.variable);
    if !chain.map.is_empty() {
        return map_transformation(chain, source, target).map(Some);
    }
    let (factor, offset) = (chain.factor, chain.offset);
    let kept = (factor, offset) == (1.0, 0.0);
    let is_converted = match (from_unit, to_unit) {
        (Some(from), Some(to)) => from.conversion_to(to) != Some((1.0, 0.0)),
        _ => false,
    };
    let real = |variable: Option<&Variable>| variable.is_some_and(|it| it.kind == FmiType::Real);
    match (kept && !is_converted, real(source) && real(target)) {
        (true, _) => Ok(None),
        (false, true) => Ok(Some(ValueTransformation::Linear { factor, offset })),
        (false, false) => Err("it has a factor or an offset for whole numbers"),
    }
}

fn map_transformation(
    chain: &InputChain,
    source: Option<&Variable>,
    target: Option<&Variable>,
) -> Result<ValueTransformation, &'static str> {
    let (Some(source), Some(target)) = (source, target) else { return Err("it has a map") };
    if (chain.factor, chain.offset) != (1.0, 0.0) {
        return Err("it has a map after a factor or an offset");
    }
    let whole = |number: f64| number.fract() == 0.0 && number.abs() < 9e15;
    if !chain.map.iter().flatten().all(|number| whole(*number)) {
        return Err("it has a map of numbers that are not whole");
    }
    // Checked: the numbers are whole and far below 2^63. Of several pairs with one source, the first counts.
    let pairs = || chain.map.iter().rev().map(|[from, to]| (*from as i64, *to as i64));
    match (source.kind, target.kind) {
        (FmiType::Boolean, FmiType::Boolean) => {
            Ok(ValueTransformation::Boolean(pairs().map(|(from, to)| (from != 0, to != 0)).collect()))
        }
        (FmiType::Integer, FmiType::Integer) => {
            let pairs = pairs().map(|(from, to)| (i128::from(from), i128::from(to)));
            Ok(ValueTransformation::Integer(pairs.collect()))
        }
        (FmiType::Enumeration, FmiType::Enumeration) => {
            let item = |variable: &Variable, value: i64| {
                let item = variable.items.iter().find(|item| item.value == value);
                item.map(|item| item.name.clone()).ok_or("it has a map of values without items")
            };
            let named = pairs().map(|(from, to)| Ok((item(source, from)?, item(target, to)?)));
            named.collect::<Result<_, &str>>().map(ValueTransformation::Enumeration)
        }
        _ => Err("it has a map between types or of real numbers"),
    }
}
