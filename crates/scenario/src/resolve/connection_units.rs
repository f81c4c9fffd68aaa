//! Judges the units of both ends of each connection, and converts between them.

use std::collections::BTreeMap;

use diagnostics::{Error, Mistakes, Spanned};
use expression::SignalUnit;
use units::Unit;

use super::nodes::UnplacedNode;
use super::port::{Side, find};
use super::ports::Port;
use super::signal_units::{cure, key, signal_unit};
use super::unit;
use crate::plan::Body;
use crate::words::{Connect, Scenario, Transform};

/// Variables that a message lists.
const LISTED: usize = 4;

/// How the units of two ends fit.
enum Fit {
    /// Factor and offset from one to the other.
    Converted((f64, f64)),
    /// One end has a unit, and this one has none that can be read.
    Lacks(Side),
    Differ((Unit, String), (Unit, String)),
    /// One end is a difference, the other a point on a scale with a shifted zero; their units.
    Zeros(String, String),
}

fn fit(from: &Port, to: &Port) -> Fit {
    let same = Fit::Converted((1.0, 0.0));
    // A plain number may do without.
    let plain = |unit: &Unit, other: &Port| *unit == Unit::ONE && other.unit.is_none();
    match (signal_unit(from), signal_unit(to)) {
        (SignalUnit::Plain, _) | (_, SignalUnit::Plain) => same,
        (SignalUnit::Known(mut a, one), SignalUnit::Known(mut b, other)) => {
            // A signal and a column of a table are what they are connected to.
            let relative = from.relative.is_some() || to.relative.is_some();
            if relative && !(from.typed && to.typed) {
                (a, b) = (a.difference_unit(), b.difference_unit());
            } else if from.relative.is_some() != to.relative.is_some()
                && (shifted(from) || shifted(to))
            {
                return Fit::Zeros(one, other);
            }
            let differ = || Fit::Differ((a, one), (b, other));
            Unit::conversion(&a, &b).map_or_else(differ, Fit::Converted)
        }
        _ if from.unit == to.unit => same,
        (SignalUnit::Known(unit, _), _) if plain(&unit, to) => same,
        (_, SignalUnit::Known(unit, _)) if plain(&unit, from) => same,
        (SignalUnit::Missing, SignalUnit::Known(..)) => Fit::Lacks(Side::Output),
        (SignalUnit::Known(..), SignalUnit::Missing) => Fit::Lacks(Side::Input),
        (SignalUnit::Missing, SignalUnit::Missing) if from.unit.is_none() => {
            Fit::Lacks(Side::Output)
        }
        _ => Fit::Lacks(Side::Input),
    }
}

/// Whether the unit of a port has an offset, even one that does not count.
fn shifted(port: &Port) -> bool {
    port.relative.or(port.dimension.map(|unit| unit.offset)).is_some_and(|offset| offset != 0.0)
}

/// Factor and offset of each connection of the scenario; none where an end is wrong.
pub(super) type Conversions = Vec<Option<(f64, f64)>>;

/// The nodes and ports of both ends of a connection.
type Ends = ((usize, usize), (usize, usize));

/// Judges all connections. An FMU of which several connected variables lack a unit is one mistake.
pub(super) fn judge(
    scenario: &Scenario,
    connects: &[Connect],
    nodes: &mut [UnplacedNode],
    mistakes: &mut Mistakes,
) -> Conversions {
    for connect in connects {
        if let (Some(word), Some(_)) = (&connect.unit, &connect.transform) {
            let message = "`transform` stands in place of a conversion of units: leave `unit` out";
            mistakes.push(scenario.error(word, message));
            continue;
        }
        // A name that is wrong is told where it is connected.
        let Some(ends) = ends(scenario, nodes, connect) else { continue };
        mistakes.take(declare(scenario, connects, nodes, (connect, ends)));
    }
    let mut lacking: BTreeMap<usize, Vec<Lacking>> = BTreeMap::new();
    let conversions = connects.iter().map(|connect| {
        let ends @ (from, to) = ends(scenario, nodes, connect)?;
        if let Some(transform) = &connect.transform {
            let Transform { factor, offset, .. } = transform.get_ref();
            return finite(scenario, transform, [*factor, *offset], mistakes);
        }
        match fit(&nodes[from.0].outputs[from.1], &nodes[to.0].inputs[to.1]) {
            Fit::Converted((factor, offset)) if connect.inverted => {
                return Some((-factor, -offset));
            }
            Fit::Converted(conversion) => return Some(conversion),
            Fit::Differ(a, b) => mistakes.push(differ(scenario, connect, &a, &b)),
            Fit::Zeros(one, other) => {
                let source = (&nodes[from.0].outputs[from.1], one);
                mistakes.push(zeros(scenario, connect, source, other));
            }
            Fit::Lacks(side) => {
                let node = if side == Side::Output { from.0 } else { to.0 };
                lacking.entry(node).or_default().push(Lacking { connect, ends, side });
            }
        }
        None
    });
    let conversions = conversions.collect();
    for (node, variables) in lacking {
        let is_fmu = matches!(nodes[node].body, Body::Fmu { .. });
        match variables.as_slice() {
            [_, _, ..] if is_fmu => mistakes.push(unitless(scenario, nodes, node, &variables)),
            single => single.iter().for_each(|it| mistakes.push(lacks(scenario, nodes, it))),
        }
        for Lacking { ends: (from, to), side, .. } in variables {
            let place = if side == Side::Output { from } else { to };
            port(nodes, place, side).wrong_unit = true;
        }
    }
    conversions
}

