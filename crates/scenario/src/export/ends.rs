//! Finds the ends of connections, and the connectors of components and of the system.

use fmu_import::{Causality, Fmu, Variable};
use recording::{Column, Direction, Full, NumberIndex, TextIndex};
use ssp::ConnectorKind;
use ssp::write::DraftConnector;
use units::Unit;

use super::definitions::Definitions;
use crate::plan::{Body, InputChain, NodePlan, ResolvedConnection, System};

/// A connection of two elements, by the columns of the run.
pub(super) struct Link<'a> {
    pub from: &'a Column,
    pub to: &'a Column,
    /// The way of a number, all the way through connectors; a text arrives unchanged.
    pub chain: Option<InputChain>,
    /// Whether something follows a map on the way.
    pub is_mixed: bool,
}

/// A variable or an element of an array.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct End {
    /// The component.
    pub component: String,
    /// The variable or the whole array.
    pub connector: String,
    /// The place of the element and the number of elements.
    pub element: (usize, usize),
}

/// The nodes of a system, for look-ups.
pub(super) struct Ends<'a> {
    pub system: &'a System,
}

impl<'a> Ends<'a> {
    pub fn new(system: &'a System) -> Self {
        Ends { system }
    }

    /// All connections to FMUs.
    pub fn links(&self) -> Vec<Link<'a>> {
        let columns = &self.system.columns;
        let mut links = Vec::new();
        let fmus = self.system.nodes.iter().filter(|it| matches!(it.body, Body::Fmu { .. }));
        for node in fmus {
            let own =
                |column: &Column| column.node == node.name && column.direction == Direction::Input;
            let numbers = columns.numbers().filter(|(_, column)| own(column));
            for ((_, to), connection) in numbers.zip(&node.connections) {
                let (source, chain, is_mixed) = self.origin(connection);
                links.push(Link { from: &columns[source], to, chain: Some(chain), is_mixed });
            }
            let texts = columns.texts().filter(|(_, column)| own(column));
            for ((_, to), source) in texts.zip(&node.texts.connections) {
                let from = &columns[self.text_origin(source.index)];
                links.push(Link { from, to, chain: None, is_mixed: false });
            }
        }
        links
    }

    fn passages(&self) -> impl Iterator<Item = &'a NodePlan> {
        self.system.nodes.iter().filter(|node| node.is_connector())
    }

    /// Where a number comes from before all connectors on its way, with the whole way; whether something follows a map on it.
    fn origin(&self, connection: &'a ResolvedConnection) -> (NumberIndex<Full>, InputChain, bool) {
        let mut source = connection.source.index;
        let (mut chain, mut is_mixed) = (connection.input_chain.clone(), false);
        let before = |index| {
            let mut all = self.passages();
            let node = all.find(|node| node.inputs.indices().any(|it| it == index))?;
            node.connections.first()
        };
        while let Some(ResolvedConnection { source: earlier, input_chain, .. }) = before(source) {
            let InputChain { factor, offset, map, .. } = input_chain;
            let is_plain = (chain.factor, chain.offset) == (1.0, 0.0) && chain.map.is_empty();
            is_mixed |= !map.is_empty() && !is_plain;
            chain.offset += offset * chain.factor;
            chain.factor *= factor;
            if chain.map.is_empty() {
                chain.map.clone_from(map);
            }
            source = earlier.index;
        }
        (source, chain, is_mixed)
    }

    fn text_origin(&self, mut index: TextIndex<Full>) -> TextIndex<Full> {
        let before = |index| {
            let mut all = self.passages();
            let node = all.find(|node| node.texts.inputs.indices().any(|it| it == index))?;
            node.texts.connections.first()
        };
        while let Some(source) = before(index) {
            index = source.index;
        }
        index
    }

    pub fn node(&self, name: &str) -> Option<&'a NodePlan> {
        self.system.nodes.iter().find(|node| node.name == name)
    }

    /// The variable of an FMU.
    pub fn variable(&self, node: &str, name: &str) -> Option<&'a Variable> {
        let Body::Fmu { fmu, .. } = &self.node(node)?.body else { return None };
        fmu.description.variables.iter().find(|variable| variable.name == name)
    }

    /// The end that a column is; none for a signal or a column of a table.
    pub fn end(&self, column: &Column) -> Option<End> {
        let variable = self.variable(&column.node, &column.variable)?;
        Some(End {
            component: column.node.clone(),
            connector: array_name(variable).to_owned(),
            element: variable.element,
        })
    }

    /// The connectors of an FMU: inputs, outputs, what is connected, and what has a start value in the scenario.
    pub fn connectors(
        &self,
        node: &NodePlan,
        links: &[Link],
        definitions: &mut Definitions,
    ) -> Vec<DraftConnector> {
        let Body::Fmu { fmu, starts, .. } = &node.body else { return Vec::new() };
        let firsts = fmu.description.variables.iter().filter(|variable| variable.element.0 == 0);
        let connectors = firsts.filter_map(|variable| {
            let is_source = links.iter().any(|link| {
                link.from.node == node.name
                    && array_of(fmu, &link.from.variable) == array_name(variable)
            });
            let started = starts.iter().any(|it| array_of(fmu, &it.name) == array_name(variable));
            let kind = match variable.causality {
                Causality::Input => ConnectorKind::Input,
                _ if is_source => ConnectorKind::Output,
                Causality::Output => ConnectorKind::Output,
                _ if !started => return None,
                Causality::StructuralParameter => ConnectorKind::StructuralParameter,
                _ => ConnectorKind::Parameter,
            };
            Some(DraftConnector {
                name: array_name(variable).to_owned(),
                kind,
                data_type: definitions.carries(&node.name, variable)?,
                unit: self.unit(node, variable, definitions),
                dimensions: dimensions(fmu, variable),
            })
        });
        connectors.collect()
    }

    /// The name of a variable's unit: that of the description, or else the one that the scenario declares.
    fn unit(
        &self,
        node: &NodePlan,
        variable: &Variable,
        definitions: &mut Definitions,
    ) -> Option<String> {
        let own = variable.unit.as_deref().zip(variable.dimension);
        let declared = || {
            let mut columns = self.system.columns.iter();
            let column = columns
                .find(|column| column.node == node.name && column.variable == variable.name)?;
            let unit = column.unit.as_deref()?;
            Some((unit, Unit::parse(unit).ok()?))
        };
        let (name, unit) = own.or_else(declared)?;
        Some(definitions.unit(&node.name, name, unit))
    }
}

