//! Finds the order in which nodes step, and the loops of their connections: each node gets its inputs as fresh as it needs them.

mod components;
mod delays;

use std::collections::HashSet;

use self::components::components;
pub use self::delays::{Delay, delays};
use crate::clock::At;
use crate::system::{Block, CouplingPlan, Link, Loop, Tear};

/// A connection: a wish that one node steps before another.
#[derive(Debug, Clone, PartialEq)]
pub struct Edge {
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
    pub at: At,
    /// The place of the connection among those of numbers of the receiver.
    pub place: Option<usize>,
    /// `producer.output -> consumer.input`.
    pub label: String,
}

/// The nodes of a system and their connections.
pub struct Graph<'g> {
    /// Number of nodes.
    pub nodes: usize,
    /// The connections.
    pub edges: &'g [Edge],
    /// Whether a node hands on a value and does nothing else.
    pub is_connector: &'g dyn Fn(usize) -> bool,
    /// Whether the output of the second connection follows the input of the first one, both of one node, without a step in between.
    pub follows: &'g dyn Fn(&Edge, &Edge) -> bool,
}

/// How the nodes step one after the other, and which of them form loops.
#[derive(Debug, Default)]
pub struct Order {
    /// The nodes in the order in which they step.
    pub nodes: Vec<usize>,
    /// The same in blocks, if the algorithm solves loops.
    pub blocks: Vec<Block>,
    /// The loops of the initialisation.
    pub initial: Vec<Block>,
    /// All loops of connections, broken or not.
    pub loops: Vec<Loop>,
}

impl Order {
    /// Sorts nodes topologically by their connections; among nodes that may go, the one that loses no fresh value goes first, then the
    /// one with the lowest index. `solves_loops` says whether the coupling solves loops.
    ///
    /// # Errors
    /// With the edges of a loop that nothing breaks or solves, in the order of the flow.
    pub fn of(graph: &Graph, solves_loops: bool) -> Result<Self, Vec<usize>> {
        let Graph { nodes: count, edges: all, is_connector, follows } = *graph;
        let fresh = |edge: &&Edge| edge.at == At::End;
        // A connector that may go delays nobody.
        let mut left: Vec<usize> = (0..count).collect();
        left.sort_by_key(|&node| !is_connector(node));
        let loops = loops(count, all, follows);
        if solves_loops {
            let fresh: Vec<_> = all.iter().filter(fresh).cloned().collect();
            let blocks = blocks(&left, &fresh, is_connector);
            let nodes: Vec<_> = blocks.iter().flat_map(|block| block.nodes.clone()).collect();
            return Ok(Order { initial: initial(&nodes, all), loops, nodes, blocks });
        }
        let places: Vec<_> = (0..all.len()).filter(|place| all[*place].at == At::End).collect();
        let fresh: Vec<_> = all.iter().filter(fresh).cloned().collect();
        let nodes = sort(left, &fresh)
            .map_err(|cycle| cycle.into_iter().map(|edge| places[edge]).collect::<Vec<_>>())?;
        Ok(Order { initial: initial(&nodes, all), loops, nodes, blocks: Vec::new() })
    }

    /// The coupling with its loops, and the order of the nodes.
    #[must_use]
    pub fn into_coupling(self, coupling: CouplingPlan) -> (CouplingPlan, Vec<usize>) {
        let Order { nodes, blocks, initial, loops } = self;
        (CouplingPlan { blocks, initial, loops, ..coupling }, nodes)
    }
}

/// The node that may go, of those that are left: the first one that waits for none of them, else the first one that can do without
/// what it waits for.
fn ready(left: &[usize], edges: &[Edge]) -> Option<usize> {
    let waits = |node: usize, needed: bool| {
        let mut into = edges.iter().filter(|edge| edge.to == node);
        into.any(|edge| (edge.needed || !needed) && left.contains(&edge.from))
    };
    let ready = left.iter().position(|&node| !waits(node, false));
    ready.or_else(|| left.iter().position(|&node| !waits(node, true)))
}

/// The order of the nodes that are left, or else the edges of a loop in the order of the flow.
fn sort(mut left: Vec<usize>, edges: &[Edge]) -> Result<Vec<usize>, Vec<usize>> {
    let mut order = Vec::with_capacity(left.len());
    while !left.is_empty() {
        let Some(ready) = ready(&left, edges) else { return Err(cycle(&left, edges)) };
        order.push(left.remove(ready));
    }
    Ok(order)
}

/// Blocks of nodes in the order in which they step. Those that get fresh values from each other are in one.
fn blocks(nodes: &[usize], edges: &[Edge], is_connector: &dyn Fn(usize) -> bool) -> Vec<Block> {
    let (links, own) = links(edges.iter());
    let found = components(nodes, &links);
    let order = found.into_iter().map(|mut left| {
        if !is_loop(&left, &own) {
            return Block { nodes: left, tears: Vec::new() };
        }
        let inner: Vec<_> =
            edges.iter().filter(|it| left.contains(&it.from) && left.contains(&it.to)).collect();
        let inner: Vec<Edge> = inner.into_iter().cloned().collect();
        let mut order = Vec::with_capacity(left.len());
        while !left.is_empty() {
            // A connector has no value of its own to begin with.
            let cut = || left.iter().position(|&node| !is_connector(node));
            let next = ready(&left, &inner).or_else(cut).unwrap_or(0);
            order.push(left.remove(next));
        }
        Block { tears: tears(&order, &inner), nodes: order }
    });
    order.collect()
}

