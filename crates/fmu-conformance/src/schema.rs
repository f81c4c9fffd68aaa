//! Checks the elements and attributes of modelDescription.xml against the tables of both versions of FMI, each with its line.

mod fmi2;
mod fmi3;
mod table;
#[cfg(test)]
mod tests;

use std::collections::BTreeMap;

use fmu_import::FmiVersion;
use roxmltree::{Document, Node};

use super::RuleSeverity::BreaksStandard;
use super::{BOTH, ConformanceRule, RuleCheck, RuleResult, violated_rule};
use table::{ElementRow, ElementRule, check_value_type, find_element_rule};

pub(super) const RULES: &[ConformanceRule] = &[ConformanceRule {
    name: "schema",
    rank: BreaksStandard,
    sentence: "modelDescription.xml has the elements and attributes of the standard",
    versions: BOTH,
    check: RuleCheck::Text(check_schema),
}];

/// The namespace of the attributes that every XML document may have.
const INSTANCE: &str = "http://www.w3.org/2001/XMLSchema-instance";
/// How many mistakes are told; a wrong table of a tool makes one for each variable.
const MOST: usize = 20;

/// The version of FMI that a text says it is a description of; FMI 2.0 where it says nothing that is known.
pub(super) fn described_version(xml: &str) -> FmiVersion {
    let document = Document::parse(xml).ok();
    let version = document.as_ref().and_then(|it| it.root_element().attribute("fmiVersion"));
    match version.and_then(|version| version.chars().next()) {
        Some('1') => FmiVersion::One,
        Some('3') => FmiVersion::Three,
        _ => FmiVersion::Two,
    }
}

fn check_schema(xml: &str) -> RuleResult {
    let wrong = schema_problems(xml);
    let more = wrong.len().saturating_sub(MOST);
    let mut told = wrong.iter().take(MOST).cloned().collect::<Vec<_>>().join("; ");
    if more > 0 {
        told += &format!("; and {more} more");
    }
    match wrong.is_empty() {
        true => Ok(String::new()),
        false => violated_rule(told),
    }
}

/// What is wrong with the text of a description.
fn schema_problems(xml: &str) -> Vec<String> {
    let document = match Document::parse(xml) {
        Ok(document) => document,
        Err(error) => return vec![format!("line {}: {error}", error.pos().row)],
    };
    let is_fmi3 = described_version(xml) == FmiVersion::Three;
    let rows = if is_fmi3 { fmi3::ROWS } else { fmi2::ROWS };
    let mut walker = SchemaWalker { rows, known: BTreeMap::new(), wrong: Vec::new() };
    let root = document.root_element();
    match root.tag_name().name() {
        "fmiModelDescription" if root.tag_name().namespace().is_none() => {
            walker.check_element(root, "fmiModelDescription");
        }
        found => {
            let space = root.tag_name().namespace();
            let of = space.map(|space| format!(" of the namespace {space:?}")).unwrap_or_default();
            let what = format!("expected <fmiModelDescription>, found <{found}>{of}");
            walker.add_problem(root, &what);
        }
    }
    walker.wrong
}

struct SchemaWalker {
    rows: &'static [ElementRow],
    /// The rows that were read before.
    known: BTreeMap<&'static str, Option<std::rc::Rc<ElementRule>>>,
    wrong: Vec<String>,
}

impl SchemaWalker {
    fn add_problem(&mut self, node: Node, what: &str) {
        let line = node.document().text_pos_at(node.range().start).row;
        self.wrong.push(format!("line {line}: {what}"));
    }

    /// Checks an element by its row, and all elements in it.
    fn check_element(&mut self, root: Node, row: &'static str) {
        // Not by recursion: the depth of a description is its author's choice.
        let mut left = vec![(root, row)];
        while let Some((node, row)) = left.pop() {
            let rows = self.rows;
            let found = self.known.entry(row).or_insert_with(|| find_element_rule(rows, row).map(Into::into));
            let Some(element) = found.clone() else {
                continue;
            };
            self.check_attributes(node, &element);
            if !element.open {
                let children = self.check_children(node, &element);
                left.extend(children.into_iter().rev());
            }
            if element.unique {
                self.check_unique_names(node);
            }
        }
    }

