//! Resolves `[[connector]]` to nodes that hand on one value from an output to inputs, and expands terminals and arrays into
//! connections of single values.

use std::collections::BTreeMap;
use std::ops::Range;

use cosim::system::NodeBody;
use diagnostics::{Error, ErrorCollector};

use super::lookup::{PortSide, find_port};
use super::node_draft::{NodeDraft, PortNames};
use super::ports::Port;
use super::{ResolveDiagnostics, arrays, manoeuvres, terminals, types, unit};
use crate::document::{Connect, Connector, ConnectorKind, Scenario, Subsystem, UnconnectedInputs};

/// The connections of a scenario, each of one output and one input; connectors join the nodes. Connections that lead on from an
/// input connector without one are left out.
pub(super) fn expand_connections(
    scenario: &Scenario,
    nodes: &mut Vec<NodeDraft>,
    diagnostics: &mut ResolveDiagnostics,
) -> Vec<Connect> {
    let mut connects = terminals::expand_terminals(scenario, nodes, diagnostics);
    let mistakes = &mut diagnostics.mistakes;
    connects.extend(manoeuvres::measurement_connections(scenario, nodes, &connects, mistakes));
    let mut connects = arrays::expand_arrays(scenario, &connects, nodes, mistakes);
    let mut open: BTreeMap<String, (Range<usize>, Vec<UnconnectedConnector>)> = BTreeMap::new();
    for word in &scenario.document.connector {
        let name = word.name.get_ref();
        let named = split_name(scenario, word, nodes);
        let Some((node, variable)) = mistakes.ok_or_record_named(name, named) else { continue };
        let connector = build_connector(scenario, word, variable, &connects, nodes);
        let Some((body, port)) = mistakes.ok_or_record_named(name, connector) else { continue };
        let fed = connects.iter().any(|connect| connect.to.get_ref() == name);
        if word.kind == ConnectorKind::Input && !fed {
            let found = input_without_start(scenario, word, &connects, nodes);
            if let Some(found) = found.filter(|_| word.unconnected != Some(UnconnectedInputs::Start)) {
                let span = connector_span(scenario, word, node);
                let connector = UnconnectedConnector { connector: variable.to_owned(), inner: found };
                open.entry(node.to_owned()).or_insert((span, Vec::new())).1.push(connector);
            }
            connects.retain(|connect| connect.from.get_ref() != name);
        }
        nodes.push(NodeDraft {
            name: node.to_owned(),
            body,
            outputs: vec![port.clone()],
            inputs: vec![port],
            started_inputs: Vec::new(),
            span: word.name.span(),
            port_names: PortNames::default(),
        });
    }
    for (node, (span, open)) in open {
        mistakes.push(unconnected_error(scenario, &node, span, &open));
    }
    connects
}

/// An input connector that nothing leads to, and an input behind it that has no start value.
struct UnconnectedConnector {
    connector: String,
    inner: (String, String),
}

/// Node and variable of a connector.
fn split_name<'w>(
    scenario: &Scenario,
    word: &'w Connector,
    nodes: &[NodeDraft],
) -> Result<(&'w str, &'w str), Error> {
    let name = word.name.get_ref();
    let wrong = |message: String| Err(scenario.error_at(&word.name, message));
    let Some((node, variable)) = name.split_once('.') else {
        return wrong(format!("expected `node.variable`, found `{name}`"));
    };
    let of_node = |known: &&NodeDraft| known.name == node;
    for known in nodes.iter().filter(of_node) {
        if !known.is_connector() {
            return wrong(format!("there are two nodes called `{node}`"));
        }
        if known.inputs.iter().any(|port| port.name == variable) {
            return wrong(format!("there are two connectors called `{name}`"));
        }
    }
    Ok((node, variable))
}

