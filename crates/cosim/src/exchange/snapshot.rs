//! Takes nodes back to the start of a step, with all that their connections remember.

use fmu_import::CallError;
use recording::{Full, Row};

use super::{Exchange, Interruption};
use crate::course::Moving;
use crate::node::NodeState;
use crate::system::InputChain;

/// Nodes at a communication point.
pub struct Snapshot {
    nodes: Vec<(usize, NodeState)>,
    /// Sensor effects and faults, by node and place.
    chains: Vec<(usize, usize, InputChain)>,
    moving: Vec<Vec<Moving>>,
    row: Row<Full>,
    last: Option<(usize, CallError)>,
}

impl Exchange<'_> {
    /// Remembers `nodes` in the place of an earlier snapshot of the same ones.
    ///
    /// # Errors
    /// When a node cannot save its state.
    pub fn save(
        &mut self,
        nodes: &[usize],
        snapshot: &mut Option<Snapshot>,
    ) -> Result<(), Interruption> {
        match snapshot {
            None => *snapshot = Some(self.first_snapshot(nodes)?),
            Some(kept) => {
                for (node, state) in &mut kept.nodes {
                    self.nodes[*node].save_again(state).map_err(failed(*node))?;
                }
                for (node, place, chain) in &mut kept.chains {
                    chain.clone_from(&self.plans[*node].connections[*place].input_chain);
                }
                for ((node, _), moving) in kept.nodes.iter().zip(&mut kept.moving) {
                    moving.clone_from(&self.moving[*node]);
                }
                kept.row.copy_from(&self.row);
                kept.last.clone_from(&self.last);
            }
        }
        Ok(())
    }

    fn first_snapshot(&mut self, nodes: &[usize]) -> Result<Snapshot, Interruption> {
        let mut states = Vec::new();
        for &node in nodes {
            states.push((node, self.nodes[node].save().map_err(failed(node))?));
        }
        let chains = nodes.iter().flat_map(|&node| {
            let links = self.plans[node].connections.iter().enumerate();
            let chains = links.map(move |(place, link)| (node, place, link.input_chain.clone()));
            chains.filter(|(.., chain)| !chain.effects.is_empty() || !chain.faults.is_empty())
        });
        Ok(Snapshot {
            nodes: states,
            chains: chains.collect(),
            moving: nodes.iter().map(|node| self.moving[*node].clone()).collect(),
            row: self.row.clone(),
            last: self.last.clone(),
        })
    }

    /// Goes back to a snapshot. The row goes back, too, if the snapshot is of all nodes.
    ///
    /// # Errors
    /// When a node cannot restore its state.
    pub fn restore(&mut self, snapshot: &Snapshot) -> Result<(), Interruption> {
        for ((node, state), moving) in snapshot.nodes.iter().zip(&snapshot.moving) {
            self.nodes[*node].restore(state).map_err(failed(*node))?;
            self.moving[*node].clone_from(moving);
        }
        for (node, place, chain) in &snapshot.chains {
            self.plans[*node].connections[*place].input_chain.clone_from(chain);
        }
        if snapshot.nodes.len() == self.nodes.len() {
            self.row.copy_from(&snapshot.row);
        }
        self.last.clone_from(&snapshot.last);
        Ok(())
    }

    /// The first of these nodes that cannot go back to an earlier state.
    #[must_use]
    pub fn cannot_go_back(&self, nodes: &[usize]) -> Vec<usize> {
        nodes.iter().copied().filter(|node| !self.nodes[*node].can_save()).collect()
    }
}

fn failed(node: usize) -> impl Fn(CallError) -> Interruption {
    move |error| Interruption::Call { node, error }
}
