//! Works out the unit conversion of each connection, and finds ends whose units are missing or do not fit.

use std::collections::BTreeMap;

use cosim::system::NodeBody;
use diagnostics::{Error, ErrorCollector, Spanned};
use expression::SignalUnit;
use units::Unit;

use super::lookup::{PortRef, PortSide, find_port};
use super::node_draft::NodeDraft;
use super::ports::Port;
use super::signal_units::{column_unit_advice, port_unit, toml_key, unit_help};
use super::unit;
use crate::document::{Connect, Scenario, Transform};

/// Variables that a message lists.
const LISTED: usize = 4;

/// How the units of two ends fit.
enum UnitMatch {
    /// Factor and offset from one to the other.
    Conversion((f64, f64)),
    /// One end has a unit, and this one has none that can be read.
    Missing(PortSide),
    Mismatch((Unit, String), (Unit, String)),
    /// One end is a difference, the other a point on a scale with a shifted zero; their units.
    ZeroMismatch(String, String),
}

fn match_units(from: &Port, to: &Port) -> UnitMatch {
    let same = UnitMatch::Conversion((1.0, 0.0));
    // A plain number may do without.
    let plain = |unit: &Unit, other: &Port| *unit == Unit::ONE && other.unit.is_none();
    match (port_unit(from), port_unit(to)) {
        (SignalUnit::Plain, _) | (_, SignalUnit::Plain) => same,
        (SignalUnit::Known(mut a, one), SignalUnit::Known(mut b, other)) => {
            // A signal and a column of a table are what they are connected to.
            let relative = from.relative.is_some() || to.relative.is_some();
            if relative && !(from.typed && to.typed) {
                (a, b) = (a.difference_unit(), b.difference_unit());
            } else if from.relative.is_some() != to.relative.is_some()
                && (has_unit_offset(from) || has_unit_offset(to))
            {
                return UnitMatch::ZeroMismatch(one, other);
            }
            let differ = || UnitMatch::Mismatch((a, one), (b, other));
            Unit::conversion(&a, &b).map_or_else(differ, UnitMatch::Conversion)
        }
        _ if from.unit == to.unit => same,
        (SignalUnit::Known(unit, _), _) if plain(&unit, to) => same,
        (_, SignalUnit::Known(unit, _)) if plain(&unit, from) => same,
        (SignalUnit::Missing, SignalUnit::Known(..)) => UnitMatch::Missing(PortSide::Output),
        (SignalUnit::Known(..), SignalUnit::Missing) => UnitMatch::Missing(PortSide::Input),
        (SignalUnit::Missing, SignalUnit::Missing) if from.unit.is_none() => {
            UnitMatch::Missing(PortSide::Output)
        }
        _ => UnitMatch::Missing(PortSide::Input),
    }
}

/// Whether the unit of a port has an offset, even one that does not count.
fn has_unit_offset(port: &Port) -> bool {
    port.relative.or(port.dimension.map(|unit| unit.offset)).is_some_and(|offset| offset != 0.0)
}

/// Factor and offset of each connection of the scenario; none where an end is wrong.
pub(super) type UnitConversions = Vec<Option<(f64, f64)>>;

/// Both ends of a connection.
#[derive(Clone, Copy)]
struct ConnectedPorts {
    from: PortRef,
    to: PortRef,
}

impl ConnectedPorts {
    fn output_port(self, nodes: &[NodeDraft]) -> &Port {
        &nodes[self.from.node].outputs[self.from.port]
    }

    fn input_port(self, nodes: &[NodeDraft]) -> &Port {
        &nodes[self.to.node].inputs[self.to.port]
    }
}

