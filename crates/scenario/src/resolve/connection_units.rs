//! Judges the units of both ends of each connection, and converts between them.

use std::collections::BTreeMap;

use diagnostics::{Error, Spanned};
use expression::SignalUnit;
use units::Unit;

use super::nodes::{Port, UnplacedNode};
use super::port::{Side, find};
use super::signal_units::{cure, key, signal_unit};
use super::unit;
use crate::plan::Body;
use crate::words::{Connect, Scenario};

/// Variables that a message lists.
const LISTED: usize = 4;

/// How the units of two ends fit.
enum Fit {
    /// Factor and offset from one to the other.
    Converted((f64, f64)),
    /// One end has a unit, and this one has none that can be read.
    Lacks(Side),
    Differ(Unit, Unit),
}

fn fit(from: &Port, to: &Port) -> Fit {
    let same = Fit::Converted((1.0, 0.0));
    // A plain number may do without.
    let plain = |unit: &Unit, other: &Port| *unit == Unit::ONE && other.unit.is_none();
    match (signal_unit(from), signal_unit(to)) {
        (SignalUnit::Plain, _) | (_, SignalUnit::Plain) => same,
        (SignalUnit::Known(a, _), SignalUnit::Known(b, _)) => {
            Unit::conversion(&a, &b).map_or(Fit::Differ(a, b), Fit::Converted)
        }
        _ if from.unit == to.unit => same,
        (SignalUnit::Known(unit, _), _) if plain(&unit, to) => same,
        (_, SignalUnit::Known(unit, _)) if plain(&unit, from) => same,
        (SignalUnit::Missing, SignalUnit::Known(..)) => Fit::Lacks(Side::Output),
        (SignalUnit::Known(..), SignalUnit::Missing) => Fit::Lacks(Side::Input),
        (SignalUnit::Missing, SignalUnit::Missing) if from.unit.is_none() => {
            Fit::Lacks(Side::Output)
        }
        (SignalUnit::Missing, SignalUnit::Missing) => Fit::Lacks(Side::Input),
    }
}

/// The factor and the offset that turn the unit of `from` into that of `to`.
pub(super) fn convert(
    scenario: &Scenario,
    connect: &Connect,
    (from, to): (&Port, &Port),
) -> Result<(f64, f64), Error> {
    let (from_word, to_word) = (connect.from.get_ref(), connect.to.get_ref());
    let text = |port: &Port| port.unit.clone().unwrap_or_default();
    match fit(from, to) {
        Fit::Converted(conversion) => Ok(conversion),
        Fit::Differ(a, b) => {
            let (from, to) = (text(from), text(to));
            let message = format!(
                "cannot connect `{from_word}` to `{to_word}`: [{from}] is no unit of [{to}]"
            );
            let help = format!("{} is not {}", a.dimension(), b.dimension());
            Err(scenario.error(&connect.to, message).help(help))
        }
        Fit::Lacks(side) => {
            let ((word, port), (other_word, other)) = match side {
                Side::Output => ((&connect.from, from), (to_word, to)),
                Side::Input => ((&connect.to, to), (from_word, from)),
            };
            let (name, example) = (word.get_ref(), text(other));
            let lacks = match &port.unit {
                None => format!("`{name}` has no unit"),
                Some(text) => format!("the unit [{text}] of `{name}` cannot be read"),
            };
            let message = format!("`{other_word}` is in [{example}], and {lacks}");
            let example = if other.dimension.is_some() { example } else { "m/s".to_owned() };
            let help = cure(scenario, name, &example);
            Err(scenario
                .error(word, message)
                .help(format!("{help}, or unit = \"{example}\" on the connection")))
        }
    }
}

