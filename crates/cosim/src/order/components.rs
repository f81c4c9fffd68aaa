//! Finds the strongly connected components of a graph.

use std::collections::{BTreeMap, BTreeSet};

/// The components of `nodes`, each in the order of `nodes`, in topological order; of several that may come, the one with the first node
/// comes first. `edges` lead from a node to another; those of other nodes do not count.
pub(super) fn strongly_connected_components(nodes: &[usize], edges: &[(usize, usize)]) -> Vec<Vec<usize>> {
    let place: BTreeMap<_, _> = nodes.iter().enumerate().map(|(place, node)| (*node, place)).collect();
    let mut next = vec![Vec::new(); nodes.len()];
    for (from, to) in edges {
        if let (Some(from), Some(to)) = (place.get(from), place.get(to)) {
            next[*from].push(*to);
        }
    }
    let component = TarjanSearch::new(&next).component_numbers();
    let count = component.iter().max().map_or(0, |last| last + 1);
    let (mut members, mut waits, mut followers) =
        (vec![Vec::new(); count], vec![0; count], vec![BTreeSet::new(); count]);
    for (place, component) in component.iter().enumerate() {
        members[*component].push(place);
    }
    for (from, to) in next.iter().enumerate().flat_map(|(from, to)| to.iter().map(move |to| (from, *to))) {
        let (from, to) = (component[from], component[to]);
        if from != to && followers[from].insert(to) {
            waits[to] += 1;
        }
    }
    let free = (0..count).filter(|it| waits[*it] == 0).map(|it| (members[it][0], it));
    let mut free: BTreeSet<_> = free.collect();
    let mut order = Vec::with_capacity(count);
    while let Some((_, component)) = free.pop_first() {
        for &follower in &followers[component] {
            waits[follower] -= 1;
            if waits[follower] == 0 {
                free.insert((members[follower][0], follower));
            }
        }
        order.push(members[component].iter().map(|place| nodes[*place]).collect());
    }
    order
}

/// The search of Tarjan (1972), with a stack of its own: systems may have chains of any length.
struct TarjanSearch<'g> {
    next: &'g [Vec<usize>],
    /// When a node was found, and the earliest one that it leads to on the stack.
    found: Vec<Option<(usize, usize)>>,
    stack: Vec<usize>,
    on_stack: Vec<bool>,
    component: Vec<usize>,
    components: usize,
    time: usize,
}

impl<'g> TarjanSearch<'g> {
    fn new(next: &'g [Vec<usize>]) -> Self {
        let count = next.len();
        TarjanSearch {
            next,
            found: vec![None; count],
            stack: Vec::new(),
            on_stack: vec![false; count],
            component: vec![0; count],
            components: 0,
            time: 0,
        }
    }

    /// The number of the component of each node.
    fn component_numbers(mut self) -> Vec<usize> {
        for root in 0..self.next.len() {
            if self.found[root].is_none() {
                self.search_from(root);
            }
        }
        self.component
    }

    fn enter_node(&mut self, node: usize) {
        self.found[node] = Some((self.time, self.time));
        self.time += 1;
        self.stack.push(node);
        self.on_stack[node] = true;
    }

    fn lower_link(&mut self, node: usize, other: usize) {
        if let Some((_, low)) = &mut self.found[node] {
            *low = other.min(*low);
        }
    }

    fn search_from(&mut self, root: usize) {
        let mut path = vec![(root, 0)];
        self.enter_node(root);
        while let Some((node, edge)) = path.last_mut() {
            let node = *node;
            if let Some(&to) = self.next[node].get(*edge) {
                *edge += 1;
                match self.found[to] {
                    None => {
                        self.enter_node(to);
                        path.push((to, 0));
                    }
                    Some((found, _)) if self.on_stack[to] => self.lower_link(node, found),
                    Some(_) => {}
                }
                continue;
            }
            path.pop();
            let Some((found, low)) = self.found[node] else { continue };
            if let Some((above, _)) = path.last() {
                self.lower_link(*above, low);
            }
            if found == low {
                self.close_component(node);
            }
        }
    }

    fn close_component(&mut self, node: usize) {
        while let Some(member) = self.stack.pop() {
            self.on_stack[member] = false;
            self.component[member] = self.components;
            if member == node {
                break;
            }
        }
        self.components += 1;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn components_come_in_the_order_of_the_flow() {
        let edges = [(5, 1), (1, 2), (2, 1), (2, 7), (9, 9)];
        assert_eq!(
            strongly_connected_components(&[7, 1, 2, 5, 9], &edges),
            [vec![5], vec![1, 2], vec![7], vec![9]]
        );
        let long: Vec<_> = (0..100_000).map(|node| (node, node + 1)).collect();
        let nodes: Vec<_> = (0..=100_000).collect();
        assert_eq!(strongly_connected_components(&nodes, &long).len(), 100_001);
        let round: Vec<_> = long.iter().copied().chain([(100_000, 0)]).collect();
        assert_eq!(strongly_connected_components(&nodes, &round), std::slice::from_ref(&nodes));
    }
}
