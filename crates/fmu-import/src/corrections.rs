//! Corrects violations of the standard in a model description where the meaning is unambiguous, so that it is parsed like any other.
//!
//! Each correction is told. What has no such meaning is refused, with variable and line. Lines stay where they are.

use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::ops::Range;

use roxmltree::{Document, Node};

use crate::FmiVersion;
use crate::definitions::list_elements;
use crate::problem_list::{ProblemList, describe_place, enclosing_name};

const VARIABILITIES: &[&str] = &["constant", "fixed", "tunable", "discrete", "continuous"];
const INITIALS: &[&str] = &["exact", "approx", "calculated"];
const KINDS: &[&str] = &["dependent", "constant", "fixed", "tunable", "discrete"];

/// Words of FMI 1.0 for what FMI 2.0 calls otherwise.
const OLDER: [(&str, &str, &str); 3] = [
    ("causality", "internal", "local"),
    ("causality", "none", "local"),
    ("variability", "parameter", "fixed"),
];

/// A description after its corrections, and what to tell of them.
#[derive(Debug, Default)]
pub(crate) struct CorrectedDescription {
    pub text: String,
    pub told: Vec<String>,
}

/// Corrects a description of FMI 2.0 or 3.0.
///
/// # Errors
/// When a word of it can mean anything.
pub(crate) fn correct_description(
    document: &Document,
    version: FmiVersion,
) -> Result<CorrectedDescription, String> {
    let (text, root) = (document.input_text(), document.root_element());
    let findings = ProblemList::new(text);
    let mut corrector = DescriptionCorrector { text, version, edits: BTreeMap::new(), findings };
    let list = root.children().filter(|node| node.has_tag_name("ModelVariables"));
    let variables: Vec<_> = list.flat_map(|list| list.children().filter(Node::is_element)).collect();
    variables.iter().try_for_each(|variable| corrector.correct_variable(*variable))?;
    if version == FmiVersion::Two {
        let attributes = variables.iter().flat_map(|variable| variable.children());
        let used: BTreeSet<_> = attributes.filter_map(|node| node.attribute("declaredType")).collect();
        for kind in list_elements(root, "TypeDefinitions", "SimpleType") {
            let is_used = kind.attribute("name").is_some_and(|name| used.contains(name));
            let integers = kind.children().filter(|node| node.has_tag_name("Integer"));
            integers.for_each(|node| corrector.drop_unreachable_limits(node));
            if !is_used {
                kind.children().for_each(|node| corrector.drop_unreadable_limits(node));
            }
        }
    }
    corrector.correct_model_structure(root, &variables);
    Ok(corrector.into_corrected_description())
}

struct DescriptionCorrector<'a> {
    text: &'a str,
    version: FmiVersion,
    /// What takes the place of a part of the text, by the beginning of the part [B].
    edits: BTreeMap<usize, (Range<usize>, String)>,
    findings: ProblemList<'a>,
}

