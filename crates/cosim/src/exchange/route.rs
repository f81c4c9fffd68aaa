//! Knows before the first step how the values of each node go: most of them straight. What a step looks at stands close together.

use std::ops::Range;

use recording::{Full, NumberIndex, NumberRange};
use scenario::document::At;
use scenario::plan::{Accepts, Body, NodePlan};

use super::Exchange;

/// How the values of a node go.
#[derive(Debug, Clone)]
pub(super) struct Route {
    /// Whether its inputs are numbers with a conversion of their unit at most: its links.
    pub links: Option<Range<usize>>,
    /// Where its numbers are, if nothing else goes in and comes out.
    pub numbers: Option<[NumberRange<Full>; 2]>,
    /// Its outputs that may not be NaN, among those of all.
    needed: Range<usize>,
}

/// A connection of numbers with a conversion of their unit at most.
#[derive(Debug, Clone, Copy)]
struct Link {
    from: NumberIndex<Full>,
    to: NumberIndex<Full>,
    at_start: bool,
    factor: f64,
    offset: f64,
}

/// The routes of all nodes.
#[derive(Debug, Clone, Default)]
pub(super) struct Routes {
    nodes: Vec<Route>,
    links: Vec<Link>,
    needed: Vec<NumberIndex<Full>>,
    /// Whether texts go anywhere.
    pub texts: bool,
}

impl Routes {
    pub fn of(plans: &[NodePlan]) -> Self {
        let mut routes = Routes::default();
        for plan in plans {
            let NodePlan { texts, exact, body, .. } = plan;
            let ends_late = matches!(body, Body::Outlet);
            let given = texts.connections.is_empty() && exact.connections.is_empty() && !ends_late;
            let numbers = exact.unneeded || exact.numbers.is_empty();
            let gives_texts = !texts.unneeded && !texts.outputs.positions().is_empty();
            let route = Route {
                links: if given { routes.link(plan) } else { None },
                numbers: (given && numbers && !gives_texts).then_some([plan.outputs, plan.inputs]),
                needed: routes.needed.len()..routes.needed.len() + plan.needed.len(),
            };
            routes.needed.extend(&plan.needed);
            routes.texts |= gives_texts || !texts.connections.is_empty();
            routes.nodes.push(route);
        }
        routes
    }

    /// Adds the links of a node, if all of its connections are some.
    fn link(&mut self, plan: &NodePlan) -> Option<Range<usize>> {
        let first = self.links.len();
        for (connection, to) in plan.connections.iter().zip(plan.inputs.indices()) {
            let (source, chain) = (connection.source, &connection.input_chain);
            let plain = chain.map.is_empty() && chain.effects.is_empty();
            if !plain || !chain.faults.is_empty() || chain.accepts != Accepts::Real {
                self.links.truncate(first);
                return None;
            }
            self.links.push(Link {
                from: source.index,
                to,
                at_start: source.at == At::Start,
                factor: chain.factor,
                offset: chain.offset,
            });
        }
        Some(first..self.links.len())
    }

    #[inline]
    pub fn of_node(&self, node: usize) -> &Route {
        &self.nodes[node]
    }

    /// The outputs of a node that may not be NaN.
    #[inline]
    pub fn needed(&self, node: usize) -> &[NumberIndex<Full>] {
        &self.needed[self.nodes[node].needed.clone()]
    }
}

impl Exchange<'_> {
    /// Puts the inputs of a node into the row, if its route has links only; whether it has.
    #[inline]
    pub(super) fn lead_directly(&mut self, node: usize) -> bool {
        let Some(links) = &self.routes.of_node(node).links else { return false };
        for link in &self.routes.links[links.clone()] {
            let value = match link.at_start {
                true => self.start[link.from],
                false => self.row[link.from],
            };
            // As `InputChain::scale`.
            self.row[link.to] = value * link.factor + link.offset;
        }
        true
    }
}