/// Judges all connections. An FMU of which several connected variables lack a unit is one mistake.
pub(super) fn convert_units(
    scenario: &Scenario,
    connects: &[Connect],
    nodes: &mut [NodeDraft],
    mistakes: &mut ErrorCollector,
) -> UnitConversions {
    for connect in connects {
        if let (Some(word), Some(_)) = (&connect.unit, &connect.transform) {
            let message = "`transform` stands in place of a conversion of units: leave `unit` out";
            mistakes.push(scenario.error_at(word, message));
            continue;
        }
        // A name that is wrong is told where it is connected.
        let Some(ends) = find_connected_ports(scenario, nodes, connect) else { continue };
        mistakes.ok_or_record(declare_unit(scenario, connects, nodes, connect, ends));
    }
    let mut lacking: BTreeMap<usize, Vec<MissingUnit>> = BTreeMap::new();
    let conversions = connects.iter().map(|connect| {
        let ends = find_connected_ports(scenario, nodes, connect)?;
        if let Some(transform) = &connect.transform {
            let Transform { factor, offset, .. } = transform.get_ref();
            return finite_transform(scenario, transform, *factor, *offset, mistakes);
        }
        match match_units(ends.output_port(nodes), ends.input_port(nodes)) {
            UnitMatch::Conversion((factor, offset)) if connect.inverted => {
                return Some((-factor, -offset));
            }
            UnitMatch::Conversion(conversion) => return Some(conversion),
            UnitMatch::Mismatch((a, from), (b, to)) => {
                mistakes.push(mismatch_error(scenario, connect, &a, &from, &b, &to));
            }
            UnitMatch::ZeroMismatch(one, other) => {
                let from = ends.output_port(nodes);
                mistakes.push(offset_mismatch_error(scenario, connect, from, &one, &other));
            }
            UnitMatch::Missing(side) => {
                let node = if side == PortSide::Output { ends.from.node } else { ends.to.node };
                lacking.entry(node).or_default().push(MissingUnit { connect, ends, side });
            }
        }
        None
    });
    let conversions = conversions.collect();
    for (node, variables) in lacking {
        let is_fmu = matches!(nodes[node].body, NodeBody::Fmu { .. });
        match variables.as_slice() {
            [_, _, ..] if is_fmu => mistakes.push(missing_units_error(scenario, nodes, node, &variables)),
            single => single.iter().for_each(|it| mistakes.push(missing_unit_error(scenario, nodes, it))),
        }
        for MissingUnit { ends, side, .. } in variables {
            let end = if side == PortSide::Output { ends.from } else { ends.to };
            port_mut(nodes, end, side).wrong_unit = true;
        }
    }
    conversions
}

/// Factor and offset that stand in the file.
fn finite_transform(
    scenario: &Scenario,
    word: &Spanned<Transform>,
    factor: f64,
    offset: f64,
    mistakes: &mut ErrorCollector,
) -> Option<(f64, f64)> {
    if factor.is_finite() && offset.is_finite() {
        return Some((factor, offset));
    }
    let message = format!("expected finite numbers, found factor {factor} and offset {offset}");
    mistakes.push(scenario.error_at(word, message));
    None
}

fn find_connected_ports(
    scenario: &Scenario,
    nodes: &[NodeDraft],
    connect: &Connect,
) -> Option<ConnectedPorts> {
    let from = find_port(scenario, nodes, &connect.from, PortSide::Output).ok()?;
    let to = find_port(scenario, nodes, &connect.to, PortSide::Input).ok()?;
    Some(ConnectedPorts { from, to })
}

/// A connection of which one end lacks a unit.
struct MissingUnit<'a> {
    connect: &'a Connect,
    ends: ConnectedPorts,
    side: PortSide,
}

impl<'a> MissingUnit<'a> {
    /// The full name and the port of the end without a unit, then those of the other end.
    fn named_ports<'n>(&self, nodes: &'n [NodeDraft]) -> [(&'a Spanned<String>, &'n Port); 2] {
        let from = (&self.connect.from, self.ends.output_port(nodes));
        let to = (&self.connect.to, self.ends.input_port(nodes));
        if self.side == PortSide::Output { [from, to] } else { [to, from] }
    }
}

fn mismatch_error(scenario: &Scenario, connect: &Connect, a: &Unit, from: &str, b: &Unit, to: &str) -> Error {
    let (from_word, to_word) = (connect.from.get_ref(), connect.to.get_ref());
    let message = format!("cannot connect `{from_word}` to `{to_word}`: [{from}] is no unit of [{to}]");
    let help = format!("{} is not {}", a.dimension_text(), b.dimension_text());
    scenario.error_at(&connect.to, message).with_help(help)
}

/// The error about a difference that meets a point on a scale with a shifted zero.
fn offset_mismatch_error(
    scenario: &Scenario,
    connect: &Connect,
    from: &Port,
    one: &str,
    other: &str,
) -> Error {
    let (a, b) = (connect.from.get_ref(), connect.to.get_ref());
    let words = ["a difference (relativeQuantity)", "a point on a scale with a shifted zero"];
    let [first, second] = if from.relative.is_some() { words } else { [words[1], words[0]] };
    let message =
        format!("cannot connect `{a}` to `{b}`: `{a}` [{one}] is {first}, and `{b}` [{other}] is {second}");
    scenario.error_at(&connect.to, message).with_help(
        "connect two of one sort; if both mean the same, say how the number is led on: transform = { factor = 1.0, offset = 0.0 }",
    )
}

