//! Parses the elements of a system structure description.

use std::collections::BTreeMap;
use std::sync::Arc;

use crate::error::mistake;
use crate::limits::DEEPEST;
use crate::package::Location;
use crate::parameters::{ABOUT, ParameterMapping, ParameterSet, version};
use crate::ssd::{
    Binding, Component, Connection, ConnectionEnd, Connector, Content, Description, Dictionary,
    Element, Source, System,
};
use crate::transformation::{self, TRANSFORMATIONS};
use crate::unit::Definitions;
use crate::value::{TYPES, read_type};
use crate::xml::Element as Xml;
use crate::{ConnectorKind, Dimension, Error};

/// Elements that every element of a model may have; the first of them is not looked at.
const COMMON: [&str; 3] = ["ElementGeometry", "Connectors", "ParameterBindings"];

impl Description {
    /// Reads a <SystemStructureDescription>.
    pub(crate) fn read(root: Xml, location: Location) -> Result<Self, Error> {
        let parts = ["System", "Enumerations", "Units", "DefaultExperiment"];
        root.known(&parts, &ABOUT);
        version(root)?;
        let definitions = Definitions::read(root)?;
        let Some(system) = root.child("System")? else {
            let cure = "write the system";
            return Err(mistake(&root.position(), "the element <System>", "none", cure));
        };
        let (mut start, mut stop, mut stepping) = (None, None, None);
        if let Some(experiment) = root.child("DefaultExperiment")? {
            experiment.known(&[], &["startTime", "stopTime"]);
            (start, stop) = (experiment.number("startTime")?, experiment.number("stopTime")?);
            stepping = experiment.stepping();
        }
        Ok(Description {
            location,
            name: root.required("name")?.to_owned(),
            system: element(system, &definitions, 1)?,
            start,
            stop,
            stepping: stepping.or_else(|| system.stepping()),
            annotations: root.annotations(),
        })
    }
}

fn element(xml: Xml, definitions: &Definitions, depth: usize) -> Result<Element, Error> {
    if depth > DEEPEST {
        let expected = format!("at most {DEEPEST} systems in each other");
        return Err(mistake(&xml.position(), expected, "one more", "nest them less"));
    }
    let name = xml.short("name")?;
    let content = match xml.name() {
        "System" => Content::System(system(xml, definitions, depth)?),
        "Component" => {
            xml.known(&COMMON, &["name", "type", "source", "implementation"]);
            Content::Component(component(xml)?)
        }
        _ => {
            xml.known(&COMMON, &["name", "dictionary"]);
            let dictionary = xml.required("dictionary")?.to_owned();
            Content::Reference(dictionary, xml.position_of("dictionary"))
        }
    };
    Ok(Element {
        name: name.into(),
        position: xml.position(),
        connectors: connectors(xml, definitions)?,
        bindings: bindings(xml)?,
        content,
    })
}

fn system(xml: Xml, definitions: &Definitions, depth: usize) -> Result<System, Error> {
    const OWN: [&str; 5] =
        ["Elements", "Connections", "SignalDictionaries", "SystemGeometry", "GraphicalElements"];
    xml.known(&[&COMMON[..], &OWN].concat(), &["name"]);
    let mut elements = Vec::new();
    if let Some(list) = xml.child("Elements")? {
        let kinds = ["Component", "SignalDictionaryReference", "System"];
        list.known(&kinds, &[]);
        for child in list.children().filter(|child| kinds.contains(&child.name())) {
            elements.push(element(child, definitions, depth + 1)?);
        }
    }
    let connections = xml.listed("Connections", "Connection")?;
    let dictionaries = xml.listed("SignalDictionaries", "SignalDictionary")?;
    Ok(System {
        id: xml.attribute("id").map(str::to_owned),
        elements,
        connections: connections.into_iter().map(connection).collect::<Result<_, _>>()?,
        dictionaries: dictionaries.into_iter().map(dictionary).collect::<Result<_, _>>()?,
    })
}

