//! Finds the variables and connections of a resolved system, through its connectors, and describes the connectors of components.

use cosim::system::{InputChain, NodeBody, NodePlan, NumberConnection, System};
use fmu_import::{Causality, Fmu, Variable};
use recording::{AllVariables, Column, NumberIndex, TextIndex, VariableDirection};
use ssp::ConnectorKind;
use ssp::write::DraftConnector;
use units::Unit;

use super::definitions::SspDefinitions;

/// A connection of two elements, by the columns of the run.
pub(super) struct ElementConnection<'a> {
    pub from: &'a Column,
    pub to: &'a Column,
    /// The way of a number, all the way through connectors; a text arrives unchanged.
    pub chain: Option<InputChain>,
    /// Whether something follows a map on the way.
    pub is_mixed: bool,
}

/// A variable or an element of an array.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct ConnectorElement {
    /// The component.
    pub component: String,
    /// The variable or the whole array.
    pub connector: String,
    /// The index of the element and the number of elements.
    pub element: (usize, usize),
}

impl ConnectorElement {
    /// Whether both are elements of one connector.
    pub fn is_same_connector(&self, other: &Self) -> bool {
        (&self.component, &self.connector) == (&other.component, &other.connector)
    }
}

/// The nodes of a system, for look-ups.
pub(super) struct SystemLookup<'a> {
    pub system: &'a System,
}

impl<'a> SystemLookup<'a> {
    pub fn new(system: &'a System) -> Self {
        SystemLookup { system }
    }

