//! Shows a source of values over time as a node. Its state is its time.

use fmu_import::CallError;
use recording::table::{ColumnType, Table};

use super::{Node, NodeState, Stateful, TypedValues, state_error};
use crate::clock::Clock;
use crate::signal::Signal;

/// Values over time, without memory.
pub trait Source: Send {
    /// Fills the outputs with the values at `time` [s].
    fn values(&mut self, time: f64, outputs: &mut [f64]);

    /// Fills the outputs that are texts.
    fn texts(&mut self, _time: f64, _outputs: &mut [String]) {}

    /// Fills the outputs that are integers of 64 bits.
    fn integers(&mut self, _time: f64, _outputs: &mut [i128]) {}
}

/// Generated signals, one output each.
impl Source for Vec<Signal> {
    fn values(&mut self, time: f64, outputs: &mut [f64]) {
        for (output, signal) in outputs.iter_mut().zip(self.iter()) {
            *output = signal.value(time);
        }
    }
}

/// A recorded table, with one output for each column.
impl Source for Table {
    fn values(&mut self, time: f64, outputs: &mut [f64]) {
        let (columns, mut outputs) = (self.names().len(), outputs.iter_mut());
        for column in 0..columns {
            if self.column_type(column) == ColumnType::Text {
                continue;
            }
            if let Some(output) = outputs.next() {
                *output = self.value(column, time);
            }
        }
    }

    fn texts(&mut self, time: f64, outputs: &mut [String]) {
        for (column, output) in self.columns_of_type(ColumnType::Text).into_iter().zip(outputs) {
            self.text(column, time).unwrap_or_default().clone_into(output);
        }
    }

    fn integers(&mut self, time: f64, outputs: &mut [i128]) {
        for (column, output) in self.columns_of_type(ColumnType::Integer).into_iter().zip(outputs) {
            *output = self.integer(column, time).unwrap_or_default();
        }
    }
}

/// A source as a node.
#[derive(Debug)]
pub struct SourceNode<S> {
    source: S,
    time: f64,
}

impl<S: Source> SourceNode<S> {
    /// Begins at time 0.
    #[must_use]
    pub fn new(source: S) -> Self {
        SourceNode { source, time: 0.0 }
    }
}

impl<S: Source> Node for SourceNode<S> {
    fn get_outputs(&mut self, outputs: &mut [f64]) -> Result<(), CallError> {
        self.source.values(self.time, outputs);
        Ok(())
    }

    fn do_step(&mut self, clock: &Clock, tick: u64) -> Result<(), CallError> {
        self.time = clock.at(tick + 1);
        Ok(())
    }

    fn state(&mut self) -> Option<&mut dyn Stateful> {
        Some(self)
    }

    fn typed_values(&mut self) -> Option<&mut dyn TypedValues> {
        Some(self)
    }
}

impl<S: Source> TypedValues for SourceNode<S> {
    fn set_texts(&mut self, _inputs: &[String]) -> Result<(), CallError> {
        Ok(())
    }

    fn get_texts(&mut self, outputs: &mut [String]) -> Result<(), CallError> {
        self.source.texts(self.time, outputs);
        Ok(())
    }

    fn set_integers(&mut self, _inputs: &[i128]) -> Result<(), CallError> {
        Ok(())
    }

    fn get_integers(&mut self, outputs: &mut [i128]) -> Result<(), CallError> {
        self.source.integers(self.time, outputs);
        Ok(())
    }
}

impl<S: Source> Stateful for SourceNode<S> {
    fn save(&mut self) -> Result<NodeState, CallError> {
        Ok(NodeState::new(self.time))
    }

    fn restore(&mut self, state: &NodeState) -> Result<(), CallError> {
        self.time = *state.get()?;
        Ok(())
    }

    fn serialise(&mut self, state: &NodeState) -> Result<Vec<u8>, CallError> {
        state.get::<f64>().map(|time| time.to_le_bytes().to_vec())
    }

    fn deserialise(&mut self, bytes: &[u8]) -> Result<NodeState, CallError> {
        let time = bytes.try_into().map(f64::from_le_bytes);
        time.map(NodeState::new).map_err(|_| state_error("these bytes are no time"))
    }
}
