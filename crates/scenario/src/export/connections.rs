//! Writes connections with their transformations.

use fmu_import::Variable;
use fmu_import::description::Type;
use ssp::write::{DraftComponent, DraftConnection};
use ssp::{Transformation, Unit};

use super::connectors::{End, Ends, Link};
use super::definitions::Definitions;
use crate::plan::InputChain;

/// The connections between components. What has no words in the standard is left out, with a note. So are signals and tables,
/// since tools refuse connectors of the system itself; their first values are start values.
pub(super) fn connections(
    ends: &Ends,
    links: &[Link],
    components: &[DraftComponent],
    definitions: &Definitions,
    notes: &mut Vec<String>,
) -> Vec<DraftConnection> {
    let unit = |end: &End| {
        let component = components.iter().find(|it| it.name == end.component)?;
        let connector = component.connectors.iter().find(|it| it.name == end.connector)?;
        definitions.find(connector.unit.as_deref())
    };
    let mut connections = Vec::new();
    for of_target in by_target(ends, links) {
        let Some((first, from, to)) = of_target.first() else { continue };
        let made = match is_whole(&of_target) {
            true => transformation(ends, first, (unit(from), unit(to))),
            false => Err("it connects elements of arrays"),
        };
        match made {
            Ok(transformation) => connections.push(DraftConnection {
                from: (Some(from.component.clone()), from.connector.clone()),
                to: (Some(to.component.clone()), to.connector.clone()),
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

/// A connection with both of its ends.
type Ended<'l, 'a> = (&'l Link<'a>, End, End);

/// The connections between components, those to elements of one array together.
fn by_target<'l, 'a>(ends: &Ends, links: &'l [Link<'a>]) -> Vec<Vec<Ended<'l, 'a>>> {
    let mut groups: Vec<Vec<Ended>> = Vec::new();
    for link in links {
        let (Some(from), Some(to)) = (ends.end(link.from), ends.end(link.to)) else { continue };
        let same = |(_, _, known): &Ended| {
            (&known.component, &known.connector) == (&to.component, &to.connector)
        };
        match groups.iter_mut().find(|group| group.iter().any(same)) {
            Some(group) => group.push((link, from, to)),
            None => groups.push(vec![(link, from, to)]),
        }
    }
    groups
}

/// Whether the links connect one whole connector to another, each element to that in the same place.
fn is_whole(links: &[Ended]) -> bool {
    let change = |link: &Link| link.chain.as_ref().map(|it| (it.factor, it.offset, it.map.clone()));
    let Some((first, from, to)) = links.first() else { return false };
    links.len() == to.element.1
        && from.element.1 == to.element.1
        && links.iter().enumerate().all(|(place, (link, source, target))| {
            (&source.component, &source.connector) == (&from.component, &from.connector)
                && (source.element.0, target.element.0) == (place, place)
                && change(link) == change(first)
        })
}

/// What happens on the way in place of a conversion of units. None where a tool that converts units and one that does not
/// do the same.
fn transformation(
    ends: &Ends,
    link: &Link,
    units: (Option<&Unit>, Option<&Unit>),
) -> Result<Option<Transformation>, &'static str> {
    let Some(chain) = &link.chain else { return Ok(None) };
    if link.is_mixed {
        return Err("it has a map before another change");
    }
    let target = ends.variable(&link.to.node, &link.to.variable);
    let source = ends.variable(&link.from.node, &link.from.variable);
    if !chain.map.is_empty() {
        return mapped(chain, source, target).map(Some);
    }
    let (factor, offset) = (chain.factor, chain.offset);
    let kept = (factor, offset) == (1.0, 0.0);
    let is_converted = match units {
        (Some(from), Some(to)) => from.to(to) != Some((1.0, 0.0)),
        _ => false,
    };
    let real = |variable: Option<&Variable>| variable.is_some_and(|it| it.kind == Type::Real);
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
