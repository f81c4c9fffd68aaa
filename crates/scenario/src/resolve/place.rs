//! Gives the values of the nodes their places in the row.

use std::ops::Range;

use fmu_import::description::Type;
use recording::{Column, Direction, Kind};

use super::links::{Connection, Links};
use super::nodes::{Port, UnplacedNode, references};
use super::types::recorded_kind;
use crate::plan::{Body, NodePlan, ResolvedConnection, Source, TextPlan};

/// Gives each output and each connected input its place among the numbers or the texts of the row;
/// returns the nodes, the columns of the numbers and those of the texts.
pub(super) fn place(
    drafts: Vec<UnplacedNode>,
    links: Links,
) -> (Vec<NodePlan>, Vec<Column>, Vec<Column>) {
    let places = places(&drafts);
    let (mut nodes, mut outputs, mut inputs) = (Vec::new(), Sides::default(), Sides::default());
    for (mut draft, wires) in drafts.into_iter().zip(links) {
        let (connected, wires): (Vec<_>, Vec<_>) = draft
            .inputs
            .into_iter()
            .zip(wires)
            .filter_map(|(port, wire)| Some((port, wire?)))
            .unzip();
        if let Body::Fmu { inputs, .. } = &mut draft.body {
            *inputs = references(&connected);
        }
        let (numbers, texts) = outputs.append(&draft.name, draft.outputs, Direction::Output);
        let mut plan = NodePlan {
            outputs: numbers,
            inputs: 0..0,
            links: Vec::new(),
            texts: TextPlan { outputs: texts, ..TextPlan::default() },
            name: draft.name,
            body: draft.body,
        };
        (plan.inputs, plan.texts.inputs) = inputs.append(&plan.name, connected, Direction::Input);
        for Connection { from: (node, output), at, treatment } in wires {
            let source = Source { place: places[node][output], at };
            match treatment {
                Some(treatment) => plan.links.push(ResolvedConnection { source, treatment }),
                None => plan.texts.links.push(source),
            }
        }
        nodes.push(plan);
    }
    let behind = |range: &mut Range<usize>, outputs: &[Column]| {
        *range = range.start + outputs.len()..range.end + outputs.len();
    };
    for node in &mut nodes {
        behind(&mut node.inputs, &outputs.numbers);
        behind(&mut node.texts.inputs, &outputs.texts);
    }
    outputs.numbers.append(&mut inputs.numbers);
    outputs.texts.append(&mut inputs.texts);
    (nodes, outputs.numbers, outputs.texts)
}

/// The place of each output of each node: all outputs come before all inputs.
fn places(drafts: &[UnplacedNode]) -> Vec<Vec<usize>> {
    let (mut numbers, mut texts) = (0.., 0..);
    let mut next = |port: &Port| match port.kind {
        Type::String => texts.next(),
        _ => numbers.next(),
    };
    drafts.iter().map(|draft| draft.outputs.iter().filter_map(&mut next).collect()).collect()
}

/// The columns of one side of all nodes.
#[derive(Default)]
struct Sides {
    numbers: Vec<Column>,
    texts: Vec<Column>,
}

impl Sides {
    /// Adds columns of a node; returns where its numbers and its texts are.
    fn append(
        &mut self,
        node: &str,
        ports: Vec<Port>,
        direction: Direction,
    ) -> (Range<usize>, Range<usize>) {
        let first = (self.numbers.len(), self.texts.len());
        for port in ports {
            let kind = recorded_kind(port.kind);
            let columns = if kind == Kind::String { &mut self.texts } else { &mut self.numbers };
            columns.push(Column {
                node: node.to_owned(),
                variable: port.name,
                direction,
                kind,
                unit: port.unit,
                description: port.description,
            });
        }
        (first.0..self.numbers.len(), first.1..self.texts.len())
    }
}
