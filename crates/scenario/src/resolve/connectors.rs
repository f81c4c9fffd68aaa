//! Makes nodes of connectors: each hands on one value from an output to inputs.

use std::collections::BTreeMap;
use std::ops::Range;

use diagnostics::{Error, Mistakes};

use super::nodes::{Names, UnplacedNode};
use super::port::{Side, find};
use super::ports::Port;
use super::{Notes, arrays, manoeuvres, terminals, types, unit};
use crate::plan::Body;
use crate::words::{Connect, Connector, ConnectorKind, Scenario, Subsystem, Unconnected};

/// The connections of a scenario, each of one output and one input; connectors join the nodes. Connections that lead on from an
/// input connector without one are left out.
pub(super) fn connects(
    scenario: &Scenario,
    unplaced: &mut Vec<UnplacedNode>,
    (mistakes, warnings): Notes,
) -> Vec<Connect> {
    let mut words = terminals::expanded(scenario, unplaced, (mistakes, warnings));
    words.extend(manoeuvres::measured(scenario, unplaced, &words, mistakes));
    let mut connects = arrays::expanded(scenario, &words, unplaced, mistakes);
    let mut open: BTreeMap<String, (Range<usize>, Vec<Open>)> = BTreeMap::new();
    for word in &scenario.document.connector {
        let name = word.name.get_ref();
        let named = names(scenario, word, unplaced);
        let Some((node, variable)) = mistakes.take_named(name, named) else { continue };
        let made = connector(scenario, (word, variable), &connects, unplaced);
        let Some((body, port)) = mistakes.take_named(name, made) else { continue };
        let fed = connects.iter().any(|connect| connect.to.get_ref() == name);
        if word.kind == ConnectorKind::Input && !fed {
            let found = unstarted(scenario, word, &connects, unplaced);
            if let Some(found) = found.filter(|_| word.unconnected != Some(Unconnected::Start)) {
                let place = place(scenario, word, node);
                let connector = Open { connector: variable.to_owned(), inner: found };
                open.entry(node.to_owned()).or_insert((place, Vec::new())).1.push(connector);
            }
            connects.retain(|connect| connect.from.get_ref() != name);
        }
        unplaced.push(UnplacedNode {
            name: node.to_owned(),
            body,
            outputs: vec![port.clone()],
            inputs: vec![port],
            started: Vec::new(),
            place: word.name.span(),
            names: Names::default(),
        });
    }
    for (node, (place, open)) in open {
        mistakes.push(unconnected(scenario, &node, place, &open));
    }
    connects
}

/// An input connector that nothing leads to, and an input behind it that has no start value.
struct Open {
    connector: String,
    inner: (String, String),
}

/// Node and variable of a connector.
fn names<'w>(
    scenario: &Scenario,
    word: &'w Connector,
    unplaced: &[UnplacedNode],
) -> Result<(&'w str, &'w str), Error> {
    let name = word.name.get_ref();
    let wrong = |message: String| Err(scenario.error(&word.name, message));
    let Some((node, variable)) = name.split_once('.') else {
        return wrong(format!("expected `node.variable`, found `{name}`"));
    };
    let of_node = |known: &&UnplacedNode| known.name == node;
    for known in unplaced.iter().filter(of_node) {
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
fn connector(
    scenario: &Scenario,
    (word, variable): (&Connector, &str),
    connects: &[Connect],
    unplaced: &[UnplacedNode],
) -> Result<(Body, Port), Error> {
    let name = word.name.get_ref();
    let before = connects.iter().find(|connect| connect.to.get_ref() == name);
    let behind = connects.iter().find(|connect| connect.from.get_ref() == name);
    let source = |connect: &Connect| {
        let (node, port) = find(scenario, unplaced, &connect.from, Side::Output)?;
        Ok(unplaced[node].outputs[port].clone())
    };
    let target = |connect: &Connect| {
        let (node, port) = find(scenario, unplaced, &connect.to, Side::Input)?;
        Ok(unplaced[node].inputs[port].clone())
    };
    let (body, inner) = match (word.kind, before, behind) {
        (ConnectorKind::Input, _, Some(behind)) => (Body::Inlet, target(behind)),
        (ConnectorKind::Input, Some(before), None) => (Body::Inlet, source(before)),
        (ConnectorKind::Output, Some(before), _) => (Body::Outlet, source(before)),
        _ => {
            let message = format!("nothing is connected to `{name}`");
            let error = scenario.error(&word.name, message);
            return Err(error.help(format!("connect it: [[connect]] to = \"{name}\"")));
        }
    };
    // An end that is wrong is told where it is connected.
    let inner = inner.map_err(|_: Error| Error::follow_up());
    let own = word.unit.as_ref().map(|word| unit::unit(scenario, word)).transpose();
    let (inner, own) = Mistakes::both(inner, own)?;
    let mut port = Port {
        name: variable.to_owned(),
        description: None,
        element: (0, 1),
        place: 0,
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
fn unstarted(
    scenario: &Scenario,
    word: &Connector,
    connects: &[Connect],
    unplaced: &[UnplacedNode],
) -> Option<(String, String)> {
    let behind = connects.iter().filter(|connect| connect.from == word.name);
    let mut targets = behind.filter_map(|connect| {
        let (node, port) = find(scenario, unplaced, &connect.to, Side::Input).ok()?;
        let (node, port) = (&unplaced[node], &unplaced[node].inputs[port]);
        (!node.started.contains(&port.name) && !port.optional).then(|| {
            let example = format!("{{ \"{}\" = {} }}", port.name, types::example(port));
            (node.name.clone(), example)
        })
    });
    targets.next()
}

/// The word that a message about a connector points at: that of its system.
fn place(scenario: &Scenario, word: &Connector, node: &str) -> Range<usize> {
    let mut systems = scenario.document.system.iter();
    let system = systems.find(|system| system.label() == node);
    system.map_or_else(|| word.name.span(), Subsystem::place)
}

/// An input that nobody thought of keeps its start value for ever, which looks like a result: the scenario has to say that it wants
/// that.
fn unconnected(scenario: &Scenario, node: &str, place: Range<usize>, open: &[Open]) -> Error {
    let names: Vec<_> = open.iter().map(|open| open.connector.as_str()).collect();
    let message = format!(
        "nothing is connected to `{}` of `{node}`, and there is no start value",
        names.join("`, `")
    );
    let error = scenario.source.error(place, message, "this one");
    let Some(Open { connector, inner: (inner, example) }) = open.first() else { return error };
    error.help(format!(
        "connect it: [[connect]] to = \"{node}.{connector}\", or let the input behind it stay at a value: start = {example} in [[fmu]] `{inner}`; with `unconnected = \"start\"` all of them keep the start values of the system"
    ))
}
