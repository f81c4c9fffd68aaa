//! Finds the node and the port that a word names.

use diagnostics::{Error, Spanned, suggest};

use super::nodes::UnplacedNode;
use crate::words::Scenario;

/// The side of a node that a port is on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Side {
    Input,
    Output,
}

/// The node and the port that a word names.
pub(super) fn find(
    scenario: &Scenario,
    unplaced: &[UnplacedNode],
    word: &Spanned<String>,
    side: Side,
) -> Result<(usize, usize), Error> {
    let full = word.get_ref();
    let Some((node, variable)) = full.split_once('.') else {
        return Err(scenario.error(word, format!("expected `node.variable`, found `{full}`")));
    };
    let Some(place) = unplaced.iter().position(|unplaced_node| unplaced_node.name == node) else {
        let known = unplaced.iter().map(|unplaced_node| unplaced_node.name.as_str());
        return Err(suggest::unknown("node", node, known).at(&scenario.source, word.span()));
    };
    let unplaced_node = &unplaced[place];
    let (ports, others, name) = match side {
        Side::Input => (&unplaced_node.inputs, &unplaced_node.outputs, "input"),
        Side::Output => (&unplaced_node.outputs, &unplaced_node.inputs, "output"),
    };
    if let Some(port) = ports.iter().position(|port| port.name == variable) {
        return Ok((place, port));
    }
    if others.iter().any(|port| port.name == variable) {
        return Err(scenario
            .error(word, format!("`{full}` is no {name} of `{node}`"))
            .help("`from` names an output, `to` an input"));
    }
    let known: Vec<_> = ports.iter().map(|port| format!("{node}.{}", port.name)).collect();
    let unknown = suggest::unknown(name, full, known.iter().map(String::as_str));
    Err(unknown.at(&scenario.source, word.span()))
}
