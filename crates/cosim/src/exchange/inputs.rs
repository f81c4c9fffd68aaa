//! Gathers the inputs of a node: from the row through their connections, which convert units and have effects and faults.
//!
//! Most connections are plain: a number with a conversion of its unit at most. Those of nodes that have no others are listed before the
//! first step, close together, and take a short way.

use std::ops::Range;

use recording::{AllVariables, NumberIndex, NumberRange};

use super::{Exchange, StepInterruption, check_accepted_value, exact};
use crate::clock::StepBoundary;
use crate::extrapolation::ExtrapolatedInput;
use crate::system::{AcceptedValues, NodeBody, NodePlan, NumberConnection};

/// A connection of numbers with a conversion of their unit at most.
#[derive(Debug, Clone, Copy)]
struct DirectConnection {
    from: NumberIndex<AllVariables>,
    to: NumberIndex<AllVariables>,
    at_start: bool,
    factor: f64,
    offset: f64,
}

/// What a step looks at of a node. It is small: the caches of the processor hold that of many nodes.
#[derive(Debug, Clone)]
pub(super) struct NodeStepView {
    /// Its connections, if all of them are plain.
    connections: Option<Range<u32>>,
    /// Whether it has numbers only, none of which is extrapolated.
    pub is_plain: bool,
    /// Its outputs and its inputs.
    outputs: Range<u32>,
    inputs: Range<u32>,
    /// Its outputs that may not be NaN, among those of all.
    needed: Range<u32>,
}

impl NodeStepView {
    /// Where its inputs and its outputs begin among all numbers.
    #[inline]
    pub fn first_places(&self) -> [usize; 2] {
        [self.inputs.start as usize, self.outputs.start as usize]
    }

    #[inline]
    pub fn outputs(&self) -> NumberRange<AllVariables> {
        NumberRange::new(long_range(&self.outputs))
    }

    #[inline]
    pub fn inputs(&self) -> NumberRange<AllVariables> {
        NumberRange::new(long_range(&self.inputs))
    }
}

#[inline]
fn long_range(range: &Range<u32>) -> Range<usize> {
    range.start as usize..range.end as usize
}

/// A range in few bytes; nobody has so many columns that it is cut.
fn short_range(range: Range<usize>) -> Range<u32> {
    let short = |position: usize| u32::try_from(position).unwrap_or(u32::MAX);
    short(range.start)..short(range.end)
}

/// The plain connections of all nodes.
#[derive(Debug, Clone, Default)]
pub(super) struct DirectConnections {
    nodes: Vec<NodeStepView>,
    connections: Vec<DirectConnection>,
    needed: Vec<NumberIndex<AllVariables>>,
    /// Whether a node has texts.
    pub has_texts: bool,
}

impl DirectConnections {
    /// Those of these nodes, with the inputs of each that are extrapolated.
    pub fn from_plans(plans: &[NodePlan], extrapolated: &[Vec<ExtrapolatedInput>]) -> Self {
        let mut all = DirectConnections::default();
        for (plan, extrapolated) in plans.iter().zip(extrapolated) {
            let NodePlan { texts, exact, body, .. } = plan;
            // An outlet takes its value when its outputs are read.
            let takes_numbers = texts.connections.is_empty()
                && exact.connections.is_empty()
                && !matches!(body, NodeBody::Outlet);
            let gives_texts = !texts.unneeded && !texts.outputs.positions().is_empty();
            let gives_integers = !exact.unneeded && !exact.numbers.is_empty();
            let has_numbers = takes_numbers && !gives_integers && !gives_texts;
            let connections = if takes_numbers { all.add_node_connections(plan) } else { None };
            all.nodes.push(NodeStepView {
                connections: connections.map(short_range),
                is_plain: has_numbers && extrapolated.is_empty(),
                outputs: short_range(plan.outputs.positions()),
                inputs: short_range(plan.inputs.positions()),
                needed: short_range(all.needed.len()..all.needed.len() + plan.needed.len()),
            });
            all.needed.extend(&plan.needed);
            all.has_texts |= gives_texts || !texts.connections.is_empty();
        }
        all
    }