    /// All connections to FMUs.
    pub fn fmu_connections(&self) -> Vec<ElementConnection<'a>> {
        let columns = &self.system.columns;
        let mut connections = Vec::new();
        let fmus = self.system.nodes.iter().filter(|it| matches!(it.body, NodeBody::Fmu { .. }));
        for node in fmus {
            let own =
                |column: &Column| column.node == node.name && column.direction == VariableDirection::Input;
            let numbers = columns.number_columns().filter(|(_, column)| own(column));
            for ((_, to), connection) in numbers.zip(&node.connections) {
                let (source, chain, is_mixed) = self.trace_number_origin(connection);
                connections.push(ElementConnection {
                    from: &columns[source],
                    to,
                    chain: Some(chain),
                    is_mixed,
                });
            }
            let texts = columns.text_columns().filter(|(_, column)| own(column));
            for ((_, to), source) in texts.zip(&node.texts.connections) {
                let from = &columns[self.text_origin(source.index)];
                connections.push(ElementConnection { from, to, chain: None, is_mixed: false });
            }
        }
        connections
    }

    fn connector_nodes(&self) -> impl Iterator<Item = &'a NodePlan> {
        self.system.nodes.iter().filter(|node| node.is_connector())
    }

    /// Where a number comes from before all connectors on its way, with the whole way; whether something follows a map on it.
    fn trace_number_origin(
        &self,
        connection: &'a NumberConnection,
    ) -> (NumberIndex<AllVariables>, InputChain, bool) {
        let mut source = connection.source.index;
        let (mut chain, mut is_mixed) = (connection.input_chain.clone(), false);
        let before = |index| {
            let mut all = self.connector_nodes();
            let node = all.find(|node| node.inputs.indices().any(|it| it == index))?;
            node.connections.first()
        };
        while let Some(NumberConnection { source: earlier, input_chain, .. }) = before(source) {
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

    fn text_origin(&self, mut index: TextIndex<AllVariables>) -> TextIndex<AllVariables> {
        let before = |index| {
            let mut all = self.connector_nodes();
            let node = all.find(|node| node.texts.inputs.indices().any(|it| it == index))?;
            node.texts.connections.first()
        };
        while let Some(source) = before(index) {
            index = source.index;
        }
        index
    }

    pub fn find_node(&self, name: &str) -> Option<&'a NodePlan> {
        self.system.nodes.iter().find(|node| node.name == name)
    }

    /// The variable of an FMU.
    pub fn find_variable(&self, node: &str, name: &str) -> Option<&'a Variable> {
        let NodeBody::Fmu { fmu, .. } = &self.find_node(node)?.body else { return None };
        fmu.description.variables.iter().find(|variable| variable.name == name)
    }

    /// The end that a column is; none for a signal or a column of a table.
    pub fn connector_element(&self, column: &Column) -> Option<ConnectorElement> {
        let variable = self.find_variable(&column.node, &column.variable)?;
        Some(ConnectorElement {
            component: column.node.clone(),
            connector: variable.array_name().to_owned(),
            element: variable.element,
        })
    }

    /// The connectors of an FMU: inputs, outputs, what is connected, and what has a start value in the scenario.
    pub fn ssp_connectors(
        &self,
        node: &NodePlan,
        connections: &[ElementConnection],
        definitions: &mut SspDefinitions,
    ) -> Vec<DraftConnector> {
        let NodeBody::Fmu { fmu, starts, .. } = &node.body else { return Vec::new() };
        let firsts = fmu.description.variables.iter().filter(|variable| variable.element.0 == 0);
        let connectors = firsts.filter_map(|variable| {
            let is_source = connections.iter().any(|link| {
                link.from.node == node.name && array_name(fmu, &link.from.variable) == variable.array_name()
            });
            let started = starts.iter().any(|it| array_name(fmu, &it.name) == variable.array_name());
            let kind = match variable.causality {
                Causality::Input => ConnectorKind::Input,
                _ if is_source => ConnectorKind::Output,
                Causality::Output => ConnectorKind::Output,
                _ if !started => return None,
                Causality::StructuralParameter => ConnectorKind::StructuralParameter,
                _ => ConnectorKind::Parameter,
            };
            Some(DraftConnector {
                name: variable.array_name().to_owned(),
                kind,
                data_type: definitions.define_type(&node.name, variable)?,
                unit: self.define_variable_unit(node, variable, definitions),
                dimensions: array_dimensions(fmu, variable),
            })
        });
        connectors.collect()
    }

    /// The name of a variable's unit: that of the description, or else the one that the scenario declares.
    fn define_variable_unit(
        &self,
        node: &NodePlan,
        variable: &Variable,
        definitions: &mut SspDefinitions,
    ) -> Option<String> {
        let own = variable.unit.as_deref().zip(variable.dimension);
        let declared = || {
            let mut columns = self.system.columns.iter();
            let column =
                columns.find(|column| column.node == node.name && column.variable == variable.name)?;
            let unit = column.unit.as_deref()?;
            Some((unit, Unit::parse(unit).ok()?))
        };
        let (name, unit) = own.or_else(declared)?;
        Some(definitions.define_unit(&node.name, name, unit))
    }
}

fn array_name<'v>(fmu: &'v Fmu, name: &'v str) -> &'v str {
    let variable = fmu.description.variables.iter().find(|variable| variable.name == name);
    variable.map_or(name, Variable::array_name)
}

/// The sizes of an array: the indices of its last element.
fn array_dimensions(fmu: &Fmu, first: &Variable) -> Vec<usize> {
    if first.element.1 == 1 {
        return Vec::new();
    }
    let own = fmu.description.variables.iter().filter(|variable| {
        variable.element.1 == first.element.1 && variable.array_name() == first.array_name()
    });
    let last = own.max_by_key(|variable| variable.element.0);
    let indices = last.and_then(|last| last.name.rsplit_once('['));
    let indices = indices.map_or("", |(_, indices)| indices.trim_end_matches(']'));
    let sizes: Vec<usize> = indices.split(',').filter_map(|size| size.trim().parse().ok()).collect();
    match sizes.iter().product::<usize>() == first.element.1 {
        true => sizes,
        false => vec![first.element.1],
    }
}