/// What a connector is, and its port: that of the input that it leads to, of an output that of its source.
fn build_connector(
    scenario: &Scenario,
    word: &Connector,
    variable: &str,
    connects: &[Connect],
    nodes: &[NodeDraft],
) -> Result<(NodeBody, Port), Error> {
    let name = word.name.get_ref();
    let before = connects.iter().find(|connect| connect.to.get_ref() == name);
    let behind = connects.iter().find(|connect| connect.from.get_ref() == name);
    let source = |connect: &Connect| {
        let end = find_port(scenario, nodes, &connect.from, PortSide::Output)?;
        Ok(nodes[end.node].outputs[end.port].clone())
    };
    let target = |connect: &Connect| {
        let end = find_port(scenario, nodes, &connect.to, PortSide::Input)?;
        Ok(nodes[end.node].inputs[end.port].clone())
    };
    let (body, inner) = match (word.kind, before, behind) {
        (ConnectorKind::Input, _, Some(behind)) => (NodeBody::Inlet, target(behind)),
        (ConnectorKind::Input, Some(before), None) => (NodeBody::Inlet, source(before)),
        (ConnectorKind::Output, Some(before), _) => (NodeBody::Outlet, source(before)),
        _ => {
            let message = format!("nothing is connected to `{name}`");
            let error = scenario.error_at(&word.name, message);
            return Err(error.with_help(format!("connect it: [[connect]] to = \"{name}\"")));
        }
    };
    // An end that is wrong is told where it is connected.
    let inner = inner.map_err(|_: Error| Error::already_reported());
    let own = word.unit.as_ref().map(|word| unit::parse_unit(scenario, word)).transpose();
    let (inner, own) = ErrorCollector::collect_both(inner, own)?;
    let mut port = Port {
        name: variable.to_owned(),
        description: None,
        element: (0, 1),
        index: 0,
        follows: Some([0].into()),
        ..inner
    };
    if let Some((unit, word)) = own.zip(word.unit.as_ref()) {
        let unit = if port.relative.is_some() { unit.difference_unit() } else { unit };
        (port.dimension, port.unit) = (Some(unit), Some(word.get_ref().clone()));
    }
    Ok((body, port))
}

/// An input behind a connector that has neither a start value nor another way to one: its node and its name.
fn input_without_start(
    scenario: &Scenario,
    word: &Connector,
    connects: &[Connect],
    nodes: &[NodeDraft],
) -> Option<(String, String)> {
    let behind = connects.iter().filter(|connect| connect.from == word.name);
    let mut targets = behind.filter_map(|connect| {
        let end = find_port(scenario, nodes, &connect.to, PortSide::Input).ok()?;
        let node = &nodes[end.node];
        let port = &node.inputs[end.port];
        (!node.started_inputs.contains(&port.name) && !port.optional).then(|| {
            let example = format!("{{ \"{}\" = {} }}", port.name, types::example_start_value(port));
            (node.name.clone(), example)
        })
    });
    targets.next()
}

/// The word that a message about a connector points at: that of its system.
fn connector_span(scenario: &Scenario, word: &Connector, node: &str) -> Range<usize> {
    let mut systems = scenario.document.system.iter();
    let system = systems.find(|system| system.subsystem_name() == node);
    system.map_or_else(|| word.name.span(), Subsystem::name_or_path_span)
}

/// An input that nobody thought of keeps its start value for ever, which looks like a result: the scenario has to say that it wants
/// that.
fn unconnected_error(
    scenario: &Scenario,
    node: &str,
    span: Range<usize>,
    open: &[UnconnectedConnector],
) -> Error {
    let names: Vec<_> = open.iter().map(|open| open.connector.as_str()).collect();
    let message =
        format!("nothing is connected to `{}` of `{node}`, and there is no start value", names.join("`, `"));
    let error = scenario.source.error_at(span, message, "this one");
    let Some(UnconnectedConnector { connector, inner: (inner, example) }) = open.first() else {
        return error;
    };
    error.with_help(format!(
        "connect it: [[connect]] to = \"{node}.{connector}\", or let the input behind it stay at a value: start = {example} in [[fmu]] `{inner}`; with `unconnected = \"start\"` all of them keep the start values of the system"
    ))
}
