//! Knows before the first step how the values of each node go: most of them straight.

use scenario::plan::{Accepts, Body, NodePlan};
use scenario::words::At;

use super::Exchange;

/// How the values of a node go.
#[derive(Debug, Clone, Copy)]
pub(super) struct Route {
    /// Whether its inputs are numbers with a conversion of their unit at most.
    pub is_direct: bool,
    /// Whether nothing but numbers goes in and comes out.
    pub has_numbers_only: bool,
}

/// The routes of all nodes.
#[derive(Debug, Clone)]
pub(super) struct Routes {
    nodes: Vec<Route>,
    /// Whether texts go anywhere.
    pub texts: bool,
}

impl Routes {
    pub fn of(plans: &[NodePlan]) -> Self {
        let texts = |plan: &NodePlan| gives_texts(plan) || !plan.texts.connections.is_empty();
        Routes { nodes: plans.iter().map(Route::of).collect(), texts: plans.iter().any(texts) }
    }

    #[inline]
    pub fn of_node(&self, node: usize) -> Route {
        self.nodes[node]
    }
}

fn gives_texts(plan: &NodePlan) -> bool {
    !plan.texts.unneeded && !plan.texts.outputs.positions().is_empty()
}

impl Route {
    fn of(plan: &NodePlan) -> Self {
        let NodePlan { texts, exact, body, connections, .. } = plan;
        let ends_late = matches!(body, Body::Outlet);
        let given = texts.connections.is_empty() && exact.connections.is_empty() && !ends_late;
        let numbers = exact.unneeded || exact.numbers.is_empty();
        let direct = connections.iter().all(|link| {
            let chain = &link.input_chain;
            let plain = chain.map.is_empty() && chain.effects.is_empty();
            plain && chain.faults.is_empty() && chain.accepts == Accepts::Real
        });
        Route {
            is_direct: given && direct,
            has_numbers_only: given && numbers && !gives_texts(plan),
        }
    }
}

impl Exchange<'_> {
    /// Puts the inputs of a node whose route is direct into the row.
    #[inline]
    pub(super) fn lead_directly(&mut self, node: usize) {
        self.efforts.turn_to(node);
        let (plan, row) = (&self.plans[node], &mut self.row);
        for (link, input) in plan.connections.iter().zip(plan.inputs.indices()) {
            let source = link.source;
            let value = match source.at {
                At::Start => self.start[source.index],
                At::End => row[source.index],
            };
            row[input] = link.input_chain.scale(value);
        }
    }
}
