//! Reads which experiments an archive brings along: `extra/org.fmi-standard.fmi-ls-ref/fmi-ls-manifest.xml` and what it names.
//!
//! The layered standard is not final. Version 1.0.0-alpha.1 names files by their roles; a draft, and experiment files of their own,
//! have elements `Experiment` with parameters, stimuli and references.

use roxmltree::{Document, Node};

const FOLDER: &str = "extra/org.fmi-standard.fmi-ls-ref";

/// Gives the contents of an entry of the archive.
type ReadArchiveEntryFn<'a> = &'a dyn Fn(&str) -> Option<Vec<u8>>;

/// A file that belongs to an experiment.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct ExperimentFile {
    /// As the manifest names it.
    pub(super) name: String,
    /// Its path in the archive.
    pub(super) path: String,
    /// Its MIME type.
    pub(super) kind: String,
}

/// What to run, and what to compare with.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct ReferenceExperiment {
    pub(super) name: String,
    /// [s], as the next two.
    pub(super) start: Option<f64>,
    pub(super) stop: Option<f64>,
    pub(super) step: Option<f64>,
    pub(super) tolerance: Option<f64>,
    pub(super) parameters: Option<ExperimentFile>,
    pub(super) stimuli: Option<ExperimentFile>,
    pub(super) results: Option<ExperimentFile>,
}

/// The experiments of the archive, none when it brings none.
///
/// # Errors
/// When the manifest, or a file of experiments that it names, cannot be read.
pub(super) fn parse_experiments(entries: ReadArchiveEntryFn) -> Result<Vec<ReferenceExperiment>, String> {
    let path = format!("{FOLDER}/fmi-ls-manifest.xml");
    let Some(bytes) = entries(&path) else { return Ok(Vec::new()) };
    let text = String::from_utf8_lossy(&bytes);
    let document = Document::parse(&text).map_err(|error| format!("{path}: {error}"))?;
    let root = document.root_element();
    let mut found = in_element(root, FOLDER)?;
    for related in root.children().filter(|node| node.tag_name().name() == "Related") {
        let role = related.attribute("role").unwrap_or_default();
        let Some(source) = parse_experiment_file(related, FOLDER, "application/octet-stream")? else {
            continue;
        };
        match role.split('/').next() {
            Some("result") => found.push(ReferenceExperiment {
                name: source.name.clone(),
                results: Some(source),
                ..ReferenceExperiment::default()
            }),
            Some("experiment") => {
                let lacks = || format!("the manifest names {:?}, which is not in the archive", source.name);
                let bytes = entries(&source.path).ok_or_else(lacks)?;
                let text = String::from_utf8_lossy(&bytes);
                let wrong = |error: roxmltree::Error| format!("{}: {error}", source.name);
                let document = Document::parse(&text).map_err(wrong)?;
                let folder = source.path.rsplit_once('/').map_or("", |it| it.0);
                found.extend(in_element(document.root_element(), folder)?);
            }
            _ => {}
        }
    }
    Ok(found)
}

/// The elements `Experiment` of an element of a file in this folder of the archive.
fn in_element(root: Node, folder: &str) -> Result<Vec<ReferenceExperiment>, String> {
    let experiments = root.children().filter(|node| node.tag_name().name() == "Experiment");
    let one = |node: Node| {
        let number = |name: &str| -> Result<Option<f64>, String> {
            let Some(text) = node.attribute(name) else { return Ok(None) };
            let wrong = |_| format!("{name}=\"{text}\" of <Experiment> is no number");
            text.trim().parse().map(Some).map_err(wrong)
        };
        let file = |name: &str, kind: &str| {
            let child = node.children().find(|child| child.tag_name().name() == name);
            child.map_or(Ok(None), |child| parse_experiment_file(child, folder, kind))
        };
        Ok(ReferenceExperiment {
            name: node.attribute("name").unwrap_or("an experiment without a name").to_owned(),
            start: number("startTime")?,
            stop: number("stopTime")?,
            step: number("stepSize")?.filter(|step| *step > 0.0),
            tolerance: number("tolerance")?,
            parameters: file("Parameters", "application/x-ssp-parameter-set")?,
            stimuli: file("Stimuli", "text/csv")?,
            results: file("References", "text/csv")?,
        })
    };
    experiments.map(one).collect()
}

/// The file that an element names relative to a folder of the archive (RFC 3986); none for one that is elsewhere.
fn parse_experiment_file(node: Node, folder: &str, kind: &str) -> Result<Option<ExperimentFile>, String> {
    let element = node.tag_name().name();
    let name = node.attribute("source").ok_or_else(|| format!("<{element}> has no source"))?;
    if name.contains("://") {
        return Ok(None);
    }
    let mut path: Vec<String> = folder.split('/').map(str::to_owned).collect();
    for part in name.split('/') {
        match part {
            "" | "." => {}
            ".." => {
                let outside = || format!("{name:?} of <{element}> leads out of the archive");
                path.pop().ok_or_else(outside)?;
            }
            part => path.push(percent_decode(part)),
        }
    }
    let kind = node.attribute("type").unwrap_or(kind).to_owned();
    Ok(Some(ExperimentFile { name: name.to_owned(), path: path.join("/"), kind }))
}

/// `%20` and the like as the characters that they stand for.
fn percent_decode(text: &str) -> String {
    let bytes = text.as_bytes();
    let (mut found, mut at) = (Vec::new(), 0);
    while at < bytes.len() {
        let digits = bytes.get(at + 1..at + 3).filter(|_| bytes[at] == b'%');
        let digits = digits.and_then(|digits| std::str::from_utf8(digits).ok());
        match digits.and_then(|digits| u8::from_str_radix(digits, 16).ok()) {
            Some(byte) => {
                found.push(byte);
                at += 3;
            }
            None => {
                found.push(bytes[at]);
                at += 1;
            }
        }
    }
    String::from_utf8_lossy(&found).into_owned()
}

/// The values of a parameter set of the standard SSP, by name.
///
/// # Errors
/// When the text is no such set.
pub(super) fn parse_parameter_set(bytes: &[u8]) -> Result<Vec<(String, String)>, String> {
    let text = String::from_utf8_lossy(bytes);
    let document = Document::parse(&text).map_err(|error| error.to_string())?;
    let root = document.root_element();
    if root.tag_name().name() != "ParameterSet" {
        return Err(format!("expected <ParameterSet>, found <{}>", root.tag_name().name()));
    }
    let all = document.descendants().filter(|node| node.tag_name().name() == "Parameter");
    let one = |node: Node| {
        let name = node.attribute("name").ok_or("<Parameter> has no name")?;
        let typed = node.children().find(|child| child.is_element() && child.has_attribute("value"));
        let value = typed.and_then(|typed| typed.attribute("value"));
        let value = value.ok_or_else(|| format!("the parameter {name:?} has no value"))?;
        Ok((name.to_owned(), value.to_owned()))
    };
    all.map(one).collect()
}
