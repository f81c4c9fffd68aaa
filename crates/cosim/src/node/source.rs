//! Shows a source of values over time as a node. Its state is its time.

use fmu_import::CallError;
use recording::table::{ColumnType, TimeSeriesTable};

use super::{Node, NodeState, Stateful, TypedValues, state_error};
use crate::clock::CommunicationClock;
use crate::signal::Signal;

/// Values over time, without memory.
pub trait ValueSource: Send {
    /// Fills the outputs with the values at `time` [s].
    fn fill_values(&mut self, time: f64, outputs: &mut [f64]);

    /// Fills the outputs that are texts.
    fn fill_texts(&mut self, _time: f64, _outputs: &mut [String]) {}

    /// Fills the outputs that are integers of 64 bits.
    fn fill_integers(&mut self, _time: f64, _outputs: &mut [i128]) {}
}

/// Generated signals, one output each.
impl ValueSource for Vec<Signal> {
    fn fill_values(&mut self, time: f64, outputs: &mut [f64]) {
        for (output, signal) in outputs.iter_mut().zip(self.iter()) {
            *output = signal.value_at(time);
        }
    }
}

/// A recorded table, with one output for each column.
impl ValueSource for TimeSeriesTable {
    fn fill_values(&mut self, time: f64, outputs: &mut [f64]) {
        let (columns, mut outputs) = (self.column_names().len(), outputs.iter_mut());
        for column in 0..columns {
            if self.column_type(column) == ColumnType::Text {
                continue;
            }
            if let Some(output) = outputs.next() {
                *output = self.value_at(column, time);
            }
        }
    }

    fn fill_texts(&mut self, time: f64, outputs: &mut [String]) {
        for (column, output) in self.columns_of_type(ColumnType::Text).into_iter().zip(outputs) {
            self.text_at(column, time).unwrap_or_default().clone_into(output);
        }
    }

    fn fill_integers(&mut self, time: f64, outputs: &mut [i128]) {
        for (column, output) in self.columns_of_type(ColumnType::Integer).into_iter().zip(outputs) {
            *output = self.integer_at(column, time).unwrap_or_default();
        }
    }
}

/// A source as a node.
#[derive(Debug)]
pub struct SourceNode<S> {
    source: S,
    time: f64,
}

impl<S: ValueSource> SourceNode<S> {
    /// Begins at time 0.
    #[must_use]
    pub fn new(source: S) -> Self {
        SourceNode { source, time: 0.0 }
    }
}

impl<S: ValueSource> Node for SourceNode<S> {
    fn get_outputs(&mut self, outputs: &mut [f64]) -> Result<(), CallError> {
        self.source.fill_values(self.time, outputs);
        Ok(())
    }

    fn do_step(&mut self, clock: &CommunicationClock, tick: u64) -> Result<(), CallError> {
        self.time = clock.time_at(tick + 1);
        Ok(())
    }

    fn as_stateful(&mut self) -> Option<&mut dyn Stateful> {
        Some(self)
    }

    fn typed_values(&mut self) -> Option<&mut dyn TypedValues> {
        Some(self)
    }
}

impl<S: ValueSource> TypedValues for SourceNode<S> {
    fn set_texts(&mut self, _inputs: &[String]) -> Result<(), CallError> {
        Ok(())
    }

    fn get_texts(&mut self, outputs: &mut [String]) -> Result<(), CallError> {
        self.source.fill_texts(self.time, outputs);
        Ok(())
    }

    fn set_integers(&mut self, _inputs: &[i128]) -> Result<(), CallError> {
        Ok(())
    }

    fn get_integers(&mut self, outputs: &mut [i128]) -> Result<(), CallError> {
        self.source.fill_integers(self.time, outputs);
        Ok(())
    }
}

impl<S: ValueSource> Stateful for SourceNode<S> {
    fn save_state(&mut self) -> Result<NodeState, CallError> {
        Ok(NodeState::new(self.time))
    }

    fn restore_state(&mut self, state: &NodeState) -> Result<(), CallError> {
        self.time = *state.downcast_ref()?;
        Ok(())
    }

    fn serialise_state(&mut self, state: &NodeState) -> Result<Vec<u8>, CallError> {
        state.downcast_ref::<f64>().map(|time| time.to_le_bytes().to_vec())
    }

    fn deserialise_state(&mut self, bytes: &[u8]) -> Result<NodeState, CallError> {
        let time = bytes.try_into().map(f64::from_le_bytes);
        time.map(NodeState::new).map_err(|_| state_error("these bytes are no time"))
    }
}
