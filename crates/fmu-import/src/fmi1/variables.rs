//! Parses the variables of FMI 1.0, with their types: causality and variability become those of FMI 2.0.

use std::collections::{HashMap, HashSet};
use std::sync::Arc;

use roxmltree::Node;
use units::Unit;

use super::is_true;
use crate::attributes::{Causality, Initial, Variability};
use crate::definitions::{self, describe_node_place, list_elements, parse_required_attribute};
use crate::description::{EnumerationItem, FmiType, StorageType, Variable};
use crate::fmi1_attributes::NegatedAliases;
use crate::problem_list::ProblemList;

/// The value reference of FMI 1.0 that stands for none.
const UNDEFINED_REFERENCE: u32 = u32::MAX;

/// A variable as it stands in the file: the element, and that of its type.
#[derive(Clone, Copy)]
struct ScalarVariable<'a> {
    node: Node<'a, 'a>,
    kind: Node<'a, 'a>,
    /// The declared type, whose attributes count where its own say nothing.
    declared: Option<Node<'a, 'a>>,
}

impl<'a> ScalarVariable<'a> {
    fn attribute(&self, name: &str) -> Option<&'a str> {
        self.kind.attribute(name).or_else(|| self.declared?.attribute(name))
    }

    fn number(&self, name: &str) -> Option<f64> {
        self.attribute(name)?.trim().parse().ok()
    }
}

/// The variables, in the order of the file.
///
/// # Errors
/// When one of them breaks the rules in a way that can mean anything.
pub(super) fn parse<'a>(
    root: Node<'a, 'a>,
    negated: &mut NegatedAliases,
    findings: &mut ProblemList,
) -> Result<Vec<Variable>, String> {
    let types: HashMap<_, _> = list_elements(root, "TypeDefinitions", "Type")
        .filter_map(|node| Some((node.attribute("name")?, node.children().find(Node::is_element)?)))
        .collect();
    let nodes: Vec<_> = list_elements(root, "ModelVariables", "ScalarVariable").collect();
    let names = nodes.iter().filter_map(|node| Some((node.attribute("name")?, node.range().start)));
    let places: HashMap<_, _> =
        nodes.iter().enumerate().filter_map(|(place, node)| Some((node.attribute("name")?, place))).collect();
    definitions::check_unique_names(names, root.document().input_text())?;
    let mut free = FreeReferences::new(&nodes);
    let mut variables = Vec::with_capacity(nodes.len());
    for node in nodes {
        let kind = node.children().find(|child| type_of(*child).is_some());
        let kind = kind.ok_or_else(|| {
            let place = describe_node_place(node);
            format!("{place}: expected one of Real, Integer, Boolean, String and Enumeration in the variable, found none")
        })?;
        let declared = kind.attribute("declaredType").and_then(|name| types.get(name).copied());
        let scalar = ScalarVariable { node, kind, declared };
        let mut variable = build_variable(scalar, findings)?;
        if is_negated(scalar, variable.kind) {
            let own = free.take().ok_or("expected a value reference that no variable has, found none")?;
            negated.push(own, variable.reference);
            variable.reference = own;
        }
        variable.dependencies = direct_dependencies(node, &places, findings);
        variables.push(variable);
    }
    Ok(variables)
}

/// References that no variable of the description has, from the highest one on.
struct FreeReferences {
    used: HashSet<u32>,
    next: u32,
}

impl FreeReferences {
    fn new(nodes: &[Node]) -> Self {
        let references =
            nodes.iter().filter_map(|node| node.attribute("valueReference")?.trim().parse().ok());
        FreeReferences { used: references.collect(), next: UNDEFINED_REFERENCE }
    }

    fn take(&mut self) -> Option<u32> {
        loop {
            self.next = self.next.checked_sub(1)?;
            if !self.used.contains(&self.next) {
                return Some(self.next);
            }
        }
    }
}

fn is_negated(scalar: ScalarVariable, kind: FmiType) -> bool {
    let has_sign = matches!(kind, FmiType::Real | FmiType::Integer | FmiType::Boolean);
    has_sign && scalar.node.attribute("alias").is_some_and(|word| word.trim() == "negatedAlias")
}

fn type_of(node: Node) -> Option<(FmiType, StorageType)> {
    Some(match node.tag_name().name() {
        "Real" => (FmiType::Real, StorageType::Float64),
        "Integer" => (FmiType::Integer, StorageType::Int32),
        "Boolean" => (FmiType::Boolean, StorageType::Boolean),
        "String" => (FmiType::String, StorageType::String),
        "Enumeration" => (FmiType::Enumeration, StorageType::Int32),
        _ => return None,
    })
}