impl DescriptionCorrector<'_> {
    fn into_corrected_description(self) -> CorrectedDescription {
        let (mut text, mut done) = (String::with_capacity(self.text.len()), 0);
        for (range, new) in self.edits.into_values() {
            // A part of what was left out as a whole.
            let Some(before) = self.text.get(done..range.start) else { continue };
            text += before;
            text += &new;
            let lines = self.text[range.clone()].bytes().filter(|byte| *byte == b'\n').count();
            text += &"\n".repeat(lines);
            done = range.end;
        }
        text += &self.text[done..];
        CorrectedDescription { text, told: self.findings.into_sentences() }
    }

    fn replace_text(&mut self, range: Range<usize>, new: String) {
        self.edits.insert(range.start, (range, new));
    }

    /// Gives an attribute another value, or leaves it out.
    fn set_attribute(&mut self, node: Node, name: &str, value: Option<&str>) {
        let new = value.map(|value| format!("{name}=\"{value}\"")).unwrap_or_default();
        if let Some(attribute) = node.attribute_node(name) {
            return self.replace_text(attribute.range(), new);
        }
        let start = node.range().start + 1;
        let ends = |it: char| it.is_whitespace() || matches!(it, '/' | '>');
        let length = self.text[start..].find(ends).unwrap_or_default();
        self.replace_text(start + length..start + length, format!(" {new}"));
    }

    fn report_correction(&mut self, node: Node, what: String) {
        self.findings.push(enclosing_name(node), node.range().start, what);
    }

    /// The word of an attribute, which has to be one of `words`. One that differs in letter case or is of FMI 1.0 is corrected; another
    /// one is left out.
    fn correct_attribute_word(
        &mut self,
        node: Node,
        attribute: &str,
        words: &[&'static str],
    ) -> Option<&'static str> {
        let found = node.attribute(attribute)?;
        if let Some(word) = words.iter().find(|word| **word == found) {
            return Some(word);
        }
        let older = OLDER.iter().find(|it| it.0 == attribute && it.1 == found.trim());
        let like = words.iter().find(|word| word.eq_ignore_ascii_case(found.trim()));
        let word = like.copied().or(older.map(|it| it.2));
        let as_what = match word {
            Some(word) => format!("read as \"{word}\""),
            None => format!("left out; write one of {}", words.join(", ")),
        };
        let version = self.version;
        self.report_correction(
            node,
            format!("{attribute}=\"{found}\" is no word of FMI {version}: {as_what}"),
        );
        self.set_attribute(node, attribute, word);
        word
    }

    /// Corrects who determines a variable and when it may change (FMI 2.0, section 2.2.7; FMI 3.0, section 2.4.7.4).
    fn correct_variable(&mut self, node: Node) -> Result<(), String> {
        let causalities = causality_words(self.version);
        let causality = self.correct_attribute_word(node, "causality", causalities);
        let written = node.attribute("causality").map_or("", str::trim);
        if causality.is_none() && !written.is_empty() {
            let (place, version) =
                (describe_place(self.text, enclosing_name(node), node.range().start), self.version);
            return Err(format!(
                "{place}: causality=\"{written}\" is no word of FMI {version}: expected one of {}; correct it where the FMU is exported",
                causalities.join(", ")
            ));
        }
        self.correct_attribute_word(node, "initial", INITIALS);
        let causality = causality.unwrap_or("local");
        let written = self.correct_attribute_word(node, "variability", VARIABILITIES);
        // The default of FMI 3.0 depends on type and causality, and is always legal.
        let default = (self.version == FmiVersion::Two).then_some("continuous");
        let Some(variability) = written.or(default) else { return Ok(()) };
        let legal = allowed_variabilities(causality);
        if legal.contains(&variability) {
            return Ok(());
        }
        let reason = match written {
            Some(_) => "",
            None => ", which counts where none is written",
        };
        let is_real = ["Float32", "Float64"].iter().any(|it| node.has_tag_name(*it))
            || node.children().any(|it| it.has_tag_name("Real"));
        // As fmi-library takes it, which PyFMI and OMSimulator read descriptions with.
        let meant = match legal.contains(&"fixed") {
            true => "fixed",
            false if is_real || causality == "independent" => "continuous",
            false => "discrete",
        };
        self.set_attribute(node, "variability", Some(meant));
        if written.is_none() && node.has_attribute("variability") {
            // It has been told as no word.
            return Ok(());
        }
        let words: Vec<_> = legal.iter().map(|word| format!("\"{word}\"")).collect();
        self.report_correction(
            node,
            format!(
                "causality=\"{causality}\" excludes variability=\"{variability}\"{reason}: read as \"{meant}\"; the exporter has to write {}",
                words.join(" or ")
            ),
        );
        Ok(())
    }

    /// Leaves out limits that no integer of 32 bits reaches.
    fn drop_unreachable_limits(&mut self, node: Node) {
        for (attribute, side) in [("min", -1.0), ("max", 1.0)] {
            let Some(text) = node.attribute(attribute) else { continue };
            let limit = text.trim().parse().unwrap_or(f64::NAN);
            if text.parse::<i32>().is_err() && side * limit >= f64::from(i32::MAX) {
                let what =
                    format!("{attribute}=\"{text}\" is beyond all integers of FMI 2.0: read as no limit");
                self.report_correction(node, what);
                self.set_attribute(node, attribute, None);
            }
        }
    }

    /// Leaves out limits without a meaning, of a type that no variable has.
    fn drop_unreadable_limits(&mut self, node: Node) {
        let is_number = |text: &str| match node.tag_name().name() {
            "Real" => text.trim().parse::<f64>().is_ok(),
            "Integer" => {
                text.parse::<f64>().is_ok_and(|limit| limit.fract() == 0.0) && !text.contains(['e', 'E', '.'])
            }
            _ => true,
        };
        for attribute in ["min", "max", "nominal"] {
            if let Some(text) = node.attribute(attribute).filter(|text| !is_number(text)) {
                let what = format!(
                    "{attribute}=\"{text}\" is no value of <{}>, and no variable has this type: left out",
                    node.tag_name().name()
                );
                self.report_correction(node, what);
                self.set_attribute(node, attribute, None);
            }
        }
    }

    /// Corrects what outputs follow, and leaves out what refers to no variable.
    fn correct_model_structure(&mut self, root: Node, variables: &[Node]) {
        let Some(structure) = root.children().find(|node| node.has_tag_name("ModelStructure")) else {
            let what = "it lacks <ModelStructure>: each output is taken to follow all inputs";
            self.findings.push(None, root.range().start, what.to_owned());
            let end = self.text[root.range()].rfind("</").map(|end| root.range().start + end);
            if let Some(end) = end {
                self.replace_text(end..end, "<ModelStructure/>".to_owned());
            }
            return;
        };
        let (id, by_reference) = match self.version {
            FmiVersion::One | FmiVersion::Two => ("index", false),
            FmiVersion::Three => ("valueReference", true),
        };
        let id_of = |(place, node): (usize, &Node)| match by_reference {
            true => node.attribute("valueReference")?.trim().parse().ok(),
            false => u32::try_from(place + 1).ok(),
        };
        let known: HashMap<u32, Option<&str>> = variables
            .iter()
            .enumerate()
            .filter_map(|it| Some((id_of(it)?, it.1.attribute("name"))))
            .collect();
        let unknowns: Vec<_> = match by_reference {
            true => structure.children().filter(|node| node.has_attribute(id)).collect(),
            false => structure
                .children()
                .flat_map(|list| list.children())
                .filter(|node| node.has_tag_name("Unknown"))
                .collect(),
        };
        for node in unknowns {
            self.correct_unknown(node, id, &known);
        }
    }

    fn correct_unknown(&mut self, node: Node, id: &str, known: &HashMap<u32, Option<&str>>) {
        let variable = |text: &str| known.get(&text.trim().parse::<u32>().ok()?);
        let (place, count) = (node.range().start, known.len());
        let written = node.attribute(id).unwrap_or_default();
        let Some(name) = variable(written).copied() else {
            let what = format!("{id}=\"{written}\" is none of the {count} variables: it is left out");
            self.findings.push(None, place, what);
            return self.replace_text(node.range(), String::new());
        };
        let words = |attribute| node.attribute(attribute).map(str::split_whitespace);
        let wrong = words("dependencies").and_then(|mut ids| ids.find(|it| variable(it).is_none()));
        if let Some(wrong) = wrong {
            let what = format!(
                "the dependency \"{wrong}\" is none of the {count} variables: it is taken to follow all inputs"
            );
            self.findings.push(name, place, what);
            self.set_attribute(node, "dependencies", None);
            return self.drop_dependency_kinds(node);
        }
        let Some(kinds) = words("dependenciesKind") else { return };
        let [has, needs] = [kinds.clone().count(), words("dependencies").map_or(0, Iterator::count)];
        let what = match kinds.clone().find(|kind| !KINDS.contains(kind)) {
            Some(kind) => {
                format!("dependenciesKind: \"{kind}\" is no word of FMI {}", self.version)
            }
            None if has != needs => {
                format!("the words of dependenciesKind are {has}, of dependencies {needs}")
            }
            None => return,
        };
        self.findings.push(name, place, what + ": the kinds are left out");
        self.drop_dependency_kinds(node);
    }

    /// Leaves out the kinds of dependencies, which nobody asks for.
    fn drop_dependency_kinds(&mut self, node: Node) {
        if node.has_attribute("dependenciesKind") {
            self.set_attribute(node, "dependenciesKind", None);
        }
    }
}

/// The words of a version for those who determine a variable.
fn causality_words(version: FmiVersion) -> &'static [&'static str] {
    const ALL: &[&str] = &[
        "parameter",
        "calculatedParameter",
        "input",
        "output",
        "local",
        "independent",
        "structuralParameter",
        "dependent",
    ];
    match version {
        FmiVersion::One | FmiVersion::Two => &ALL[..6],
        FmiVersion::Three => ALL,
    }
}

/// The variabilities that a causality allows.
fn allowed_variabilities(causality: &str) -> &'static [&'static str] {
    match causality {
        "parameter" | "calculatedParameter" | "structuralParameter" => &["fixed", "tunable"],
        "input" => &["discrete", "continuous"],
        "output" => &["discrete", "continuous", "constant"],
        "independent" => &["continuous"],
        _ => VARIABILITIES,
    }
}
