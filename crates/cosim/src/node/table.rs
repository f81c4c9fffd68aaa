//! Shows a recorded table as a node. Its state is its time.

use fmu_import::CallError;
use recording::table::Table;
use scenario::plan::Clock;

use super::{Node, NodeState};

/// A recorded table as a node.
#[derive(Debug)]
pub struct TableNode {
    table: Table,
    time: f64,
}

impl TableNode {
    /// One output for each column of the table.
    #[must_use]
    pub fn new(table: Table) -> Self {
        TableNode { table, time: 0.0 }
    }
}

impl Node for TableNode {
    fn get(&mut self, outputs: &mut [f64]) -> Result<(), CallError> {
        for (column, output) in outputs.iter_mut().enumerate() {
            *output = self.table.value(column, self.time);
        }
        Ok(())
    }

    fn step(&mut self, clock: &Clock, tick: u64) -> Result<(), CallError> {
        self.time = clock.at(tick + 1);
        Ok(())
    }

    fn can_save(&self) -> bool {
        true
    }

    fn save(&mut self) -> Result<NodeState, CallError> {
        Ok(NodeState::new(self.time))
    }

    fn restore(&mut self, state: &NodeState) -> Result<(), CallError> {
        self.time = *state.get()?;
        Ok(())
    }
}
