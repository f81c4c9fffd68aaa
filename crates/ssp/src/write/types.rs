//! Names the elements of types and values.

use crate::{SspType, SspValue};

/// Whether version 1.0 has the type.
pub(super) fn is_ssp1_type(of: &SspType) -> bool {
    match of {
        SspType::Float64 | SspType::Boolean | SspType::String | SspType::Enumeration(_) => true,
        SspType::Binary { .. } => true,
        SspType::Integer(width) => width.bits == 32 && width.signed,
        SspType::Float32 | SspType::Clock => false,
    }
}

/// The name of the element. That of version 1.0 where it has one, which 2.0 has too.
pub(super) fn type_element_name(of: &SspType) -> String {
    match of {
        SspType::Float64 => "Real".to_owned(),
        SspType::Float32 => "Float32".to_owned(),
        SspType::Integer(width) if width.bits == 32 && width.signed => "Integer".to_owned(),
        SspType::Integer(width) => {
            format!("{}Int{}", if width.signed { "" } else { "U" }, width.bits)
        }
        SspType::Boolean => "Boolean".to_owned(),
        SspType::String => "String".to_owned(),
        SspType::Enumeration(_) => "Enumeration".to_owned(),
        SspType::Binary { .. } => "Binary".to_owned(),
        SspType::Clock => "Clock".to_owned(),
    }
}

/// A number as XML Schema writes it: the shortest text that is read as the same number.
pub(super) fn format_number(number: f64) -> String {
    match number {
        number if number.is_nan() => "NaN".to_owned(),
        f64::INFINITY => "INF".to_owned(),
        f64::NEG_INFINITY => "-INF".to_owned(),
        number => format!("{number:?}"),
    }
}

/// A single value as a text.
pub(super) fn format_value(value: &SspValue) -> String {
    match value {
        SspValue::Real(real) => format_number(*real),
        SspValue::Integer(integer) => integer.to_string(),
        SspValue::Boolean(truth) => truth.to_string(),
        SspValue::String(text) | SspValue::Enumeration(text) => text.clone(),
        SspValue::Binary(bytes) => bytes.iter().map(|byte| format!("{byte:02x}")).collect(),
        SspValue::Array { elements, .. } => elements.iter().map(format_value).collect::<Vec<_>>().join(" "),
    }
}