/// The name of a variable, and that of the array for one of its elements.
pub(super) fn array_name(variable: &Variable) -> &str {
    match variable.element {
        (_, 1) => &variable.name,
        _ => variable.name.rsplit_once('[').map_or(variable.name.as_str(), |(name, _)| name),
    }
}

fn array_of<'v>(fmu: &'v Fmu, name: &'v str) -> &'v str {
    let variable = fmu.description.variables.iter().find(|variable| variable.name == name);
    variable.map_or(name, array_name)
}

/// The sizes of an array: the indices of its last element.
fn dimensions(fmu: &Fmu, first: &Variable) -> Vec<usize> {
    if first.element.1 == 1 {
        return Vec::new();
    }
    let own = fmu.description.variables.iter().filter(|variable| {
        variable.element.1 == first.element.1 && array_name(variable) == array_name(first)
    });
    let last = own.max_by_key(|variable| variable.element.0);
    let indices = last.and_then(|last| last.name.rsplit_once('['));
    let indices = indices.map_or("", |(_, indices)| indices.trim_end_matches(']'));
    let sizes: Vec<usize> =
        indices.split(',').filter_map(|size| size.trim().parse().ok()).collect();
    match sizes.iter().product::<usize>() == first.element.1 {
        true => sizes,
        false => vec![first.element.1],
    }
}
