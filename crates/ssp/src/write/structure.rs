//! Writes the description of a system, section 5.

use super::xml::XmlWriter;
use super::{DraftAnnotation, DraftComponent, DraftConnection, DraftConnector, SystemDraft, types};
use crate::{BASES, ConnectorKind, SspType, SspUnit, ValueTransformation};

const SPACE: &str = "http://ssp-standard.org/SSP1/";

/// The namespace of annotations of OMSimulator.
const OMS: &str = "https://raw.githubusercontent.com/OpenModelica/OMSimulator/master/schema/oms.xsd";
/// The namespace of annotations of libcosim.
const OSP: &str = "http://opensimulationplatform.com/SSP/OSPAnnotations";
const TOOL: &str = concat!("Trackside ", env!("CARGO_PKG_VERSION"));

/// The text of an `.ssd` file.
#[must_use]
pub fn system_structure_xml(draft: &SystemDraft) -> String {
    let mut xml = XmlWriter::new();
    let space = |name: &str| format!("{SPACE}{name}");
    let (structure, common) = (space("SystemStructureDescription"), space("SystemStructureCommon"));
    let mut attributes = vec![("xmlns:ssd", structure.as_str()), ("xmlns:ssc", common.as_str())];
    if draft.step.is_some() {
        // At the root: libcosim takes an attribute of its element for the name of an algorithm.
        attributes.extend([("xmlns:oms", OMS), ("xmlns:osp", OSP)]);
    }
    let version = draft.required_version().version_text();
    attributes.extend([("version", version), ("name", &draft.name), ("generationTool", TOOL)]);
    xml.open_element("ssd:SystemStructureDescription", &attributes);
    xml.open_element("ssd:System", &[("name", &draft.name)]);
    write_connectors(&mut xml, &draft.connectors);
    if !draft.components.is_empty() {
        xml.open_element("ssd:Elements", &[]);
        draft.components.iter().for_each(|it| write_component(&mut xml, it));
        xml.close_element();
    }
    if !draft.connections.is_empty() {
        xml.open_element("ssd:Connections", &[]);
        draft.connections.iter().for_each(|it| write_connection(&mut xml, it));
        xml.close_element();
    }
    write_omsimulator_step(&mut xml, draft);
    xml.close_element();
    write_definitions(&mut xml, draft);
    write_default_experiment(&mut xml, draft);
    if let Some(found) = &draft.annotation {
        xml.open_element("ssd:Annotations", &[]);
        write_annotation(&mut xml, found);
        xml.close_element();
    }
    xml.finish()
}

fn write_component(xml: &mut XmlWriter, component: &DraftComponent) {
    let mime = "application/x-fmu-sharedlibrary";
    let attributes = [
        ("name", component.name.as_str()),
        ("type", mime),
        ("source", &component.source),
        ("implementation", &component.implementation),
    ];
    // Version 1.0 and its readers know `implementation`, whose default is any interface.
    xml.open_element("ssd:Component", &attributes);
    write_connectors(xml, &component.connectors);
    if let Some(source) = &component.values {
        xml.open_element("ssd:ParameterBindings", &[]);
        let mime = "application/x-ssp-parameter-set";
        xml.write_empty_element("ssd:ParameterBinding", &[("type", mime), ("source", source)]);
        xml.close_element();
    }
    xml.close_element();
}

fn write_connectors(xml: &mut XmlWriter, connectors: &[DraftConnector]) {
    if connectors.is_empty() {
        return;
    }
    xml.open_element("ssd:Connectors", &[]);
    for connector in connectors {
        let kind = ConnectorKind::ALL.iter().find(|(_, kind)| *kind == connector.kind);
        let kind = kind.map_or("unspecified", |(word, _)| word);
        xml.open_element("ssd:Connector", &[("name", &connector.name), ("kind", kind)]);
        let element = format!("ssc:{}", types::type_element_name(&connector.data_type));
        match (&connector.data_type, &connector.unit) {
            (SspType::Float64 | SspType::Float32, Some(unit)) => {
                xml.write_empty_element(&element, &[("unit", unit)])
            }
            (SspType::Enumeration(Some(found)), _) => {
                xml.write_empty_element(&element, &[("name", &found.name)])
            }
            (SspType::Binary { mime }, _) => xml.write_empty_element(&element, &[("mime-type", mime)]),
            _ => xml.write_empty_element(&element, &[]),
        }
        for size in &connector.dimensions {
            xml.write_empty_element("ssc:Dimension", &[("size", &size.to_string())]);
        }
        xml.close_element();
    }
    xml.close_element();
}

fn write_connection(xml: &mut XmlWriter, connection: &DraftConnection) {
    let (from, to) = (&connection.from, &connection.to);
    let mut attributes = Vec::new();
    attributes.extend(from.0.as_deref().map(|element| ("startElement", element)));
    attributes.push(("startConnector", from.1.as_str()));
    attributes.extend(to.0.as_deref().map(|element| ("endElement", element)));
    attributes.push(("endConnector", to.1.as_str()));
    let Some(transformation) = &connection.transformation else {
        xml.write_empty_element("ssd:Connection", &attributes);
        return;
    };
    attributes.push(("suppressUnitConversion", "true"));
    xml.open_element("ssd:Connection", &attributes);
    self::write_transformation(xml, transformation);
    xml.close_element();
}

