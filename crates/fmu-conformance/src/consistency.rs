//! Checks consistency of a model description beyond the schema: cross references, capability flags, array dimensions, terminals.

use std::collections::BTreeMap;

use fmu_import::{FmiVersion, Fmu};
use roxmltree::{Document, Node};

use super::RuleSeverity::BreaksStandard;
use super::{
    BOTH, ConformanceRule, RuleCheck, RuleResult, THREE, description_xml, not_applicable, violated_rule,
};

pub(super) const RULES: &[ConformanceRule] = &[
    ConformanceRule {
        name: "capabilities",
        rank: BreaksStandard,
        sentence: "what the FMU claims to do fits together",
        versions: BOTH,
        check: RuleCheck::Files(check_capability_flags),
    },
    ConformanceRule {
        name: "cross-references",
        rank: BreaksStandard,
        sentence: "types, units, clocks and derivatives refer to what there is",
        versions: BOTH,
        check: RuleCheck::Files(cross_references),
    },
    ConformanceRule {
        name: "dimensions",
        rank: BreaksStandard,
        sentence: "arrays have sizes, and as many start values",
        versions: THREE,
        check: RuleCheck::Files(check_dimensions),
    },
    ConformanceRule {
        name: "terminals",
        rank: BreaksStandard,
        sentence: "terminals keep the rules, and their members are variables",
        versions: THREE,
        check: RuleCheck::Files(check_terminals),
    },
];

/// Says what is wrong with the description, each at its line.
fn judge_description(fmu: &Fmu, check: fn(&mut ProblemCollector, Node)) -> RuleResult {
    let xml = description_xml(fmu);
    let document = match Document::parse(&xml) {
        Ok(document) => document,
        Err(error) => return violated_rule(error.to_string()),
    };
    let mut look = ProblemCollector { version: fmu.description.version, wrong: Vec::new() };
    check(&mut look, document.root_element());
    match look.wrong.as_slice() {
        [] => Ok(String::new()),
        wrong => violated_rule(wrong.join("; ")),
    }
}

struct ProblemCollector {
    version: FmiVersion,
    wrong: Vec<String>,
}

impl ProblemCollector {
    fn add_problem_at(&mut self, node: Node, what: &str) {
        let line = node.document().text_pos_at(node.range().start).row;
        let name = node.attribute("name").map(|name| format!(" `{name}`")).unwrap_or_default();
        self.wrong.push(format!("line {line}: <{}>{name} {what}", node.tag_name().name()));
    }
}

fn child_element<'a>(node: Node<'a, 'a>, name: &str) -> Option<Node<'a, 'a>> {
    node.children().find(|child| child.has_tag_name(name))
}

/// The elements in the list of this name.
fn list_elements<'a>(root: Node<'a, 'a>, name: &str) -> Vec<Node<'a, 'a>> {
    let list = child_element(root, name);
    list.into_iter().flat_map(|list| list.children()).filter(Node::is_element).collect()
}

fn bool_attribute(node: Node, name: &str) -> bool {
    matches!(node.attribute(name).map(str::trim), Some("true" | "1"))
}

fn number_attribute<T: std::str::FromStr>(node: Node, name: &str) -> Option<T> {
    node.attribute(name)?.trim().parse().ok()
}

fn check_capability_flags(fmu: &Fmu) -> RuleResult {
    judge_description(fmu, |look, root| {
        let Some(node) = child_element(root, "CoSimulation") else { return };
        let needs: &[(&str, &str)] = match look.version {
            FmiVersion::One | FmiVersion::Two => &[("canSerializeFMUstate", "canGetAndSetFMUstate")],
            FmiVersion::Three => &[
                ("canSerializeFMUState", "canGetAndSetFMUState"),
                ("canReturnEarlyAfterIntermediateUpdate", "providesIntermediateUpdate"),
                ("providesEvaluateDiscreteStates", "hasEventMode"),
            ],
        };
        for (claim, base) in needs {
            if bool_attribute(node, claim) && !bool_attribute(node, base) {
                look.add_problem_at(node, &format!("has {claim} without {base}, which it needs"));
            }
        }
        let clocks = list_elements(root, "ModelVariables").iter().any(|it| it.has_tag_name("Clock"));
        if clocks && !bool_attribute(node, "hasEventMode") {
            look.add_problem_at(node, "has no hasEventMode, which its clocks need to tick");
        }
        if number_attribute::<f64>(node, "fixedInternalStepSize").is_some_and(|step| step <= 0.0) {
            look.add_problem_at(node, "has a fixedInternalStepSize that is not positive");
        }
        let Some(experiment) = child_element(root, "DefaultExperiment") else { return };
        for name in ["stepSize", "tolerance"] {
            if number_attribute::<f64>(experiment, name).is_some_and(|value| value <= 0.0) {
                look.add_problem_at(experiment, &format!("has a {name} that is not positive"));
            }
        }
        let start = number_attribute(experiment, "startTime").unwrap_or(0.0);
        if number_attribute::<f64>(experiment, "stopTime").is_some_and(|stop| stop < start) {
            look.add_problem_at(experiment, "has a stopTime before its startTime");
        }
    })
}

