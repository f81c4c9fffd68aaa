//! Lets a node do all of its step at once, which costs less than one call after the other.

use super::limits::nan_output_error;
use super::{Exchange, StepInterruption};

impl Exchange<'_> {
    /// Hands a node its inputs, lets it go to the end of the step, and reads its outputs into the row: [`do_step`](Self::do_step) and
    /// [`read_outputs`](Self::read_outputs).
    ///
    /// # Errors
    /// When the node fails, or ends the run before the end of the step; when an output is NaN.
    pub fn step_node(&mut self, node: usize) -> Result<(), StepInterruption> {
        let sides = match self.plain.of_node(node).numbers {
            Some([outputs, inputs]) if self.extrapolated[node].is_empty() => {
                self.row.disjoint_number_ranges(outputs, inputs)
            }
            _ => None,
        };
        let Some((outputs, inputs)) = sides else {
            self.do_step(node)?;
            return self.read_outputs(node);
        };
        self.efforts.count_step(node);
        self.efforts.start_timing_node(node);
        match self.nodes[node].exchange_and_step(inputs, &self.part.0, self.part.1, outputs) {
            Ok(has_messages) => {
                self.message_flag |= has_messages;
                self.check_outputs(node)
            }
            Err(error) => {
                self.efforts.stop_timing_node();
                self.handle_step_error(node, error)?;
                self.read_outputs(node)
            }
        }
    }

    /// Checks the outputs of a node, which have been read.
    #[inline]
    pub(super) fn check_outputs(&mut self, node: usize) -> Result<(), StepInterruption> {
        self.efforts.stop_timing_node();
        let needed = self.plain.needed_outputs(node);
        match needed.iter().copied().find(|&output| self.row[output].is_nan()) {
            None => Ok(()),
            Some(output) => {
                let (plan, time) = (&self.plans[node], self.step_interval().end);
                Err(StepInterruption::Value(nan_output_error(plan, &self.columns[output].variable, time)))
            }
        }
    }
}
