//! Goes some steps from a checkpoint and compares them with those of the run: an FMU may forget a part of its state.

use diagnostics::{Error, rounded_time};
use recording::{AllVariables, Columns, Row, VariableDirection};

use super::{Checkpoint, CheckpointCompatibility, NodeStates};
use crate::coupling::CouplingAlgorithm;
use crate::exchange::{Exchange, StepInterruption, call_failure_error};
use crate::node::Node;
use crate::system::System;

/// A value that is not what it was.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct OutputDifference {
    /// The node that does not go on as it did.
    pub node: String,
    /// Its output.
    pub output: String,
    /// When [s].
    pub time: f64,
    /// What it was, and what it is now.
    pub values: [String; 2],
}

impl OutputDifference {
    /// The differences as a warning about the checkpoint at a time [s].
    #[must_use]
    pub fn describe_differences(all: &[Self], checkpoint: f64) -> Option<String> {
        let first = all.first()?;
        let OutputDifference { node, time, .. } = first;
        let each = all.iter().map(|it| {
            let OutputDifference { node, output, values: [then, now], .. } = it;
            format!("`{node}.{output}` was {then} and is {now}")
        });
        let shown: Vec<_> = each.clone().take(SHOWN).collect();
        let more = match all.len().saturating_sub(SHOWN) {
            0 => String::new(),
            more => format!(", and {more} more"),
        };
        Some(format!(
            "`{node}` does not go on bit for bit from the checkpoint at {} s: at {} s {}{more}; its state is not all that it knows",
            rounded_time(checkpoint),
            rounded_time(*time),
            shown.join(", ")
        ))
    }
}

/// So many differences are told one by one.
const SHOWN: usize = 5;

/// What nodes show otherwise in one of two rows at a time [s], though their inputs are the same in both. Without such a node all that
/// differs: somewhere it began.
#[must_use]
pub fn output_differences(
    columns: &Columns<AllVariables>,
    then: &Row<AllVariables>,
    now: &Row<AllVariables>,
    time: f64,
) -> Vec<OutputDifference> {
    let mut found = Vec::new();
    for (index, column) in columns.number_columns() {
        let exact = columns.integer_index_of(index).map(|integer| [then[integer], now[integer]]);
        let [one, other] = [then[index], now[index]];
        let (differs, values) = match exact {
            Some([a, b]) => (a != b, [a, b].map(|value| value.to_string())),
            None => (one.to_bits() != other.to_bits(), [one, other].map(|value| format!("{value:?}"))),
        };
        found.extend(differs.then_some((column, values)));
    }
    for (index, column) in columns.text_columns().filter(|(index, _)| then[*index] != now[*index]) {
        found.push((column, [&then[index], &now[index]].map(|text| format!("{text:?}"))));
    }
    let has_other_inputs = |node: &str| {
        found.iter().any(|(column, _)| column.node == node && column.direction == VariableDirection::Input)
    };
    let own = found.iter().filter(|(column, _)| !has_other_inputs(&column.node));
    let own: Vec<_> = if own.clone().next().is_some() { own.collect() } else { found.iter().collect() };
    let difference = |(column, values): &&(&recording::Column, [String; 2])| OutputDifference {
        node: column.node.clone(),
        output: column.variable.clone(),
        time,
        values: values.clone(),
    };
    own.iter().map(difference).collect()
}

/// Lets nodes go from a checkpoint of this system as far as the checkpoint knows how the run went on, until something is another. With
/// `states` the nodes are those of the run, else they are new.
///
/// # Errors
/// When a node fails.
pub fn verify_checkpoint(
    checkpoint: &Checkpoint,
    system: &mut System,
    nodes: &mut [Box<dyn Node>],
    coupling: &mut dyn CouplingAlgorithm,
    states: Option<&NodeStates>,
) -> Result<Vec<OutputDifference>, Error> {
    let mut exchange = Exchange::new(system, nodes);
    if states.is_none() {
        coupling.initialise(&mut exchange)?;
    }
    let (fingerprint, same) = (&checkpoint.fingerprint, &CheckpointCompatibility::default());
    checkpoint.restore(&mut exchange, coupling, states, fingerprint, same)?;
    for index in 0..checkpoint.following.len() {
        let tick = checkpoint.tick + index as u64;
        let time = exchange.clock().time_at(tick + 1);
        exchange.begin_step(tick);
        coupling.step(&mut exchange).map_err(|interruption| match interruption {
            StepInterruption::Value(error) | StepInterruption::Unsolved(error) => error,
            StepInterruption::Call { node, error } => {
                call_failure_error(&exchange.node_plans()[node], error, time)
            }
        })?;
        let now = exchange.row().clone();
        let Some(then) = checkpoint.following_row(index, &now, &exchange) else { break };
        let found = output_differences(exchange.columns, &then, &now, time);
        if !found.is_empty() {
            return Ok(found);
        }
    }
    Ok(Vec::new())
}
