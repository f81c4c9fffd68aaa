//! Finds the order of the nodes in a step: each gets its inputs as fresh as it needs them.

use std::collections::HashSet;

use diagnostics::Error;

use super::connections::Connections;
use super::nodes::UnplacedNode;
use super::ports::Port;
use crate::plan::Body;
use crate::words::{At, Connect, Scenario};

/// A wish that one node steps before another.
#[derive(Debug, Clone, PartialEq)]
struct Edge {
    from: usize,
    to: usize,
    /// An output of the receiver follows the input without a step in between. If none does, the value
    /// acts during the step only, and the one from the start of the step serves as well.
    needed: bool,
    /// `producer.output -> consumer.input`.
    label: String,
}

/// Sorts the nodes topologically by their connections; among nodes that may go, the one that loses no
/// fresh value goes first, then the one that comes first in the file.
pub(super) fn order(
    scenario: &Scenario,
    connects: &[Connect],
    unplaced: &[UnplacedNode],
    connections: &Connections,
) -> Result<Vec<usize>, Error> {
    let edges = edges(unplaced, connections);
    // A connector that may go delays nobody.
    let mut left: Vec<usize> = (0..unplaced.len()).collect();
    left.sort_by_key(|&node| !unplaced[node].is_connector());
    sort(left, &edges).map_err(|cycle| {
        let labels: Vec<_> = cycle.iter().map(|&edge| edges[edge].label.as_str()).collect();
        let inputs: Vec<_> = labels.iter().filter_map(|label| label.split(" -> ").nth(1)).collect();
        let in_loop = |to: &str| inputs.contains(&to);
        let those = connects.iter().filter(|connect| in_loop(connect.to.get_ref()));
        // The file of the user comes before those of systems.
        let connect = those.min_by_key(|connect| connect.to.span().start);
        let message = format!("these connections form a loop: {}", labels.join(", "));
        let place = connect.map_or(0..0, |connect| connect.to.span());
        scenario.source.error(place, message, "one of them").help(
            "write `at = \"start\"` on the connection that breaks it: it hands over the value from the start of the step",
        )
    })
}

/// The inputs of a node that an output follows without a step in between, by their places; none when an output may follow all.
struct Followed(Option<HashSet<usize>>);

impl Followed {
    fn of(node: &UnplacedNode) -> Self {
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
        self.0.as_ref().is_none_or(|places| places.contains(&input.place))
    }
}

fn edges(unplaced: &[UnplacedNode], connections: &Connections) -> Vec<Edge> {
    let mut edges = Vec::new();
    let followed: Vec<_> = unplaced.iter().map(Followed::of).collect();
    for (to, (unplaced_node, own)) in unplaced.iter().zip(connections).enumerate() {
        for (input, connection) in unplaced_node.inputs.iter().zip(own) {
            let Some(connection) =
                connection.as_ref().filter(|connection| connection.at == At::End)
            else {
                continue;
            };
            let (from, output) = connection.from;
            let output = &unplaced[from].outputs[output];
            let needed = match (&unplaced[from].body, &unplaced_node.body) {
                (Body::Inlet, _) | (_, Body::Outlet) => true,
                // An inlet waits as its receivers would.
                (_, Body::Inlet) => is_followed(unplaced, (connections, &followed), to),
                _ => followed[to].has(input),
            };
            edges.push(Edge {
                from,
                to,
                needed,
                label: format!(
                    "{}.{} -> {}.{}",
                    unplaced[from].name, output.name, unplaced_node.name, input.name
                ),
            });
        }
    }
    edges
}

/// Whether an output of a node that an inlet leads to follows the value without a step in between.
fn is_followed(
    unplaced: &[UnplacedNode],
    (connections, followed): (&Connections, &[Followed]),
    inlet: usize,
) -> bool {
    unplaced.iter().zip(connections).zip(followed).any(|((node, connections), followed)| {
        let fed = node.inputs.iter().zip(connections).filter(|(_, connection)| {
            connection.as_ref().is_some_and(|connection| connection.from.0 == inlet)
        });
        fed.into_iter().any(|(input, _)| followed.has(input))
    })
}

/// The order of the nodes that are left, or else the edges of a loop in the order of the flow. Of several that may go, the first one
/// goes.
fn sort(mut left: Vec<usize>, edges: &[Edge]) -> Result<Vec<usize>, Vec<usize>> {
    let mut order = Vec::with_capacity(left.len());
    while !left.is_empty() {
        let waits = |node: usize, needed: bool| {
            let mut into = edges.iter().filter(|edge| edge.to == node);
            into.any(|edge| (edge.needed || !needed) && left.contains(&edge.from))
        };
        let ready = left.iter().position(|&node| !waits(node, false));
        let ready = ready.or_else(|| left.iter().position(|&node| !waits(node, true)));
        let Some(ready) = ready else { return Err(cycle(&left, edges)) };
        order.push(left.remove(ready));
    }
    Ok(order)
}

/// A loop among nodes that all wait for another one of them.
fn cycle(left: &[usize], edges: &[Edge]) -> Vec<usize> {
    let mut path: Vec<usize> = Vec::new();
    let mut node = left[0];
    loop {
        if let Some(start) = path.iter().position(|&edge| edges[edge].to == node) {
            let mut cycle = path.split_off(start);
            cycle.reverse();
            return cycle;
        }
        // Every node that is left waits for another one, so there is such an edge.
        let Some(edge) = edges
            .iter()
            .position(|edge| edge.to == node && edge.needed && left.contains(&edge.from))
        else {
            return path;
        };
        path.push(edge);
        node = edges[edge].from;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn edge(from: usize, to: usize, needed: bool) -> Edge {
        Edge { from, to, needed, label: format!("{from} -> {to}") }
    }

    #[test]
    fn producers_go_first_and_the_file_decides_the_rest() {
        assert_eq!(sort((0..3).collect(), &[]), Ok(vec![0, 1, 2]));
        assert_eq!(
            sort((0..3).collect(), &[edge(2, 0, true), edge(0, 1, true)]),
            Ok(vec![2, 0, 1])
        );
        assert_eq!(sort((0..3).collect(), &[edge(2, 1, false)]), Ok(vec![0, 2, 1]));
    }

    #[test]
    fn a_loop_is_cut_where_an_input_acts_only_during_the_step() {
        assert_eq!(sort((0..2).collect(), &[edge(0, 1, true), edge(1, 0, false)]), Ok(vec![0, 1]));
        assert_eq!(sort((0..2).collect(), &[edge(0, 1, false), edge(1, 0, true)]), Ok(vec![1, 0]));
    }

    #[test]
    fn a_loop_of_needed_values_is_named_edge_by_edge() {
        let edges = [edge(0, 1, true), edge(1, 2, true), edge(2, 1, true), edge(0, 3, true)];
        let cycle = sort((0..4).collect(), &edges).expect_err("there is a loop");
        let (first, last) = (&edges[cycle[0]], &edges[cycle[cycle.len() - 1]]);
        assert_eq!(last.to, first.from);
        assert_eq!(cycle.len(), 2);
        assert_eq!(sort((0..1).collect(), &[edge(0, 0, true)]), Err(vec![0]));
    }
}
