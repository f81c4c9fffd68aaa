//! Finds the order of the nodes of a scenario and the loops of their connections, and says which connections form a loop.

use std::collections::HashSet;

use cosim::clock::At;
use cosim::order::{Delay, Edge, Graph, Order, delays};
use cosim::system::Body;
use diagnostics::Error;
use diagnostics::suggest::shortened;

use super::Diagnostics;
use super::connections::Connections;
use super::nodes::NodeDraft;
use super::ports::Port;
use crate::document::{Connect, Loops, Scenario};

/// Sorts the nodes topologically by their connections; among nodes that may go, the one that loses no
/// fresh value goes first, then the one that comes first in the file. Connections of loops are delayed, if the scenario wants that.
pub(super) fn order(
    scenario: &Scenario,
    connects: &[Connect],
    unplaced: &[NodeDraft],
    connections: &mut Connections,
    diagnostics: &mut Diagnostics,
) -> Option<Order> {
    let mut all = edges(unplaced, connections);
    let coupling = &scenario.document.coupling;
    if coupling.loops == Loops::Delay && !coupling.algorithm.rules().solves_loops {
        let hands_on = |edge: &Edge| {
            let bodies = (&unplaced[edge.from].body, &unplaced[edge.to].body);
            matches!(bodies, (Body::Inlet, _) | (_, Body::Outlet))
        };
        for delay in delays(&all, &hands_on) {
            diagnostics.warnings.push(delayed(&delay, &all));
            for edge in delay.edges {
                let edge = &mut all[edge];
                edge.at = At::Start;
                if let Some(connection) = &mut connections[edge.to][edge.input] {
                    connection.at = At::Start;
                }
            }
        }
    }
    diagnostics.mistakes.take(sorted(scenario, connects, unplaced, &all))
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
    unplaced: &[NodeDraft],
    edges: &[Edge],
) -> Result<Order, Error> {
    let solves_loops = scenario.document.coupling.algorithm.rules().solves_loops;
    let graph = Graph {
        nodes: unplaced.len(),
        edges,
        is_connector: &|node| unplaced[node].is_connector(),
        follows: &|before, behind| {
            let node = &unplaced[before.to];
            let (output, input) = (&node.outputs[behind.output], &node.inputs[before.input]);
            output.follows.as_ref().is_none_or(|places| places.contains(&input.index))
        },
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

/// The inputs of a node that an output follows without a step in between, by their places; none when an output may follow all.
struct Followed(Option<HashSet<usize>>);

impl Followed {
    fn of(node: &NodeDraft) -> Self {
        let (mut places, mut known) = (HashSet::new(), HashSet::new());
        for output in &node.outputs {
            let Some(inputs) = &output.follows else { return Followed(None) };
            // All elements of an array share one list.
            if known.insert(inputs.as_ptr()) {
                places.extend(inputs.iter().copied());
            }
        }
        Followed(Some(places))
    }

    fn has(&self, input: &Port) -> bool {
        self.0.as_ref().is_none_or(|places| places.contains(&input.index))
    }
}

fn edges(unplaced: &[NodeDraft], connections: &Connections) -> Vec<Edge> {
    let mut edges = Vec::new();
    let followed: Vec<_> = unplaced.iter().map(Followed::of).collect();
    for (to, (unplaced_node, own)) in unplaced.iter().zip(connections).enumerate() {
        let mut numbers = 0;
        for (port, (input, connection)) in unplaced_node.inputs.iter().zip(own).enumerate() {
            let Some(connection) = connection else { continue };
            let place = connection.input_chain.is_some().then_some(numbers);
            numbers += usize::from(place.is_some());
            let from = connection.from.node;
            let output = &unplaced[from].outputs[connection.from.port];
            let needed = match (&unplaced[from].body, &unplaced_node.body) {
                (Body::Inlet, _) | (_, Body::Outlet) => true,
                // An inlet waits as its receivers would.
                (_, Body::Inlet) => is_followed(unplaced, (connections, &followed), to),
                _ => followed[to].has(input),
            };
            let names = [&unplaced[from].name, &output.name, &unplaced_node.name, &input.name];
            let [giver, output, taker, input] = names;
            let label = format!("{giver}.{output} -> {taker}.{input}");
            edges.push(Edge {
                from,
                to,
                output: connection.from.port,
                input: port,
                needed,
                at: connection.at,
                place,
                label,
            });
        }
    }
    edges
}

/// Whether an output of a node that an inlet leads to follows the value without a step in between.
fn is_followed(
    unplaced: &[NodeDraft],
    (connections, followed): (&Connections, &[Followed]),
    inlet: usize,
) -> bool {
    unplaced.iter().zip(connections).zip(followed).any(|((node, connections), followed)| {
        let fed = node.inputs.iter().zip(connections).filter(|(_, connection)| {
            connection.as_ref().is_some_and(|connection| connection.from.node == inlet)
        });
        fed.into_iter().any(|(input, _)| followed.has(input))
    })
}
