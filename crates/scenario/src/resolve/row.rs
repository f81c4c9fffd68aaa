//! Hands nodes and their connections over to `cosim`, which gives their values columns in the row.

use cosim::assembly;

use super::connections::InputConnections;
use super::node_draft::NodeDraft;
use super::ports::Port;

impl From<Port> for assembly::Port {
    fn from(port: Port) -> Self {
        assembly::Port {
            kind: assembly::recorded_kind(port.kind, port.storage),
            name: port.name,
            storage: port.storage,
            reference: port.reference,
            element: port.element,
            discrete: port.discrete,
            tunable: port.tunable,
            clocks: port.clocks,
            unit: port.unit,
            description: port.description,
            place: port.index,
            follows: port.follows,
        }
    }
}

/// The nodes with their connections, without what only the words of the scenario need.
pub(super) fn to_unplaced_nodes(
    drafts: Vec<NodeDraft>,
    connections: InputConnections,
) -> Vec<assembly::NodeDefinition> {
    let ports = |ports: Vec<Port>| ports.into_iter().map(Into::into).collect();
    let nodes = drafts.into_iter().zip(connections).map(|(node, connections)| {
        let NodeDraft { name, body, outputs, inputs, .. } = node;
        let (outputs, inputs) = (ports(outputs), ports(inputs));
        assembly::NodeDefinition { name, body, outputs, inputs, connections }
    });
    nodes.collect()
}