/// The ends of edges, and the nodes that lead to themselves.
fn links<'e>(edges: impl Iterator<Item = &'e Edge>) -> (Vec<(usize, usize)>, HashSet<usize>) {
    let links: Vec<_> = edges.map(|edge| (edge.from, edge.to)).collect();
    let own = links.iter().filter(|(from, to)| from == to).map(|(node, _)| *node).collect();
    (links, own)
}

fn is_loop(component: &[usize], own: &HashSet<usize>) -> bool {
    component.len() > 1 || component.iter().any(|node| own.contains(node))
}

/// The edges that lead back, among nodes in this order.
fn tears(order: &[usize], edges: &[Edge]) -> Vec<Tear> {
    let position = |node: usize| order.iter().position(|it| *it == node);
    let back = edges.iter().filter(|edge| {
        let ends = position(edge.from).zip(position(edge.to));
        ends.is_some_and(|(from, to)| from >= to)
    });
    back.filter_map(|edge| Some(Tear { node: edge.to, place: edge.place? })).collect()
}

/// The loops of the initialisation, at which no step is in between and no value from the start of one.
fn initial(order: &[usize], all: &[Edge]) -> Vec<Block> {
    let needed: Vec<_> = all.iter().filter(|edge| edge.needed).cloned().collect();
    let (links, own) = links(needed.iter());
    let found = components(order, &links).into_iter().filter(|nodes| is_loop(nodes, &own));
    found.map(|nodes| Block { tears: tears(&nodes, &needed), nodes }).collect()
}

/// All loops, also those that `at = "start"` breaks. `follows` says whether the output of the second connection follows the input of
/// the first one, both of one node, without a step in between.
fn loops(nodes: usize, all: &[Edge], follows: &dyn Fn(&Edge, &Edge) -> bool) -> Vec<Loop> {
    let members: Vec<_> = (0..nodes).collect();
    let (ends, own) = links(all.iter());
    let found = components(&members, &ends).into_iter().filter(|nodes| is_loop(nodes, &own));
    let loops = found.map(|nodes| {
        let inside = |edge: &&Edge| nodes.contains(&edge.from) && nodes.contains(&edge.to);
        let edges: Vec<_> = all.iter().filter(inside).collect();
        let is_algebraic = goes_round(&edges, follows);
        let link = |edge: &&Edge| {
            let Edge { label, at, needed, from, to, .. } = (*edge).clone();
            Link { label, ends: (from, to), at, needed }
        };
        Loop { links: edges.iter().map(link).collect(), nodes, is_algebraic }
    });
    loops.collect()
}

/// Whether a value goes round by connections without a step in between.
fn goes_round(edges: &[&Edge], follows: &dyn Fn(&Edge, &Edge) -> bool) -> bool {
    let mut links = Vec::new();
    for (place, before) in edges.iter().enumerate() {
        let behind = edges.iter().enumerate().filter(|(_, it)| it.from == before.to);
        let behind = behind.filter(|(_, behind)| follows(before, behind));
        links.extend(behind.map(|(behind, _)| (place, behind)));
    }
    let own = links.iter().filter(|(from, to)| from == to).map(|(it, _)| *it).collect();
    let all: Vec<_> = (0..edges.len()).collect();
    components(&all, &links).iter().any(|component| is_loop(component, &own))
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

    pub(super) fn edge(from: usize, to: usize, needed: bool) -> Edge {
        Edge {
            from,
            to,
            needed,
            at: At::End,
            place: Some(0),
            output: 0,
            input: 0,
            label: format!("{from} -> {to}"),
        }
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

    #[test]
    fn blocks_are_the_loops_in_the_order_of_the_flow_with_the_connections_that_lead_back() {
        let edges = [
            edge(3, 1, true),
            edge(1, 2, true),
            edge(2, 1, true),
            edge(2, 0, true),
            edge(4, 4, true),
        ];
        let found = blocks(&[0, 1, 2, 3, 4], &edges, &|_| false);
        let nodes: Vec<_> = found.iter().map(|block| block.nodes.as_slice()).collect();
        assert_eq!(nodes, [&[3][..], &[1, 2], &[0], &[4]]);
        let tears: Vec<_> =
            found.iter().map(|it| it.tears.iter().map(|it| it.node).collect::<Vec<_>>()).collect();
        assert_eq!(tears, [vec![], vec![1], vec![], vec![4]]);
        // The connector goes where its value is.
        let found = blocks(&[1, 2], &[edge(1, 2, true), edge(2, 1, true)], &|node| node == 1);
        assert_eq!(found[0].nodes, [2, 1]);
    }

    #[test]
    fn a_loop_is_algebraic_when_no_step_is_on_the_way_round() {
        let follows = |before: &Edge, _: &Edge| before.needed;
        let step = loops(2, &[edge(0, 1, true), edge(1, 0, false)], &follows);
        let edges = [edge(0, 1, true), edge(1, 0, true), edge(1, 2, true)];
        let algebraic = loops(3, &edges, &follows);
        // The output of the loop may follow another input than that of the loop.
        let apart = loops(3, &edges, &|before, behind| (before.to, behind.to) != (1, 0));
        assert_eq!((step[0].is_algebraic, step[0].links.len()), (false, 2));
        assert_eq!((algebraic.len(), algebraic[0].is_algebraic), (1, true));
        assert!(!apart[0].is_algebraic);
        assert_eq!(algebraic[0].nodes, [0, 1]);
    }
}
