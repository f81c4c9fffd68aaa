//! Writes the description of a system, section 5.

use super::xml::Document;
use super::{Draft, DraftAnnotation, DraftComponent, DraftConnection, DraftConnector, types};
use crate::{BASES, ConnectorKind, Transformation, Type, Unit};

const SPACE: &str = "http://ssp-standard.org/SSP1/";

/// The namespace of annotations of OMSimulator.
const OMS: &str =
    "https://raw.githubusercontent.com/OpenModelica/OMSimulator/master/schema/oms.xsd";
/// The namespace of annotations of libcosim.
const OSP: &str = "http://opensimulationplatform.com/SSP/OSPAnnotations";
const TOOL: &str = concat!("Trackside ", env!("CARGO_PKG_VERSION"));

/// The text of an `.ssd` file.
#[must_use]
pub fn structure(draft: &Draft) -> String {
    let mut xml = Document::new();
    let space = |name: &str| format!("{SPACE}{name}");
    let (structure, common) = (space("SystemStructureDescription"), space("SystemStructureCommon"));
    let mut attributes = vec![("xmlns:ssd", structure.as_str()), ("xmlns:ssc", common.as_str())];
    if draft.step.is_some() {
        // At the root: libcosim takes an attribute of its element for the name of an algorithm.
        attributes.extend([("xmlns:oms", OMS), ("xmlns:osp", OSP)]);
    }
    let version = draft.version().text();
    attributes.extend([("version", version), ("name", &draft.name), ("generationTool", TOOL)]);
    xml.open("ssd:SystemStructureDescription", &attributes);
    xml.open("ssd:System", &[("name", &draft.name)]);
    connectors(&mut xml, &draft.connectors);
    if !draft.components.is_empty() {
        xml.open("ssd:Elements", &[]);
        draft.components.iter().for_each(|it| component(&mut xml, it));
        xml.close();
    }
    if !draft.connections.is_empty() {
        xml.open("ssd:Connections", &[]);
        draft.connections.iter().for_each(|it| connection(&mut xml, it));
        xml.close();
    }
    master(&mut xml, draft);
    xml.close();
    definitions(&mut xml, draft);
    experiment(&mut xml, draft);
    if let Some(found) = &draft.annotation {
        xml.open("ssd:Annotations", &[]);
        annotation(&mut xml, found);
        xml.close();
    }
    xml.finish()
}

fn component(xml: &mut Document, component: &DraftComponent) {
    let mime = "application/x-fmu-sharedlibrary";
    let attributes = [
        ("name", component.name.as_str()),
        ("type", mime),
        ("source", &component.source),
        ("implementation", "CoSimulation"),
    ];
    // Version 1.0 and its readers know `implementation`, whose default is any interface.
    xml.open("ssd:Component", &attributes);
    connectors(xml, &component.connectors);
    if let Some(source) = &component.values {
        xml.open("ssd:ParameterBindings", &[]);
        let mime = "application/x-ssp-parameter-set";
        xml.empty("ssd:ParameterBinding", &[("type", mime), ("source", source)]);
        xml.close();
    }
    xml.close();
}

fn connectors(xml: &mut Document, connectors: &[DraftConnector]) {
    if connectors.is_empty() {
        return;
    }
    xml.open("ssd:Connectors", &[]);
    for connector in connectors {
        let kind = ConnectorKind::ALL.iter().find(|(_, kind)| *kind == connector.kind);
        let kind = kind.map_or("unspecified", |(word, _)| word);
        xml.open("ssd:Connector", &[("name", &connector.name), ("kind", kind)]);
        let element = format!("ssc:{}", types::name(&connector.data_type));
        match (&connector.data_type, &connector.unit) {
            (Type::Float64 | Type::Float32, Some(unit)) => xml.empty(&element, &[("unit", unit)]),
            (Type::Enumeration(Some(found)), _) => xml.empty(&element, &[("name", &found.name)]),
            (Type::Binary { mime }, _) => xml.empty(&element, &[("mime-type", mime)]),
            _ => xml.empty(&element, &[]),
        }
        for size in &connector.dimensions {
            xml.empty("ssc:Dimension", &[("size", &size.to_string())]);
        }
        xml.close();
    }
    xml.close();
}

fn connection(xml: &mut Document, connection: &DraftConnection) {
    let (from, to) = (&connection.from, &connection.to);
    let mut attributes = Vec::new();
    attributes.extend(from.0.as_deref().map(|element| ("startElement", element)));
    attributes.push(("startConnector", from.1.as_str()));
    attributes.extend(to.0.as_deref().map(|element| ("endElement", element)));
    attributes.push(("endConnector", to.1.as_str()));
    let Some(transformation) = &connection.transformation else {
        xml.empty("ssd:Connection", &attributes);
        return;
    };
    attributes.push(("suppressUnitConversion", "true"));
    xml.open("ssd:Connection", &attributes);
    self::transformation(xml, transformation);
    xml.close();
}

