//! Finds the order of the nodes of a scenario and the loops of their connections, and says which connections form a loop.

use cosim::assembly::{NodeDefinition, connection_edges, has_feedthrough};
use cosim::clock::StepBoundary;
use cosim::order::{ConnectionEdge, ConnectionGraph, LoopDelay, StepOrder, choose_loop_delays};
use cosim::system::NodeBody;
use diagnostics::Error;
use diagnostics::suggest::join_shortened;

use super::ResolveDiagnostics;
use crate::document::{Connect, LoopPolicy, Scenario};

/// Sorts the nodes topologically by their connections; among nodes that may go, the one that loses no
/// fresh value goes first, then the one that comes first in the file. Connections of loops are delayed, if the scenario wants that.
pub(super) fn order_nodes(
    scenario: &Scenario,
    connects: &[Connect],
    nodes: &mut [NodeDefinition],
    diagnostics: &mut ResolveDiagnostics,
) -> Option<StepOrder> {
    let mut all = connection_edges(nodes);
    let coupling = &scenario.document.coupling;
    if coupling.loops == LoopPolicy::Delay && !coupling.algorithm.properties().solves_loops {
        let hands_on = |edge: &ConnectionEdge| {
            let bodies = (&nodes[edge.from].body, &nodes[edge.to].body);
            matches!(bodies, (NodeBody::Inlet, _) | (_, NodeBody::Outlet))
        };
        let delays = choose_loop_delays(&all, &hands_on);
        for delay in delays {
            diagnostics.warnings.push(delayed_loop_warning(&delay, &all));
            for edge in delay.edges {
                let edge = &mut all[edge];
                edge.at = StepBoundary::Start;
                if let Some(connection) = &mut nodes[edge.to].connections[edge.input] {
                    connection.at = StepBoundary::Start;
                }
            }
        }
    }
    diagnostics.mistakes.ok_or_record(sort_nodes(scenario, connects, nodes, &all))
}

/// The warning about connections of a loop that are delayed.
fn delayed_loop_warning(delay: &LoopDelay, edges: &[ConnectionEdge]) -> String {
    let listed = |places: &[usize]| {
        let labels: Vec<_> = places.iter().map(|it| edges[*it].label.as_str()).collect();
        join_shortened(&labels)
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
fn sort_nodes(
    scenario: &Scenario,
    connects: &[Connect],
    nodes: &[NodeDefinition],
    edges: &[ConnectionEdge],
) -> Result<StepOrder, Error> {
    let solves_loops = scenario.document.coupling.algorithm.properties().solves_loops;
    let graph = ConnectionGraph {
        nodes: nodes.len(),
        edges,
        is_connector: &|node| nodes[node].is_connector(),
        follows: &|before, behind| has_feedthrough(nodes, before, behind),
    };
    StepOrder::of_graph(&graph, solves_loops).map_err(|it| loop_error(scenario, connects, edges, it))
}

/// The error of a loop that nothing breaks.
fn loop_error(
    scenario: &Scenario,
    connects: &[Connect],
    edges: &[ConnectionEdge],
    cycle: Vec<usize>,
) -> Error {
    let labels: Vec<_> = cycle.iter().map(|&edge| edges[edge].label.as_str()).collect();
    let inputs: Vec<_> = labels.iter().filter_map(|label| label.split(" -> ").nth(1)).collect();
    let in_loop = |to: &str| inputs.contains(&to);
    let those = connects.iter().filter(|connect| in_loop(connect.to.get_ref()));
    // The file of the user comes before those of systems.
    let connect = those.min_by_key(|connect| connect.to.span().start);
    let message = format!("these connections form a loop: {}", labels.join(", "));
    let place = connect.map_or(0..0, |connect| connect.to.span());
    scenario.source.error_at(place, message, "one of them").with_help(
        "write `at = \"start\"` on the connection that breaks it: it hands over the value from the start of the step; or solve the loop \
         at each step: [coupling] algorithm = \"iterate\"; or let the program choose: [coupling] loops = \"delay\"",
    )
}
