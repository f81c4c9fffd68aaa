//! Lets a node do all of its step at once, which costs less than one call after the other.

use fmu_import::{CallError, StepRound};
use recording::{AllVariables, NumberIndex};

use super::limits::nan_output_error;
use super::{Exchange, StepInterruption};

impl Exchange<'_> {
    /// Lets all nodes step one after the other, in their order; each sees the new outputs of those before it.
    ///
    /// # Errors
    /// As of [`gather_inputs`](Self::gather_inputs) and [`step_node`](Self::step_node).
    pub fn step_nodes_in_order(&mut self) -> Result<(), StepInterruption> {
        if !self.state.concurrent.is_empty() {
            return self.step_nodes_concurrently(true);
        }
        let (clock, tick) = self.part;
        let time = clock.time_at(tick);
        let mut round =
            if self.state.efforts.measures() { None } else { StepRound::begin(&mut self.state.step_memory) };
        for &node in self.order {
            self.gather_inputs(node)?;
            let view = self.state.plain.of_node(node);
            let (numbers, places) = (self.state.row.numbers_mut(), view.first_places());
            let is_done = round.as_mut().is_some_and(|round| {
                view.is_plain && self.nodes[node].step_in_row(round, numbers, places, time, clock.step)
            });
            if is_done {
                self.state.efforts.count_step(node);
                self.check_outputs(node)?;
            } else {
                self.step_node(node)?;
            }
        }
        if let Some(round) = round {
            self.state.step_memory = round.into_memory();
            self.state.message_flag |= fmu_import::has_new_messages(&mut self.state.seen_messages);
        }
        Ok(())
    }

    /// Lets all nodes step from the inputs that they gathered.
    ///
    /// # Errors
    /// As of [`step_node`](Self::step_node).
    pub fn step_nodes_from_gathered_inputs(&mut self) -> Result<(), StepInterruption> {
        match self.state.concurrent.is_empty() {
            true => self.order.iter().try_for_each(|&node| self.step_node(node)),
            false => self.step_nodes_concurrently(false),
        }
    }

    /// Hands a node its inputs, lets it go to the end of the step, and reads its outputs into the row: [`do_step`](Self::do_step) and
    /// [`read_outputs`](Self::read_outputs).
    ///
    /// # Errors
    /// When the node fails, or ends the run before the end of the step; when an output is NaN.
    #[inline]
    pub fn step_node(&mut self, node: usize) -> Result<(), StepInterruption> {
        let view = self.state.plain.of_node(node);
        let sides = match view.is_plain {
            true => self.state.row.disjoint_number_ranges(view.outputs(), view.inputs()),
            false => None,
        };
        let Some((outputs, inputs)) = sides else { return self.step_node_by_calls(node) };
        self.state.efforts.count_step(node);
        self.state.efforts.start_timing_node(node);
        match self.nodes[node].exchange_and_step(inputs, &self.part.0, self.part.1, outputs) {
            Ok(has_messages) => {
                self.state.message_flag |= has_messages;
                self.check_outputs(node)
            }
            Err(error) => self.read_outputs_after_error(node, error),
        }
    }

    #[inline(never)]
    fn step_node_by_calls(&mut self, node: usize) -> Result<(), StepInterruption> {
        self.do_step(node)?;
        self.read_outputs(node)
    }

    #[cold]
    fn read_outputs_after_error(&mut self, node: usize, error: CallError) -> Result<(), StepInterruption> {
        self.state.efforts.stop_timing_node();
        self.handle_step_error(node, error)?;
        self.read_outputs(node)
    }

    /// Checks the outputs of a node, which have been read.
    #[inline(always)]
    pub(super) fn check_outputs(&mut self, node: usize) -> Result<(), StepInterruption> {
        self.state.efforts.stop_timing_node();
        for &output in self.state.plain.needed_outputs(node) {
            if self.state.row[output].is_nan() {
                return Err(self.nan_interruption(node, output));
            }
        }
        Ok(())
    }

    #[cold]
    fn nan_interruption(&self, node: usize, output: NumberIndex<AllVariables>) -> StepInterruption {
        let (plan, time) = (&self.plans[node], self.step_interval().end);
        StepInterruption::Value(nan_output_error(plan, &self.columns[output].variable, time))
    }
}
