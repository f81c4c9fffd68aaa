//! Checks consistency of a model description beyond the schema: cross references, capability flags, array dimensions, terminals.

use std::collections::BTreeMap;

use fmu_import::{Fmu, Version};
use roxmltree::{Document, Node};

use super::Rank::BreaksStandard;
use super::{BOTH, Check, Rule, RuleResult, THREE, not_applicable, text, violated};

pub(super) const RULES: &[Rule] = &[
    Rule {
        name: "capabilities",
        rank: BreaksStandard,
        sentence: "what the FMU claims to do fits together",
        versions: BOTH,
        check: Check::Files(capabilities),
    },
    Rule {
        name: "cross-references",
        rank: BreaksStandard,
        sentence: "types, units, clocks and derivatives refer to what there is",
        versions: BOTH,
        check: Check::Files(cross_references),
    },
    Rule {
        name: "dimensions",
        rank: BreaksStandard,
        sentence: "arrays have sizes, and as many start values",
        versions: THREE,
        check: Check::Files(dimensions),
    },
    Rule {
        name: "terminals",
        rank: BreaksStandard,
        sentence: "terminals keep the rules, and their members are variables",
        versions: THREE,
        check: Check::Files(terminals),
    },
];

/// Says what is wrong with the description, each at its line.
fn judge(fmu: &Fmu, check: fn(&mut ProblemCollector, Node)) -> RuleResult {
    let xml = text(fmu);
    let document = match Document::parse(&xml) {
        Ok(document) => document,
        Err(error) => return violated(error.to_string()),
    };
    let mut look = ProblemCollector { version: fmu.description.version, wrong: Vec::new() };
    check(&mut look, document.root_element());
    match look.wrong.as_slice() {
        [] => Ok(String::new()),
        wrong => violated(wrong.join("; ")),
    }
}

struct ProblemCollector {
    version: Version,
    wrong: Vec<String>,
}

impl ProblemCollector {
    fn at(&mut self, node: Node, what: &str) {
        let line = node.document().text_pos_at(node.range().start).row;
        let name = node.attribute("name").map(|name| format!(" `{name}`")).unwrap_or_default();
        self.wrong.push(format!("line {line}: <{}>{name} {what}", node.tag_name().name()));
    }
}

fn child<'a>(node: Node<'a, 'a>, name: &str) -> Option<Node<'a, 'a>> {
    node.children().find(|child| child.has_tag_name(name))
}

/// The elements in the list of this name.
fn list<'a>(root: Node<'a, 'a>, name: &str) -> Vec<Node<'a, 'a>> {
    let list = child(root, name);
    list.into_iter().flat_map(|list| list.children()).filter(Node::is_element).collect()
}

fn flag(node: Node, name: &str) -> bool {
    matches!(node.attribute(name).map(str::trim), Some("true" | "1"))
}

fn number<T: std::str::FromStr>(node: Node, name: &str) -> Option<T> {
    node.attribute(name)?.trim().parse().ok()
}

fn capabilities(fmu: &Fmu) -> RuleResult {
    judge(fmu, |look, root| {
        let Some(node) = child(root, "CoSimulation") else { return };
        let needs: &[(&str, &str)] = match look.version {
            Version::Two => &[("canSerializeFMUstate", "canGetAndSetFMUstate")],
            Version::Three => &[
                ("canSerializeFMUState", "canGetAndSetFMUState"),
                ("canReturnEarlyAfterIntermediateUpdate", "providesIntermediateUpdate"),
                ("providesEvaluateDiscreteStates", "hasEventMode"),
            ],
        };
        for (claim, base) in needs {
            if flag(node, claim) && !flag(node, base) {
                look.at(node, &format!("has {claim} without {base}, which it needs"));
            }
        }
        let clocks = list(root, "ModelVariables").iter().any(|it| it.has_tag_name("Clock"));
        if clocks && !flag(node, "hasEventMode") {
            look.at(node, "has no hasEventMode, which its clocks need to tick");
        }
        if number::<f64>(node, "fixedInternalStepSize").is_some_and(|step| step <= 0.0) {
            look.at(node, "has a fixedInternalStepSize that is not positive");
        }
        let Some(experiment) = child(root, "DefaultExperiment") else { return };
        for name in ["stepSize", "tolerance"] {
            if number::<f64>(experiment, name).is_some_and(|value| value <= 0.0) {
                look.at(experiment, &format!("has a {name} that is not positive"));
            }
        }
        let start = number(experiment, "startTime").unwrap_or(0.0);
        if number::<f64>(experiment, "stopTime").is_some_and(|stop| stop < start) {
            look.at(experiment, "has a stopTime before its startTime");
        }
    })
}

