//! Finds the order in which nodes step, and the loops of their connections: each node gets its inputs as fresh as it needs them.

mod components;
mod delays;

use std::collections::HashSet;

use self::components::strongly_connected_components;
pub use self::delays::{LoopDelay, choose_loop_delays};
use crate::clock::StepBoundary;
use crate::system::{ConnectionLoop, CouplingPlan, LoopConnection, NodeBlock, TearConnection};

/// A connection: a wish that one node steps before another.
#[derive(Debug, Clone, PartialEq)]
pub struct ConnectionEdge {
    /// The node that gives the value.
    pub from: usize,
    /// The node that takes it.
    pub to: usize,
    /// Its output among those of the producer.
    pub output: usize,
    /// Its input among those of the receiver.
    pub input: usize,
    /// An output of the receiver follows the input without a step in between. If none does, the value
    /// acts during the step only, and the one from the start of the step serves as well.
    pub needed: bool,
    /// Which end of the step the value is taken at.
    pub at: StepBoundary,
    /// The place of the connection among those of numbers of the receiver.
    pub place: Option<usize>,
    /// `producer.output -> consumer.input`.
    pub label: String,
}

/// The nodes of a system and their connections.
pub struct ConnectionGraph<'g> {
    /// Number of nodes.
    pub nodes: usize,
    /// The connections.
    pub edges: &'g [ConnectionEdge],
    /// Whether a node hands on a value and does nothing else.
    pub is_connector: &'g dyn Fn(usize) -> bool,
    /// Whether the output of the second connection follows the input of the first one, both of one node, without a step in between.
    pub follows: &'g dyn Fn(&ConnectionEdge, &ConnectionEdge) -> bool,
}

/// How the nodes step one after the other, and which of them form loops.
#[derive(Debug, Default)]
pub struct StepOrder {
    /// The nodes in the order in which they step.
    pub nodes: Vec<usize>,
    /// The same in blocks, if the algorithm solves loops.
    pub blocks: Vec<NodeBlock>,
    /// The loops of the initialisation.
    pub initial: Vec<NodeBlock>,
    /// All loops of connections, broken or not.
    pub loops: Vec<ConnectionLoop>,
}

impl StepOrder {
    /// Sorts nodes topologically by their connections; among nodes that may go, the one that loses no fresh value goes first, then the
    /// one with the lowest index. `solves_loops` says whether the coupling solves loops.
    ///
    /// # Errors
    /// With the edges of a loop that nothing breaks or solves, in the order of the flow.
    pub fn of_graph(graph: &ConnectionGraph, solves_loops: bool) -> Result<Self, Vec<usize>> {
        let ConnectionGraph { nodes: count, edges: all, is_connector, follows } = *graph;
        let fresh = |edge: &&ConnectionEdge| edge.at == StepBoundary::End;
        // A connector that may go delays nobody.
        let mut left: Vec<usize> = (0..count).collect();
        left.sort_by_key(|&node| !is_connector(node));
        let loops = find_loops(count, all, follows);
        if solves_loops {
            let fresh: Vec<_> = all.iter().filter(fresh).cloned().collect();
            let blocks = step_blocks(&left, &fresh, is_connector);
            let nodes: Vec<_> = blocks.iter().flat_map(|block| block.nodes.clone()).collect();
            return Ok(StepOrder { initial: initial_loop_blocks(&nodes, all), loops, nodes, blocks });
        }
        let places: Vec<_> = (0..all.len()).filter(|place| all[*place].at == StepBoundary::End).collect();
        let fresh: Vec<_> = all.iter().filter(fresh).cloned().collect();
        let nodes = sort_topologically(left, &fresh)
            .map_err(|cycle| cycle.into_iter().map(|edge| places[edge]).collect::<Vec<_>>())?;
        Ok(StepOrder { initial: initial_loop_blocks(&nodes, all), loops, nodes, blocks: Vec::new() })
    }

    /// The coupling with its loops, and the order of the nodes.
    #[must_use]
    pub fn into_coupling(self, coupling: CouplingPlan) -> (CouplingPlan, Vec<usize>) {
        let StepOrder { nodes, blocks, initial, loops } = self;
        (CouplingPlan { blocks, initial, loops, ..coupling }, nodes)
    }
}

/// The node that may go, of those that are left: the first one that waits for none of them, else the first one that can do without
/// what it waits for.
fn next_ready_node(left: &[usize], edges: &[ConnectionEdge]) -> Option<usize> {
    let waits = |node: usize, needed: bool| {
        let mut into = edges.iter().filter(|edge| edge.to == node);
        into.any(|edge| (edge.needed || !needed) && left.contains(&edge.from))
    };
    let ready = left.iter().position(|&node| !waits(node, false));
    ready.or_else(|| left.iter().position(|&node| !waits(node, true)))
}

