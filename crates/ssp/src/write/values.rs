//! Writes a set of start values, section 6.

use super::xml::Document;
use super::{DraftValue, Version, types};
use crate::{Type, Value};

/// The text of an `.ssv` file.
#[must_use]
pub fn parameter_set(name: &str, version: Version, values: &[DraftValue]) -> String {
    let mut xml = Document::new();
    xml.open(
        "ssv:ParameterSet",
        &[
            ("xmlns:ssv", "http://ssp-standard.org/SSP1/SystemStructureParameterValues"),
            ("xmlns:ssc", "http://ssp-standard.org/SSP1/SystemStructureCommon"),
            ("version", version.text()),
            ("name", name),
        ],
    );
    xml.open("ssv:Parameters", &[]);
    for DraftValue { name, data_type, value } in values {
        xml.open("ssv:Parameter", &[("name", name)]);
        typed(&mut xml, data_type, value);
        if let Value::Array { dimensions, .. } = value {
            for size in dimensions {
                xml.empty("ssc:Dimension", &[("size", &size.to_string())]);
            }
        }
        xml.close();
    }
    xml.finish()
}

fn typed(xml: &mut Document, data_type: &Type, value: &Value) {
    // An enumeration without items has numbers only.
    let integer = matches!(value, Value::Integer(_)) && matches!(data_type, Type::Enumeration(_));
    let name = if integer { "Integer".to_owned() } else { types::name(data_type) };
    let element = format!("ssv:{name}");
    let spaced = matches!(data_type, Type::String | Type::Enumeration(_) | Type::Binary { .. });
    match value {
        // Texts may have spaces in them, so each stands in an element of its own.
        Value::Array { elements, .. } if spaced => {
            xml.open(&element, &[]);
            elements.iter().for_each(|it| xml.empty("ssv:Value", &[("value", &types::text(it))]));
            xml.close();
        }
        value => xml.empty(&element, &[("value", &types::text(value))]),
    }
}
