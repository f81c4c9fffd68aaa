//! Steps nodes whose inputs are extrapolated within a step.

use std::mem::take;

use super::{Exchange, StepInterruption, set_typed_values};
use crate::extrapolation::ExtrapolatedInput;
use crate::node::{InputPolynomial, set_extrapolated_inputs};
use crate::system::NodePlan;

/// The inputs of a node that are extrapolated within a step.
pub(super) fn extrapolated_inputs_of_node(plan: &NodePlan) -> Vec<ExtrapolatedInput> {
    let connections = plan.connections.iter().enumerate();
    let inputs = connections.filter_map(|(place, connection)| {
        Some(ExtrapolatedInput::new(place, connection.extrapolation?, connection.source.at))
    });
    inputs.collect()
}

impl Exchange<'_> {
    /// The extrapolated inputs with their last values, by the names of the inputs.
    pub(crate) fn extrapolated_inputs(&self) -> Vec<(String, ExtrapolatedInput)> {
        let all = self.plans.iter().zip(&self.state.extrapolated).flat_map(|(plan, inputs)| {
            let name = |place| Some(self.columns[plan.inputs.nth_index(place)?].qualified_name());
            inputs.iter().filter_map(move |it| Some((name(it.place)?, *it)))
        });
        all.collect()
    }

    /// Goes on with the last values of inputs that are extrapolated in the same way.
    pub(crate) fn restore_extrapolated_inputs(&mut self, saved: &[(String, ExtrapolatedInput)]) {
        for (plan, inputs) in self.plans.iter().zip(&mut self.state.extrapolated) {
            for own in inputs {
                let name = plan.inputs.nth_index(own.place).map(|input| self.columns[input].qualified_name());
                if let Some((_, saved)) = saved.iter().find(|(it, _)| Some(it) == name.as_ref()) {
                    own.restore_history_if_compatible(saved);
                }
            }
        }
    }

    /// Hands a node its inputs with their polynomials, and lets it go to the end of the step. Inputs whose value at the end is known have it
    /// afterwards, since outputs may follow it.
    pub(super) fn do_extrapolated_step(&mut self, node: usize) -> Result<(), StepInterruption> {
        let ((clock, tick), span) = (self.part, self.step_interval());
        let mut values = take(&mut self.input_buffer);
        let mut polynomials = take(&mut self.polynomial_buffer);
        let inputs = self.plans[node].inputs;
        values.clear();
        values.extend_from_slice(&self.state.row[inputs]);
        polynomials.clear();
        for input in &mut self.state.extrapolated[node] {
            let before = inputs.nth_index(input.place).map(|index| self.state.start[index]);
            let value = values[input.place];
            input.push_step_values(&span, before.unwrap_or(value), value);
            polynomials.push(InputPolynomial { place: input.place, polynomial: input.step_polynomial() });
        }
        let updates = self.state.extrapolated[node].iter().any(ExtrapolatedInput::knows_end);
        let done = self.call_node(node, |plan, node, row| {
            set_typed_values(plan, node, row)?;
            set_extrapolated_inputs(node, &mut values, &polynomials, span)?;
            node.do_step(&clock, tick)?;
            if updates { node.update_outputs(&row[plan.inputs]) } else { Ok(()) }
        });
        (self.input_buffer, self.polynomial_buffer) = (values, polynomials);
        done
    }
}