fn cross_references(fmu: &Fmu) -> RuleResult {
    judge_description(fmu, |look, root| {
        let variables = list_elements(root, "ModelVariables");
        let names = |name: &str| -> BTreeMap<String, Node> {
            let nodes = list_elements(root, name).into_iter();
            nodes.filter_map(|node| Some((node.attribute("name")?.to_owned(), node))).collect()
        };
        let (types, units) = (names("TypeDefinitions"), names("UnitDefinitions"));
        // In FMI 2.0 the attributes of types are those of a child.
        let types_of = list_elements(root, "TypeDefinitions");
        let (of_types, of_variables) = match look.version {
            FmiVersion::One | FmiVersion::Two => {
                (first_child_elements(&types_of), first_child_elements(&variables))
            }
            FmiVersion::Three => (types_of.clone(), variables.clone()),
        };
        for node in of_types.iter().chain(&of_variables) {
            if let Some(unit) = node.attribute("unit").filter(|it| !units.contains_key(*it)) {
                look.add_problem_at(*node, &format!("has the unit {unit:?}, which UnitDefinitions lack"));
            }
        }
        for node in &of_variables {
            let Some(name) = node.attribute("declaredType") else { continue };
            let kind = node.tag_name().name();
            let fits = types.get(name).map(|found| match look.version {
                FmiVersion::One | FmiVersion::Two => child_element(*found, kind).is_some(),
                FmiVersion::Three => found.tag_name().name() == format!("{kind}Type"),
            });
            match fits {
                None => {
                    look.add_problem_at(*node, &format!("has the type {name:?}, which TypeDefinitions lack"))
                }
                Some(false) => {
                    look.add_problem_at(*node, &format!("has the type {name:?}, which is of another kind"))
                }
                Some(true) => {}
            }
        }
        if look.version == FmiVersion::Three {
            check_variable_references(look, &variables);
        }
    })
}

fn first_child_elements<'a>(nodes: &[Node<'a, 'a>]) -> Vec<Node<'a, 'a>> {
    nodes.iter().filter_map(|node| node.children().find(Node::is_element)).collect()
}

/// What variables of FMI 3.0 name by value reference.
fn check_variable_references(look: &mut ProblemCollector, variables: &[Node]) {
    let by_reference: BTreeMap<u32, Node> = variables
        .iter()
        .filter_map(|node| Some((number_attribute(*node, "valueReference")?, *node)))
        .collect();
    for node in variables {
        let clocks = node.attribute("clocks").unwrap_or_default();
        for clock in clocks.split_whitespace() {
            let found = clock.parse().ok().and_then(|clock: u32| by_reference.get(&clock));
            if !found.is_some_and(|found| found.has_tag_name("Clock")) {
                look.add_problem_at(*node, &format!("has the clock {clock}, which is no Clock"));
            }
        }
        if node.has_attribute("previous") && clocks.trim().is_empty() {
            look.add_problem_at(*node, "has a previous value, but no clocks");
        }
        for name in ["previous", "derivative"] {
            let Some(reference) = number_attribute::<u32>(*node, name) else { continue };
            match by_reference.get(&reference) {
                None => look.add_problem_at(*node, &format!("has {name} {reference}, which no variable has")),
                Some(found) if found.tag_name() != node.tag_name() => {
                    look.add_problem_at(*node, &format!("has {name} {reference}, which is of another type"));
                }
                Some(_) => {}
            }
        }
    }
}

fn check_dimensions(fmu: &Fmu) -> RuleResult {
    judge_description(fmu, |look, root| {
        let variables = list_elements(root, "ModelVariables");
        let sizes: BTreeMap<u32, Node> = variables
            .iter()
            .filter_map(|node| Some((number_attribute(*node, "valueReference")?, *node)))
            .collect();
        for node in &variables {
            let all: Vec<_> = node.children().filter(|child| child.has_tag_name("Dimension")).collect();
            let elements = all.iter().map(|dimension| dimension_size(look, *dimension, &sizes));
            let Some(elements) = elements.collect::<Vec<_>>().into_iter().collect::<Option<Vec<u64>>>()
            else {
                continue;
            };
            let elements = elements.into_iter().fold(1, u64::saturating_mul);
            let texts = node.children().filter(|child| child.has_tag_name("Start")).count();
            let numbers = node.attribute("start").map_or(0, |it| it.split_whitespace().count());
            let given = (texts + numbers) as u64;
            // One value is that of all elements.
            if given > 1 && given != elements {
                look.add_problem_at(*node, &format!("has {given} start values for {elements} elements"));
            }
        }
    })
}

/// The size of a dimension, or what is wrong with it.
fn dimension_size(
    look: &mut ProblemCollector,
    dimension: Node,
    variables: &BTreeMap<u32, Node>,
) -> Option<u64> {
    let fixed = number_attribute::<u64>(dimension, "start");
    match (fixed, number_attribute::<u32>(dimension, "valueReference")) {
        (Some(_), Some(_)) => look.add_problem_at(dimension, "has both start and valueReference"),
        (None, None) => look.add_problem_at(dimension, "has neither start nor valueReference"),
        (Some(0), None) => look.add_problem_at(dimension, "has the size 0"),
        (Some(size), None) => return Some(size),
        (None, Some(reference)) => {
            let found = variables.get(&reference).filter(|node| {
                node.has_tag_name("UInt64")
                    && (node.attribute("causality") == Some("structuralParameter")
                        || node.attribute("variability") == Some("constant"))
            });
            match found {
                None => {
                    let what =
                        format!("refers to {reference}, which is no structural parameter of type UInt64");
                    look.add_problem_at(dimension, &what);
                }
                Some(node) => return number_attribute(*node, "start"),
            }
        }
    }
    None
}

fn check_terminals(fmu: &Fmu) -> RuleResult {
    match fmu.terminals() {
        Ok((terminals, problems)) if terminals.is_empty() && problems.is_empty() => {
            not_applicable("there are no terminals")
        }
        Ok((terminals, problems)) if problems.is_empty() => Ok(format!("{} terminals", terminals.len())),
        Ok((_, problems)) => violated_rule(problems.join("; ")),
        Err(problem) => violated_rule(problem),
    }
}
