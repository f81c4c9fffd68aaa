//! Wraps XML elements with typed attributes and positions, and notes what the standard does not know.

use std::sync::Arc;

use archive::{ATTRIBUTES, find_excess_attributes};
use roxmltree::{Document, Node, ParsingOptions};

use crate::error::mistake;
use crate::limits::NAME;
use crate::notes::Notes;
use crate::source_position::SourceText;
use crate::{Annotation, Error, Master, SourcePosition, StepSettings};

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
pub(crate) struct Element<'a> {
    node: Node<'a, 'a>,
    text: &'a Arc<SourceText>,
    notes: &'a Notes,
}

/// Reads a file whose outermost element is called `root`.
pub(crate) fn read<T>(
    text: &Arc<SourceText>,
    root: &str,
    notes: &Notes,
    reader: impl FnOnce(Element) -> Result<T, Error>,
) -> Result<T, Error> {
    if let Some(offset) = find_excess_attributes(&text.text) {
        let position = SourcePosition::new(text, offset);
        let expected = format!("at most {ATTRIBUTES} attributes and namespaces");
        return Err(mistake(
            &position,
            expected,
            "more",
            "leave out what the system does not need",
        ));
    }
    let options = ParsingOptions { nodes_limit: MOST_NODES, ..ParsingOptions::default() };
    let document =
        Document::parse_with_options(&text.text, options).map_err(|error| not_xml(text, &error))?;
    let node = document.root_element();
    let element = Element { node, text, notes };
    if !element.is(root) {
        let namespace = node.tag_name().namespace().unwrap_or("none");
        return Err(mistake(
            &element.position(),
            format!("the element <{root}> of the standard"),
            format!("<{}> of the namespace {namespace}", element.name()),
            format!(
                "refer to a file of the right kind, with a namespace such as http://ssp-standard.org/SSP1/{}",
                SPACES[0]
            ),
        ));
    }
    reader(element)
}

fn not_xml(text: &Arc<SourceText>, error: &roxmltree::Error) -> Error {
    if matches!(error, roxmltree::Error::DtdDetected) {
        let position = SourcePosition::new(text, text.text.find("<!DOCTYPE").unwrap_or_default());
        let cure = "remove it, and write what its entities stand for";
        return mistake(&position, "no document type", "<!DOCTYPE", cure);
    }
    let position = error.pos();
    let position = SourcePosition::of_line(text, position.row as usize, position.col as usize);
    mistake(&position, "a well-formed document", error.to_string(), "write the file again")
}

