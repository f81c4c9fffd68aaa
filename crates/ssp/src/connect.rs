//! Resolves connections to edges: finds both connectors, and which of them is the source.

use std::sync::Arc;

use crate::error::mistake_error;
use crate::limits::CONNECTORS;
use crate::ssd::{ConnectionEnd, SsdConnection};
use crate::tree::{ConnectionEdge, ConnectorRole, PortNodes, SystemTree};
use crate::{ConnectorKind, Error, ValueTransformation};

/// A connector as the connections of a system see it.
struct ConnectorEnd {
    ports: PortNodes,
    kind: ConnectorKind,
    /// Whether it is one of the system itself.
    own: bool,
    is_source: bool,
    is_sink: bool,
}

impl SystemTree<'_> {
    /// Adds a connection of a system.
    pub(crate) fn resolve_connection(
        &mut self,
        system: usize,
        connection: &SsdConnection,
    ) -> Result<(), Error> {
        self.edges += 1;
        if self.edges > CONNECTORS {
            let expected = format!("at most {CONNECTORS} connections in all");
            let cure = "make the system smaller";
            return Err(mistake_error(&connection.position, expected, "one more", cure));
        }
        let start = self.resolve_connection_end(system, &connection.start)?;
        let end = self.resolve_connection_end(system, &connection.end)?;
        // Section 5.3.2: start and end are no direction, the kinds of the connectors decide.
        let (from, to, target) = if start.is_source && end.is_sink {
            (start, end, &connection.end)
        } else if end.is_source && start.is_sink {
            (end, start, &connection.start)
        } else {
            return Err(mistake_error(
                &connection.position,
                "a connector that gives values and one that takes them",
                format!("{} and {}", describe_connector_end(&start), describe_connector_end(&end)),
                "correct the connection, or the kinds of the connectors",
            ));
        };
        let varies = matches!(
            from.kind,
            ConnectorKind::Input | ConnectorKind::Output | ConnectorKind::InOut | ConnectorKind::Local
        );
        let fixed = matches!(to.kind, ConnectorKind::Parameter | ConnectorKind::StructuralParameter);
        if varies && fixed && !to.own {
            return Err(mistake_error(
                &target.position,
                "a connector that may change its value",
                format!(
                    "{} that takes the value of {}",
                    describe_connector_end(&to),
                    describe_connector_end(&from)
                ),
                "connect a parameter with parameters only, section 5.3.2.1",
            ));
        }
        for node in [from.ports.out, to.ports.into] {
            let data_type = self.nodes[node].connector.data_type.as_ref();
            if !connection.transformation.is_allowed_for_type(data_type) {
                return Err(mistake_error(
                    &connection.position,
                    "a transformation for the type of the connectors",
                    format!(
                        "one for {} at `{}`",
                        connection.transformation.purpose_text(),
                        self.qualified_connector_name(node)
                    ),
                    "use the transformation for the type of the connectors",
                ));
            }
        }
        let edge = ConnectionEdge {
            from: from.ports.out,
            transformation: Arc::clone(&connection.transformation),
            suppress: connection.suppress,
            inherits_before: to.own,
            position: connection.position.clone(),
        };
        self.add_edge(to.ports.into, edge)
    }

    /// Adds an edge, and at a reference to a dictionary another one to the entry behind it.
    fn add_edge(&mut self, to: usize, edge: ConnectionEdge) -> Result<(), Error> {
        if let Some(first) = &self.nodes[to].incoming {
            let found =
                format!("`{}`, which {} leads to already", self.qualified_connector_name(to), first.position);
            let expected = "a connector that no other connection leads to";
            return Err(mistake_error(&edge.position, expected, found, "remove one of the connections"));
        }
        let position = edge.position.clone();
        self.nodes[to].incoming = Some(edge);
        let ConnectorRole::Into(entry) = self.nodes[to].role else { return Ok(()) };
        let transformation = Arc::new(ValueTransformation::IDENTITY);
        self.add_edge(
            entry,
            ConnectionEdge { from: to, transformation, suppress: false, inherits_before: true, position },
        )
    }

    fn resolve_connection_end(&self, system: usize, end: &ConnectionEnd) -> Result<ConnectorEnd, Error> {
        let own = end.element.is_none();
        let system = &self.instances[system];
        let owner = match &end.element {
            None => system,
            Some(name) => {
                let child = system.children.get(name.as_str()).ok_or_else(|| {
                    let names = format_some_names(system.children.keys());
                    let found = format!("`{name}`, the system has {names}");
                    mistake_error(&end.position, "an element of the system", found, "correct the name")
                })?;
                &self.instances[*child]
            }
        };
        let Some(&ports) = owner.ports.get(end.connector.as_str()) else {
            let name = if own { "the system" } else { owner.name.as_str() };
            let names = format_some_names(owner.ports.keys());
            return Err(mistake_error(
                &end.position,
                format!("a connector of {name}"),
                format!("`{}`, it has {names}", end.connector),
                "correct the name, or add the connector",
            ));
        };
        let kind = self.nodes[ports.into].connector.kind;
        let (is_sink, is_source) = match kind {
            ConnectorKind::Input | ConnectorKind::Parameter | ConnectorKind::StructuralParameter => {
                (!own, own)
            }
            ConnectorKind::Output
            | ConnectorKind::CalculatedParameter
            | ConnectorKind::Constant
            | ConnectorKind::Local => (own, !own),
            ConnectorKind::InOut | ConnectorKind::Unspecified => (true, true),
        };
        Ok(ConnectorEnd { ports, kind, own, is_source, is_sink })
    }
}

fn describe_connector_end(side: &ConnectorEnd) -> String {
    let word = ConnectorKind::ALL.iter().find(|(_, kind)| *kind == side.kind).map_or("?", |(word, _)| word);
    let owner = if side.own { "the system itself" } else { "an element" };
    format!("the {word} of {owner}")
}

/// Some names of a list.
fn format_some_names<'a>(names: impl Iterator<Item = &'a Arc<str>>) -> String {
    let mut names: Vec<_> = names.take(12).map(|name| format!("`{name}`")).collect();
    if names.len() == 12 {
        names[11] = "others".to_owned();
    }
    if names.is_empty() { "none".to_owned() } else { names.join(", ") }
}
