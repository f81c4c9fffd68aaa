//! Looks up the port that a name in the scenario means, and says what is wrong when there is none.

use cosim::system::NodeBody;
use diagnostics::{Error, Spanned, suggest};
use fmu_import::{Causality, Variability};

use super::node_draft::NodeDraft;
pub(super) use super::ports::PortSide;
use crate::document::Scenario;

/// A port of a node, by the index of the node and that of the port on its side.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct PortRef {
    pub node: usize,
    pub port: usize,
}

/// The port that a word names.
pub(super) fn find_port(
    scenario: &Scenario,
    nodes: &[NodeDraft],
    word: &Spanned<String>,
    side: PortSide,
) -> Result<PortRef, Error> {
    let full = word.get_ref();
    let Some((node, variable)) = full.split_once('.') else {
        return Err(scenario.error_at(word, format!("expected `node.variable`, found `{full}`")));
    };
    // Each connector is a node, and several may have one name.
    let own = || nodes.iter().enumerate().filter(|(_, it)| it.name == node);
    if own().next().is_none() {
        let known = nodes.iter().map(|node| node.name.as_str());
        let unknown = suggest::unknown_name("node", node, known);
        return Err(unknown.into_error_at(&scenario.source, word.span()));
    }
    if side == PortSide::Input
        && let Some(fixed) = own().find_map(|(_, found)| unconnectable_parameter_kind(found, variable))
    {
        let error = scenario.error_at(
            word,
            format!("`{full}` is a {fixed} parameter, which keeps its start value during a run"),
        );
        return Err(error.with_help(format!(
            "only inputs and tunable parameters (variability=\"tunable\") take values during a run; give it one by start = {{ \"{variable}\" = ... }} in [[fmu]] `{node}`"
        )));
    }
    let (mut known, mut is_other) = (Vec::new(), false);
    let name = if side == PortSide::Input { "input" } else { "output" };
    let other = if side == PortSide::Input { PortSide::Output } else { PortSide::Input };
    for (index, found) in own() {
        if let Some(port) = found.find_port_index(side, variable) {
            return Ok(PortRef { node: index, port });
        }
        is_other |= found.find_port_index(other, variable).is_some();
        // A connector has both sides; one of them is for the connections of its system.
        let is_meant = match side {
            PortSide::Input => !matches!(found.body, NodeBody::Outlet),
            PortSide::Output => !matches!(found.body, NodeBody::Inlet),
        };
        let names = found.ports(side).iter().map(|port| format!("{node}.{}", port.name));
        known.extend(names.filter(|_| is_meant));
    }
    if is_other {
        return Err(scenario
            .error_at(word, format!("`{full}` is no {name} of `{node}`"))
            .with_help("`from` names an output, `to` an input"));
    }
    let unknown = suggest::unknown_name(name, full, known.iter().map(String::as_str));
    Err(unknown.into_error_at(&scenario.source, word.span()))
}

/// How a parameter of an FMU that no connection reaches is called: fixed, or structural.
fn unconnectable_parameter_kind(node: &NodeDraft, variable: &str) -> Option<&'static str> {
    let NodeBody::Fmu { fmu, .. } = &node.body else { return None };
    let about = &fmu.description.variables[fmu.description.find_variable(variable)?];
    match (about.causality, about.variability) {
        (Causality::Parameter, Variability::Tunable) => None,
        (Causality::Parameter, _) => Some("fixed"),
        (Causality::StructuralParameter, _) => Some("structural"),
        _ => None,
    }
}
