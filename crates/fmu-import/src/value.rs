//! Defines a value of any FMI type.

use serde::{Deserialize, Serialize};

/// A value of any type.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub enum Value {
    /// `Real`, `Float32` or `Float64`.
    Real(f64),
    /// An integer of any size, or an `Enumeration`.
    Integer(i128),
    /// `Boolean`.
    Boolean(bool),
    /// `String`.
    String(String),
    /// `Binary`.
    Binary(Vec<u8>),
}

/// Equal numbers or equal bits: NaN equals itself, and 0 equals -0.
impl PartialEq for Value {
    fn eq(&self, other: &Self) -> bool {
        match (self, other) {
            (Value::Real(a), Value::Real(b)) => a == b || a.to_bits() == b.to_bits(),
            (Value::Integer(a), Value::Integer(b)) => a == b,
            (Value::Boolean(a), Value::Boolean(b)) => a == b,
            (Value::String(a), Value::String(b)) => a == b,
            (Value::Binary(a), Value::Binary(b)) => a == b,
            _ => false,
        }
    }
}

impl std::fmt::Display for Value {
    fn fmt(&self, out: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Value::Real(value) => write!(out, "{value:?}"),
            Value::Integer(value) => write!(out, "{value}"),
            Value::Boolean(value) => write!(out, "{value}"),
            Value::String(value) => write!(out, "{value:?}"),
            Value::Binary(value) => write!(out, "\"{}\"", to_hex(value)),
        }
    }
}

/// Bytes as text: two digits each.
#[must_use]
pub fn to_hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

/// The bytes of a text of two hexadecimal digits each; none if it is something else.
#[must_use]
pub fn from_hex(text: &str) -> Option<Vec<u8>> {
    let digits: Vec<u32> = text.chars().map(|digit| digit.to_digit(16)).collect::<Option<_>>()?;
    let pairs = digits.chunks(2);
    pairs.map(|pair| u8::try_from(16 * pair[0] + pair.get(1)?).ok()).collect()
}
