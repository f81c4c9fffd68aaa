//! Lets a node do all of its step at once, which costs less than one call after the other.

use super::judge::no_number;
use super::{Exchange, Interruption};

impl Exchange<'_> {
    /// Hands a node its inputs, lets it go to the end of the step, and reads its outputs into the row: [`step`](Self::step) and
    /// [`read`](Self::read).
    ///
    /// # Errors
    /// When the node fails, or ends the run before the end of the step; when an output is NaN.
    pub fn go(&mut self, node: usize) -> Result<(), Interruption> {
        let sides = match self.routes.of_node(node).numbers {
            Some([outputs, inputs]) if self.moving[node].is_empty() => {
                self.row.both(outputs, inputs)
            }
            _ => None,
        };
        let Some((outputs, inputs)) = sides else {
            self.step(node)?;
            return self.read(node);
        };
        self.efforts.count(node);
        self.efforts.turn_to(node);
        match self.nodes[node].visit(inputs, (&self.part.0, self.part.1), outputs) {
            Ok(spoke) => {
                self.spoke |= spoke;
                self.check(node)
            }
            Err(error) => {
                self.efforts.rest();
                self.ended(node, error)?;
                self.read(node)
            }
        }
    }

    /// Checks the outputs of a node, which have been read.
    #[inline]
    pub(super) fn check(&mut self, node: usize) -> Result<(), Interruption> {
        self.efforts.rest();
        let needed = self.routes.needed(node);
        match needed.iter().copied().find(|&output| self.row[output].is_nan()) {
            None => Ok(()),
            Some(output) => {
                let (plan, time) = (&self.plans[node], self.span().1);
                Err(Interruption::Value(no_number(plan, &self.columns[output].variable, time)))
            }
        }
    }
}
