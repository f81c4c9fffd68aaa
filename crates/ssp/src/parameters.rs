//! Parses parameter sets and parameter mappings (sections 6 and 7 of the standard).

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use crate::error::mistake;
use crate::notes::Notes;
use crate::transformation::{self, TRANSFORMATIONS};
use crate::unit::Definitions;
use crate::value::{TYPES, read_value};
use crate::xml::Element;
use crate::{Error, SourcePosition, Transformation, Unit, Value};

/// What the outermost elements of files may have beside their contents.
pub(crate) const ABOUT: [&str; 8] = [
    "version",
    "name",
    "author",
    "fileversion",
    "copyright",
    "license",
    "generationTool",
    "generationDateAndTime",
];

/// The contents of an .ssv file.
#[derive(Debug)]
pub(crate) struct ParameterSet {
    parameters: Vec<Parameter>,
}

#[derive(Debug)]
struct Parameter {
    name: String,
    value: Arc<Value>,
    unit: Option<Arc<Unit>>,
    position: SourcePosition,
}

/// The contents of an .ssm file.
#[derive(Debug)]
pub(crate) struct ParameterMapping {
    entries: Vec<Entry>,
}

#[derive(Debug)]
struct Entry {
    source: String,
    target: String,
    transformation: Arc<Transformation>,
    suppress: bool,
    position: SourcePosition,
}

/// A value for the parameter that has this name in the system or component of its binding.
#[derive(Debug, Clone)]
pub(crate) struct Assignment {
    pub(crate) name: String,
    pub(crate) value: Arc<Value>,
    pub(crate) unit: Option<Arc<Unit>>,
    /// What happens to the value after its unit was converted.
    pub(crate) transformation: Arc<Transformation>,
    pub(crate) suppress: bool,
    /// Where the value is written.
    pub(crate) position: SourcePosition,
}

impl ParameterSet {
    /// Reads a <ParameterSet>.
    pub(crate) fn read(root: Element) -> Result<Self, Error> {
        root.known(&["Parameters", "Enumerations", "Units"], &ABOUT);
        version(root)?;
        let definitions = Definitions::read(root)?;
        let mut parameters = Vec::new();
        let mut names = BTreeSet::new();
        for element in root.listed("Parameters", "Parameter")? {
            element.known(&[&TYPES[..], &["Dimension"]].concat(), &["name"]);
            let name = element.short("name")?;
            if !names.insert(name) {
                return Err(element.wrong("name", "a name that no other parameter of the set has"));
            }
            let (typed, value) = read_value(element)?;
            let unit = definitions.unit(typed);
            let (name, value) = (name.to_owned(), Arc::new(value));
            parameters.push(Parameter { name, value, unit, position: typed.position() });
        }
        Ok(ParameterSet { parameters })
    }

    /// What a binding assigns. Section 5.2.3: the prefix stands before all names of the set before anything
    /// else happens; with a mapping, only mapped parameters count.
    pub(crate) fn assignments(
        &self,
        prefix: &str,
        mapping: Option<&ParameterMapping>,
        notes: &Notes,
    ) -> Result<Vec<Assignment>, Error> {
        let identity = Arc::new(Transformation::IDENTITY);
        let Some(mapping) = mapping else {
            let all = self.parameters.iter().map(|parameter| Assignment {
                name: format!("{prefix}{}", parameter.name),
                value: Arc::clone(&parameter.value),
                unit: parameter.unit.clone(),
                transformation: Arc::clone(&identity),
                suppress: false,
                position: parameter.position.clone(),
            });
            return Ok(all.collect());
        };
        let named: BTreeMap<String, &Parameter> =
            self.parameters.iter().map(|x| (format!("{prefix}{}", x.name), x)).collect();
        let mut assignments = Vec::new();
        for entry in &mapping.entries {
            let Some(parameter) = named.get(&entry.source) else {
                let Entry { position, source, .. } = entry;
                notes.add(|| {
                    format!(
                        "{position}: the parameter `{source}` has no value, so nothing is mapped"
                    )
                });
                continue;
            };
            if entry.transformation.apply(&parameter.value).is_none() {
                return Err(mistake(
                    &entry.position,
                    format!("a transformation for the value at {}", parameter.position),
                    format!("one for {}", entry.transformation.purpose()),
                    "use the transformation for the type of the value",
                ));
            }
            assignments.push(Assignment {
                name: entry.target.clone(),
                value: Arc::clone(&parameter.value),
                unit: parameter.unit.clone(),
                transformation: Arc::clone(&entry.transformation),
                suppress: entry.suppress,
                position: parameter.position.clone(),
            });
        }
        Ok(assignments)
    }
}

impl ParameterMapping {
    /// Reads a <ParameterMapping>.
    pub(crate) fn read(root: Element) -> Result<Self, Error> {
        root.known(&["MappingEntry"], &ABOUT);
        version(root)?;
        let mut entries = Vec::new();
        let mut targets = BTreeSet::new();
        for element in root.all("MappingEntry") {
            element.known(&TRANSFORMATIONS, &["source", "target", "suppressUnitConversion"]);
            let target = element.short("target")?;
            if !targets.insert(target) {
                return Err(element.wrong("target", "a target that no other entry has"));
            }
            // OMSimulator writes an empty source for what nothing is mapped to.
            if element.attribute("source") == Some("") {
                let position = element.position();
                element.notes().add(|| {
                    format!("{position}: `{target}` has no source, so nothing is mapped to it")
                });
                continue;
            }
            entries.push(Entry {
                source: element.short("source")?.to_owned(),
                target: target.to_owned(),
                transformation: Arc::new(transformation::read(element)?),
                suppress: element.truth("suppressUnitConversion")?,
                position: element.position(),
            });
        }
        Ok(ParameterMapping { entries })
    }
}

/// Refuses files of versions that are not known.
pub(crate) fn version(root: Element) -> Result<(), Error> {
    match root.attribute("version").map(str::trim) {
        Some("1.0" | "2.0") => Ok(()),
        // Parts inside of another file are of its version.
        None => Ok(()),
        Some(_) => Err(root.wrong("version", "version 1.0 or 2.0")),
    }
}