fn component(xml: Xml) -> Result<Component, Error> {
    let implementation = xml.attribute("implementation").unwrap_or("any");
    let known = ["any", "CoSimulation", "ModelExchange", "ScheduledExecution"];
    if !known.contains(&implementation) {
        return Err(xml.wrong("implementation", &format!("one of {}", known.join(", "))));
    }
    Ok(Component {
        mime: xml.attribute("type").unwrap_or("application/x-fmu-sharedlibrary").to_owned(),
        mime_position: xml.position_of("type"),
        source: xml.attribute("source").map(|x| (x.to_owned(), xml.position_of("source"))),
        implementation: implementation.to_owned(),
    })
}

fn connectors(xml: Xml, definitions: &Definitions) -> Result<Vec<Arc<Connector>>, Error> {
    let list = xml.listed("Connectors", "Connector")?;
    let connectors = list.into_iter().map(|xml| {
        let parts = [&TYPES[..], &["Clock", "Dimension", "ConnectorGeometry"]].concat();
        xml.known(&parts, &["name", "kind"]);
        let word = xml.required("kind")?.trim();
        let kind = ConnectorKind::ALL.iter().find(|(name, _)| *name == word).ok_or_else(|| {
            let names: Vec<_> = ConnectorKind::ALL.iter().map(|(name, _)| *name).collect();
            xml.wrong("kind", &format!("one of {}", names.join(", ")))
        })?;
        signal(xml, kind.1, definitions)
    });
    unique(connectors.collect::<Result<_, _>>()?, "connector")
}

/// A connector, or an entry of a dictionary: both have a name, a type and a size.
fn signal(xml: Xml, kind: ConnectorKind, definitions: &Definitions) -> Result<Connector, Error> {
    // Elements <Clock> with a name say which clock a connector belongs to.
    let is_type = |child: &Xml| {
        TYPES.contains(&child.name())
            || (child.name() == "Clock" && child.attribute("name").is_none())
    };
    let typed = xml.children().find(is_type);
    let dimensions = xml.all("Dimension").map(|xml| {
        xml.known(&[], &["size", "sizeConnector"]);
        let Some(text) = xml.attribute("size") else {
            let connector = xml.attribute("sizeConnector");
            return Ok(connector.map_or(Dimension::Open, |name| Dimension::Of(name.to_owned())));
        };
        let size = text.trim().parse().map(Dimension::Fixed);
        size.map_err(|_| xml.wrong("size", "a whole number such as 3"))
    });
    Ok(Connector {
        name: xml.short("name")?.into(),
        kind,
        data_type: typed.map(|typed| read_type(typed, definitions)),
        unit: typed.and_then(|typed| definitions.unit(typed)),
        dimensions: dimensions.collect::<Result<_, _>>()?,
        position: xml.position(),
    })
}

fn unique(connectors: Vec<Connector>, what: &str) -> Result<Vec<Arc<Connector>>, Error> {
    let mut seen = BTreeMap::new();
    for connector in &connectors {
        if let Some(first) = seen.insert(&connector.name, &connector.position) {
            let found = format!("`{}`, which {first} has already", connector.name);
            let expected = format!("a {what} with a name of its own");
            return Err(mistake(
                &connector.position,
                expected,
                found,
                "rename or remove one of them",
            ));
        }
    }
    Ok(connectors.into_iter().map(Arc::new).collect())
}

fn connection(xml: Xml) -> Result<Connection, Error> {
    const ATTRIBUTES: [&str; 7] = [
        "startElement",
        "startConnector",
        "startIndices",
        "endElement",
        "endConnector",
        "endIndices",
        "suppressUnitConversion",
    ];
    xml.known(&[&TRANSFORMATIONS[..], &["ConnectionGeometry"]].concat(), &ATTRIBUTES);
    for indices in ["startIndices", "endIndices"] {
        if xml.attribute(indices).is_some() {
            let found = format!("the attribute {indices}");
            let cure = "connect whole arrays, or make the elements connectors of their own";
            return Err(mistake(&xml.position_of(indices), "whole connectors", found, cure));
        }
    }
    let end = |element: &str, connector: &str| -> Result<ConnectionEnd, Error> {
        // Some tools write an empty name for the system itself.
        let name = xml.attribute(element).filter(|name| !name.is_empty());
        Ok(ConnectionEnd {
            element: name.map(str::to_owned),
            connector: xml.required(connector)?.to_owned(),
            position: xml.position_of(connector),
        })
    };
    Ok(Connection {
        start: end("startElement", "startConnector")?,
        end: end("endElement", "endConnector")?,
        transformation: Arc::new(transformation::read(xml)?),
        suppress: xml.truth("suppressUnitConversion")?,
        position: xml.position(),
    })
}

