//! Parses the elements of a system structure description.

use std::collections::BTreeMap;
use std::sync::Arc;

use crate::error::mistake_error;
use crate::limits::DEEPEST;
use crate::package::PackageLocation;
use crate::parameters::{ABOUT, ParameterMapping, ParameterSet, check_version};
use crate::ssd::{
    ConnectionEnd, ElementContent, InlineOrFile, ParameterBinding, SignalDictionary, SsdComponent,
    SsdConnection, SsdConnector, SsdSystem, SystemDescription, SystemElement,
};
use crate::transformation::{self, TRANSFORMATIONS};
use crate::unit::SspDefinitions;
use crate::value::{TYPES, parse_type};
use crate::xml::XmlElement as Xml;
use crate::{ArrayDimension, ConnectorKind, Error};

/// Elements that every element of a model may have; the first of them is not looked at.
const COMMON: [&str; 3] = ["ElementGeometry", "Connectors", "ParameterBindings"];

impl SystemDescription {
    /// Reads a <SystemStructureDescription>.
    pub(crate) fn read(root: Xml, location: PackageLocation) -> Result<Self, Error> {
        let parts = ["System", "Enumerations", "Units", "DefaultExperiment"];
        root.note_unknown_content(&parts, &ABOUT);
        check_version(root)?;
        let definitions = SspDefinitions::read(root)?;
        let Some(system) = root.only_child("System")? else {
            let cure = "write the system";
            return Err(mistake_error(&root.position(), "the element <System>", "none", cure));
        };
        let (mut start, mut stop, mut stepping) = (None, None, None);
        if let Some(experiment) = root.only_child("DefaultExperiment")? {
            experiment.note_unknown_content(&[], &["startTime", "stopTime"]);
            (start, stop) =
                (experiment.number_attribute("startTime")?, experiment.number_attribute("stopTime")?);
            stepping = experiment.step_settings();
        }
        Ok(SystemDescription {
            location,
            name: root.required_attribute("name")?.to_owned(),
            system: parse_element(system, &definitions, 1)?,
            start,
            stop,
            stepping: stepping.or_else(|| system.step_settings()),
            annotations: root.annotations(),
        })
    }
}

fn parse_element(xml: Xml, definitions: &SspDefinitions, depth: usize) -> Result<SystemElement, Error> {
    if depth > DEEPEST {
        let expected = format!("at most {DEEPEST} systems in each other");
        return Err(mistake_error(&xml.position(), expected, "one more", "nest them less"));
    }
    let name = xml.short_name_attribute("name")?;
    let content = match xml.local_name() {
        "System" => ElementContent::System(parse_system(xml, definitions, depth)?),
        "Component" => {
            xml.note_unknown_content(&COMMON, &["name", "type", "source", "implementation"]);
            ElementContent::Component(parse_component(xml)?)
        }
        _ => {
            xml.note_unknown_content(&COMMON, &["name", "dictionary"]);
            let dictionary = xml.required_attribute("dictionary")?.to_owned();
            ElementContent::Reference(dictionary, xml.attribute_position("dictionary"))
        }
    };
    Ok(SystemElement {
        name: name.into(),
        position: xml.position(),
        connectors: parse_connectors(xml, definitions)?,
        bindings: parse_bindings(xml)?,
        content,
    })
}

fn parse_system(xml: Xml, definitions: &SspDefinitions, depth: usize) -> Result<SsdSystem, Error> {
    const OWN: [&str; 5] =
        ["Elements", "Connections", "SignalDictionaries", "SystemGeometry", "GraphicalElements"];
    xml.note_unknown_content(&[&COMMON[..], &OWN].concat(), &["name"]);
    let mut elements = Vec::new();
    if let Some(list) = xml.only_child("Elements")? {
        let kinds = ["Component", "SignalDictionaryReference", "System"];
        list.note_unknown_content(&kinds, &[]);
        for child in list.standard_children().filter(|child| kinds.contains(&child.local_name())) {
            elements.push(parse_element(child, definitions, depth + 1)?);
        }
    }
    let connections = xml.listed_children("Connections", "Connection")?;
    let dictionaries = xml.listed_children("SignalDictionaries", "SignalDictionary")?;
    Ok(SsdSystem {
        id: xml.attribute("id").map(str::to_owned),
        elements,
        connections: connections.into_iter().map(parse_connection).collect::<Result<_, _>>()?,
        dictionaries: dictionaries.into_iter().map(parse_dictionary).collect::<Result<_, _>>()?,
    })
}

