//! Hands values on before the first step, until those of the first communication point have settled.

use std::collections::BTreeSet;

use diagnostics::Error;
use fmu_import::CallError;
use recording::{Full, Row};

use super::{Exchange, accept, check_numbers, exact, failure, get, set};
use crate::node::Node;
use crate::system::{Body, NodePlan, ResolvedConnection, Tear};

/// Values of connections that lead back in loops.
pub type Solved = Vec<(Tear, f64)>;

/// Which nodes have an output that another one takes: FMUs whose outputs only the recording takes need not be ready to show them in
/// initialization mode, where some refuse it.
fn feeds(plans: &[NodePlan]) -> Vec<bool> {
    let numbers = plans.iter().flat_map(|plan| &plan.connections).map(|link| link.source.index);
    let numbers: BTreeSet<_> = numbers.collect();
    let texts = plans.iter().flat_map(|plan| &plan.texts.connections).map(|source| source.index);
    let texts: BTreeSet<_> = texts.collect();
    let feeds = |plan: &NodePlan| {
        plan.outputs.indices().any(|output| numbers.contains(&output))
            || plan.texts.outputs.indices().any(|output| texts.contains(&output))
            || !matches!(plan.body, Body::Fmu { .. })
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
        solve: &mut dyn FnMut(&mut Self) -> Result<Solved, Error>,
    ) -> Result<(), Error> {
        let feeds = feeds(self.plans);
        for (node, feeds) in feeds.iter().enumerate() {
            self.notices.extend(self.nodes[node].enter()?);
            if *feeds {
                self.initial_call(node, get)?;
            }
        }
        for &node in self.order {
            match feeds[node] {
                true => self.visit_initially(node, &[])?,
                false => {
                    self.feed_initially(node, &[])?;
                    self.initial_call(node, |plan, node, row| set(plan, node, row))?;
                }
            }
        }
        let solved = solve(self)?;
        for &node in self.order {
            let own = solved.iter().filter(|(tear, _)| tear.node == node);
            let own: Vec<_> = own.map(|(tear, value)| (tear.place, *value)).collect();
            self.feed_initially(node, &own)?;
            self.initial_call(node, |plan, node, row| {
                set(plan, node, row)?;
                node.ready()?;
                get(plan, node, row)
            })?;
        }
        let mut plans = self.plans.iter();
        plans.try_for_each(|plan| check_numbers(plan, self.columns, &self.row, || self.clock.start))
    }

    /// Hands a node its inputs before the first step, some of them given by their places, and reads its outputs.
    ///
    /// # Errors
    /// With the node, when it fails.
    pub(crate) fn visit_initially(
        &mut self,
        node: usize,
        given: &[(usize, f64)],
    ) -> Result<(), Error> {
        self.feed_initially(node, given)?;
        self.initial_call(node, |plan, node, row| {
            set(plan, node, row)?;
            get(plan, node, row)
        })
    }

    fn initial_call(
        &mut self,
        node: usize,
        call: impl FnOnce(&NodePlan, &mut dyn Node, &mut Row<Full>) -> Result<(), CallError>,
    ) -> Result<(), Error> {
        let plan = &self.plans[node];
        call(plan, self.nodes[node].as_mut(), &mut self.row)
            .map_err(|error| failure(plan, error, self.clock.start))
    }

    /// Puts converted values into the inputs of a node, without effects and faults: they act from the first
    /// step on.
    fn feed_initially(&mut self, node: usize, given: &[(usize, f64)]) -> Result<(), Error> {
        let (plan, row) = (&self.plans[node], &mut self.row);
        exact::check(plan, self.columns, (None, row), &|_| self.clock.start)?;
        let links = plan.connections.iter().zip(plan.inputs.indices()).enumerate();
        for (place, (ResolvedConnection { source, input_chain, .. }, input)) in links {
            if let Some((_, value)) = given.iter().find(|(own, _)| *own == place) {
                row[input] = *value;
                continue;
            }
            row[input] = input_chain.convert(row[source.index]);
            accept(input_chain, self.columns, (source.index, input), row[input], || {
                self.clock.start
            })?;
        }
        exact::carry(plan, None, row);
        for (source, input) in plan.texts.connections.iter().zip(plan.texts.inputs.indices()) {
            row.copy_text(source.index, input);
        }
        Ok(())
    }
}
