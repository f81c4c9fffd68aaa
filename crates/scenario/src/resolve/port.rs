//! Finds the node and the port that a word names.

use cosim::system::Body;
use diagnostics::{Error, Spanned, suggest};
use fmu_import::{Causality, Variability};

use super::nodes::UnplacedNode;
pub(super) use super::ports::Side;
use crate::words::Scenario;

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
    if side == Side::Input
        && let Some(fixed) = own().find_map(|(_, found)| fixed_parameter(found, variable))
    {
        let error = scenario.error(
            word,
            format!("`{full}` is a {fixed} parameter, which keeps its start value during a run"),
        );
        return Err(error.help(format!(
            "only inputs and tunable parameters (variability=\"tunable\") take values during a run; give it one by start = {{ \"{variable}\" = ... }} in [[fmu]] `{node}`"
        )));
    }
    let (mut known, mut is_other) = (Vec::new(), false);
    let name = if side == Side::Input { "input" } else { "output" };
    let other = if side == Side::Input { Side::Output } else { Side::Input };
    for (place, found) in own() {
        if let Some(port) = found.port(side, variable) {
            return Ok((place, port));
        }
        is_other |= found.port(other, variable).is_some();
        // A connector has both sides; one of them is for the connections of its system.
        let is_meant = match side {
            Side::Input => !matches!(found.body, Body::Outlet),
            Side::Output => !matches!(found.body, Body::Inlet),
        };
        let names = found.ports(side).iter().map(|port| format!("{node}.{}", port.name));
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

/// How a parameter of an FMU that no connection reaches is called: fixed, or structural.
fn fixed_parameter(node: &UnplacedNode, variable: &str) -> Option<&'static str> {
    let Body::Fmu { fmu, .. } = &node.body else { return None };
    let about = &fmu.description.variables[fmu.description.find(variable)?];
    match (about.causality, about.variability) {
        (Causality::Parameter, Variability::Tunable) => None,
        (Causality::Parameter, _) => Some("fixed"),
        (Causality::StructuralParameter, _) => Some("structural"),
        _ => None,
    }
}