fn parse_component(xml: Xml) -> Result<SsdComponent, Error> {
    let implementation = xml.attribute("implementation").unwrap_or("any");
    let known = ["any", "CoSimulation", "ModelExchange", "ScheduledExecution"];
    if !known.contains(&implementation) {
        return Err(xml.wrong_attribute_error("implementation", &format!("one of {}", known.join(", "))));
    }
    Ok(SsdComponent {
        mime: xml.attribute("type").unwrap_or("application/x-fmu-sharedlibrary").to_owned(),
        mime_position: xml.attribute_position("type"),
        source: xml.attribute("source").map(|x| (x.to_owned(), xml.attribute_position("source"))),
        implementation: implementation.to_owned(),
    })
}

fn parse_connectors(xml: Xml, definitions: &SspDefinitions) -> Result<Vec<Arc<SsdConnector>>, Error> {
    let list = xml.listed_children("Connectors", "Connector")?;
    let connectors = list.into_iter().map(|xml| {
        let parts = [&TYPES[..], &["Clock", "Dimension", "ConnectorGeometry"]].concat();
        xml.note_unknown_content(&parts, &["name", "kind"]);
        let word = xml.required_attribute("kind")?.trim();
        let kind = ConnectorKind::ALL.iter().find(|(name, _)| *name == word).ok_or_else(|| {
            let names: Vec<_> = ConnectorKind::ALL.iter().map(|(name, _)| *name).collect();
            xml.wrong_attribute_error("kind", &format!("one of {}", names.join(", ")))
        })?;
        parse_signal(xml, kind.1, definitions)
    });
    check_unique_names(connectors.collect::<Result<_, _>>()?, "connector")
}

/// A connector, or an entry of a dictionary: both have a name, a type and a size.
fn parse_signal(xml: Xml, kind: ConnectorKind, definitions: &SspDefinitions) -> Result<SsdConnector, Error> {
    // Elements <Clock> with a name say which clock a connector belongs to.
    let is_type = |child: &Xml| {
        TYPES.contains(&child.local_name())
            || (child.local_name() == "Clock" && child.attribute("name").is_none())
    };
    let typed = xml.standard_children().find(is_type);
    let dimensions = xml.children_named("Dimension").map(|xml| {
        xml.note_unknown_content(&[], &["size", "sizeConnector"]);
        let Some(text) = xml.attribute("size") else {
            let connector = xml.attribute("sizeConnector");
            return Ok(connector.map_or(ArrayDimension::Open, |name| ArrayDimension::Of(name.to_owned())));
        };
        let size = text.trim().parse().map(ArrayDimension::Fixed);
        size.map_err(|_| xml.wrong_attribute_error("size", "a whole number such as 3"))
    });
    Ok(SsdConnector {
        name: xml.short_name_attribute("name")?.into(),
        kind,
        data_type: typed.map(|typed| parse_type(typed, definitions)),
        unit: typed.and_then(|typed| definitions.unit_of_element(typed)),
        dimensions: dimensions.collect::<Result<_, _>>()?,
        position: xml.position(),
    })
}

fn check_unique_names(connectors: Vec<SsdConnector>, what: &str) -> Result<Vec<Arc<SsdConnector>>, Error> {
    let mut seen = BTreeMap::new();
    for connector in &connectors {
        if let Some(first) = seen.insert(&connector.name, &connector.position) {
            let found = format!("`{}`, which {first} has already", connector.name);
            let expected = format!("a {what} with a name of its own");
            return Err(mistake_error(&connector.position, expected, found, "rename or remove one of them"));
        }
    }
    Ok(connectors.into_iter().map(Arc::new).collect())
}

fn parse_connection(xml: Xml) -> Result<SsdConnection, Error> {
    const ATTRIBUTES: [&str; 7] = [
        "startElement",
        "startConnector",
        "startIndices",
        "endElement",
        "endConnector",
        "endIndices",
        "suppressUnitConversion",
    ];
    xml.note_unknown_content(&[&TRANSFORMATIONS[..], &["ConnectionGeometry"]].concat(), &ATTRIBUTES);
    for indices in ["startIndices", "endIndices"] {
        if xml.attribute(indices).is_some() {
            let found = format!("the attribute {indices}");
            let cure = "connect whole arrays, or make the elements connectors of their own";
            return Err(mistake_error(&xml.attribute_position(indices), "whole connectors", found, cure));
        }
    }
    let end = |element: &str, connector: &str| -> Result<ConnectionEnd, Error> {
        // Some tools write an empty name for the system itself.
        let name = xml.attribute(element).filter(|name| !name.is_empty());
        Ok(ConnectionEnd {
            element: name.map(str::to_owned),
            connector: xml.required_attribute(connector)?.to_owned(),
            position: xml.attribute_position(connector),
        })
    };
    Ok(SsdConnection {
        start: end("startElement", "startConnector")?,
        end: end("endElement", "endConnector")?,
        transformation: Arc::new(transformation::parse_transformation(xml)?),
        suppress: xml.bool_attribute("suppressUnitConversion")?,
        position: xml.position(),
    })
}

