//! Hands values on before the first step, until those of the first communication point have settled.

use std::collections::BTreeSet;

use diagnostics::Error;
use fmu_import::CallError;
use recording::{AllVariables, Row};

use super::inputs::GuessedInput;
use super::{
    Exchange, call_failure_error, check_accepted_value, check_outputs_not_nan, exact, get_outputs, set_inputs,
};
use crate::node::Node;
use crate::system::{NodeBody, NodePlan, NumberConnection, TearConnection};

/// The value of a connection that leads back in a loop.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TearValue {
    /// The connection.
    pub tear: TearConnection,
    /// Its value.
    pub value: f64,
}

/// Which nodes have an output that another one takes: FMUs whose outputs only the recording takes need not be ready to show them in
/// initialization mode, where some refuse it.
fn nodes_with_consumers(plans: &[NodePlan]) -> Vec<bool> {
    let numbers = plans.iter().flat_map(|plan| &plan.connections).map(|link| link.source.index);
    let numbers: BTreeSet<_> = numbers.collect();
    let texts = plans.iter().flat_map(|plan| &plan.texts.connections).map(|source| source.index);
    let texts: BTreeSet<_> = texts.collect();
    let feeds = |plan: &NodePlan| {
        plan.outputs.indices().any(|output| numbers.contains(&output))
            || plan.texts.outputs.indices().any(|output| texts.contains(&output))
            || !matches!(plan.body, NodeBody::Fmu { .. })
    };
    plans.iter().map(feeds).collect()
}

impl Exchange<'_> {
    /// Lets the values of the first communication point settle: all nodes show their start values, then two passes hand them on in
    /// the order of the system. In between, `solve` makes values of loops fit, and gives those for the second pass.
    ///
    /// # Errors
    /// With the node, when one fails, or shows a value that is no number; those of `solve`.
    pub fn initialise(
        &mut self,
        solve: &mut dyn FnMut(&mut Self) -> Result<Vec<TearValue>, Error>,
    ) -> Result<(), Error> {
        let feeds = nodes_with_consumers(self.plans);
        for (node, feeds) in feeds.iter().enumerate() {
            self.state.notices.extend(self.nodes[node].enter_initialization()?);
            if *feeds {
                self.call_before_first_step(node, get_outputs)?;
            }
        }
        for &node in self.order {
            match feeds[node] {
                true => self.exchange_initial_values(node, &[])?,
                false => {
                    self.gather_initial_inputs(node, &[])?;
                    self.call_before_first_step(node, |plan, node, row| set_inputs(plan, node, row))?;
                }
            }
        }
        let solved = solve(self)?;
        for &node in self.order {
            let own = solved.iter().filter(|it| it.tear.node == node);
            let own: Vec<_> = own.map(|it| GuessedInput { place: it.tear.place, value: it.value }).collect();
            self.gather_initial_inputs(node, &own)?;
            self.call_before_first_step(node, |plan, node, row| {
                set_inputs(plan, node, row)?;
                node.exit_initialization()?;
                get_outputs(plan, node, row)
            })?;
        }
        let mut plans = self.plans.iter();
        plans.try_for_each(|plan| {
            check_outputs_not_nan(plan, self.columns, &self.state.row, || self.clock.start)
        })
    }

    /// Hands a node its inputs before the first step, with guesses of some, and reads its outputs.
    ///
    /// # Errors
    /// With the node, when it fails.
    pub(crate) fn exchange_initial_values(
        &mut self,
        node: usize,
        guesses: &[GuessedInput],
    ) -> Result<(), Error> {
        self.gather_initial_inputs(node, guesses)?;
        self.call_before_first_step(node, |plan, node, row| {
            set_inputs(plan, node, row)?;
            get_outputs(plan, node, row)
        })
    }

    fn call_before_first_step(
        &mut self,
        node: usize,
        call: impl FnOnce(&NodePlan, &mut dyn Node, &mut Row<AllVariables>) -> Result<(), CallError>,
    ) -> Result<(), Error> {
        let plan = &self.plans[node];
        call(plan, self.nodes[node].as_mut(), &mut self.state.row)
            .map_err(|error| call_failure_error(plan, error, self.clock.start))
    }

    /// Puts converted values into the inputs of a node, without effects and faults: they act from the first
    /// step on.
    fn gather_initial_inputs(&mut self, node: usize, guesses: &[GuessedInput]) -> Result<(), Error> {
        let (plan, row) = (&self.plans[node], &mut self.state.row);
        exact::check_integer_inputs(plan, self.columns, None, row, &|_| self.clock.start)?;
        let links = plan.connections.iter().zip(plan.inputs.indices()).enumerate();
        for (place, (NumberConnection { source, input_chain, .. }, input)) in links {
            if let Some(guess) = guesses.iter().find(|guess| guess.place == place) {
                row[input] = guess.value;
                continue;
            }
            row[input] = input_chain.convert_and_map(row[source.index]);
            check_accepted_value(input_chain, self.columns, source.index, input, row[input], || {
                self.clock.start
            })?;
        }
        exact::carry_integer_inputs(plan, None, row);
        for (source, input) in plan.texts.connections.iter().zip(plan.texts.inputs.indices()) {
            row.copy_text(source.index, input);
        }
        Ok(())
    }
}