    /// Adds the connections of a node, if all of them are plain.
    fn add_node_connections(&mut self, plan: &NodePlan) -> Option<Range<usize>> {
        let is_plain = |connection: &NumberConnection| {
            let chain = &connection.input_chain;
            let unchanged = chain.map.is_empty() && chain.effects.is_empty();
            unchanged && chain.faults.is_empty() && chain.accepts == AcceptedValues::Real
        };
        if !plan.connections.iter().all(is_plain) {
            return None;
        }
        let first = self.connections.len();
        let connections = plan.connections.iter().zip(plan.inputs.indices());
        self.connections.extend(connections.map(|(connection, to)| DirectConnection {
            from: connection.source.index,
            to,
            at_start: connection.source.at == StepBoundary::Start,
            factor: connection.input_chain.factor,
            offset: connection.input_chain.offset,
        }));
        Some(first..self.connections.len())
    }

    #[inline]
    pub fn of_node(&self, node: usize) -> &NodeStepView {
        &self.nodes[node]
    }

    /// The outputs of a node that may not be NaN.
    #[inline]
    pub fn needed_outputs(&self, node: usize) -> &[NumberIndex<AllVariables>] {
        &self.needed[long_range(&self.nodes[node].needed)]
    }
}

/// The value that a connection of a loop has, by its place among those of the node that takes it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GuessedInput {
    /// The place of the connection.
    pub place: usize,
    /// Its value.
    pub value: f64,
}

impl Exchange<'_> {
    /// Puts the inputs of a node for this step into the row. Effects and faults of its connections go on by one
    /// step with each call.
    ///
    /// # Errors
    /// When an input does not accept its value.
    #[inline(always)]
    pub fn gather_inputs(&mut self, node: usize) -> Result<(), StepInterruption> {
        if let Some(connections) = &self.state.plain.of_node(node).connections {
            self.state.efforts.start_timing_node(node);
            for connection in &self.state.plain.connections[long_range(connections)] {
                let value = match connection.at_start {
                    true => self.state.start[connection.from],
                    false => self.state.row[connection.from],
                };
                // As `InputChain::convert_unit`.
                self.state.row[connection.to] = value * connection.factor + connection.offset;
            }
            return Ok(());
        }
        self.gather_other_inputs(node)
    }

    #[inline(never)]
    fn gather_other_inputs(&mut self, node: usize) -> Result<(), StepInterruption> {
        match self.plans[node].body {
            // It gets its value when that is there.
            NodeBody::Outlet => Ok(()),
            _ => self.gather_all_inputs(node, &[]),
        }
    }

    /// The same with guesses of some inputs, in a loop.
    ///
    /// # Errors
    /// When an input does not accept its value.
    pub fn gather_guessed_inputs(
        &mut self,
        node: usize,
        guesses: &[GuessedInput],
    ) -> Result<(), StepInterruption> {
        match guesses {
            [] => self.gather_inputs(node),
            guesses => self.gather_all_inputs(node, guesses),
        }
    }

    /// Puts the inputs of a node into the row, also where connections are not plain.
    pub(super) fn gather_all_inputs(
        &mut self,
        node: usize,
        guesses: &[GuessedInput],
    ) -> Result<(), StepInterruption> {
        self.state.efforts.start_timing_node(node);
        let span = self.step_interval();
        let time_of = |at| if at == StepBoundary::End { span.end } else { span.start };
        let samples = self.begins_at_communication_point();
        let (plan, row) = (&mut self.plans[node], &mut self.state.row);
        if !plan.exact.connections.is_empty() {
            exact::check_integer_inputs(plan, self.columns, Some(&self.state.start), row, &time_of)
                .map_err(StepInterruption::Value)?;
        }
        // Faults begin and end at communication points.
        let time = self.clock.time_at(self.tick);
        let connections = plan.connections.iter_mut().zip(plan.inputs.indices()).enumerate();
        for (place, (NumberConnection { source, input_chain, .. }, input)) in connections {
            if let Some(guess) = guesses.iter().find(|guess| guess.place == place) {
                row[input] = guess.value;
                continue;
            }
            if !samples && !input_chain.effects.is_empty() {
                continue;
            }
            let from = if source.at == StepBoundary::Start { &self.state.start } else { &*row };
            row[input] = input_chain.next_input_value(from[source.index], time);
            check_accepted_value(input_chain, self.columns, source.index, input, row[input], || {
                time_of(source.at)
            })
            .map_err(StepInterruption::Value)?;
        }
        exact::carry_integer_inputs(plan, Some(&self.state.start), row);
        for (source, input) in plan.texts.connections.iter().zip(plan.texts.inputs.indices()) {
            match source.at {
                StepBoundary::Start => row[input].clone_from(&self.state.start[source.index]),
                StepBoundary::End => row.copy_text(source.index, input),
            }
        }
        Ok(())
    }
}