fn parse_bindings(xml: Xml) -> Result<Vec<ParameterBinding>, Error> {
    let list = xml.listed_children("ParameterBindings", "ParameterBinding")?;
    list.into_iter().map(parse_binding).collect()
}

fn parse_binding(xml: Xml) -> Result<ParameterBinding, Error> {
    let attributes = ["type", "source", "sourceBase", "prefix"];
    xml.note_unknown_content(&["ParameterValues", "ParameterMapping"], &attributes);
    let inline = xml.only_child("ParameterValues")?;
    let values = parse_source(xml, inline, "application/x-ssp-parameter-set", "ParameterSet", |xml| {
        ParameterSet::read(xml).map(Arc::new)
    })?;
    let mapping = xml.only_child("ParameterMapping")?.map(|xml| {
        xml.note_unknown_content(&["ParameterMapping"], &["type", "source", "sourceBase"]);
        let mime = "application/x-ssp-parameter-mapping";
        parse_source(xml, Some(xml), mime, "ParameterMapping", |xml| {
            ParameterMapping::read(xml).map(Arc::new)
        })
    });
    let prefix = match xml.attribute("prefix") {
        None | Some("") => String::new(),
        Some(_) => xml.short_name_attribute("prefix")?.to_owned(),
    };
    Ok(ParameterBinding { values, mapping: mapping.transpose()?, prefix, position: xml.position() })
}

/// What the attribute `source` refers to, or what stands in `inline`.
fn parse_source<T>(
    xml: Xml,
    inline: Option<Xml>,
    mime: &str,
    root: &str,
    read: impl FnOnce(Xml) -> Result<T, Error>,
) -> Result<InlineOrFile<T>, Error> {
    if xml.attribute("type").is_some_and(|found| found != mime) {
        return Err(xml.wrong_attribute_error("type", mime));
    }
    let content = inline.map(|xml| xml.only_child(root)).transpose()?.flatten();
    match (xml.attribute("source"), content) {
        (Some(_), Some(content)) => {
            let expected = "the attribute source or contents in the file";
            Err(mistake_error(&content.position(), expected, "both", "remove one of them"))
        }
        (Some(address), None) => {
            let in_component = match xml.attribute("sourceBase").unwrap_or("SSD") {
                "SSD" => false,
                "component" => true,
                _ => return Err(xml.wrong_attribute_error("sourceBase", "SSD or component")),
            };
            let position = xml.attribute_position("source");
            Ok(InlineOrFile::File { address: address.to_owned(), in_component, position })
        }
        (None, Some(content)) => read(content).map(InlineOrFile::Inline),
        (None, None) => {
            let expected = format!("the attribute source or an element <{root}>");
            Err(mistake_error(&xml.position(), expected, "neither", "write one of them"))
        }
    }
}

fn parse_dictionary(xml: Xml) -> Result<SignalDictionary, Error> {
    xml.note_unknown_content(&["SignalDictionary"], &["name", "type", "source"]);
    let mime = "application/x-ssp-signal-dictionary";
    let entries = parse_source(xml, Some(xml), mime, "SignalDictionary", |xml| {
        parse_dictionary_entries(xml).map(Arc::new)
    })?;
    Ok(SignalDictionary {
        name: xml.required_attribute("name")?.to_owned(),
        position: xml.position(),
        entries,
    })
}

/// Reads a <SignalDictionary>, section 8: its entries are connectors that lead anywhere.
pub(crate) fn parse_dictionary_entries(root: Xml) -> Result<Vec<Arc<SsdConnector>>, Error> {
    root.note_unknown_content(&["DictionaryEntry", "Enumerations", "Units"], &ABOUT);
    check_version(root)?;
    let definitions = SspDefinitions::read(root)?;
    let entries = root.children_named("DictionaryEntry").map(|xml| {
        xml.note_unknown_content(&[&TYPES[..], &["Clock", "Dimension"]].concat(), &["name"]);
        parse_signal(xml, ConnectorKind::InOut, &definitions)
    });
    check_unique_names(entries.collect::<Result<_, _>>()?, "entry")
}