/// The order of the nodes that are left, or else the edges of a loop in the order of the flow.
fn sort_topologically(mut left: Vec<usize>, edges: &[ConnectionEdge]) -> Result<Vec<usize>, Vec<usize>> {
    let mut order = Vec::with_capacity(left.len());
    while !left.is_empty() {
        let Some(ready) = next_ready_node(&left, edges) else {
            return Err(find_cycle(&left, edges));
        };
        order.push(left.remove(ready));
    }
    Ok(order)
}

/// Blocks of nodes in the order in which they step. Those that get fresh values from each other are in one.
fn step_blocks(
    nodes: &[usize],
    edges: &[ConnectionEdge],
    is_connector: &dyn Fn(usize) -> bool,
) -> Vec<NodeBlock> {
    let (links, own) = edge_pairs(edges.iter());
    let found = strongly_connected_components(nodes, &links);
    let order = found.into_iter().map(|mut left| {
        if !is_loop(&left, &own) {
            return NodeBlock { nodes: left, tears: Vec::new() };
        }
        let inner: Vec<_> =
            edges.iter().filter(|it| left.contains(&it.from) && left.contains(&it.to)).collect();
        let inner: Vec<ConnectionEdge> = inner.into_iter().cloned().collect();
        let mut order = Vec::with_capacity(left.len());
        while !left.is_empty() {
            // A connector has no value of its own to begin with.
            let cut = || left.iter().position(|&node| !is_connector(node));
            let next = next_ready_node(&left, &inner).or_else(cut).unwrap_or(0);
            order.push(left.remove(next));
        }
        NodeBlock { tears: feedback_tears(&order, &inner), nodes: order }
    });
    order.collect()
}

/// The ends of edges, and the nodes that lead to themselves.
fn edge_pairs<'e>(edges: impl Iterator<Item = &'e ConnectionEdge>) -> (Vec<(usize, usize)>, HashSet<usize>) {
    let links: Vec<_> = edges.map(|edge| (edge.from, edge.to)).collect();
    let own = links.iter().filter(|(from, to)| from == to).map(|(node, _)| *node).collect();
    (links, own)
}

fn is_loop(component: &[usize], own: &HashSet<usize>) -> bool {
    component.len() > 1 || component.iter().any(|node| own.contains(node))
}

/// The edges that lead back, among nodes in this order.
fn feedback_tears(order: &[usize], edges: &[ConnectionEdge]) -> Vec<TearConnection> {
    let position = |node: usize| order.iter().position(|it| *it == node);
    let back = edges.iter().filter(|edge| {
        let ends = position(edge.from).zip(position(edge.to));
        ends.is_some_and(|(from, to)| from >= to)
    });
    back.filter_map(|edge| Some(TearConnection { node: edge.to, place: edge.place? })).collect()
}

/// The loops of the initialisation, at which no step is in between and no value from the start of one.
fn initial_loop_blocks(order: &[usize], all: &[ConnectionEdge]) -> Vec<NodeBlock> {
    let needed: Vec<_> = all.iter().filter(|edge| edge.needed).cloned().collect();
    let (links, own) = edge_pairs(needed.iter());
    let found = strongly_connected_components(order, &links).into_iter().filter(|nodes| is_loop(nodes, &own));
    found.map(|nodes| NodeBlock { tears: feedback_tears(&nodes, &needed), nodes }).collect()
}

/// All loops, also those that `at = "start"` breaks. `follows` says whether the output of the second connection follows the input of
/// the first one, both of one node, without a step in between.
fn find_loops(
    nodes: usize,
    all: &[ConnectionEdge],
    follows: &dyn Fn(&ConnectionEdge, &ConnectionEdge) -> bool,
) -> Vec<ConnectionLoop> {
    let members: Vec<_> = (0..nodes).collect();
    let (ends, own) = edge_pairs(all.iter());
    let found =
        strongly_connected_components(&members, &ends).into_iter().filter(|nodes| is_loop(nodes, &own));
    let loops = found.map(|nodes| {
        let inside = |edge: &&ConnectionEdge| nodes.contains(&edge.from) && nodes.contains(&edge.to);
        let edges: Vec<_> = all.iter().filter(inside).collect();
        let is_algebraic = is_algebraic_loop(&edges, follows);
        let link = |edge: &&ConnectionEdge| {
            let ConnectionEdge { label, at, needed, from, to, .. } = (*edge).clone();
            LoopConnection { label, ends: (from, to), at, needed }
        };
        ConnectionLoop { links: edges.iter().map(link).collect(), nodes, is_algebraic }
    });
    loops.collect()
}

/// Whether a value goes round by connections without a step in between.
fn is_algebraic_loop(
    edges: &[&ConnectionEdge],
    follows: &dyn Fn(&ConnectionEdge, &ConnectionEdge) -> bool,
) -> bool {
    let mut links = Vec::new();
    for (place, before) in edges.iter().enumerate() {
        let behind = edges.iter().enumerate().filter(|(_, it)| it.from == before.to);
        let behind = behind.filter(|(_, behind)| follows(before, behind));
        links.extend(behind.map(|(behind, _)| (place, behind)));
    }
    has_loop(&links)
}

