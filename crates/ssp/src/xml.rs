//! Wraps XML elements with typed attributes and positions, and notes what the standard does not know.

use std::sync::Arc;

use archive::{ATTRIBUTES, find_element_over_limit};
use roxmltree::{Document, Node, ParsingOptions};

use crate::error::mistake_error;
use crate::limits::NAME;
use crate::notes::ReadingNotes;
use crate::source_position::SourceText;
use crate::{Error, SourcePosition, StepSettings, SteppingTool, ToolAnnotation};

/// The last parts of the namespaces of the standard. What stands before them may change with its versions.
const SPACES: [&str; 5] = [
    "SystemStructureDescription",
    "SystemStructureCommon",
    "SystemStructureParameterValues",
    "SystemStructureParameterMapping",
    "SystemStructureSignalDictionary",
];

/// A document may have this many elements, attributes and texts.
const MOST_NODES: u32 = 8_000_000;

/// Attributes that every element of a model may have.
const COMMON: [&str; 2] = ["id", "description"];

/// Words in elements and attributes of annotations that tell how a tool steps its system.
const STEPPING: [&str; 5] = ["step", "master", "algorithm", "solver", "tolerance"];

/// An element of a file.
#[derive(Clone, Copy)]
pub(crate) struct XmlElement<'a> {
    node: Node<'a, 'a>,
    text: &'a Arc<SourceText>,
    notes: &'a ReadingNotes,
}

/// Reads a file whose outermost element is called `root`.
pub(crate) fn parse_document<T>(
    text: &Arc<SourceText>,
    root: &str,
    notes: &ReadingNotes,
    reader: impl FnOnce(XmlElement) -> Result<T, Error>,
) -> Result<T, Error> {
    if let Some(offset) = find_element_over_limit(&text.text) {
        let position = SourcePosition::new(text, offset);
        let expected = format!("at most {ATTRIBUTES} attributes and namespaces");
        return Err(mistake_error(&position, expected, "more", "leave out what the system does not need"));
    }
    let options = ParsingOptions { nodes_limit: MOST_NODES, ..ParsingOptions::default() };
    let document =
        Document::parse_with_options(&text.text, options).map_err(|error| invalid_xml_error(text, &error))?;
    let node = document.root_element();
    let element = XmlElement { node, text, notes };
    if !element.is_named(root) {
        let namespace = node.tag_name().namespace().unwrap_or("none");
        return Err(mistake_error(
            &element.position(),
            format!("the element <{root}> of the standard"),
            format!("<{}> of the namespace {namespace}", element.local_name()),
            format!(
                "refer to a file of the right kind, with a namespace such as http://ssp-standard.org/SSP1/{}",
                SPACES[0]
            ),
        ));
    }
    reader(element)
}

fn invalid_xml_error(text: &Arc<SourceText>, error: &roxmltree::Error) -> Error {
    if matches!(error, roxmltree::Error::DtdDetected) {
        let position = SourcePosition::new(text, text.text.find("<!DOCTYPE").unwrap_or_default());
        let cure = "remove it, and write what its entities stand for";
        return mistake_error(&position, "no document type", "<!DOCTYPE", cure);
    }
    let position = error.pos();
    let position = SourcePosition::from_line_and_column(text, position.row as usize, position.col as usize);
    mistake_error(&position, "a well-formed document", error.to_string(), "write the file again")
}