/// The error about one end without a unit.
fn missing_unit_error(scenario: &Scenario, nodes: &[NodeDraft], lacking: &MissingUnit) -> Error {
    let [(word, port), (other, other_port)] = lacking.named_ports(nodes);
    let ends = lacking.ends;
    let (name, unit) = (word.get_ref(), other_port.unit.as_deref().unwrap_or("1"));
    let what = match &port.unit {
        None => format!("`{name}` has no unit"),
        Some(text) => format!("the unit [{text}] of `{name}` cannot be read"),
    };
    let message = format!("`{}` is in [{unit}], and {what}", other.get_ref());
    let example = if other_port.dimension.is_some() { unit } else { "m/s" };
    let node = &nodes[if lacking.side == PortSide::Output { ends.from.node } else { ends.to.node }];
    let written = scenario.document.table.iter().find(|table| *table.name.get_ref() == node.name);
    let (cure, connect) = match (&node.body, written) {
        // The unit of a recorded column is anybody's guess, but for its name and its numbers.
        (NodeBody::Table(table), Some(written)) => {
            let values = table.column_values(ends.from.port).iter().copied();
            let largest = values.filter(|it| it.is_finite()).map(f64::abs).reduce(f64::max);
            let advice = column_unit_advice(written, &port.name, example, largest);
            let cure = format!(
                "say which unit it has: {advice} in the column `{}` of [[table]] `{}`",
                port.name, node.name
            );
            (cure, advice)
        }
        _ => (unit_help(scenario, name, example), format!("unit = \"{example}\"")),
    };
    scenario.error_at(word, message).with_help(format!("{cure}, or {connect} in the [[connect]]"))
}

/// Gives the end without a unit the one that the connection declares.
fn declare_unit(
    scenario: &Scenario,
    connects: &[Connect],
    nodes: &mut [NodeDraft],
    connect: &Connect,
    ConnectedPorts { from, to }: ConnectedPorts,
) -> Result<(), Error> {
    let Some(word) = &connect.unit else { return Ok(()) };
    let known = unit::parse_unit(scenario, word);
    let mut ends = [(from, PortSide::Output), (to, PortSide::Input)].into_iter();
    let mut lacking =
        ends.clone().filter(|&(end, side)| port_unit(port_mut(nodes, end, side)) == SignalUnit::Missing);
    match (lacking.next(), lacking.next()) {
        (Some((end, side)), None) => {
            let port = port_mut(nodes, end, side);
            port.wrong_unit = known.is_err();
            (port.dimension, port.unit) = (Some(known?), Some(word.get_ref().clone()));
            Ok(())
        }
        (None, _) => {
            // Another connection of the same variable may have declared it.
            let same = |port: &Port| port.unit.as_ref() == Some(word.get_ref());
            let declared = connects.iter().any(|other| {
                !std::ptr::eq(other, connect)
                    && other.unit.as_ref() == Some(word)
                    && (other.from == connect.from)
            });
            match declared && ends.any(|(end, side)| same(port_mut(nodes, end, side))) {
                true => known.map(|_| ()),
                false => Err(redundant_unit_error(scenario, connect, word, true)),
            }
        }
        _ => Err(redundant_unit_error(scenario, connect, word, false)),
    }
}

fn port_mut(nodes: &mut [NodeDraft], end: PortRef, side: PortSide) -> &mut Port {
    match side {
        PortSide::Input => &mut nodes[end.node].inputs[end.port],
        PortSide::Output => &mut nodes[end.node].outputs[end.port],
    }
}

/// The error about a unit of a connection that no end needs, or both.
fn redundant_unit_error(
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
    scenario.error_at(word, message).with_help(help)
}

/// The error about all connected variables of an FMU that lack a unit.
fn missing_units_error(scenario: &Scenario, nodes: &[NodeDraft], node: usize, all: &[MissingUnit]) -> Error {
    let NodeDraft { name, span, .. } = &nodes[node];
    let unit = |port: &Port| port.unit.clone().unwrap_or_else(|| "1".to_owned());
    let meets = all.iter().map(|lacking| {
        let [(_, port), (other, other_port)] = lacking.named_ports(nodes);
        format!("`{}` meets `{}` [{}]", port.name, other.get_ref(), unit(other_port))
    });
    let meets: Vec<_> = meets.collect();
    let more = match meets.len().saturating_sub(LISTED) {
        0 => String::new(),
        more => format!(" and {more} more"),
    };
    let listed = meets[..meets.len().min(LISTED)].join(", ");
    let message = format!("connected variables of `{name}` have no unit: {listed}{more}");
    let units = all.iter().map(|lacking| {
        let [(_, port), (_, other)] = lacking.named_ports(nodes);
        (port.name.as_str(), unit(other))
    });
    let units: BTreeMap<_, _> = units.collect();
    let units = units.iter().map(|(port, unit)| format!("{} = \"{unit}\"", toml_key(port)));
    let help = format!(
        "say in [[fmu]] `{name}` which units they have, such as unit = {{ {} }}",
        units.collect::<Vec<_>>().join(", ")
    );
    scenario.source.error_at(span.clone(), message, "this node").with_help(help)
}