fn build_variable(scalar: ScalarVariable, findings: &mut ProblemList) -> Result<Variable, String> {
    let ScalarVariable { node, kind, .. } = scalar;
    let (fmi_type, storage) = type_of(kind).unwrap_or((FmiType::Real, StorageType::Float64));
    let start = kind.attribute("start").map(str::to_owned);
    let (causality, variability) = causality_and_variability(node, fmi_type, start.is_some(), findings)?;
    let is_real = fmi_type == FmiType::Real;
    let relative = is_real && scalar.attribute("relativeQuantity").is_some_and(is_true);
    let unit = scalar.attribute("unit").filter(|name| is_real && definitions::is_unit(name));
    let measure = unit.and_then(|name| Unit::parse(name).ok());
    let guess = kind.attribute("fixed").is_some_and(|word| !is_true(word));
    let initial = match (causality, &start) {
        (Causality::Input, _) => None,
        (Causality::Parameter, _) => Some(Initial::Exact),
        (_, None) => Some(Initial::Calculated),
        (_, Some(_)) if guess => Some(Initial::Approx),
        (_, Some(_)) => Some(Initial::Exact),
    };
    Ok(Variable {
        name: parse_required_attribute(node, "name")?,
        reference: parse_required_attribute(node, "valueReference")?,
        kind: fmi_type,
        storage,
        element: (0, 1),
        items: if fmi_type == FmiType::Enumeration { enumeration_items(scalar.declared) } else { Vec::new() },
        causality,
        variability,
        initial,
        min: scalar.number("min"),
        max: scalar.number("max"),
        nominal: scalar.number("nominal"),
        dimension: measure.map(|it| if relative { it.difference_unit() } else { it }),
        relative: relative.then(|| measure.map_or(0.0, |it| it.offset)),
        unit: unit.map(str::to_owned),
        start,
        description: node.attribute("description").map(str::to_owned),
        dependencies: None,
        optional: false,
        ticks: None,
        clocks: Vec::new(),
    })
}

/// Who determines a variable and when it may change, in the words of FMI 2.0. FMI 1.0 has no causality of parameters: their
/// variability says it, and one with a start value can be set before the initialisation, whatever its causality.
fn causality_and_variability(
    node: Node,
    kind: FmiType,
    has_start: bool,
    findings: &mut ProblemList,
) -> Result<(Causality, Variability), String> {
    let word = |name: &str, default| node.attribute(name).map_or(default, str::trim).to_owned();
    let (causality, variability) = (word("causality", "internal"), word("variability", "continuous"));
    let name = node.attribute("name");
    let mut changes = match variability.as_str() {
        "constant" => Variability::Constant,
        "parameter" => Variability::Fixed,
        "discrete" => Variability::Discrete,
        "continuous" => Variability::Continuous,
        _ => {
            let what = format!("variability=\"{variability}\" is no word of FMI 1.0: read as \"continuous\"");
            findings.push(name, node.range().start, what);
            Variability::Continuous
        }
    };
    if changes == Variability::Continuous && kind != FmiType::Real {
        changes = Variability::Discrete;
    }
    let by_whom = match (causality.as_str(), changes) {
        ("input", Variability::Fixed) => Causality::Parameter,
        ("internal" | "none", Variability::Fixed) if has_start => Causality::Parameter,
        ("internal" | "none", Variability::Fixed) => Causality::CalculatedParameter,
        ("input", Variability::Constant) => Causality::Local,
        ("input", _) => Causality::Input,
        ("output", _) => Causality::Output,
        ("internal" | "none", _) => Causality::Local,
        _ => {
            let place = describe_node_place(node);
            return Err(format!(
                "{place}: causality=\"{causality}\" is no word of FMI 1.0: expected one of input, output, internal, none; \
                 correct it where the FMU is exported"
            ));
        }
    };
    if (by_whom, changes) == (Causality::Output, Variability::Fixed) {
        changes = Variability::Discrete;
    }
    Ok((by_whom, changes))
}

/// The items of a declared enumeration, which count from 1.
fn enumeration_items(declared: Option<Node>) -> Vec<EnumerationItem> {
    let items = declared.into_iter().flat_map(|it| it.children()).filter(|node| node.has_tag_name("Item"));
    let item = |(value, node): (i64, Node)| {
        Some(EnumerationItem { name: node.attribute("name")?.to_owned(), value })
    };
    (1..).zip(items).filter_map(item).collect()
}

/// The places of the inputs that an output follows; none where all inputs count.
fn direct_dependencies(
    node: Node,
    places: &HashMap<&str, usize>,
    findings: &mut ProblemList,
) -> Option<Arc<[usize]>> {
    let list = node.children().find(|child| child.has_tag_name("DirectDependency"))?;
    let names = list.children().filter(|child| child.has_tag_name("Name"));
    let names: Vec<_> = names.map(|name| name.text().unwrap_or_default().trim()).collect();
    let found: Option<Arc<[usize]>> = names.iter().map(|name| places.get(name).copied()).collect();
    if found.is_none() {
        let what = "its <DirectDependency> names no variable of the file: it is taken to follow all inputs";
        findings.push(node.attribute("name"), list.range().start, what.to_owned());
    }
    found
}
