//! Parses parameter sets and parameter mappings (sections 6 and 7 of the standard).

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use crate::error::mistake_error;
use crate::notes::ReadingNotes;
use crate::transformation::{self, TRANSFORMATIONS};
use crate::unit::SspDefinitions;
use crate::value::{TYPES, parse_parameter_value};
use crate::xml::XmlElement;
use crate::{Error, SourcePosition, SspUnit, SspValue, ValueTransformation};

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
    parameters: Vec<SetParameter>,
}

#[derive(Debug)]
struct SetParameter {
    name: String,
    value: Arc<SspValue>,
    unit: Option<Arc<SspUnit>>,
    position: SourcePosition,
}

/// The contents of an .ssm file.
#[derive(Debug)]
pub(crate) struct ParameterMapping {
    entries: Vec<MappingEntry>,
}

#[derive(Debug)]
struct MappingEntry {
    source: String,
    target: String,
    transformation: Arc<ValueTransformation>,
    suppress: bool,
    position: SourcePosition,
}

/// A value for the parameter that has this name in the system or component of its binding.
#[derive(Debug, Clone)]
pub(crate) struct ParameterAssignment {
    pub(crate) name: String,
    pub(crate) value: Arc<SspValue>,
    pub(crate) unit: Option<Arc<SspUnit>>,
    /// What happens to the value after its unit was converted.
    pub(crate) transformation: Arc<ValueTransformation>,
    pub(crate) suppress: bool,
    /// Where the value is written.
    pub(crate) position: SourcePosition,
}

impl ParameterSet {
    /// Reads a <ParameterSet>.
    pub(crate) fn read(root: XmlElement) -> Result<Self, Error> {
        root.note_unknown_content(&["Parameters", "Enumerations", "Units"], &ABOUT);
        check_version(root)?;
        let definitions = SspDefinitions::read(root)?;
        let mut parameters = Vec::new();
        let mut names = BTreeSet::new();
        for element in root.listed_children("Parameters", "Parameter")? {
            element.note_unknown_content(&[&TYPES[..], &["Dimension"]].concat(), &["name"]);
            let name = element.short_name_attribute("name")?;
            if !names.insert(name) {
                return Err(
                    element.wrong_attribute_error("name", "a name that no other parameter of the set has")
                );
            }
            let (typed, value) = parse_parameter_value(element)?;
            let unit = definitions.unit_of_element(typed);
            let (name, value) = (name.to_owned(), Arc::new(value));
            parameters.push(SetParameter { name, value, unit, position: typed.position() });
        }
        Ok(ParameterSet { parameters })
    }

    /// What a binding assigns. Section 5.2.3: the prefix stands before all names of the set before anything
    /// else happens; with a mapping, only mapped parameters count.
    pub(crate) fn assignments(
        &self,
        prefix: &str,
        mapping: Option<&ParameterMapping>,
        notes: &ReadingNotes,
    ) -> Result<Vec<ParameterAssignment>, Error> {
        let identity = Arc::new(ValueTransformation::IDENTITY);
        let Some(mapping) = mapping else {
            let all = self.parameters.iter().map(|parameter| ParameterAssignment {
                name: format!("{prefix}{}", parameter.name),
                value: Arc::clone(&parameter.value),
                unit: parameter.unit.clone(),
                transformation: Arc::clone(&identity),
                suppress: false,
                position: parameter.position.clone(),
            });
            return Ok(all.collect());
        };
        let named: BTreeMap<String, &SetParameter> =
            self.parameters.iter().map(|x| (format!("{prefix}{}", x.name), x)).collect();
        let mut assignments = Vec::new();
        for entry in &mapping.entries {
            let Some(parameter) = named.get(&entry.source) else {
                let MappingEntry { position, source, .. } = entry;
                notes.add_note(|| {
                    format!("{position}: the parameter `{source}` has no value, so nothing is mapped")
                });
                continue;
            };
            if entry.transformation.apply(&parameter.value).is_none() {
                return Err(mistake_error(
                    &entry.position,
                    format!("a transformation for the value at {}", parameter.position),
                    format!("one for {}", entry.transformation.purpose_text()),
                    "use the transformation for the type of the value",
                ));
            }
            assignments.push(ParameterAssignment {
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
    pub(crate) fn read(root: XmlElement) -> Result<Self, Error> {
        root.note_unknown_content(&["MappingEntry"], &ABOUT);
        check_version(root)?;
        let mut entries = Vec::new();
        let mut targets = BTreeSet::new();
        for element in root.children_named("MappingEntry") {
            element.note_unknown_content(&TRANSFORMATIONS, &["source", "target", "suppressUnitConversion"]);
            let target = element.short_name_attribute("target")?;
            if !targets.insert(target) {
                return Err(element.wrong_attribute_error("target", "a target that no other entry has"));
            }
            // OMSimulator writes an empty source for what nothing is mapped to.
            if element.attribute("source") == Some("") {
                let position = element.position();
                element
                    .reading_notes()
                    .add_note(|| format!("{position}: `{target}` has no source, so nothing is mapped to it"));
                continue;
            }
            entries.push(MappingEntry {
                source: element.short_name_attribute("source")?.to_owned(),
                target: target.to_owned(),
                transformation: Arc::new(transformation::parse_transformation(element)?),
                suppress: element.bool_attribute("suppressUnitConversion")?,
                position: element.position(),
            });
        }
        Ok(ParameterMapping { entries })
    }
}

/// Refuses files of versions that are not known.
pub(crate) fn check_version(root: XmlElement) -> Result<(), Error> {
    match root.attribute("version").map(str::trim) {
        Some("1.0" | "2.0") => Ok(()),
        // Parts inside of another file are of its version.
        None => Ok(()),
        Some(_) => Err(root.wrong_attribute_error("version", "version 1.0 or 2.0")),
    }
}