fn write_transformation(xml: &mut XmlWriter, transformation: &ValueTransformation) {
    let (name, pairs): (_, Vec<(String, String)>) = match transformation {
        ValueTransformation::Linear { factor, offset } => {
            let (factor, offset) = (types::format_number(*factor), types::format_number(*offset));
            let attributes = [("factor", factor.as_str()), ("offset", offset.as_str())];
            xml.write_empty_element("ssc:LinearTransformation", &attributes);
            return;
        }
        ValueTransformation::Boolean(map) => (
            "ssc:BooleanMappingTransformation",
            map.iter().map(|(a, b)| (a.to_string(), b.to_string())).collect(),
        ),
        ValueTransformation::Integer(map) => (
            "ssc:IntegerMappingTransformation",
            map.iter().map(|(a, b)| (a.to_string(), b.to_string())).collect(),
        ),
        ValueTransformation::Enumeration(map) => (
            "ssc:EnumerationMappingTransformation",
            map.iter().map(|(a, b)| (a.clone(), b.clone())).collect(),
        ),
    };
    xml.open_element(name, &[]);
    for (source, target) in &pairs {
        xml.write_empty_element("ssc:MapEntry", &[("source", source), ("target", target)]);
    }
    xml.close_element();
}

fn write_definitions(xml: &mut XmlWriter, draft: &SystemDraft) {
    let enumerations = draft.distinct_enumerations();
    if !enumerations.is_empty() {
        xml.open_element("ssd:Enumerations", &[]);
        for enumeration in enumerations {
            xml.open_element("ssc:Enumeration", &[("name", &enumeration.name)]);
            for (name, value) in &enumeration.items {
                xml.write_empty_element("ssc:Item", &[("name", name), ("value", &value.to_string())]);
            }
            xml.close_element();
        }
        xml.close_element();
    }
    if draft.units.is_empty() {
        return;
    }
    xml.open_element("ssd:Units", &[]);
    draft.units.iter().for_each(|it| write_unit(xml, it));
    xml.close_element();
}

fn write_unit(xml: &mut XmlWriter, unit: &SspUnit) {
    let Some(base) = unit.base else { return };
    xml.open_element("ssc:Unit", &[("name", &unit.name)]);
    let exponents = BASES.iter().zip(base.exponents).filter(|(_, exponent)| *exponent != 0);
    let mut attributes: Vec<_> = exponents.map(|(name, exponent)| (*name, exponent.to_string())).collect();
    attributes.extend((base.factor != 1.0).then(|| ("factor", types::format_number(base.factor))));
    attributes.extend((base.offset != 0.0).then(|| ("offset", types::format_number(base.offset))));
    let attributes: Vec<_> = attributes.iter().map(|(key, value)| (*key, value.as_str())).collect();
    xml.write_empty_element("ssc:BaseUnit", &attributes);
    xml.close_element();
}

/// The step for OMSimulator, which looks for it in the system.
fn write_omsimulator_step(xml: &mut XmlWriter, draft: &SystemDraft) {
    let Some(step) = draft.step else { return };
    xml.open_element("ssd:Annotations", &[]);
    xml.open_element("ssc:Annotation", &[("type", "org.openmodelica")]);
    xml.open_element("oms:Annotations", &[]);
    xml.open_element("oms:SimulationInformation", &[]);
    let step = types::format_number(step);
    let attributes = [
        ("description", "oms-ma"),
        ("stepSize", step.as_str()),
        ("absoluteTolerance", "0.0001"),
        ("relativeTolerance", "0.0001"),
    ];
    xml.write_empty_element("oms:FixedStepMaster", &attributes);
    (0..4).for_each(|_| xml.close_element());
}

/// Start and stop, and the step for libcosim.
fn write_default_experiment(xml: &mut XmlWriter, draft: &SystemDraft) {
    let times = [("startTime", draft.experiment.start), ("stopTime", draft.experiment.stop)];
    let times = times.map(|(name, time)| Some((name, types::format_number(time?))));
    let times: Vec<_> = times.iter().flatten().map(|(name, time)| (*name, time.as_str())).collect();
    let Some(step) = draft.step else {
        if !times.is_empty() {
            xml.write_empty_element("ssd:DefaultExperiment", &times);
        }
        return;
    };
    xml.open_element("ssd:DefaultExperiment", &times);
    xml.open_element("ssd:Annotations", &[]);
    xml.open_element("ssc:Annotation", &[("type", "com.opensimulationplatform")]);
    xml.open_element("osp:Algorithm", &[]);
    xml.write_empty_element("osp:FixedStepAlgorithm", &[("baseStepSize", &types::format_number(step))]);
    (0..4).for_each(|_| xml.close_element());
}

fn write_annotation(xml: &mut XmlWriter, annotation: &DraftAnnotation) {
    xml.open_element("ssc:Annotation", &[("type", &annotation.kind)]);
    let mut attributes = vec![("xmlns", annotation.namespace.as_str())];
    attributes.extend(annotation.attributes.iter().map(|(key, value)| (key.as_str(), value.as_str())));
    xml.text_element(&annotation.element, &attributes, &annotation.text);
    xml.close_element();
}
