//! Lets each node of B get what it got in A: after a node has stepped, its outputs are compared with those of A, and A's go on.
//!
//! So a node that differs is one that differs by itself, and not since another one does.

use std::sync::{Arc, Mutex, PoisonError};

use cosim::clock::CommunicationClock;
use cosim::node::{Node, SourceNode, Stateful};
use cosim::signal::Signal;
use cosim::system::System;
use fmu_import::CallError;

use crate::trajectory::{SignalName, Trajectory, differs_beyond_rounding};

/// Where the outputs of a node first differ from those of A, while all that it gets is as in A.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct OutputDeviation {
    /// The time [s].
    pub time: f64,
    /// The place among the outputs of the node.
    pub output: usize,
    pub a: f64,
    pub b: f64,
}

/// A node that shows the outputs of another run.
struct ReferenceOutputs {
    node: Box<dyn Node>,
    reference: Arc<Trajectory>,
    /// The column of the reference for each output.
    columns: Vec<Option<usize>>,
    /// The largest value of each output in the reference.
    scales: Vec<f64>,
    /// The time of the outputs [s].
    time: f64,
    first: Arc<Mutex<Option<OutputDeviation>>>,
}

/// Puts all nodes into nodes that show the outputs of the reference. Gives the first deviation of each, once the system has run.
pub(crate) fn show_reference_outputs(
    system: &System,
    nodes: &mut [Box<dyn Node>],
    reference: &Arc<Trajectory>,
) -> Vec<Arc<Mutex<Option<OutputDeviation>>>> {
    let mut found = Vec::new();
    for (plan, node) in system.nodes.iter().zip(nodes) {
        let column_of = |index: recording::NumberIndex<recording::AllVariables>| {
            let column = &system.columns[index];
            let same = |it: &SignalName| {
                !it.input
                    && it.node == column.node
                    && it.variable == column.variable
                    && it.unit == column.unit
            };
            reference.columns.iter().position(same)
        };
        let columns: Vec<_> = plan.outputs.indices().map(column_of).collect();
        let largest = |column: &Option<usize>| {
            let values =
                |column: usize| (0..reference.times.len()).map(move |row| reference.row(row)[column]);
            column.map_or(0.0, |column| {
                values(column).filter(|it| it.is_finite()).fold(0.0, |a: f64, b| a.max(b.abs()))
            })
        };
        let first = Arc::new(Mutex::new(None));
        found.push(Arc::clone(&first));
        let nothing: Box<dyn Node> = Box::new(SourceNode::new(Vec::<Signal>::new()));
        *node = Box::new(ReferenceOutputs {
            scales: columns.iter().map(largest).collect(),
            node: std::mem::replace(node, nothing),
            reference: Arc::clone(reference),
            columns,
            time: system.clock.time_at(0),
            first,
        });
    }
    found
}

impl ReferenceOutputs {
    fn replace_outputs(&mut self, outputs: &mut [f64]) {
        // Within a step there is nothing to compare with.
        let Some(row) = self.reference.find_time(self.time) else { return };
        let row = self.reference.row(row);
        for (place, (output, column)) in outputs.iter_mut().zip(&self.columns).enumerate() {
            let Some(column) = column else { continue };
            let (a, b) = (row[*column], *output);
            if differs_beyond_rounding(a, b, self.scales[place]) {
                let mut first = self.first.lock().unwrap_or_else(PoisonError::into_inner);
                first.get_or_insert(OutputDeviation { time: self.time, output: place, a, b });
            }
            *output = a;
        }
    }
}

impl Node for ReferenceOutputs {
    fn inner_node(&self) -> Option<&dyn Node> {
        Some(self.node.as_ref())
    }

    fn inner_mut(&mut self) -> Option<&mut dyn Node> {
        Some(self.node.as_mut())
    }

    fn do_step(&mut self, clock: &CommunicationClock, tick: u64) -> Result<(), CallError> {
        self.time = clock.time_at(tick + 1);
        self.node.do_step(clock, tick)
    }

    fn get_outputs(&mut self, outputs: &mut [f64]) -> Result<(), CallError> {
        self.node.get_outputs(outputs)?;
        self.replace_outputs(outputs);
        Ok(())
    }

    fn exchange_and_step(
        &mut self,
        inputs: &[f64],
        clock: &CommunicationClock,
        tick: u64,
        outputs: &mut [f64],
    ) -> Result<bool, CallError> {
        self.time = clock.time_at(tick + 1);
        let messages = self.node.exchange_and_step(inputs, clock, tick, outputs)?;
        self.replace_outputs(outputs);
        Ok(messages)
    }

    fn as_stateful(&mut self) -> Option<&mut dyn Stateful> {
        self.node.as_stateful()
    }
}