impl<'a> XmlElement<'a> {
    /// The name without its prefix.
    pub(crate) fn local_name(self) -> &'a str {
        self.node.tag_name().name()
    }

    /// Whether the element is of the standard and called so.
    pub(crate) fn is_named(self, name: &str) -> bool {
        self.local_name() == name && self.is_standard()
    }

    fn is_standard(self) -> bool {
        let namespace = self.node.tag_name().namespace();
        namespace.and_then(|space| space.rsplit('/').next()).is_some_and(|x| SPACES.contains(&x))
    }

    fn contains(self, position: &SourcePosition) -> bool {
        self.node.range().contains(&position.byte_offset())
    }

    pub(crate) fn position(self) -> SourcePosition {
        SourcePosition::new(self.text, self.node.range().start)
    }

    /// The place of the value of an attribute, or of the element without it.
    pub(crate) fn attribute_position(self, attribute: &str) -> SourcePosition {
        let node = self.node.attribute_node(attribute);
        let offset = node.map_or(self.node.range().start, |node| node.range_value().start);
        SourcePosition::new(self.text, offset)
    }

    pub(crate) fn attribute(self, name: &str) -> Option<&'a str> {
        self.node.attribute(name)
    }

    pub(crate) fn required_attribute(self, name: &str) -> Result<&'a str, Error> {
        self.attribute(name).ok_or_else(|| {
            let expected = format!("the attribute {name}=\"...\"");
            let found = format!("<{}> without it", self.local_name());
            mistake_error(&self.position(), expected, found, "write it")
        })
    }

    /// A name: neither empty nor longer than names may be.
    pub(crate) fn short_name_attribute(self, name: &str) -> Result<&'a str, Error> {
        let text = self.required_attribute(name)?;
        if text.is_empty() || text.len() > NAME {
            return Err(self.wrong_attribute_error(name, &format!("a name of 1 to {NAME} bytes")));
        }
        Ok(text)
    }

    /// Elements of the standard in this one.
    pub(crate) fn standard_children(self) -> impl Iterator<Item = XmlElement<'a>> {
        let elements = self.node.children().filter(Node::is_element);
        elements.map(move |node| XmlElement { node, ..self }).filter(|element| element.is_standard())
    }

    /// Elements of the standard in this one that are called so.
    pub(crate) fn children_named(self, name: &str) -> impl Iterator<Item = XmlElement<'a>> {
        self.standard_children().filter(move |element| element.local_name() == name)
    }

    /// The only element called so, if there is one.
    pub(crate) fn only_child(self, name: &str) -> Result<Option<XmlElement<'a>>, Error> {
        let mut all = self.children_named(name);
        let first = all.next();
        match all.next() {
            Some(second) => Err(mistake_error(
                &second.position(),
                format!("one <{name}>"),
                "a second one",
                "put the contents of both into one",
            )),
            None => Ok(first),
        }
    }

    /// The elements called `name` in the list called `list`; the list has nothing else.
    pub(crate) fn listed_children(self, list: &str, name: &str) -> Result<Vec<XmlElement<'a>>, Error> {
        let Some(list) = self.only_child(list)? else { return Ok(Vec::new()) };
        list.note_unknown_content(&[name], &[]);
        Ok(list.children_named(name).collect())
    }

    /// A number that is neither infinite nor none.
    pub(crate) fn number_attribute(self, name: &str) -> Result<Option<f64>, Error> {
        let Some(text) = self.attribute(name) else { return Ok(None) };
        let value = parse_number(text).filter(|value| value.is_finite());
        value.map(Some).ok_or_else(|| self.wrong_attribute_error(name, "a finite number such as 1.5e-3"))
    }

    /// A truth value; without the attribute, false.
    pub(crate) fn bool_attribute(self, name: &str) -> Result<bool, Error> {
        let Some(text) = self.attribute(name) else { return Ok(false) };
        parse_bool(text).ok_or_else(|| self.wrong_attribute_error(name, "true or false"))
    }

    /// The error about an attribute that has a wrong value.
    pub(crate) fn wrong_attribute_error(self, name: &str, expected: &str) -> Error {
        let found = self.attribute(name).unwrap_or_default();
        let cure = format!("correct {name} of <{}>", self.local_name());
        mistake_error(&self.attribute_position(name), expected, format!("`{found}`"), cure)
    }

    /// Notes annotations, and everything but these elements and attributes.
    pub(crate) fn note_unknown_content(self, elements: &[&str], attributes: &[&str]) {
        for node in self.node.children().filter(Node::is_element) {
            let child = XmlElement { node, ..self };
            match child.local_name() {
                "Annotations" if child.is_standard() => child.note_annotations(),
                name if child.is_standard() && elements.contains(&name) => {}
                name => self.note_at(child.position(), &format!("the element <{name}>")),
            }
        }
        for attribute in self.node.attributes() {
            let name = attribute.name();
            let known = attributes.contains(&name) || COMMON.contains(&name);
            // Attributes of other namespaces, such as the place of the schema, are no business of the standard.
            if attribute.namespace().is_none() && !known {
                let position = SourcePosition::new(self.text, attribute.range().start);
                self.note_at(position, &format!("the attribute {name} of <{}>", self.local_name()));
            }
        }
    }

    fn note_at(self, position: SourcePosition, what: &str) {
        self.notes.add_note(|| format!("{position}: {what} is not used here, it is ignored"));
    }

    /// The step that an annotation of an experiment or of the outermost system has.
    pub(crate) fn step_settings(self) -> Option<StepSettings> {
        let outermost = |node: Node| node.parent_element() == Some(node.document().root_element());
        let master = match self.local_name() {
            "DefaultExperiment" => SteppingTool::Osp,
            "System" if outermost(self.node) => SteppingTool::OmSimulator,
            _ => return None,
        };
        let (element, attribute) = master.step_parameter();
        let all = self.children_named("Annotations").flat_map(|list| list.children_named("Annotation"));
        let inner = all.flat_map(|it| it.node.descendants());
        let mut named = inner.filter(|node| node.tag_name().name() == element);
        named.find_map(|node| {
            let found = XmlElement { node, ..self };
            let step = parse_number(found.attribute(attribute)?).filter(|it| *it > 0.0 && it.is_finite());
            Some(StepSettings { master, step: step?, position: found.attribute_position(attribute) })
        })
    }

    /// Names the annotations of foreign tools, and what they say about steps and algorithms. One with a step that is used is not
    /// ignored.
    fn note_annotations(self) {
        let owner = self.node.parent_element().map(|node| XmlElement { node, ..self });
        let used = owner.and_then(XmlElement::step_settings).map(|it| it.position);
        for annotation in self.children_named("Annotation") {
            if used.as_ref().is_some_and(|position| annotation.contains(position)) {
                continue;
            }
            let kind = annotation.attribute("type").unwrap_or("without a type");
            let mut said = Vec::new();
            for node in annotation.node.descendants().skip(1).filter(Node::is_element) {
                let steps = |name: &str| {
                    let name = name.to_lowercase();
                    STEPPING.iter().any(|word| name.contains(word))
                };
                let name = node.tag_name().name();
                let all = node.attributes().filter(|x| steps(name) || steps(x.name()));
                said.extend(all.map(|x| format!("{name}.{} = {}", x.name(), x.value())));
            }
            said.truncate(8);
            let said = if said.is_empty() {
                String::new()
            } else {
                format!("; it says {}, which the standard does not define", said.join(", "))
            };
            let position = annotation.position();
            self.notes.add_note(|| format!("{position}: the annotation {kind} is ignored{said}"));
        }
    }

    /// The annotations of this element that have an element in them.
    pub(crate) fn annotations(self) -> Vec<ToolAnnotation> {
        let all = self.children_named("Annotations").flat_map(|list| list.children_named("Annotation"));
        let annotations = all.filter_map(|annotation| {
            let content = annotation.node.first_element_child()?;
            let attributes = content.attributes().take(ATTRIBUTES);
            let texts = content.children().filter_map(|child| child.text());
            Some(ToolAnnotation {
                kind: annotation.attribute("type")?.to_owned(),
                attributes: attributes.map(|x| (x.name().to_owned(), x.value().to_owned())).collect(),
                text: texts.collect(),
            })
        });
        annotations.collect()
    }

    pub(crate) fn reading_notes(self) -> &'a ReadingNotes {
        self.notes
    }
}

/// A number as XML Schema writes it: Rust knows more words for infinity.
pub(crate) fn parse_number(text: &str) -> Option<f64> {
    match text.trim() {
        "INF" | "+INF" => Some(f64::INFINITY),
        "-INF" => Some(f64::NEG_INFINITY),
        text if text.bytes().all(|x| x.is_ascii_digit() || b"+-.eE".contains(&x)) => text.parse().ok(),
        _ => None,
    }
}

/// A truth value as XML Schema writes it.
pub(crate) fn parse_bool(text: &str) -> Option<bool> {
    match text.trim() {
        "true" | "1" => Some(true),
        "false" | "0" => Some(false),
        _ => None,
    }
}
