//! Finds the order of the nodes of a scenario and the loops of their connections, and says which connections form a loop.

use cosim::assembly::{UnplacedNode, edges, follows};
use cosim::clock::At;
use cosim::order::{Delay, Edge, Graph, Order, delays};
use cosim::system::Body;
use diagnostics::Error;
use diagnostics::suggest::shortened;

use super::Diagnostics;
use crate::document::{Connect, Loops, Scenario};

/// Sorts the nodes topologically by their connections; among nodes that may go, the one that loses no
/// fresh value goes first, then the one that comes first in the file. Connections of loops are delayed, if the scenario wants that.
pub(super) fn order(
    scenario: &Scenario,
    connects: &[Connect],
    nodes: &mut [UnplacedNode],
    diagnostics: &mut Diagnostics,
) -> Option<Order> {
    let mut all = edges(nodes);
    let coupling = &scenario.document.coupling;
    if coupling.loops == Loops::Delay && !coupling.algorithm.rules().solves_loops {
        let hands_on = |edge: &Edge| {
            let bodies = (&nodes[edge.from].body, &nodes[edge.to].body);
            matches!(bodies, (Body::Inlet, _) | (_, Body::Outlet))
        };
        let delays = delays(&all, &hands_on);
        for delay in delays {
            diagnostics.warnings.push(delayed(&delay, &all));
            for edge in delay.edges {
                let edge = &mut all[edge];
                edge.at = At::Start;
                if let Some(connection) = &mut nodes[edge.to].connections[edge.input] {
                    connection.at = At::Start;
                }
            }
        }
    }
    diagnostics.mistakes.take(sorted(scenario, connects, nodes, &all))
}

/// The warning about connections of a loop that are delayed.
fn delayed(delay: &Delay, edges: &[Edge]) -> String {
    let listed = |places: &[usize]| {
        let labels: Vec<_> = places.iter().map(|it| edges[*it].label.as_str()).collect();
        shortened(&labels)
    };
    let (all, late) = (listed(&delay.all), listed(&delay.edges));
    let other = delay.other.and_then(|it| edges[it].label.split(" -> ").nth(1));
    let other = other.map_or(String::new(), |to| {
        format!(
            "; a scenario that `extends` this one delays another connection: [[connect]] to = \"{to}\" and at = \"start\""
        )
    });
    format!(
        "these connections form a loop: {all}; delayed by a step, with the value of its start: {late}. To choose otherwise: \
         `--coupling jacobi` delays all connections, `--coupling iterate` solves the loop{other}"
    )
}

/// The order of nodes with these edges.
fn sorted(
    scenario: &Scenario,
    connects: &[Connect],
    nodes: &[UnplacedNode],
    edges: &[Edge],
) -> Result<Order, Error> {
    let solves_loops = scenario.document.coupling.algorithm.rules().solves_loops;
    let graph = Graph {
        nodes: nodes.len(),
        edges,
        is_connector: &|node| nodes[node].is_connector(),
        follows: &|before, behind| follows(nodes, before, behind),
    };
    Order::of(&graph, solves_loops).map_err(|it| looped(scenario, connects, edges, it))
}

/// The error of a loop that nothing breaks.
fn looped(scenario: &Scenario, connects: &[Connect], edges: &[Edge], cycle: Vec<usize>) -> Error {
    let labels: Vec<_> = cycle.iter().map(|&edge| edges[edge].label.as_str()).collect();
    let inputs: Vec<_> = labels.iter().filter_map(|label| label.split(" -> ").nth(1)).collect();
    let in_loop = |to: &str| inputs.contains(&to);
    let those = connects.iter().filter(|connect| in_loop(connect.to.get_ref()));
    // The file of the user comes before those of systems.
    let connect = those.min_by_key(|connect| connect.to.span().start);
    let message = format!("these connections form a loop: {}", labels.join(", "));
    let place = connect.map_or(0..0, |connect| connect.to.span());
    scenario.source.error(place, message, "one of them").help(
        "write `at = \"start\"` on the connection that breaks it: it hands over the value from the start of the step; or solve the loop \
         at each step: [coupling] algorithm = \"iterate\"; or let the program choose: [coupling] loops = \"delay\"",
    )
}
