//! Chooses the connections of loops that hand over the value of the start of the step: as few as possible.

use super::ConnectionEdge;
use super::components::strongly_connected_components;
use super::{edge_pairs, is_loop};
use crate::clock::StepBoundary;

/// The nodes of a loop for which all orders are tried.
const TRIED: usize = 14;

/// The weight of a connection that hands on its value without a step in between: it is delayed last.
const FIXED: u64 = 1 << 20;

/// The connections of a loop that are delayed.
#[derive(Debug, PartialEq)]
pub struct LoopDelay {
    /// The places of all edges of the loop.
    pub all: Vec<usize>,
    /// Those that are delayed.
    pub edges: Vec<usize>,
    /// Another one that can be delayed.
    pub other: Option<usize>,
}

/// The delays that leave no loop, for each group of nodes that wait for each other.
#[must_use]
pub fn choose_loop_delays(
    edges: &[ConnectionEdge],
    hands_on: &dyn Fn(&ConnectionEdge) -> bool,
) -> Vec<LoopDelay> {
    let needed = || edges.iter().filter(|edge| edge.needed && edge.at == StepBoundary::End);
    let (links, own) = edge_pairs(needed());
    let mut nodes: Vec<usize> = links.iter().flat_map(|(from, to)| [*from, *to]).collect();
    nodes.sort_unstable();
    nodes.dedup();
    let loops =
        strongly_connected_components(&nodes, &links).into_iter().filter(|nodes| is_loop(nodes, &own));
    let delay = |mut nodes: Vec<usize>| {
        nodes.sort_unstable();
        let place = |node: usize| nodes.binary_search(&node).ok();
        let mut weights = vec![vec![0; nodes.len()]; nodes.len()];
        let mut inside = Vec::new();
        for (index, edge) in edges.iter().enumerate() {
            let ends = place(edge.from).zip(place(edge.to));
            let Some(ends) = ends.filter(|_| edge.needed && edge.at == StepBoundary::End) else {
                continue;
            };
            weights[ends.0][ends.1] += if hands_on(edge) { FIXED } else { 1 };
            inside.push((index, ends));
        }
        let mut rank = vec![0; nodes.len()];
        min_feedback_order(&weights).into_iter().enumerate().for_each(|(turn, node)| rank[node] = turn);
        let is_late = |(_, (from, to)): &(usize, (usize, usize))| rank[*from] >= rank[*to];
        let can = inside.iter().find(|it| !is_late(it) && !hands_on(&edges[it.0]));
        let other = can.map(|(edge, _)| *edge);
        let late = inside.iter().filter(|it| is_late(it)).map(|(edge, _)| *edge).collect();
        LoopDelay { all: inside.iter().map(|(edge, _)| *edge).collect(), edges: late, other }
    };
    loops.map(delay).collect()
}

/// An order of nodes with the least sum of weights from a node to one that does not come behind it; of several, the first one.
fn min_feedback_order(weights: &[Vec<u64>]) -> Vec<usize> {
    match weights.len() <= TRIED {
        true => optimal_order(weights),
        false => heuristic_order(weights),
    }
}

/// The weights that lead to a node from those that are not in a set.
fn feedback_cost(weights: &[Vec<u64>], node: usize, done: impl Fn(usize) -> bool) -> u64 {
    (0..weights.len()).filter(|from| !done(*from)).map(|from| weights[from][node]).sum()
}

/// The best order, from the least cost of all that follows each set of nodes (dynamic programming by Held and Karp).
fn optimal_order(weights: &[Vec<u64>]) -> Vec<usize> {
    let count = weights.len();
    let has = |set: usize, node: usize| (set >> node) & 1 == 1;
    let mut rest = vec![0; 1 << count];
    let step = |rest: &[u64], set: usize, node: usize| {
        feedback_cost(weights, node, |it| has(set, it)) + rest[set | (1 << node)]
    };
    for set in (0..rest.len() - 1).rev() {
        let open = (0..count).filter(|node| !has(set, *node));
        rest[set] = open.map(|node| step(&rest, set, node)).min().unwrap_or_default();
    }
    let (mut order, mut set) = (Vec::new(), 0);
    while let Some(next) = (0..count).find(|node| !has(set, *node) && step(&rest, set, *node) == rest[set]) {
        order.push(next);
        set |= 1 << next;
    }
    order
}

/// A good order of many nodes: the one goes next that gives the others most beyond what it waits for (Eades, Lin and Smyth).
fn heuristic_order(weights: &[Vec<u64>]) -> Vec<usize> {
    let (mut order, mut left) = (Vec::new(), (0..weights.len()).collect::<Vec<_>>());
    while !left.is_empty() {
        let gain = |node: usize| {
            let gives: u64 = left.iter().map(|to| weights[node][*to]).sum();
            let waits: u64 = left.iter().map(|from| weights[*from][node]).sum();
            // Nodes that wait for nothing lose nothing.
            if waits == weights[node][node] { i64::MAX } else { gives.cast_signed() - waits.cast_signed() }
        };
        let most = left.iter().map(|node| gain(*node)).max();
        let next = left.iter().position(|node| Some(gain(*node)) == most).unwrap_or(0);
        order.push(left.remove(next));
    }
    order
}

#[cfg(test)]
mod tests {
    use super::super::tests::edge;
    use super::*;

    /// The delayed edges of connections from one node to another.
    fn late(ends: &[(usize, usize)]) -> Vec<(usize, usize)> {
        let edges: Vec<_> = ends.iter().map(|(from, to)| edge(*from, *to, true)).collect();
        let found = choose_loop_delays(&edges, &|_| false);
        found.iter().flat_map(|it| it.edges.iter().map(|edge| ends[*edge])).collect()
    }

    #[test]
    fn as_few_connections_as_possible_are_delayed() {
        assert_eq!(late(&[(0, 1), (1, 2)]), []);
        assert_eq!(late(&[(0, 1), (1, 0)]), [(1, 0)]);
        // One connection leads to node 1, two to node 0.
        assert_eq!(late(&[(0, 1), (1, 0), (1, 0)]), [(0, 1)]);
        // Both loops go through 1 -> 2.
        assert_eq!(late(&[(0, 1), (1, 2), (2, 0), (2, 1)]), [(1, 2)]);
        // Two loops that share a node, one by itself, and a node that leads to itself.
        assert_eq!(late(&[(0, 1), (1, 0), (0, 2), (2, 0)]), [(1, 0), (2, 0)]);
        assert_eq!(late(&[(5, 4), (4, 5), (3, 3), (0, 5)]), [(3, 3), (5, 4)]);
        // What follows a loop is none of it.
        assert_eq!(late(&[(0, 1), (1, 0), (1, 2), (2, 3)]), [(1, 0)]);
    }

    #[test]
    fn a_long_ring_is_cut_once() {
        let ring: Vec<_> = (0..40).map(|node| (node, (node + 1) % 40)).collect();
        assert_eq!(late(&ring).len(), 1);
    }

    #[test]
    fn what_has_a_step_in_between_is_no_part_of_a_loop() {
        let mut edges = vec![edge(0, 1, true), edge(1, 0, false)];
        assert_eq!(choose_loop_delays(&edges, &|_| false), []);
        edges[1].needed = true;
        edges[0].at = StepBoundary::Start;
        assert_eq!(choose_loop_delays(&edges, &|_| false), []);
    }
}
