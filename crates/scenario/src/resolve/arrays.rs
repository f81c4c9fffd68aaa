//! Turns a connection of two arrays into connections of their elements.

use diagnostics::{Error, Mistakes, Spanned};

use super::nodes::UnplacedNode;
use super::port::{Side, find};
use crate::words::{Connect, Scenario};

/// The connections, each of one output and one input. Names that are wrong stay as they are.
pub(super) fn expanded(
    scenario: &Scenario,
    connects: &[Connect],
    unplaced: &[UnplacedNode],
    mistakes: &mut Mistakes,
) -> Vec<Connect> {
    let mut all = Vec::new();
    for connect in connects {
        let from = elements(unplaced, connect.from.get_ref(), Side::Output);
        let to = elements(unplaced, connect.to.get_ref(), Side::Input);
        if from.len() != to.len() {
            let sizes = (from.len(), to.len());
            mistakes.push(wrong(scenario, unplaced, connect, sizes));
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
fn elements(unplaced: &[UnplacedNode], full: &str, side: Side) -> Vec<String> {
    let Some((node, array)) = full.split_once('.') else { return Vec::new() };
    let Some(unplaced) = unplaced.iter().find(|it| it.name == node) else { return Vec::new() };
    let ports = unplaced.ports(side);
    unplaced.elements(side, array).map(|place| format!("{node}.{}", ports[place].name)).collect()
}

/// The error of two ends of different sizes, or of the one that is not there.
fn wrong(
    scenario: &Scenario,
    unplaced: &[UnplacedNode],
    connect: &Connect,
    (from, to): (usize, usize),
) -> Error {
    let (word, side) = match from {
        0 => (&connect.from, Side::Output),
        _ => (&connect.to, Side::Input),
    };
    let absent = find(scenario, unplaced, word, side).err().filter(|_| from == 0 || to == 0);
    absent.unwrap_or_else(|| differ(scenario, connect, (from, to)))
}

fn differ(scenario: &Scenario, connect: &Connect, (from, to): (usize, usize)) -> Error {
    let (output, input) = (connect.from.get_ref(), connect.to.get_ref());
    let size = |name: &str, count: usize| match count {
        0 => format!("`{name}` is no array"),
        count => format!("`{name}` has {count} elements"),
    };
    let message =
        format!("both ends need the same size: {}, {}", size(output, from), size(input, to));
    let example = match (from, to) {
        (0, _) => format!("name an element, such as to = \"{input}[1]\""),
        (_, 0) => format!("name an element, such as from = \"{output}[1]\""),
        _ => "structural parameters among the start values change the sizes".to_owned(),
    };
    scenario.error(&connect.to, message).help(example)
}
