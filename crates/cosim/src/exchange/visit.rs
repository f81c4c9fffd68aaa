//! Lets a node do all of its step at once, which costs less than one call after the other.

use super::judge::check_numbers;
use super::{Exchange, Interruption};

impl Exchange<'_> {
    /// Hands a node its inputs, lets it go to the end of the step, and reads its outputs into the row: [`step`](Self::step) and
    /// [`read`](Self::read).
    ///
    /// # Errors
    /// When the node fails, or ends the run before the end of the step; when an output is NaN.
    pub fn go(&mut self, node: usize) -> Result<(), Interruption> {
        let plan = &self.plans[node];
        let is_plain = self.routes.of_node(node).has_numbers_only && self.moving[node].is_empty();
        let sides = match is_plain {
            true => self.row.both(plan.outputs, plan.inputs),
            false => None,
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
        let plan = &self.plans[node];
        let checked = check_numbers(plan, self.columns, &self.row, || self.span().1);
        self.efforts.rest();
        checked.map_err(Interruption::Value)
    }
}
