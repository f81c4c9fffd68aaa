//! Expands a connection of two arrays into connections of their elements.

use diagnostics::{Error, ErrorCollector, Spanned};

use super::lookup::{PortSide, find_port};
use super::node_draft::NodeDraft;
use crate::document::{Connect, Scenario};

/// The connections, each of one output and one input. Names that are wrong stay as they are.
pub(super) fn expand_arrays(
    scenario: &Scenario,
    connects: &[Connect],
    nodes: &[NodeDraft],
    mistakes: &mut ErrorCollector,
) -> Vec<Connect> {
    let mut all = Vec::new();
    for connect in connects {
        let from = array_element_names(nodes, connect.from.get_ref(), PortSide::Output);
        let to = array_element_names(nodes, connect.to.get_ref(), PortSide::Input);
        if from.len() != to.len() {
            mistakes.push(size_error(scenario, nodes, connect, from.len(), to.len()));
            continue;
        }
        if from.is_empty() {
            all.push(connect.clone());
        }
        for (from, to) in from.into_iter().zip(to) {
            let from = Spanned::new(connect.from.span(), from);
            let to = Spanned::new(connect.to.span(), to);
            all.push(Connect { from, to, ..connect.clone() });
        }
    }
    all
}

/// The names of the elements of an array, row by row; none for anything else.
fn array_element_names(nodes: &[NodeDraft], full: &str, side: PortSide) -> Vec<String> {
    let Some((node, array)) = full.split_once('.') else { return Vec::new() };
    let Some(draft) = nodes.iter().find(|it| it.name == node) else { return Vec::new() };
    let ports = draft.ports(side);
    draft.array_element_indices(side, array).map(|index| format!("{node}.{}", ports[index].name)).collect()
}

/// The error of two ends of different sizes, or of the one that is not there.
fn size_error(scenario: &Scenario, nodes: &[NodeDraft], connect: &Connect, from: usize, to: usize) -> Error {
    let (word, side) = match from {
        0 => (&connect.from, PortSide::Output),
        _ => (&connect.to, PortSide::Input),
    };
    let absent = find_port(scenario, nodes, word, side).err().filter(|_| from == 0 || to == 0);
    absent.unwrap_or_else(|| size_mismatch(scenario, connect, from, to))
}

fn size_mismatch(scenario: &Scenario, connect: &Connect, from: usize, to: usize) -> Error {
    let (output, input) = (connect.from.get_ref(), connect.to.get_ref());
    let size = |name: &str, count: usize| match count {
        0 => format!("`{name}` is no array"),
        count => format!("`{name}` has {count} elements"),
    };
    let message = format!("both ends need the same size: {}, {}", size(output, from), size(input, to));
    let example = match (from, to) {
        (0, _) => format!("name an element, such as to = \"{input}[1]\""),
        (_, 0) => format!("name an element, such as from = \"{output}[1]\""),
        _ => "structural parameters among the start values change the sizes".to_owned(),
    };
    scenario.error_at(&connect.to, message).with_help(example)
}
