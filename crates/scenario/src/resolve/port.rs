//! Finds the node and the port that a word names.

use diagnostics::{Error, Spanned, suggest};

use super::nodes::UnplacedNode;
use crate::plan::Body;
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
    // Each connector is a node, and several may have one name.
    let own = || unplaced.iter().enumerate().filter(|(_, it)| it.name == node);
    if own().next().is_none() {
        let known = unplaced.iter().map(|unplaced_node| unplaced_node.name.as_str());
        let unknown = suggest::unknown("node", node, known);
        return Err(unknown.at(&scenario.source, word.span()));
    }
    let (mut known, mut is_other) = (Vec::new(), false);
    let name = if side == Side::Input { "input" } else { "output" };
    for (place, UnplacedNode { inputs, outputs, body, .. }) in own() {
        let (ports, others) = match side {
            Side::Input => (inputs, outputs),
            Side::Output => (outputs, inputs),
        };
        if let Some(port) = ports.iter().position(|port| port.name == variable) {
            return Ok((place, port));
        }
        is_other |= others.iter().any(|port| port.name == variable);
        // A connector has both sides; one of them is for the connections of its system.
        let is_meant = match side {
            Side::Input => !matches!(body, Body::Outlet),
            Side::Output => !matches!(body, Body::Inlet),
        };
        let names = ports.iter().map(|port| format!("{node}.{}", port.name));
        known.extend(names.filter(|_| is_meant));
    }
    if is_other {
        return Err(scenario
            .error(word, format!("`{full}` is no {name} of `{node}`"))
            .help("`from` names an output, `to` an input"));
    }
    let unknown = suggest::unknown(name, full, known.iter().map(String::as_str));
    Err(unknown.at(&scenario.source, word.span()))
}
