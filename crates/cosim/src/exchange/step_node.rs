//! Lets a node do all of its step at once, which costs less than one call after the other.

use super::limits::no_number;
use super::{Exchange, Interruption};

impl Exchange<'_> {
    /// Hands a node its inputs, lets it go to the end of the step, and reads its outputs into the row: [`do_step`](Self::do_step) and
    /// [`read_outputs`](Self::read_outputs).
    ///
    /// # Errors
    /// When the node fails, or ends the run before the end of the step; when an output is NaN.
    pub fn step_node(&mut self, node: usize) -> Result<(), Interruption> {
        let sides = match self.plain.of_node(node).numbers {
            Some([outputs, inputs]) if self.extrapolated[node].is_empty() => {
                self.row.both(outputs, inputs)
            }
            _ => None,
        };
        let Some((outputs, inputs)) = sides else {
            self.do_step(node)?;
            return self.read_outputs(node);
        };
        self.efforts.count(node);
        self.efforts.turn_to(node);
        match self.nodes[node].do_step_with(inputs, &self.part.0, self.part.1, outputs) {
            Ok(has_messages) => {
                self.message_flag |= has_messages;
                self.check_outputs(node)
            }
            Err(error) => {
                self.efforts.rest();
                self.stop_or_fail(node, error)?;
                self.read_outputs(node)
            }
        }
    }

    /// Checks the outputs of a node, which have been read.
    #[inline]
    pub(super) fn check_outputs(&mut self, node: usize) -> Result<(), Interruption> {
        self.efforts.rest();
        let needed = self.plain.needed(node);
        match needed.iter().copied().find(|&output| self.row[output].is_nan()) {
            None => Ok(()),
            Some(output) => {
                let (plan, time) = (&self.plans[node], self.span().end);
                Err(Interruption::Value(no_number(plan, &self.columns[output].variable, time)))
            }
        }
    }
}
