//! Parses the model description of FMI 1.0, into what descriptions of FMI 2.0 become.

mod variables;

use roxmltree::{Document, Node};

use crate::definitions::{parse_attribute, parse_required_attribute};
use crate::description::{
    ContinuousState, EquationStructure, FmiInterface, FmiVersion, FmuDescription, VariableNameIndex,
};
use crate::fmi1_attributes::{Fmi1Attributes, NegatedAliases};
use crate::problem_list::ProblemList;

/// An FMU may have so many continuous states, and so many event indicators: nothing else bounds the number in its description.
const MOST: usize = 1_000_000;

/// The element for co-simulation: by itself, or with a tool.
fn co_simulation_element<'a>(root: Node<'a, 'a>) -> Option<Node<'a, 'a>> {
    let implementation = root.children().find(|node| node.has_tag_name("Implementation"))?;
    let names = ["CoSimulation_StandAlone", "CoSimulation_Tool"];
    implementation.children().find(|node| names.iter().any(|name| node.has_tag_name(*name)))
}

/// The only interface of an FMU of FMI 1.0.
pub(crate) fn interface(root: Node) -> FmiInterface {
    match root.children().any(|node| node.has_tag_name("Implementation")) {
        true => FmiInterface::CoSimulation,
        false => FmiInterface::ModelExchange,
    }
}

/// Reads a description.
///
/// # Errors
/// When it breaks the rules.
pub(crate) fn parse(document: &Document) -> Result<FmuDescription, String> {
    let (xml, root) = (document.input_text(), document.root_element());
    let interface = interface(root);
    let identifier: String = parse_required_attribute(root, "modelIdentifier")?;
    if identifier.contains(['/', '\\']) || identifier.is_empty() {
        return Err(format!("modelIdentifier {identifier:?} is not a name"));
    }
    let mut findings = ProblemList::new(xml);
    let mut negated = NegatedAliases::default();
    let variables = variables::parse(root, &mut negated, &mut findings)?;
    let implementation = co_simulation_element(root);
    let child = |name: &str| implementation.and_then(|it| it.children().find(|node| node.has_tag_name(name)));
    let capabilities = child("Capabilities");
    let can = |name: &str| capabilities.and_then(|it| it.attribute(name)).is_some_and(is_true);
    let order = capabilities.map(|it| parse_attribute(it, "maxOutputDerivativeOrder")).transpose()?;
    let tool = child("Model").and_then(|model| model.attribute("type")).map(str::to_owned);
    let experiment = root.children().find(|node| node.has_tag_name("DefaultExperiment"));
    let default = |name: &str| -> Option<f64> {
        experiment?.attribute(name)?.trim().parse().ok().filter(|it: &f64| it.is_finite())
    };
    let equations = match interface {
        FmiInterface::CoSimulation => EquationStructure::default(),
        FmiInterface::ModelExchange => equation_structure(root)?,
    };
    let by_importer = interface == FmiInterface::ModelExchange;
    Ok(FmuDescription {
        version: FmiVersion::One,
        interface,
        interfaces: Vec::new(),
        equations,
        name: parse_required_attribute(root, "modelName")?,
        guid: parse_required_attribute(root, "guid")?,
        identifier,
        summary: parse_attribute(root, "description")?,
        tool: parse_attribute(root, "generationTool")?,
        variable_step: by_importer || can("canHandleVariableCommunicationStepSize"),
        state: false,
        serialised_state: false,
        directional_derivative: false,
        interpolated_inputs: by_importer || can("canInterpolateInputs"),
        output_derivatives: order.flatten().unwrap_or(0),
        event_mode: by_importer,
        early_return: false,
        only_once: can("canBeInstantiatedOnlyOncePerProcess"),
        default_step: None,
        internal_step: None,
        default_start: default("startTime").unwrap_or(0.0),
        default_stop: default("stopTime"),
        default_tolerance: default("tolerance"),
        log_categories: Vec::new(),
        variables,
        corrections: findings.into_sentences(),
        problems: Vec::new(),
        names: VariableNameIndex::default(),
        fmi1: Fmi1Attributes { negated, tool },
    })
}

fn is_true(word: &str) -> bool {
    matches!(word.trim(), "true" | "1")
}

/// The states and indicators. Which variables the states are is known to the library alone, and may change at events.
fn equation_structure(root: Node) -> Result<EquationStructure, String> {
    let count = |name: &str| -> Result<usize, String> {
        let count = parse_required_attribute(root, name)?;
        match count {
            0..=MOST => Ok(count),
            _ => Err(format!("expected {name} of at most {MOST}, found {count}")),
        }
    };
    let state = |number| ContinuousState {
        name: format!("state {number}"),
        reference: None,
        derivative: format!("the derivative of state {number}"),
        derivative_reference: None,
        dependencies: None,
    };
    Ok(EquationStructure {
        states: (1..=count("numberOfContinuousStates")?).map(state).collect(),
        event_indicators: count("numberOfEventIndicators")?,
        needs_completed_step: true,
    })
}

#[cfg(test)]
mod tests;
