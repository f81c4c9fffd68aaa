//! Lets a node do all of its step at once, which costs less than one call after the other.

use fmu_import::{CallError, DirectStep, InterruptedCall, StepRound};
use recording::{AllVariables, NumberIndex};

use super::limits::nan_output_error;
use super::{Exchange, StepInterruption};

impl Exchange<'_> {
    /// Lets all nodes step one after the other, in their order; each sees the new outputs of those before it.
    ///
    /// # Errors
    /// As of [`gather_inputs`](Self::gather_inputs) and [`step_node`](Self::step_node).
    pub fn step_nodes_in_order(&mut self) -> Result<(), StepInterruption> {
        let ((clock, tick), order) = (self.part, self.order);
        let time = clock.time_at(tick);
        let round = if self.efforts.measures() { None } else { StepRound::begin(&mut self.step_memory) };
        let Some(mut round) = round else {
            return order.iter().try_for_each(|&node| {
                self.gather_inputs(node)?;
                self.step_node(node)
            });
        };
        for &node in order {
            self.gather_inputs(node)?;
            let view = self.plain.of_node(node);
            if !view.is_plain {
                self.step_node_by_calls(node)?;
                continue;
            }
            let (numbers, places) = (self.row.numbers_mut(), view.first_places());
            match self.nodes[node].step_in_row(&mut round, numbers, places, time, clock.step) {
                DirectStep::Done => {
                    self.efforts.count_step(node);
                    for &output in self.plain.needed_outputs(node) {
                        if self.row[output].is_nan() {
                            return Err(self.nan_interruption(node, output));
                        }
                    }
                }
                DirectStep::NotDirect => self.step_node(node)?,
                DirectStep::Interrupted(interrupted) => self.finish_interrupted_step(node, interrupted)?,
            }
        }
        self.step_memory = round.into_memory();
        self.message_flag |= fmu_import::has_new_messages(&mut self.seen_messages);
        Ok(())
    }

    #[cold]
    fn finish_interrupted_step(
        &mut self,
        node: usize,
        interrupted: InterruptedCall,
    ) -> Result<(), StepInterruption> {
        let ((clock, tick), view) = (self.part, self.plain.of_node(node));
        let Some((outputs, inputs)) = self.row.disjoint_number_ranges(view.outputs(), view.inputs()) else {
            return self.step_node_by_calls(node);
        };
        self.efforts.count_step(node);
        match self.nodes[node].finish_interrupted_step(interrupted, inputs, &clock, tick, outputs) {
            Ok(has_messages) => {
                self.message_flag |= has_messages;
                self.check_outputs(node)
            }
            Err(error) => self.read_outputs_after_error(node, error),
        }
    }

    /// Hands a node its inputs, lets it go to the end of the step, and reads its outputs into the row: [`do_step`](Self::do_step) and
    /// [`read_outputs`](Self::read_outputs).
    ///
    /// # Errors
    /// When the node fails, or ends the run before the end of the step; when an output is NaN.
    #[inline]
    pub fn step_node(&mut self, node: usize) -> Result<(), StepInterruption> {
        let view = self.plain.of_node(node);
        let sides = match view.is_plain {
            true => self.row.disjoint_number_ranges(view.outputs(), view.inputs()),
            false => None,
        };
        let Some((outputs, inputs)) = sides else { return self.step_node_by_calls(node) };
        self.efforts.count_step(node);
        self.efforts.start_timing_node(node);
        match self.nodes[node].exchange_and_step(inputs, &self.part.0, self.part.1, outputs) {
            Ok(has_messages) => {
                self.message_flag |= has_messages;
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
        self.efforts.stop_timing_node();
        self.handle_step_error(node, error)?;
        self.read_outputs(node)
    }

    /// Checks the outputs of a node, which have been read.
    #[inline]
    pub(super) fn check_outputs(&mut self, node: usize) -> Result<(), StepInterruption> {
        self.efforts.stop_timing_node();
        let needed = self.plain.needed_outputs(node);
        match needed.iter().position(|&output| self.row[output].is_nan()) {
            None => Ok(()),
            Some(place) => Err(self.nan_interruption(node, needed[place])),
        }
    }

    #[cold]
    fn nan_interruption(&self, node: usize, output: NumberIndex<AllVariables>) -> StepInterruption {
        let (plan, time) = (&self.plans[node], self.step_interval().end);
        StepInterruption::Value(nan_output_error(plan, &self.columns[output].variable, time))
    }
}