impl<'a> Element<'a> {
    /// The name without its prefix.
    pub(crate) fn name(self) -> &'a str {
        self.node.tag_name().name()
    }

    /// Whether the element is of the standard and called so.
    pub(crate) fn is(self, name: &str) -> bool {
        self.name() == name && self.standard()
    }

    fn standard(self) -> bool {
        let namespace = self.node.tag_name().namespace();
        namespace.and_then(|space| space.rsplit('/').next()).is_some_and(|x| SPACES.contains(&x))
    }

    fn contains(self, position: &SourcePosition) -> bool {
        self.node.range().contains(&position.offset())
    }

    pub(crate) fn position(self) -> SourcePosition {
        SourcePosition::new(self.text, self.node.range().start)
    }

    /// The place of the value of an attribute, or of the element without it.
    pub(crate) fn position_of(self, attribute: &str) -> SourcePosition {
        let node = self.node.attribute_node(attribute);
        let offset = node.map_or(self.node.range().start, |node| node.range_value().start);
        SourcePosition::new(self.text, offset)
    }

    pub(crate) fn attribute(self, name: &str) -> Option<&'a str> {
        self.node.attribute(name)
    }

    pub(crate) fn required(self, name: &str) -> Result<&'a str, Error> {
        self.attribute(name).ok_or_else(|| {
            let expected = format!("the attribute {name}=\"...\"");
            let found = format!("<{}> without it", self.name());
            mistake(&self.position(), expected, found, "write it")
        })
    }

    /// A name: neither empty nor longer than names may be.
    pub(crate) fn short(self, name: &str) -> Result<&'a str, Error> {
        let text = self.required(name)?;
        if text.is_empty() || text.len() > NAME {
            return Err(self.wrong(name, &format!("a name of 1 to {NAME} bytes")));
        }
        Ok(text)
    }

    /// Elements of the standard in this one.
    pub(crate) fn children(self) -> impl Iterator<Item = Element<'a>> {
        let elements = self.node.children().filter(Node::is_element);
        elements.map(move |node| Element { node, ..self }).filter(|element| element.standard())
    }

    /// Elements of the standard in this one that are called so.
    pub(crate) fn all(self, name: &str) -> impl Iterator<Item = Element<'a>> {
        self.children().filter(move |element| element.name() == name)
    }

    /// The only element called so, if there is one.
    pub(crate) fn child(self, name: &str) -> Result<Option<Element<'a>>, Error> {
        let mut all = self.all(name);
        let first = all.next();
        match all.next() {
            Some(second) => Err(mistake(
                &second.position(),
                format!("one <{name}>"),
                "a second one",
                "put the contents of both into one",
            )),
            None => Ok(first),
        }
    }

    /// The elements called `name` in the list called `list`; the list has nothing else.
    pub(crate) fn listed(self, list: &str, name: &str) -> Result<Vec<Element<'a>>, Error> {
        let Some(list) = self.child(list)? else { return Ok(Vec::new()) };
        list.known(&[name], &[]);
        Ok(list.all(name).collect())
    }

    /// A number that is neither infinite nor none.
    pub(crate) fn number(self, name: &str) -> Result<Option<f64>, Error> {
        let Some(text) = self.attribute(name) else { return Ok(None) };
        let value = number(text).filter(|value| value.is_finite());
        value.map(Some).ok_or_else(|| self.wrong(name, "a finite number such as 1.5e-3"))
    }

    /// A truth value; without the attribute, false.
    pub(crate) fn truth(self, name: &str) -> Result<bool, Error> {
        let Some(text) = self.attribute(name) else { return Ok(false) };
        truth(text).ok_or_else(|| self.wrong(name, "true or false"))
    }

    /// The error about an attribute that has a wrong value.
    pub(crate) fn wrong(self, name: &str, expected: &str) -> Error {
        let found = self.attribute(name).unwrap_or_default();
        let cure = format!("correct {name} of <{}>", self.name());
        mistake(&self.position_of(name), expected, format!("`{found}`"), cure)
    }

    /// Notes annotations, and everything but these elements and attributes.
    pub(crate) fn known(self, elements: &[&str], attributes: &[&str]) {
        for node in self.node.children().filter(Node::is_element) {
            let child = Element { node, ..self };
            match child.name() {
                "Annotations" if child.standard() => child.note_annotations(),
                name if child.standard() && elements.contains(&name) => {}
                name => self.note(child.position(), &format!("the element <{name}>")),
            }
        }
        for attribute in self.node.attributes() {
            let name = attribute.name();
            let known = attributes.contains(&name) || COMMON.contains(&name);
            // Attributes of other namespaces, such as the place of the schema, are no business of the standard.
            if attribute.namespace().is_none() && !known {
                let position = SourcePosition::new(self.text, attribute.range().start);
                self.note(position, &format!("the attribute {name} of <{}>", self.name()));
            }
        }
    }

    fn note(self, position: SourcePosition, what: &str) {
        self.notes.add(|| format!("{position}: {what} is not used here, it is ignored"));
    }

    /// The step that an annotation of an experiment or of the outermost system has.
    pub(crate) fn stepping(self) -> Option<StepSettings> {
        let outermost = |node: Node| node.parent_element() == Some(node.document().root_element());
        let master = match self.name() {
            "DefaultExperiment" => Master::Osp,
            "System" if outermost(self.node) => Master::OmSimulator,
            _ => return None,
        };
        let (element, attribute) = master.step_parameter();
        let all = self.all("Annotations").flat_map(|list| list.all("Annotation"));
        let inner = all.flat_map(|it| it.node.descendants());
        let mut named = inner.filter(|node| node.tag_name().name() == element);
        named.find_map(|node| {
            let found = Element { node, ..self };
            let step = number(found.attribute(attribute)?).filter(|it| *it > 0.0 && it.is_finite());
            Some(StepSettings { master, step: step?, position: found.position_of(attribute) })
        })
    }

    /// Names the annotations of foreign tools, and what they say about steps and algorithms. One with a step that is used is not
    /// ignored.
    fn note_annotations(self) {
        let owner = self.node.parent_element().map(|node| Element { node, ..self });
        let used = owner.and_then(Element::stepping).map(|it| it.position);
        for annotation in self.all("Annotation") {
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
            self.notes.add(|| format!("{position}: the annotation {kind} is ignored{said}"));
        }
    }

    /// The annotations of this element that have an element in them.
    pub(crate) fn annotations(self) -> Vec<Annotation> {
        let all = self.all("Annotations").flat_map(|list| list.all("Annotation"));
        let annotations = all.filter_map(|annotation| {
            let content = annotation.node.first_element_child()?;
            let attributes = content.attributes().take(ATTRIBUTES);
            let texts = content.children().filter_map(|child| child.text());
            Some(Annotation {
                kind: annotation.attribute("type")?.to_owned(),
                attributes: attributes
                    .map(|x| (x.name().to_owned(), x.value().to_owned()))
                    .collect(),
                text: texts.collect(),
            })
        });
        annotations.collect()
    }

    pub(crate) fn notes(self) -> &'a Notes {
        self.notes
    }
}

/// A number as XML Schema writes it: Rust knows more words for infinity.
pub(crate) fn number(text: &str) -> Option<f64> {
    match text.trim() {
        "INF" | "+INF" => Some(f64::INFINITY),
        "-INF" => Some(f64::NEG_INFINITY),
        text if text.bytes().all(|x| x.is_ascii_digit() || b"+-.eE".contains(&x)) => {
            text.parse().ok()
        }
        _ => None,
    }
}

/// A truth value as XML Schema writes it.
pub(crate) fn truth(text: &str) -> Option<bool> {
    match text.trim() {
        "true" | "1" => Some(true),
        "false" | "0" => Some(false),
        _ => None,
    }
}