/// Whether links, each from a node to another one, lead from a node back to itself.
#[must_use]
pub fn has_loop(links: &[(usize, usize)]) -> bool {
    let own = links.iter().filter(|(from, to)| from == to).map(|(it, _)| *it).collect();
    let mut nodes: Vec<_> = links.iter().flat_map(|(from, to)| [*from, *to]).collect();
    nodes.sort_unstable();
    nodes.dedup();
    strongly_connected_components(&nodes, links).iter().any(|component| is_loop(component, &own))
}

/// A loop among nodes that all wait for another one of them.
fn find_cycle(left: &[usize], edges: &[ConnectionEdge]) -> Vec<usize> {
    let mut path: Vec<usize> = Vec::new();
    let mut node = left[0];
    loop {
        if let Some(start) = path.iter().position(|&edge| edges[edge].to == node) {
            let mut cycle = path.split_off(start);
            cycle.reverse();
            return cycle;
        }
        // Every node that is left waits for another one, so there is such an edge.
        let Some(edge) =
            edges.iter().position(|edge| edge.to == node && edge.needed && left.contains(&edge.from))
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

    pub(super) fn edge(from: usize, to: usize, needed: bool) -> ConnectionEdge {
        ConnectionEdge {
            from,
            to,
            needed,
            at: StepBoundary::End,
            place: Some(0),
            output: 0,
            input: 0,
            label: format!("{from} -> {to}"),
        }
    }

    #[test]
    fn producers_go_first_and_the_file_decides_the_rest() {
        assert_eq!(sort_topologically((0..3).collect(), &[]), Ok(vec![0, 1, 2]));
        assert_eq!(
            sort_topologically((0..3).collect(), &[edge(2, 0, true), edge(0, 1, true)]),
            Ok(vec![2, 0, 1])
        );
        assert_eq!(sort_topologically((0..3).collect(), &[edge(2, 1, false)]), Ok(vec![0, 2, 1]));
    }

    #[test]
    fn a_loop_is_cut_where_an_input_acts_only_during_the_step() {
        assert_eq!(
            sort_topologically((0..2).collect(), &[edge(0, 1, true), edge(1, 0, false)]),
            Ok(vec![0, 1])
        );
        assert_eq!(
            sort_topologically((0..2).collect(), &[edge(0, 1, false), edge(1, 0, true)]),
            Ok(vec![1, 0])
        );
    }

    #[test]
    fn a_loop_of_needed_values_is_named_edge_by_edge() {
        let edges = [edge(0, 1, true), edge(1, 2, true), edge(2, 1, true), edge(0, 3, true)];
        let cycle = sort_topologically((0..4).collect(), &edges).expect_err("there is a loop");
        let (first, last) = (&edges[cycle[0]], &edges[cycle[cycle.len() - 1]]);
        assert_eq!(last.to, first.from);
        assert_eq!(cycle.len(), 2);
        assert_eq!(sort_topologically((0..1).collect(), &[edge(0, 0, true)]), Err(vec![0]));
    }

    #[test]
    fn blocks_are_the_loops_in_the_order_of_the_flow_with_the_connections_that_lead_back() {
        let edges =
            [edge(3, 1, true), edge(1, 2, true), edge(2, 1, true), edge(2, 0, true), edge(4, 4, true)];
        let found = step_blocks(&[0, 1, 2, 3, 4], &edges, &|_| false);
        let nodes: Vec<_> = found.iter().map(|block| block.nodes.as_slice()).collect();
        assert_eq!(nodes, [&[3][..], &[1, 2], &[0], &[4]]);
        let tears: Vec<_> =
            found.iter().map(|it| it.tears.iter().map(|it| it.node).collect::<Vec<_>>()).collect();
        assert_eq!(tears, [vec![], vec![1], vec![], vec![4]]);
        // The connector goes where its value is.
        let found = step_blocks(&[1, 2], &[edge(1, 2, true), edge(2, 1, true)], &|node| node == 1);
        assert_eq!(found[0].nodes, [2, 1]);
    }

    #[test]
    fn a_loop_is_algebraic_when_no_step_is_on_the_way_round() {
        let follows = |before: &ConnectionEdge, _: &ConnectionEdge| before.needed;
        let step = find_loops(2, &[edge(0, 1, true), edge(1, 0, false)], &follows);
        let edges = [edge(0, 1, true), edge(1, 0, true), edge(1, 2, true)];
        let algebraic = find_loops(3, &edges, &follows);
        // The output of the loop may follow another input than that of the loop.
        let apart = find_loops(3, &edges, &|before, behind| (before.to, behind.to) != (1, 0));
        assert_eq!((step[0].is_algebraic, step[0].links.len()), (false, 2));
        assert_eq!((algebraic.len(), algebraic[0].is_algebraic), (1, true));
        assert!(!apart[0].is_algebraic);
        assert_eq!(algebraic[0].nodes, [0, 1]);
    }
}
