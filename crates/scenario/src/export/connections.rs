//! Writes connections with their transformations.

use std::collections::BTreeMap;

use fmu_import::Variable;
use fmu_import::description::Type;
use ssp::write::{DraftComponent, DraftConnection, DraftConnector};
use ssp::{Transformation, Unit};

use super::definitions::Definitions;
use super::ends::{End, Ends, Link, is_real};
use crate::plan::InputChain;

/// The connections of the system. What has no words in the standard is left out, with a note.
pub(super) fn connections(
    ends: &Ends,
    links: &[Link],
    (components, inputs): (&[DraftComponent], &[DraftConnector]),
    definitions: &Definitions,
    notes: &mut Vec<String>,
) -> Vec<DraftConnection> {
    let mut by_target: BTreeMap<(Option<String>, String), Vec<&Link>> = BTreeMap::new();
    let mut order = Vec::new();
    for link in links {
        let to = ends.end(link.to);
        let key = (to.component, to.connector);
        if !by_target.contains_key(&key) {
            order.push(key.clone());
        }
        by_target.entry(key).or_default().push(link);
    }
    let connector = |end: &End| {
        let own = match &end.component {
            None => inputs,
            Some(name) => components.iter().find(|it| it.name == *name)?.connectors.as_slice(),
        };
        own.iter().find(|connector| connector.name == end.connector)
    };
    let mut connections = Vec::new();
    for key in &order {
        let of_target = by_target[key].as_slice();
        let Some(first) = of_target.first() else { continue };
        let (from, to) = (ends.end(first.from), ends.end(first.to));
        let unit = |end| definitions.find(connector(end).and_then(|it| it.unit.as_deref()));
        let made = match is_whole(ends, of_target, (&from, &to)) {
            true => transformation(ends, first, (unit(&from), unit(&to)))
                .and_then(|made| typed(ends, first, connector(&from)).map(|()| made)),
            false => Err("it connects elements of arrays"),
        };
        match made {
            Ok(transformation) => connections.push(DraftConnection {
                from: (from.component, from.connector),
                to: (to.component, to.connector),
                transformation,
            }),
            Err(reason) => notes.push(format!(
                "the connection from `{}` to `{}` is in the annotation only: {reason}, which SSP has no words for",
                first.from.name(),
                first.to.name()
            )),
        }
    }
    connections
}

/// Whether the links connect one whole connector to another, each element to that in the same place.
fn is_whole(ends: &Ends, links: &[&Link], (from, to): (&End, &End)) -> bool {
    let change = |link: &Link| link.chain.map(|it| (it.factor, it.offset, it.map.clone()));
    let first = links.first().map(|link| change(link));
    links.len() == to.element.1
        && from.element.1 == to.element.1
        && links.iter().enumerate().all(|(place, link)| {
            let (source, target) = (ends.end(link.from), ends.end(link.to));
            source.connector == from.connector
                && source.component == from.component
                && (source.element.0, target.element.0) == (place, place)
                && Some(change(link)) == first
        })
}

/// A number of a signal has the type of the connector.
fn typed(ends: &Ends, link: &Link, from: Option<&DraftConnector>) -> Result<(), &'static str> {
    let signal = ends.variable(&link.from.node, &link.from.variable).is_none();
    let target = ends.variable(&link.to.node, &link.to.variable);
    let real = from.is_some_and(|it| it.carries == ssp::Type::Float64);
    match signal && real && target.is_some_and(|it| !is_real(it.kind)) {
        true => Err("it leads one signal to inputs of several types"),
        false => Ok(()),
    }
}

/// What happens on the way in place of a conversion of units. None where a tool that converts units and one that does not
/// do the same.
fn transformation(
    ends: &Ends,
    link: &Link,
    units: (Option<&Unit>, Option<&Unit>),
) -> Result<Option<Transformation>, &'static str> {
    let Some(chain) = link.chain else { return Ok(None) };
    let target = ends.variable(&link.to.node, &link.to.variable);
    let source = ends.variable(&link.from.node, &link.from.variable);
    if !chain.map.is_empty() {
        return mapped(chain, source.or(target), target).map(Some);
    }
    let (factor, offset) = (chain.factor, chain.offset);
    let kept = (factor, offset) == (1.0, 0.0);
    let is_converted = match units {
        (Some(from), Some(to)) => from.to(to) != Some((1.0, 0.0)),
        _ => false,
    };
    let real = |variable: Option<&Variable>| variable.is_none_or(|it| is_real(it.kind));
    match (kept && !is_converted, real(source) && real(target)) {
        (true, _) => Ok(None),
        (false, true) => Ok(Some(Transformation::Linear { factor, offset })),
        (false, false) => Err("it has a factor or an offset for whole numbers"),
    }
}

fn mapped(
    chain: &InputChain,
    source: Option<&Variable>,
    target: Option<&Variable>,
) -> Result<Transformation, &'static str> {
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
        (Type::Boolean, Type::Boolean) => {
            Ok(Transformation::Boolean(pairs().map(|(from, to)| (from != 0, to != 0)).collect()))
        }
        (Type::Integer, Type::Integer) => {
            let pairs = pairs().map(|(from, to)| (i128::from(from), i128::from(to)));
            Ok(Transformation::Integer(pairs.collect()))
        }
        (Type::Enumeration, Type::Enumeration) => {
            let item = |variable: &Variable, value: i64| {
                let item = variable.items.iter().find(|item| item.value == value);
                item.map(|item| item.name.clone()).ok_or("it has a map of values without items")
            };
            let named = pairs().map(|(from, to)| Ok((item(source, from)?, item(target, to)?)));
            named.collect::<Result<_, &str>>().map(Transformation::Enumeration)
        }
        _ => Err("it has a map between types or of real numbers"),
    }
}
