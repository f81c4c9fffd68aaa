//! Lays out the row: gives each output and each connected input its column, and resolves connections to indices of columns.

use std::collections::BTreeSet;

use cosim::system::{
    Accepts, Body, ExactConnection, ExactPlan, NodePlan, ResolvedConnection, Source, TextPlan,
};
use recording::{
    Column, ColumnIndex, Columns, Direction, Full, IntegerRange, NumberRange, TextRange,
};

use super::connections::{Connection, Connections};
use super::nodes::NodeDraft;
use super::ports::{Port, port_groups};
use super::types::recorded_kind;

/// Gives each output and each connected input its column in the row: all outputs come before all inputs.
pub(super) fn assign_columns(
    drafts: Vec<NodeDraft>,
    connections: Connections,
) -> (Vec<NodePlan>, Columns<Full>) {
    let mut columns = Columns::default();
    let outputs = outputs(&mut columns, &drafts, &connections);
    let integers: Vec<_> = columns.integers().map(|(_, number)| number).collect();
    let mut nodes = Vec::new();
    for ((mut node, connections), output) in drafts.into_iter().zip(connections).zip(&outputs) {
        let (connected, connections): (Vec<_>, Vec<_>) = node
            .inputs
            .into_iter()
            .zip(connections)
            .filter_map(|(port, connection)| Some((port, connection?)))
            .unzip();
        if let Body::Fmu { inputs, .. } = &mut node.body {
            *inputs = port_groups(&connected);
        }
        let (numbers, texts, own_integers) = match node.body {
            // What it takes is what it gives.
            Body::Inlet | Body::Outlet => (output.numbers, output.texts, output.integers),
            _ => {
                let name = &node.name;
                let input = NodeColumns::append(&mut columns, name, &connected, Direction::Input);
                (input.numbers, input.texts, input.integers)
            }
        };
        let mut plan = NodePlan {
            name: node.name,
            body: node.body,
            pace: None,
            outputs: output.numbers,
            needed: output.numbers.indices().collect(),
            inputs: numbers,
            connections: Vec::new(),
            texts: TextPlan { outputs: output.texts, inputs: texts, ..TextPlan::default() },
            exact: ExactPlan {
                outputs: output.integers,
                numbers: integers[output.integers.positions()].to_vec(),
                inputs: own_integers,
                ..ExactPlan::default()
            },
            faults: Vec::new(),
        };
        for Connection { from, at, input_chain, extrapolation } in connections {
            // Types were compared: a number goes to a number and a text to a text.
            match (outputs[from.node].ports[from.port], input_chain) {
                (ColumnIndex::Number(index), Some(input_chain)) => {
                    plan.connections.push(ResolvedConnection {
                        source: Source { index, at },
                        input_chain,
                        course: extrapolation,
                    });
                }
                (ColumnIndex::Text(index), _) => plan.texts.connections.push(Source { index, at }),
                (ColumnIndex::Number(_), None) => unreachable!("a number goes to a text"),
            }
        }
        exact(&mut plan, &columns);
        nodes.push(plan);
    }
    (nodes, columns)
}

/// Gives the outputs of all nodes their columns. Those of an input connector are inputs.
fn outputs(
    columns: &mut Columns<Full>,
    drafts: &[NodeDraft],
    connections: &Connections,
) -> Vec<NodeColumns> {
    let sources = connections.iter().flatten().flatten().map(|connection| connection.from.node);
    let sources: BTreeSet<_> = sources.collect();
    let sides = drafts.iter().zip(connections).enumerate().map(|(index, (node, connections))| {
        let NodeDraft { name, body, outputs, .. } = node;
        let is_used = connections.iter().any(Option::is_some) || sources.contains(&index);
        match body {
            // As for other inputs, a value that nobody gives is none.
            Body::Inlet if !is_used => NodeColumns::append(columns, name, &[], Direction::Input),
            Body::Inlet => NodeColumns::append(columns, name, outputs, Direction::Input),
            _ => NodeColumns::append(columns, name, outputs, Direction::Output),
        }
    });
    sides.collect()
}

/// Finds the connections of a node with an integer of 64 bits at one end or at both. Where both have one and nothing changes it,
/// the integer itself is what the input has to accept, not its number.
fn exact(plan: &mut NodePlan, columns: &Columns<Full>) {
    let links = plan.connections.iter_mut().zip(plan.inputs.indices()).enumerate();
    for (index, (link, input)) in links {
        let source = columns.integer(link.source.index);
        let input = columns.integer(input);
        if source.is_none() && input.is_none() {
            continue;
        }
        let chain = &mut link.input_chain;
        let both = source.is_some() && input.is_some() && chain.is_plain();
        let as_it_is = both.then(|| std::mem::replace(&mut chain.accepts, Accepts::Real));
        plan.exact.connections.push(ExactConnection { place: index, source, input, as_it_is });
    }
}

/// The columns of one side of a node.
struct NodeColumns {
    /// The column of each port.
    ports: Vec<ColumnIndex<Full>>,
    numbers: NumberRange<Full>,
    texts: TextRange<Full>,
    integers: IntegerRange<Full>,
}

impl NodeColumns {
    fn append(
        columns: &mut Columns<Full>,
        node: &str,
        ports: &[Port],
        direction: Direction,
    ) -> Self {
        let ends = |columns: &Columns<Full>| {
            (columns.numbers().len(), columns.texts().len(), columns.integers().len())
        };
        let (numbers, texts, integers) = ends(columns);
        let column = |port: &Port| Column {
            node: node.to_owned(),
            variable: port.name.clone(),
            direction,
            kind: recorded_kind(port.kind, port.storage),
            unit: port.unit.clone(),
            description: port.description.clone(),
        };
        let ports = ports.iter().map(|port| columns.push(column(port))).collect();
        let (numbers_end, texts_end, integers_end) = ends(columns);
        Self {
            ports,
            numbers: NumberRange::new(numbers..numbers_end),
            texts: TextRange::new(texts..texts_end),
            integers: IntegerRange::new(integers..integers_end),
        }
    }
}
