//! Turns validation errors of fmi-rs into sentences with variables and lines.

use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::sync::{Mutex, PoisonError};

use fmi_rs::model_description::ValidationError;
use roxmltree::{Document, Node};

use crate::description::Variable;
use crate::problem_list::{ProblemList, describe_place, enclosing_name};

/// A variable as the lists of a model structure name it.
#[derive(Debug, Clone, Copy)]
pub(crate) struct StructureVariable<'a> {
    /// Its index or its value reference.
    pub id: u32,
    pub name: &'a str,
    /// Where it begins in the text [B].
    pub place: usize,
    /// Whether it has a value at ticks only: such a variable may be an initial unknown and need not be.
    pub clocked: bool,
}

/// The checks of fmi-rs run one after the other: its parser of structured names, made by Flex and Bison, has one state for the process.
static CHECKING: Mutex<()> = Mutex::new(());

/// One sentence for each kind of mistake that `check` finds in `text`. `unknowns` are the places of entries of the model structure [B], with the ids of
/// their variables.
pub(crate) fn validation_problems(
    text: &str,
    check: impl FnOnce() -> Vec<ValidationError>,
    variables: &[StructureVariable],
    unknowns: impl Iterator<Item = (usize, u32)>,
) -> Vec<String> {
    let found = {
        let _turn = CHECKING.lock().unwrap_or_else(PoisonError::into_inner);
        check()
    };
    if found.is_empty() {
        return Vec::new();
    }
    let by_id: HashMap<u32, &StructureVariable> = variables.iter().rev().map(|it| (it.id, it)).collect();
    let mut names: HashMap<usize, &str> = variables.iter().map(|it| (it.place, it.name)).collect();
    names.extend(unknowns.filter_map(|(place, id)| Some((place, by_id.get(&id)?.name))));
    let mut findings = ProblemList::new(text);
    for ValidationError { range, message } in found {
        if let Some(ModelStructureMismatch { list, expected, actual }) =
            ModelStructureMismatch::from_fmi_rs_message(&message)
        {
            let lacks = format!("it is missing in <{list}> of <ModelStructure>");
            let extra = format!("it does not belong into <{list}> of <ModelStructure>");
            for it in variables {
                match (expected.contains(&it.id), actual.contains(&it.id)) {
                    (true, false) => findings.push(Some(it.name), it.place, lacks.clone()),
                    (false, true) if !it.clocked => {
                        findings.push(Some(it.name), it.place, extra.clone());
                    }
                    _ => {}
                }
            }
            continue;
        }
        let place = range.last().map_or(0, |range| range.start);
        let name = names.get(&place).copied();
        findings.push(name, place, message_without_name(&message, name));
    }
    findings.into_sentences()
}

/// Start values outside of the limits of their variable, and items of an enumeration with one value: one sentence for each kind.
pub(crate) fn value_problems(document: &Document, variables: &[Variable]) -> Vec<String> {
    let (text, root) = (document.input_text(), document.root_element());
    let mut findings = ProblemList::new(text);
    let mut enumerations: Vec<(Node, BTreeMap<&str, &str>)> = Vec::new();
    let items = root.children().filter(|list| list.has_tag_name("TypeDefinitions"));
    for item in items.flat_map(|list| list.descendants()).filter(|node| node.has_tag_name("Item")) {
        let (Some(parent), Some(name), Some(value)) =
            (item.parent(), item.attribute("name"), item.attribute("value"))
        else {
            continue;
        };
        if enumerations.last().is_none_or(|(last, _)| *last != parent) {
            enumerations.push((parent, BTreeMap::new()));
        }
        let known = enumerations.last_mut().and_then(|(_, known)| known.insert(value.trim(), name));
        if let Some(other) = known {
            let what =
                format!("its items \"{other}\" and \"{name}\" have one value, {value}: each needs its own");
            findings.push(enclosing_name(parent), parent.range().start, what);
        }
    }
    let elements = root.children().filter(|list| list.has_tag_name("ModelVariables"));
    let elements = elements.flat_map(|list| list.children().filter(Node::is_element));
    let places: HashMap<&str, usize> =
        elements.filter_map(|node| Some((node.attribute("name")?, node.range().start))).collect();
    for variable in variables {
        let start = variable.start.as_deref().and_then(|start| start.trim().parse::<f64>().ok());
        let (Some(start), Some(place)) = (start, places.get(variable.array_name())) else { continue };
        let limits = [
            ("min", variable.min, start < variable.min.unwrap_or(start)),
            ("max", variable.max, start > variable.max.unwrap_or(start)),
        ];
        for (name, limit, _) in limits.iter().filter(|(.., outside)| *outside) {
            let limit = limit.unwrap_or_default();
            let side = if *name == "min" { "below" } else { "above" };
            let what = format!("its start value {start} is {side} its {name} {limit}");
            findings.push(Some(&variable.name), *place, what);
        }
    }
    findings.into_sentences()
}