fn transformation(xml: &mut Document, transformation: &Transformation) {
    let (name, pairs): (_, Vec<(String, String)>) = match transformation {
        Transformation::Linear { factor, offset } => {
            let (factor, offset) = (types::number(*factor), types::number(*offset));
            let attributes = [("factor", factor.as_str()), ("offset", offset.as_str())];
            xml.empty("ssc:LinearTransformation", &attributes);
            return;
        }
        Transformation::Boolean(map) => (
            "ssc:BooleanMappingTransformation",
            map.iter().map(|(a, b)| (a.to_string(), b.to_string())).collect(),
        ),
        Transformation::Integer(map) => (
            "ssc:IntegerMappingTransformation",
            map.iter().map(|(a, b)| (a.to_string(), b.to_string())).collect(),
        ),
        Transformation::Enumeration(map) => (
            "ssc:EnumerationMappingTransformation",
            map.iter().map(|(a, b)| (a.clone(), b.clone())).collect(),
        ),
    };
    xml.open(name, &[]);
    for (source, target) in &pairs {
        xml.empty("ssc:MapEntry", &[("source", source), ("target", target)]);
    }
    xml.close();
}

fn definitions(xml: &mut Document, draft: &Draft) {
    let enumerations = draft.enumerations();
    if !enumerations.is_empty() {
        xml.open("ssd:Enumerations", &[]);
        for enumeration in enumerations {
            xml.open("ssc:Enumeration", &[("name", &enumeration.name)]);
            for (name, value) in &enumeration.items {
                xml.empty("ssc:Item", &[("name", name), ("value", &value.to_string())]);
            }
            xml.close();
        }
        xml.close();
    }
    if draft.units.is_empty() {
        return;
    }
    xml.open("ssd:Units", &[]);
    draft.units.iter().for_each(|it| unit(xml, it));
    xml.close();
}

fn unit(xml: &mut Document, unit: &Unit) {
    let Some(base) = unit.base else { return };
    xml.open("ssc:Unit", &[("name", &unit.name)]);
    let exponents = BASES.iter().zip(base.exponents).filter(|(_, exponent)| *exponent != 0);
    let mut attributes: Vec<_> =
        exponents.map(|(name, exponent)| (*name, exponent.to_string())).collect();
    attributes.extend((base.factor != 1.0).then(|| ("factor", types::number(base.factor))));
    attributes.extend((base.offset != 0.0).then(|| ("offset", types::number(base.offset))));
    let attributes: Vec<_> = attributes.iter().map(|(key, value)| (*key, value.as_str())).collect();
    xml.empty("ssc:BaseUnit", &attributes);
    xml.close();
}

/// The step for OMSimulator, which looks for it in the system.
fn master(xml: &mut Document, draft: &Draft) {
    let Some(step) = draft.step else { return };
    xml.open("ssd:Annotations", &[]);
    xml.open("ssc:Annotation", &[("type", "org.openmodelica")]);
    xml.open("oms:Annotations", &[]);
    xml.open("oms:SimulationInformation", &[]);
    let step = types::number(step);
    let attributes = [
        ("description", "oms-ma"),
        ("stepSize", step.as_str()),
        ("absoluteTolerance", "0.0001"),
        ("relativeTolerance", "0.0001"),
    ];
    xml.empty("oms:FixedStepMaster", &attributes);
    (0..4).for_each(|_| xml.close());
}

/// Start and stop, and the step for libcosim.
fn experiment(xml: &mut Document, draft: &Draft) {
    let times = [("startTime", draft.experiment.start), ("stopTime", draft.experiment.stop)];
    let times = times.map(|(name, time)| Some((name, types::number(time?))));
    let times: Vec<_> = times.iter().flatten().map(|(name, time)| (*name, time.as_str())).collect();
    let Some(step) = draft.step else {
        if !times.is_empty() {
            xml.empty("ssd:DefaultExperiment", &times);
        }
        return;
    };
    xml.open("ssd:DefaultExperiment", &times);
    xml.open("ssd:Annotations", &[]);
    xml.open("ssc:Annotation", &[("type", "com.opensimulationplatform")]);
    xml.open("osp:Algorithm", &[]);
    xml.empty("osp:FixedStepAlgorithm", &[("baseStepSize", &types::number(step))]);
    (0..4).for_each(|_| xml.close());
}

fn annotation(xml: &mut Document, annotation: &DraftAnnotation) {
    xml.open("ssc:Annotation", &[("type", &annotation.kind)]);
    let mut attributes = vec![("xmlns", annotation.namespace.as_str())];
    attributes
        .extend(annotation.attributes.iter().map(|(key, value)| (key.as_str(), value.as_str())));
    xml.text_element(&annotation.element, &attributes, &annotation.text);
    xml.close();
}