/// Factor and offset that stand in the file.
fn finite(
    scenario: &Scenario,
    word: &Spanned<Transform>,
    [factor, offset]: [f64; 2],
    mistakes: &mut Mistakes,
) -> Option<(f64, f64)> {
    if factor.is_finite() && offset.is_finite() {
        return Some((factor, offset));
    }
    let message = format!("expected finite numbers, found factor {factor} and offset {offset}");
    mistakes.push(scenario.error(word, message));
    None
}

fn ends(scenario: &Scenario, nodes: &[UnplacedNode], connect: &Connect) -> Option<Ends> {
    let from = find(scenario, nodes, &connect.from, Side::Output).ok()?;
    Some((from, find(scenario, nodes, &connect.to, Side::Input).ok()?))
}

/// A connection of which one end lacks a unit.
struct Lacking<'a> {
    connect: &'a Connect,
    ends: Ends,
    side: Side,
}

impl<'a> Lacking<'a> {
    /// The full name and the port of the end without a unit, then those of the other end.
    fn named<'n>(&self, nodes: &'n [UnplacedNode]) -> [(&'a Spanned<String>, &'n Port); 2] {
        let (from, to) = self.ends;
        let from = (&self.connect.from, &nodes[from.0].outputs[from.1]);
        let to = (&self.connect.to, &nodes[to.0].inputs[to.1]);
        if self.side == Side::Output { [from, to] } else { [to, from] }
    }
}

fn differ(
    scenario: &Scenario,
    connect: &Connect,
    (a, from): &(Unit, String),
    (b, to): &(Unit, String),
) -> Error {
    let (from_word, to_word) = (connect.from.get_ref(), connect.to.get_ref());
    let message =
        format!("cannot connect `{from_word}` to `{to_word}`: [{from}] is no unit of [{to}]");
    let help = format!("{} is not {}", a.dimension(), b.dimension());
    scenario.error(&connect.to, message).help(help)
}

/// The error about a difference that meets a point on a scale with a shifted zero.
fn zeros(
    scenario: &Scenario,
    connect: &Connect,
    (from, one): (&Port, String),
    other: String,
) -> Error {
    let (a, b) = (connect.from.get_ref(), connect.to.get_ref());
    let words = ["a difference (relativeQuantity)", "a point on a scale with a shifted zero"];
    let [first, second] = if from.relative.is_some() { words } else { [words[1], words[0]] };
    let message = format!(
        "cannot connect `{a}` to `{b}`: `{a}` [{one}] is {first}, and `{b}` [{other}] is {second}"
    );
    scenario.error(&connect.to, message).help(
        "connect two of one sort; if both mean the same, say how the number is led on: transform = { factor = 1.0, offset = 0.0 }",
    )
}

/// The error about one end without a unit.
fn lacks(scenario: &Scenario, nodes: &[UnplacedNode], lacking: &Lacking) -> Error {
    let [(word, port), (other, other_port)] = lacking.named(nodes);
    let (name, unit) = (word.get_ref(), other_port.unit.as_deref().unwrap_or("1"));
    let what = match &port.unit {
        None => format!("`{name}` has no unit"),
        Some(text) => format!("the unit [{text}] of `{name}` cannot be read"),
    };
    let message = format!("`{}` is in [{unit}], and {what}", other.get_ref());
    let example = if other_port.dimension.is_some() { unit } else { "m/s" };
    let cure = cure(scenario, name, example);
    scenario
        .error(word, message)
        .help(format!("{cure}, or unit = \"{example}\" in the [[connect]]"))
}

/// Gives the end without a unit the one that the connection declares.
fn declare(
    scenario: &Scenario,
    connects: &[Connect],
    nodes: &mut [UnplacedNode],
    (connect, (from, to)): (&Connect, Ends),
) -> Result<(), Error> {
    let Some(word) = &connect.unit else { return Ok(()) };
    let known = unit::unit(scenario, word);
    let mut ends = [(from, Side::Output), (to, Side::Input)].into_iter();
    let mut lacking = ends
        .clone()
        .filter(|&(place, side)| signal_unit(port(nodes, place, side)) == SignalUnit::Missing);
    match (lacking.next(), lacking.next()) {
        (Some((place, side)), None) => {
            let port = port(nodes, place, side);
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
            match declared && ends.any(|(place, side)| same(port(nodes, place, side))) {
                true => known.map(|_| ()),
                false => Err(pointless(scenario, connect, word, true)),
            }
        }
        _ => Err(pointless(scenario, connect, word, false)),
    }
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

/// The error about all connected variables of an FMU that lack a unit.
fn unitless(scenario: &Scenario, nodes: &[UnplacedNode], node: usize, all: &[Lacking]) -> Error {
    let UnplacedNode { name, place, .. } = &nodes[node];
    let unit = |port: &Port| port.unit.clone().unwrap_or_else(|| "1".to_owned());
    let meets = all.iter().map(|lacking| {
        let [(_, port), (other, other_port)] = lacking.named(nodes);
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
        let [(_, port), (_, other)] = lacking.named(nodes);
        (port.name.as_str(), unit(other))
    });
    let units: BTreeMap<_, _> = units.collect();
    let units = units.iter().map(|(port, unit)| format!("{} = \"{unit}\"", key(port)));
    let help = format!(
        "say in [[fmu]] `{name}` which units they have, such as unit = {{ {} }}",
        units.collect::<Vec<_>>().join(", ")
    );
    scenario.source.error(place.clone(), message, "this node").help(help)
}
