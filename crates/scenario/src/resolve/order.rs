//! Finds the order of the nodes in a step: each gets its inputs as fresh as it needs them.

use diagnostics::Error;

use super::connections::Connections;
use super::nodes::UnplacedNode;
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
    sort(unplaced.len(), &edges).map_err(|cycle| {
        let labels: Vec<_> = cycle.iter().map(|&edge| edges[edge].label.as_str()).collect();
        let inputs: Vec<_> = labels.iter().filter_map(|label| label.split(" -> ").nth(1)).collect();
        let in_loop = |to: &str| inputs.contains(&to);
        let connect = connects.iter().find(|connect| in_loop(connect.to.get_ref()));
        let message = format!("these connections form a loop: {}", labels.join(", "));
        let place = connect.map_or(0..0, |connect| connect.to.span());
        scenario.source.error(place, message, "one of them").help(
            "write `at = \"start\"` on the connection that breaks it: it hands over the value from the start of the step",
        )
    })
}

fn edges(unplaced: &[UnplacedNode], connections: &Connections) -> Vec<Edge> {
    let mut edges = Vec::new();
    for (to, (unplaced_node, connections)) in unplaced.iter().zip(connections).enumerate() {
        for (input, connection) in unplaced_node.inputs.iter().zip(connections) {
            let Some(connection) =
                connection.as_ref().filter(|connection| connection.at == At::End)
            else {
                continue;
            };
            let (from, output) = connection.from;
            let output = &unplaced[from].outputs[output];
            let follows = |output: &super::ports::Port| match &output.follows {
                Some(inputs) => inputs.contains(&input.name),
                None => true,
            };
            edges.push(Edge {
                from,
                to,
                needed: unplaced_node.outputs.iter().any(follows),
                label: format!(
                    "{}.{} -> {}.{}",
                    unplaced[from].name, output.name, unplaced_node.name, input.name
                ),
            });
        }
    }
    edges
}

/// The order, or else the edges of a loop in the order of the flow.
fn sort(nodes: usize, edges: &[Edge]) -> Result<Vec<usize>, Vec<usize>> {
    let mut left: Vec<usize> = (0..nodes).collect();
    let mut order = Vec::with_capacity(nodes);
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
        assert_eq!(sort(3, &[]), Ok(vec![0, 1, 2]));
        assert_eq!(sort(3, &[edge(2, 0, true), edge(0, 1, true)]), Ok(vec![2, 0, 1]));
        assert_eq!(sort(3, &[edge(2, 1, false)]), Ok(vec![0, 2, 1]));
    }

    #[test]
    fn a_loop_is_cut_where_an_input_acts_only_during_the_step() {
        assert_eq!(sort(2, &[edge(0, 1, true), edge(1, 0, false)]), Ok(vec![0, 1]));
        assert_eq!(sort(2, &[edge(0, 1, false), edge(1, 0, true)]), Ok(vec![1, 0]));
    }

    #[test]
    fn a_loop_of_needed_values_is_named_edge_by_edge() {
        let edges = [edge(0, 1, true), edge(1, 2, true), edge(2, 1, true), edge(0, 3, true)];
        let cycle = sort(4, &edges).expect_err("there is a loop");
        let (first, last) = (&edges[cycle[0]], &edges[cycle[cycle.len() - 1]]);
        assert_eq!(last.to, first.from);
        assert_eq!(cycle.len(), 2);
        assert_eq!(sort(1, &[edge(0, 0, true)]), Err(vec![0]));
    }
}
