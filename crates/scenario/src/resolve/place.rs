//! Gives the values of the nodes their indices in the row.

use recording::{Column, ColumnIndex, Columns, Direction, Full, NumberRange, TextRange};

use super::links::{Links, Wire};
use super::nodes::{Draft, Port, references};
use super::types::recorded_kind;
use crate::plan::{Body, Link, NodePlan, Source, TextPlan};

/// Gives each output and each connected input its column in the row: all outputs come before all inputs.
pub(super) fn place(drafts: Vec<Draft>, links: Links) -> (Vec<NodePlan>, Columns<Full>) {
    let mut columns = Columns::default();
    let sides = drafts
        .iter()
        .map(|draft| Side::append(&mut columns, &draft.name, &draft.outputs, Direction::Output));
    let outputs: Vec<_> = sides.collect();
    let mut nodes = Vec::new();
    for ((mut draft, wires), output) in drafts.into_iter().zip(links).zip(&outputs) {
        let (connected, wires): (Vec<_>, Vec<_>) = draft
            .inputs
            .into_iter()
            .zip(wires)
            .filter_map(|(port, wire)| Some((port, wire?)))
            .unzip();
        if let Body::Fmu { inputs, .. } = &mut draft.body {
            *inputs = references(&connected);
        }
        let input = Side::append(&mut columns, &draft.name, &connected, Direction::Input);
        let mut plan = NodePlan {
            name: draft.name,
            body: draft.body,
            outputs: output.numbers,
            inputs: input.numbers,
            links: Vec::new(),
            texts: TextPlan { outputs: output.texts, inputs: input.texts, links: Vec::new() },
        };
        for Wire { from: (node, port), at, treatment } in wires {
            // Types were compared: a number goes to a number and a text to a text.
            match (outputs[node].ports[port], treatment) {
                (ColumnIndex::Number(index), Some(treatment)) => {
                    plan.links.push(Link { source: Source { index, at }, treatment });
                }
                (ColumnIndex::Text(index), _) => plan.texts.links.push(Source { index, at }),
                (ColumnIndex::Number(_), None) => unreachable!("a number goes to a text"),
            }
        }
        nodes.push(plan);
    }
    (nodes, columns)
}

/// The columns of one side of a node.
struct Side {
    /// The column of each port.
    ports: Vec<ColumnIndex<Full>>,
    numbers: NumberRange<Full>,
    texts: TextRange<Full>,
}

impl Side {
    fn append(
        columns: &mut Columns<Full>,
        node: &str,
        ports: &[Port],
        direction: Direction,
    ) -> Self {
        let ends = |columns: &Columns<Full>| (columns.numbers().len(), columns.texts().len());
        let (numbers, texts) = ends(columns);
        let column = |port: &Port| Column {
            node: node.to_owned(),
            variable: port.name.clone(),
            direction,
            kind: recorded_kind(port.kind),
            unit: port.unit.clone(),
            description: port.description.clone(),
        };
        let ports = ports.iter().map(|port| columns.push(column(port))).collect();
        let (numbers_end, texts_end) = ends(columns);
        Self {
            ports,
            numbers: NumberRange::new(numbers..numbers_end),
            texts: TextRange::new(texts..texts_end),
        }
    }
}
