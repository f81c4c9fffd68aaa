//! Takes nodes back to the start of a step, with all that their connections remember.

use fmu_import::CallError;
use recording::{AllVariables, Row};

use super::{Exchange, NodeTermination, StepInterruption};
use crate::extrapolation::ExtrapolatedInput;
use crate::node::{NodeState, stateful_node};
use crate::system::InputChain;

/// Nodes at a communication point.
pub struct ExchangeSnapshot {
    nodes: Vec<(usize, NodeState)>,
    /// Sensor effects and faults, by node and place.
    chains: Vec<(usize, usize, InputChain)>,
    extrapolated: Vec<Vec<ExtrapolatedInput>>,
    row: Row<AllVariables>,
    stop: Option<NodeTermination>,
}

impl Exchange<'_> {
    /// Remembers `nodes` in the place of an earlier snapshot of the same ones.
    ///
    /// # Errors
    /// When a node cannot save its state.
    pub fn save_snapshot(
        &mut self,
        nodes: &[usize],
        snapshot: &mut Option<ExchangeSnapshot>,
    ) -> Result<(), StepInterruption> {
        match snapshot {
            None => *snapshot = Some(self.first_snapshot(nodes)?),
            Some(kept) => {
                for (node, state) in &mut kept.nodes {
                    let saved = stateful_node(self.nodes[*node].as_mut());
                    saved.and_then(|it| it.save_into(state)).map_err(call_interruption(*node))?;
                }
                for (node, place, chain) in &mut kept.chains {
                    chain.clone_from(&self.plans[*node].connections[*place].input_chain);
                }
                for ((node, _), extrapolated) in kept.nodes.iter().zip(&mut kept.extrapolated) {
                    extrapolated.clone_from(&self.state.extrapolated[*node]);
                }
                kept.row.copy_from(&self.state.row);
                kept.stop.clone_from(&self.state.stop);
            }
        }
        Ok(())
    }

    fn first_snapshot(&mut self, nodes: &[usize]) -> Result<ExchangeSnapshot, StepInterruption> {
        let mut states = Vec::new();
        for &node in nodes {
            let saved = stateful_node(self.nodes[node].as_mut()).and_then(|it| it.save_state());
            states.push((node, saved.map_err(call_interruption(node))?));
        }
        let chains = nodes.iter().flat_map(|&node| {
            let links = self.plans[node].connections.iter().enumerate();
            let chains = links.map(move |(place, link)| (node, place, link.input_chain.clone()));
            chains.filter(|(.., chain)| !chain.effects.is_empty() || !chain.faults.is_empty())
        });
        Ok(ExchangeSnapshot {
            nodes: states,
            chains: chains.collect(),
            extrapolated: nodes.iter().map(|node| self.state.extrapolated[*node].clone()).collect(),
            row: self.state.row.clone(),
            stop: self.state.stop.clone(),
        })
    }

    /// Goes back to a snapshot. The row goes back, too, if the snapshot is of all nodes.
    ///
    /// # Errors
    /// When a node cannot restore its state.
    pub fn restore_snapshot(&mut self, snapshot: &ExchangeSnapshot) -> Result<(), StepInterruption> {
        for ((node, state), extrapolated) in snapshot.nodes.iter().zip(&snapshot.extrapolated) {
            let restored = stateful_node(self.nodes[*node].as_mut()).and_then(|it| it.restore_state(state));
            restored.map_err(call_interruption(*node))?;
            self.state.extrapolated[*node].clone_from(extrapolated);
        }
        for (node, place, chain) in &snapshot.chains {
            self.plans[*node].connections[*place].input_chain.clone_from(chain);
        }
        if snapshot.nodes.len() == self.nodes.len() {
            self.state.row.copy_from(&snapshot.row);
        }
        self.state.stop.clone_from(&snapshot.stop);
        Ok(())
    }

    /// Those of these nodes that cannot go back to an earlier state.
    #[must_use]
    pub fn nodes_without_rollback(&mut self, nodes: &[usize]) -> Vec<usize> {
        let mut can_save = |node: usize| self.nodes[node].as_stateful().is_some_and(|state| state.can_save());
        nodes.iter().copied().filter(|node| !can_save(*node)).collect()
    }
}

fn call_interruption(node: usize) -> impl Fn(CallError) -> StepInterruption {
    move |error| StepInterruption::Call { node, error }
}