    fn check_attributes(&mut self, node: Node, element: &ElementRule) {
        let name = node.tag_name().name();
        for attribute in node.attributes() {
            let known = element.attributes.iter().find(|it| it.name == attribute.name());
            match (attribute.namespace(), known) {
                (Some(INSTANCE), _) => {}
                (None, Some(known)) => {
                    if let Err(expected) = check_value_type(attribute.value(), known.kind) {
                        let (of, value) = (attribute.name(), attribute.value());
                        self.add_problem(
                            node,
                            &format!("{of} of <{name}>: expected {expected}, found {value:?}"),
                        );
                    }
                }
                _ if element.other_attributes => {}
                _ => self.add_problem(node, &format!("<{name}> has no attribute {:?}", attribute.name())),
            }
        }
        for needed in element.attributes.iter().filter(|it| it.required) {
            if node.attribute(needed.name).is_none() {
                self.add_problem(node, &format!("<{name}> lacks the attribute {:?}", needed.name));
            }
        }
    }

    /// Checks the order of the children, and gives those that have a row.
    fn check_children<'a>(
        &mut self,
        node: Node<'a, 'a>,
        element: &ElementRule,
    ) -> Vec<(Node<'a, 'a>, &'static str)> {
        let name = node.tag_name().name();
        let (mut at, mut used) = (0, vec![false; element.places.len()]);
        let mut found = Vec::new();
        for child in node.children() {
            if child.is_text() && child.text().is_some_and(|text| !text.trim().is_empty()) {
                self.add_problem(
                    child,
                    &format!("<{name}> has a text inside: {:?}", child.text().unwrap_or_default().trim()),
                );
            }
            if !child.is_element() {
                continue;
            }
            let tag = child.tag_name().name();
            let own = child.tag_name().namespace().is_none();
            let place = element.places.iter().position(|it| own && it.choices.iter().any(|it| it.0 == tag));
            let Some(place) = place else {
                self.add_problem(child, &format!("<{name}> has no element <{tag}>"));
                continue;
            };
            let (repeated, choices) = (element.places[place].repeated, &element.places[place].choices);
            if place < at {
                self.add_problem(child, &format!("<{tag}> comes too late in <{name}>"));
            } else if used[place] && !repeated {
                self.add_problem(child, &format!("<{name}> has more than one <{tag}>"));
            }
            at = at.max(place);
            used[place] = true;
            found.extend(choices.iter().find(|it| it.0 == tag).map(|it| (child, it.1)));
        }
        for (place, used) in element.places.iter().zip(used) {
            if place.required && !used {
                let names = place.choices.iter().map(|it| format!("<{}>", it.0)).collect::<Vec<_>>();
                self.add_problem(node, &format!("<{name}> lacks {}", names.join(" or ")));
            }
        }
        found
    }

    /// Insists on a name of its own for each child, and for each alias.
    fn check_unique_names(&mut self, node: Node) {
        let mut seen: BTreeMap<&str, u32> = BTreeMap::new();
        let aliases = |child: Node| child.children().any(|it| it.has_tag_name("Alias"));
        for child in node.children().filter(Node::is_element) {
            let own = std::iter::once(child).filter(|it| it.has_attribute("name"));
            let inner = child.children().filter(|it| aliases(child) && it.has_tag_name("Alias"));
            for named in own.chain(inner) {
                let name = named.attribute("name").unwrap_or_default();
                let line = node.document().text_pos_at(named.range().start).row;
                if let Some(first) = seen.insert(name, line) {
                    self.add_problem(
                        named,
                        &format!("the name {name:?} is there twice, first in line {first}"),
                    );
                }
            }
        }
    }
}
