//! Names the elements of types and values.

use crate::{Type, Value};

/// Whether version 1.0 has the type.
pub(super) fn is_old(of: &Type) -> bool {
    match of {
        Type::Float64 | Type::Boolean | Type::String | Type::Enumeration(_) => true,
        Type::Binary { .. } => true,
        Type::Integer(width) => width.bits == 32 && width.signed,
        Type::Float32 | Type::Clock => false,
    }
}

/// The name of the element. That of version 1.0 where it has one, which 2.0 has too.
pub(super) fn name(of: &Type) -> String {
    match of {
        Type::Float64 => "Real".to_owned(),
        Type::Float32 => "Float32".to_owned(),
        Type::Integer(width) if width.bits == 32 && width.signed => "Integer".to_owned(),
        Type::Integer(width) => {
            format!("{}Int{}", if width.signed { "" } else { "U" }, width.bits)
        }
        Type::Boolean => "Boolean".to_owned(),
        Type::String => "String".to_owned(),
        Type::Enumeration(_) => "Enumeration".to_owned(),
        Type::Binary { .. } => "Binary".to_owned(),
        Type::Clock => "Clock".to_owned(),
    }
}

/// A number as XML Schema writes it: the shortest text that is read as the same number.
pub(super) fn number(number: f64) -> String {
    match number {
        number if number.is_nan() => "NaN".to_owned(),
        f64::INFINITY => "INF".to_owned(),
        f64::NEG_INFINITY => "-INF".to_owned(),
        number => format!("{number:?}"),
    }
}

/// A single value as a text.
pub(super) fn text(value: &Value) -> String {
    match value {
        Value::Real(real) => number(*real),
        Value::Integer(integer) => integer.to_string(),
        Value::Boolean(truth) => truth.to_string(),
        Value::String(text) | Value::Enumeration(text) => text.clone(),
        Value::Binary(bytes) => bytes.iter().map(|byte| format!("{byte:02x}")).collect(),
        Value::Array { elements, .. } => elements.iter().map(text).collect::<Vec<_>>().join(" "),
    }
}
