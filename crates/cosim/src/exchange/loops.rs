//! The parts of an exchange that loops need: guessed inputs, and what those would get.

use diagnostics::Error;
use recording::{AllVariables, NumberIndex};

use super::{Exchange, StepInterruption};
use crate::clock::StepBoundary;
use crate::system::{AcceptedValues, FmuFailurePolicy, NodeBody, TearConnection};

/// The values at both ends of a connection, in the unit of the input.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ConnectionValues {
    /// The value that the input has.
    pub input: f64,
    /// The value that its source has now.
    pub source: f64,
}

impl Exchange<'_> {
    /// The value that the input of a connection has.
    #[must_use]
    pub fn input_value(&self, tear: TearConnection) -> f64 {
        self.input_column(tear).map_or(0.0, |input| self.state.row[input])
    }

    /// The value that it had at the start of the step.
    #[must_use]
    pub fn input_value_at_step_start(&self, tear: TearConnection) -> f64 {
        self.input_column(tear).map_or(0.0, |input| self.state.start[input])
    }

    /// The value that it would get. Effects and faults of the connection go on by one step.
    ///
    /// # Errors
    /// When the input does not accept it.
    pub fn source_value(&mut self, tear: TearConnection) -> Result<f64, StepInterruption> {
        let (Some(input), end) = (self.input_column(tear), self.step_interval().end) else {
            return Ok(0.0);
        };
        let (time, samples) = (self.clock.time_at(self.tick), self.begins_at_communication_point());
        let link = &mut self.plans[tear.node].connections[tear.place];
        if !samples && !link.input_chain.effects.is_empty() {
            return Ok(self.state.row[input]);
        }
        let value = link.input_chain.next_input_value(self.state.row[link.source.index], time);
        super::check_accepted_value(&link.input_chain, self.columns, link.source.index, input, value, || end)
            .map_err(StepInterruption::Value)?;
        Ok(value)
    }

    /// What the source of the input shows now, in the unit of the input, without effects and faults of the connection.
    pub(crate) fn source_value_in_input_unit(&self, tear: TearConnection) -> f64 {
        let link = &self.plans[tear.node].connections[tear.place];
        link.input_chain.convert_and_map(self.state.row[link.source.index])
    }

    /// The value that an input has, and what its source shows now, both in the unit of the input.
    #[must_use]
    pub fn connection_values(&self, tear: TearConnection) -> ConnectionValues {
        let source = self.source_value_in_input_unit(tear);
        ConnectionValues { input: self.input_value(tear), source }
    }

    /// Whether the input is a real number.
    #[must_use]
    pub fn is_real_input(&self, tear: TearConnection) -> bool {
        let link = &self.plans[tear.node].connections[tear.place];
        matches!(link.input_chain.accepts, AcceptedValues::Real)
    }

    /// The name of the input.
    #[must_use]
    pub fn input_name(&self, tear: TearConnection) -> String {
        self.input_column(tear).map(|input| self.columns[input].qualified_name()).unwrap_or_default()
    }

    /// Tells something at the end of the run.
    pub fn add_notice(&mut self, what: String) {
        self.state.notices.push(what);
    }

    fn input_column(&self, tear: TearConnection) -> Option<NumberIndex<AllVariables>> {
        self.plans[tear.node].inputs.nth_index(tear.place)
    }

    /// How what each connection of a loop would get changes with what one of them has, without a step in between; none if a node does
    /// not know. `changes` has room for the row.
    ///
    /// # Errors
    /// When a node fails.
    pub(crate) fn loop_derivatives(
        &mut self,
        nodes: &[usize],
        tears: &[TearConnection],
        by: TearConnection,
        changes: &mut Vec<f64>,
    ) -> Result<Option<Vec<f64>>, StepInterruption> {
        changes.clear();
        changes.resize(self.state.row.numbers().len(), 0.0);
        let mut given = Vec::new();
        for &node in nodes {
            let plan = &self.plans[node];
            given.clear();
            given.extend(plan.connections.iter().enumerate().map(|(place, link)| {
                let here = TearConnection { node, place };
                match (here == by, tears.contains(&here) || link.source.at == StepBoundary::Start) {
                    (true, _) => 1.0,
                    (false, true) => 0.0,
                    (false, false) => link.input_chain.factor * changes[link.source.index.position()],
                }
            }));
            let outputs = plan.outputs.positions();
            if plan.is_connector() {
                changes[outputs].copy_from_slice(&given);
                continue;
            }
            let known = match self.nodes[node].as_directional_derivatives() {
                Some(it) => it.directional_derivatives(&given, &mut changes[outputs]),
                None => Ok(false),
            };
            match known {
                Ok(true) => {}
                Ok(false) => return Ok(None),
                Err(error) => return Err(StepInterruption::Call { node, error }),
            }
        }
        let found = tears.iter().map(|tear| {
            let link = &self.plans[tear.node].connections[tear.place];
            link.input_chain.factor * changes[link.source.index.position()]
        });
        Ok(Some(found.collect()))
    }
}

/// Refuses nodes that go on after a failure, of those whose steps are repeated: their earlier states end with their process.
pub(crate) fn check_failures(exchange: &Exchange, nodes: &[usize]) -> Result<(), Error> {
    let goes_on = |node: &&usize| match &exchange.plans[**node].body {
        NodeBody::Fmu { isolation: Some(isolation), .. } => isolation.on_failure != FmuFailurePolicy::End,
        _ => false,
    };
    let Some(node) = nodes.iter().find(goes_on) else { return Ok(()) };
    let message = format!(
        "[coupling] repeats steps of {}, whose states do not outlive the failure that its `on_failure` is for",
        quoted_node_names(exchange, &[*node])
    );
    Err(Error::invalid_input(message).with_help(
        "leave `on_failure` out, or choose a coupling that repeats no steps: `gauss_seidel` or `jacobi`, with the estimate `energy` if with a `tolerance`",
    ))
}

/// Names a node that lacks what an algorithm needs.
pub(crate) fn quoted_node_names(exchange: &Exchange, nodes: &[usize]) -> String {
    let names: Vec<_> = nodes.iter().map(|node| format!("`{}`", exchange.plans[*node].name)).collect();
    names.join(", ")
}

/// An error of the coupling at a time [s].
pub(crate) fn unsolved_loop_interruption(message: String, help: &str) -> StepInterruption {
    StepInterruption::Unsolved(Error::invalid_input(message).with_help(help.to_owned()))
}