fn cross_references(fmu: &Fmu) -> RuleResult {
    judge(fmu, |look, root| {
        let variables = list(root, "ModelVariables");
        let names = |name: &str| -> BTreeMap<String, Node> {
            let nodes = list(root, name).into_iter();
            nodes.filter_map(|node| Some((node.attribute("name")?.to_owned(), node))).collect()
        };
        let (types, units) = (names("TypeDefinitions"), names("UnitDefinitions"));
        // In FMI 2.0 the attributes of types are those of a child.
        let types_of = list(root, "TypeDefinitions");
        let (of_types, of_variables) = match look.version {
            Version::Two => (inner(&types_of), inner(&variables)),
            Version::Three => (types_of.clone(), variables.clone()),
        };
        for node in of_types.iter().chain(&of_variables) {
            if let Some(unit) = node.attribute("unit").filter(|it| !units.contains_key(*it)) {
                look.at(*node, &format!("has the unit {unit:?}, which UnitDefinitions lack"));
            }
        }
        for node in &of_variables {
            let Some(name) = node.attribute("declaredType") else { continue };
            let kind = node.tag_name().name();
            let fits = types.get(name).map(|found| match look.version {
                Version::Two => child(*found, kind).is_some(),
                Version::Three => found.tag_name().name() == format!("{kind}Type"),
            });
            match fits {
                None => {
                    look.at(*node, &format!("has the type {name:?}, which TypeDefinitions lack"))
                }
                Some(false) => {
                    look.at(*node, &format!("has the type {name:?}, which is of another kind"))
                }
                Some(true) => {}
            }
        }
        if look.version == Version::Three {
            linked(look, &variables);
        }
    })
}

fn inner<'a>(nodes: &[Node<'a, 'a>]) -> Vec<Node<'a, 'a>> {
    nodes.iter().filter_map(|node| node.children().find(Node::is_element)).collect()
}

/// What variables of FMI 3.0 name by value reference.
fn linked(look: &mut ProblemCollector, variables: &[Node]) {
    let by_reference: BTreeMap<u32, Node> = variables
        .iter()
        .filter_map(|node| Some((number(*node, "valueReference")?, *node)))
        .collect();
    for node in variables {
        let clocks = node.attribute("clocks").unwrap_or_default();
        for clock in clocks.split_whitespace() {
            let found = clock.parse().ok().and_then(|clock: u32| by_reference.get(&clock));
            if !found.is_some_and(|found| found.has_tag_name("Clock")) {
                look.at(*node, &format!("has the clock {clock}, which is no Clock"));
            }
        }
        if node.has_attribute("previous") && clocks.trim().is_empty() {
            look.at(*node, "has a previous value, but no clocks");
        }
        for name in ["previous", "derivative"] {
            let Some(reference) = number::<u32>(*node, name) else { continue };
            match by_reference.get(&reference) {
                None => look.at(*node, &format!("has {name} {reference}, which no variable has")),
                Some(found) if found.tag_name() != node.tag_name() => {
                    look.at(*node, &format!("has {name} {reference}, which is of another type"));
                }
                Some(_) => {}
            }
        }
    }
}

fn dimensions(fmu: &Fmu) -> RuleResult {
    judge(fmu, |look, root| {
        let variables = list(root, "ModelVariables");
        let sizes: BTreeMap<u32, Node> = variables
            .iter()
            .filter_map(|node| Some((number(*node, "valueReference")?, *node)))
            .collect();
        for node in &variables {
            let all: Vec<_> =
                node.children().filter(|child| child.has_tag_name("Dimension")).collect();
            let elements = all.iter().map(|dimension| size(look, *dimension, &sizes));
            let Some(elements) =
                elements.collect::<Vec<_>>().into_iter().collect::<Option<Vec<u64>>>()
            else {
                continue;
            };
            let elements = elements.into_iter().fold(1, u64::saturating_mul);
            let texts = node.children().filter(|child| child.has_tag_name("Start")).count();
            let numbers = node.attribute("start").map_or(0, |it| it.split_whitespace().count());
            let given = (texts + numbers) as u64;
            // One value is that of all elements.
            if given > 1 && given != elements {
                look.at(*node, &format!("has {given} start values for {elements} elements"));
            }
        }
    })
}

/// The size of a dimension, or what is wrong with it.
fn size(
    look: &mut ProblemCollector,
    dimension: Node,
    variables: &BTreeMap<u32, Node>,
) -> Option<u64> {
    let fixed = number::<u64>(dimension, "start");
    match (fixed, number::<u32>(dimension, "valueReference")) {
        (Some(_), Some(_)) => look.at(dimension, "has both start and valueReference"),
        (None, None) => look.at(dimension, "has neither start nor valueReference"),
        (Some(0), None) => look.at(dimension, "has the size 0"),
        (Some(size), None) => return Some(size),
        (None, Some(reference)) => {
            let found = variables.get(&reference).filter(|node| {
                node.has_tag_name("UInt64")
                    && (node.attribute("causality") == Some("structuralParameter")
                        || node.attribute("variability") == Some("constant"))
            });
            match found {
                None => {
                    let what = format!(
                        "refers to {reference}, which is no structural parameter of type UInt64"
                    );
                    look.at(dimension, &what);
                }
                Some(node) => return number(*node, "start"),
            }
        }
    }
    None
}

fn terminals(fmu: &Fmu) -> RuleResult {
    match fmu.terminals() {
        Ok((terminals, problems)) if terminals.is_empty() && problems.is_empty() => {
            not_applicable("there are no terminals")
        }
        Ok((terminals, problems)) if problems.is_empty() => {
            Ok(format!("{} terminals", terminals.len()))
        }
        Ok((_, problems)) => violated(problems.join("; ")),
        Err(problem) => violated(problem),
    }
}
