//! Parses array dimensions and output dependencies of FMI 3.0.

use std::collections::{HashMap, HashSet};
use std::ops::Range;
use std::sync::Arc;

use roxmltree::Node;

use super::{DeclaredVariable, StructuralSizes};
use crate::definitions::{self, list_elements, parse_attribute, parse_required_attribute};
use crate::description::{ContinuousState, EquationStructure};

/// All outputs together may follow this many variables, of arrays each element.
const MOST_DEPENDENCIES: usize = 1 << 24;

/// What each output follows, by reference; `None` means all inputs.
pub(super) type OutputDependencies = HashMap<u32, Option<Arc<[usize]>>>;

/// The sizes of arrays by reference: start values of structural parameters, unless others are given.
pub(super) fn structural_sizes<'a>(
    nodes: impl Iterator<Item = Node<'a, 'a>>,
    given: &StructuralSizes,
) -> Result<StructuralSizes, String> {
    let mut sizes = StructuralSizes::new();
    for node in nodes.filter(|node| node.has_tag_name("UInt64")) {
        if let Some(start) = parse_attribute(node, "start").ok().flatten() {
            sizes.insert(parse_required_attribute(node, "valueReference")?, start);
        }
    }
    sizes.extend(given);
    Ok(sizes)
}

pub(super) fn parse_dimensions(node: Node, sizes: &StructuralSizes) -> Result<Vec<usize>, String> {
    let size = |dimension: Node| -> Result<usize, String> {
        let size: u64 = match parse_attribute::<u32>(dimension, "valueReference")? {
            Some(reference) => *sizes.get(&reference).ok_or_else(|| {
                let place = definitions::describe_node_place(dimension);
                format!("{place}: <Dimension> refers to {reference}, which is no UInt64 with a start value")
            })?,
            None => parse_required_attribute(dimension, "start")?,
        };
        usize::try_from(size).map_err(|error| error.to_string())
    };
    node.children().filter(|child| child.has_tag_name("Dimension")).map(size).collect()
}

/// What outputs follow by reference, as indices of variables; `None` means all inputs.
///
/// `all` are the variables by reference, each with the places of its elements.
pub(super) fn parse_output_dependencies(
    root: Node,
    all: &HashMap<u32, Range<usize>>,
) -> Result<OutputDependencies, String> {
    let mut left = MOST_DEPENDENCIES;
    let mut list = |text: String| -> Result<Arc<[usize]>, String> {
        let (mut known, mut places) = (HashSet::new(), Vec::new());
        for reference in text.split_whitespace() {
            let reference: u32 = reference
                .parse()
                .map_err(|_| format!("dependencies=\"{text}\" of <Output> is no list of references"))?;
            let Some(one) = all.get(&reference).filter(|_| known.insert(reference)) else {
                continue;
            };
            left = left.checked_sub(one.len()).ok_or_else(|| {
                format!("expected at most {MOST_DEPENDENCIES} dependencies of <Output>, found more")
            })?;
            places.extend(one.clone());
        }
        Ok(places.into())
    };
    let one = |output: Node| {
        let follows = parse_attribute::<String>(output, "dependencies")?.map(&mut list).transpose()?;
        Ok((parse_required_attribute(output, "valueReference")?, follows))
    };
    list_elements(root, "ModelStructure", "Output").map(one).collect()
}

/// The states and indicators of an FMU for model exchange.
pub(super) fn equation_structure(
    root: Node,
    all: &[DeclaredVariable],
    needs_completed_step: bool,
) -> Result<EquationStructure, String> {
    let variable = |reference: u32| all.iter().find(|it| it.reference == reference);
    let listed = |element: Node| -> Result<(u32, usize), String> {
        let reference = parse_required_attribute(element, "valueReference")?;
        Ok((reference, variable(reference).map_or(0, DeclaredVariable::element_count)))
    };
    let name = |it: &DeclaredVariable, element: usize| -> Result<String, String> {
        let name: String = parse_required_attribute(it.node, "name")?;
        Ok(name + &it.element_subscript(element))
    };
    let mut states = Vec::new();
    for element in list_elements(root, "ModelStructure", "ContinuousStateDerivative") {
        let (reference, count) = listed(element)?;
        let Some(derivative) = variable(reference) else { continue };
        let state = parse_attribute(derivative.node, "derivative")?.and_then(variable);
        let is_scalar = derivative.dimensions.is_empty();
        let references = |text: String| -> Option<Vec<u32>> {
            text.split_whitespace().map(|it| it.parse().ok()).collect()
        };
        let dependencies = parse_attribute(element, "dependencies")?.and_then(references);
        for place in 0..count {
            let derivative = name(derivative, place)?;
            states.push(ContinuousState {
                name: match state {
                    Some(state) => name(state, place)?,
                    None => format!("the state of `{derivative}`"),
                },
                reference: state.filter(|_| is_scalar).map(|it| it.reference),
                derivative,
                derivative_reference: is_scalar.then_some(reference),
                dependencies: dependencies.clone(),
            });
        }
    }
    let indicators = list_elements(root, "ModelStructure", "EventIndicator").map(listed);
    let event_indicators = indicators.map(|it| it.map(|(_, count)| count)).sum::<Result<_, _>>()?;
    Ok(EquationStructure { states, event_indicators, needs_completed_step })
}