/// Sentences of fmi-rs without the name of their variable, and what there is to do.
const CURES: [(&str, &str); 3] = [
    (
        "Only Real variables can be continuous",
        "only Real variables can be continuous, which counts where no variability is written: write variability=\"discrete\"",
    ),
    (
        "it is calculated but provides a start value",
        "it is calculated and has a start value: leave that out, or write initial=\"exact\" or \"approx\"",
    ),
    ("it has no start value", "it needs a start value"),
];

/// The message without the name of its variable, so that those of one kind are equal.
fn message_without_name(message: &str, name: Option<&str>) -> String {
    let mut text = message.trim_end_matches('.').to_owned();
    if let Some(name) = name {
        text = text.replace(&format!(" for variable '{name}'"), "");
        text = text.replace(&format!("Variable name '{name}'"), "its name");
        text = text.replace(&format!("Variable '{name}'"), "it");
        text = text.replace(&format!("Variable {name} "), "it ");
    }
    for initial in ["Exact", "Approx", "Calculated"] {
        text = text.replace(&format!("Some({initial})"), initial);
    }
    // Where the grammar of names ends differs from name to name.
    let text = text.split(": syntax error").next().unwrap_or_default();
    if let Some((_, told)) = CURES.iter().find(|(found, _)| *found == text) {
        return (*told).to_owned();
    }
    let mut letters = text.chars();
    let first = letters.next().map(|it| it.to_lowercase().to_string()).unwrap_or_default();
    first + letters.as_str()
}

/// What fmi-rs says of a list of the model structure: it holds other variables than it should.
struct ModelStructureMismatch {
    /// The element that lists them.
    list: &'static str,
    expected: BTreeSet<u32>,
    actual: BTreeSet<u32>,
}

impl ModelStructureMismatch {
    fn from_fmi_rs_message(message: &str) -> Option<Self> {
        let (what, sets) = message.split_once(" do not match the expected set of variables. Expected: {")?;
        let (expected, actual) = sets.split_once("}, Actual: {")?;
        let list = match what.contains("initial unknowns") {
            true => "InitialUnknowns",
            false => "Outputs",
        };
        let ids = |text: &str| text.split([',', ' ', '}']).filter_map(|id| id.parse().ok()).collect();
        Some(ModelStructureMismatch { list, expected: ids(expected), actual: ids(actual) })
    }
}

/// Says where in a description the mistake is for which fmi-rs refuses it with `message`: `read` gives the message for another text,
/// and here it is asked about each variable and each other element alone.
pub(crate) fn locate_validation_error(
    document: &Document,
    message: &str,
    read: impl Fn(&str) -> Option<String>,
) -> String {
    let (text, root) = (document.input_text(), document.root_element());
    let version = root.attribute("fmiVersion").unwrap_or_default();
    let alone = |variables: &str, other: &str| {
        format!(
            "<fmiModelDescription fmiVersion=\"{version}\" modelName=\"\" guid=\"\" instantiationToken=\"\">\
             {other}<ModelVariables>{variables}</ModelVariables><ModelStructure/></fmiModelDescription>"
        )
    };
    let refused = |text: String| read(&text).is_some_and(|found| found == message);
    let elements = |node: Node<'_, '_>| node.is_element();
    let (lists, others): (Vec<_>, Vec<_>) =
        root.children().filter(|node| elements(*node)).partition(|node| node.has_tag_name("ModelVariables"));
    let mut variables = lists.iter().flat_map(|list| list.children()).filter(|it| elements(*it));
    let wrong = variables
        .find(|node| refused(alone(&text[node.range()], "")))
        .or_else(|| others.into_iter().find(|node| refused(alone("", &text[node.range()]))));
    let what = message_without_name(message, wrong.and_then(enclosing_name));
    match wrong {
        Some(node) => {
            format!("{}: {what}", describe_place(text, enclosing_name(node), node.range().start))
        }
        None => what,
    }
}
