//! Writes a set of start values, section 6.

use super::xml::XmlWriter;
use super::{DraftValue, SspVersion, types};
use crate::{SspType, SspValue};

/// The text of an `.ssv` file.
#[must_use]
pub fn parameter_set(name: &str, version: SspVersion, values: &[DraftValue]) -> String {
    let mut xml = XmlWriter::new();
    xml.open_element(
        "ssv:ParameterSet",
        &[
            ("xmlns:ssv", "http://ssp-standard.org/SSP1/SystemStructureParameterValues"),
            ("xmlns:ssc", "http://ssp-standard.org/SSP1/SystemStructureCommon"),
            ("version", version.version_text()),
            ("name", name),
        ],
    );
    xml.open_element("ssv:Parameters", &[]);
    for DraftValue { name, data_type, value } in values {
        xml.open_element("ssv:Parameter", &[("name", name)]);
        write_typed_value(&mut xml, data_type, value);
        if let SspValue::Array { dimensions, .. } = value {
            for size in dimensions {
                xml.write_empty_element("ssc:Dimension", &[("size", &size.to_string())]);
            }
        }
        xml.close_element();
    }
    xml.finish()
}

fn write_typed_value(xml: &mut XmlWriter, data_type: &SspType, value: &SspValue) {
    // An enumeration without items has numbers only.
    let integer = matches!(value, SspValue::Integer(_)) && matches!(data_type, SspType::Enumeration(_));
    let name = if integer { "Integer".to_owned() } else { types::type_element_name(data_type) };
    let element = format!("ssv:{name}");
    let spaced = matches!(data_type, SspType::String | SspType::Enumeration(_) | SspType::Binary { .. });
    match value {
        // Texts may have spaces in them, so each stands in an element of its own.
        SspValue::Array { elements, .. } if spaced => {
            xml.open_element(&element, &[]);
            elements
                .iter()
                .for_each(|it| xml.write_empty_element("ssv:Value", &[("value", &types::format_value(it))]));
            xml.close_element();
        }
        value => xml.write_empty_element(&element, &[("value", &types::format_value(value))]),
    }
}