/// Gives the ends without a unit the one that their connection declares.
pub(super) fn declare(scenario: &Scenario, nodes: &mut [UnplacedNode]) -> Result<(), Error> {
    let mut declared = BTreeMap::new();
    for connect in &scenario.document.connect {
        let Some(word) = &connect.unit else { continue };
        let known = unit::unit(scenario, word)?;
        let ends = [(&connect.from, Side::Output), (&connect.to, Side::Input)];
        let [from, to] = ends.map(|(word, side)| find(scenario, nodes, word, side));
        let places = [(from?, Side::Output), (to?, Side::Input)];
        let lacking: Vec<_> = places
            .into_iter()
            .filter(|&(place, side)| signal_unit(port(nodes, place, side)) == SignalUnit::Missing)
            .collect();
        match lacking.as_slice() {
            [(place, side)] => {
                let port = port(nodes, *place, *side);
                (port.dimension, port.unit) = (Some(known), Some(word.get_ref().clone()));
                declared.insert((*place, *side), known);
            }
            [] if places.iter().any(|place| declared.get(place) == Some(&known)) => {}
            lacking => return Err(pointless(scenario, connect, word, lacking.is_empty())),
        }
    }
    Ok(())
}

fn port(nodes: &mut [UnplacedNode], (node, port): (usize, usize), side: Side) -> &mut Port {
    match side {
        Side::Input => &mut nodes[node].inputs[port],
        Side::Output => &mut nodes[node].outputs[port],
    }
}

/// The error about a unit of a connection that no end needs, or both.
fn pointless(
    scenario: &Scenario,
    connect: &Connect,
    word: &Spanned<String>,
    complete: bool,
) -> Error {
    let names = format!("`{}` and `{}`", connect.from.get_ref(), connect.to.get_ref());
    let (message, help) = match complete {
        true => (
            format!("neither of {names} lacks a unit"),
            "leave `unit` out: the connection converts; a variable has one unit in all its connections",
        ),
        false => (
            format!("both of {names} lack a unit, so nothing is converted"),
            "leave `unit` out, or declare the unit of each where the node is",
        ),
    };
    scenario.error(word, message).help(help)
}

/// Refuses an FMU of which several connected variables lack a unit, in one error for them all.
pub(super) fn judge_nodes(scenario: &Scenario, nodes: &[UnplacedNode]) -> Result<(), Error> {
    let mut lacking: BTreeMap<usize, Vec<(&str, &str, &str)>> = BTreeMap::new();
    for connect in &scenario.document.connect {
        let from = find(scenario, nodes, &connect.from, Side::Output);
        let to = find(scenario, nodes, &connect.to, Side::Input);
        // A name that is wrong is reported at its connection.
        let (Ok(from), Ok(to)) = (from, to) else { continue };
        let ports = (&nodes[from.0].outputs[from.1], &nodes[to.0].inputs[to.1]);
        let (node, port, other, word) = match fit(ports.0, ports.1) {
            Fit::Lacks(Side::Output) => (from.0, ports.0, ports.1, &connect.to),
            Fit::Lacks(Side::Input) => (to.0, ports.1, ports.0, &connect.from),
            _ => continue,
        };
        let unit = other.unit.as_deref().unwrap_or("1");
        lacking.entry(node).or_default().push((&port.name, unit, word.get_ref()));
    }
    let is_fmu = |node: &usize| matches!(nodes[*node].body, Body::Fmu { .. });
    lacking.retain(|node, variables| is_fmu(node) && variables.len() > 1);
    match lacking.into_iter().next() {
        Some((node, variables)) => Err(unitless(scenario, &nodes[node], &variables)),
        None => Ok(()),
    }
}

/// The error about all connected variables of an FMU that lack a unit: name, unit and name of the other end.
fn unitless(scenario: &Scenario, node: &UnplacedNode, variables: &[(&str, &str, &str)]) -> Error {
    let name = &node.name;
    let listed = variables.iter().take(LISTED);
    let listed: Vec<_> =
        listed.map(|(port, unit, other)| format!("`{port}` meets `{other}` [{unit}]")).collect();
    let more = match variables.len().saturating_sub(LISTED) {
        0 => String::new(),
        more => format!(" and {more} more"),
    };
    let message =
        format!("connected variables of `{name}` have no unit: {}{more}", listed.join(", "));
    let units: BTreeMap<_, _> = variables.iter().map(|(port, unit, _)| (*port, *unit)).collect();
    let units: Vec<_> =
        units.into_iter().map(|(port, unit)| format!("{} = \"{unit}\"", key(port))).collect();
    let help = format!(
        "say in [[fmu]] `{name}` which units they have, such as unit = {{ {} }}",
        units.join(", ")
    );
    scenario.source.error(node.place.clone(), message, "this node").help(help)
}