fn bindings(xml: Xml) -> Result<Vec<Binding>, Error> {
    let list = xml.listed("ParameterBindings", "ParameterBinding")?;
    list.into_iter().map(binding).collect()
}

fn binding(xml: Xml) -> Result<Binding, Error> {
    let attributes = ["type", "source", "sourceBase", "prefix"];
    xml.known(&["ParameterValues", "ParameterMapping"], &attributes);
    let inline = xml.child("ParameterValues")?;
    let values = source(xml, inline, "application/x-ssp-parameter-set", "ParameterSet", |xml| {
        ParameterSet::read(xml).map(Arc::new)
    })?;
    let mapping = xml.child("ParameterMapping")?.map(|xml| {
        xml.known(&["ParameterMapping"], &["type", "source", "sourceBase"]);
        let mime = "application/x-ssp-parameter-mapping";
        source(xml, Some(xml), mime, "ParameterMapping", |xml| {
            ParameterMapping::read(xml).map(Arc::new)
        })
    });
    let prefix = match xml.attribute("prefix") {
        None | Some("") => String::new(),
        Some(_) => xml.short("prefix")?.to_owned(),
    };
    Ok(Binding { values, mapping: mapping.transpose()?, prefix, position: xml.position() })
}

/// What the attribute `source` refers to, or what stands in `inline`.
fn source<T>(
    xml: Xml,
    inline: Option<Xml>,
    mime: &str,
    root: &str,
    read: impl FnOnce(Xml) -> Result<T, Error>,
) -> Result<Source<T>, Error> {
    if xml.attribute("type").is_some_and(|found| found != mime) {
        return Err(xml.wrong("type", mime));
    }
    let content = inline.map(|xml| xml.child(root)).transpose()?.flatten();
    match (xml.attribute("source"), content) {
        (Some(_), Some(content)) => {
            let expected = "the attribute source or contents in the file";
            Err(mistake(&content.position(), expected, "both", "remove one of them"))
        }
        (Some(address), None) => {
            let in_component = match xml.attribute("sourceBase").unwrap_or("SSD") {
                "SSD" => false,
                "component" => true,
                _ => return Err(xml.wrong("sourceBase", "SSD or component")),
            };
            let position = xml.position_of("source");
            Ok(Source::File { address: address.to_owned(), in_component, position })
        }
        (None, Some(content)) => read(content).map(Source::Inline),
        (None, None) => {
            let expected = format!("the attribute source or an element <{root}>");
            Err(mistake(&xml.position(), expected, "neither", "write one of them"))
        }
    }
}

fn dictionary(xml: Xml) -> Result<Dictionary, Error> {
    xml.known(&["SignalDictionary"], &["name", "type", "source"]);
    let mime = "application/x-ssp-signal-dictionary";
    let entries =
        source(xml, Some(xml), mime, "SignalDictionary", |xml| entries(xml).map(Arc::new))?;
    Ok(Dictionary { name: xml.required("name")?.to_owned(), position: xml.position(), entries })
}

/// Reads a <SignalDictionary>, section 8: its entries are connectors that lead anywhere.
pub(crate) fn entries(root: Xml) -> Result<Vec<Arc<Connector>>, Error> {
    root.known(&["DictionaryEntry", "Enumerations", "Units"], &ABOUT);
    version(root)?;
    let definitions = Definitions::read(root)?;
    let entries = root.all("DictionaryEntry").map(|xml| {
        xml.known(&[&TYPES[..], &["Clock", "Dimension"]].concat(), &["name"]);
        signal(xml, ConnectorKind::InOut, &definitions)
    });
    unique(entries.collect::<Result<_, _>>()?, "entry")
}
