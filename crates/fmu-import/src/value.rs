//! Holds a value of any type, and moves one from and to an instance.

use crate::description::Storage;
use crate::{CallError, Instance, Type};

/// A value of any type.
#[derive(Debug, Clone)]
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
            Value::Binary(value) => write!(out, "\"{}\"", hexadecimal(value)),
        }
    }
}

impl Value {
    /// Its type; that of an `Enumeration` is `Integer`.
    #[must_use]
    pub fn kind(&self) -> Type {
        match self {
            Value::Real(_) => Type::Real,
            Value::Integer(_) => Type::Integer,
            Value::Boolean(_) => Type::Boolean,
            Value::String(_) => Type::String,
            Value::Binary(_) => Type::Binary,
        }
    }
}

/// Bytes as text: two digits each.
#[must_use]
pub fn hexadecimal(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

/// The bytes of a text of two hexadecimal digits each; none if it is something else.
#[must_use]
pub fn bytes(text: &str) -> Option<Vec<u8>> {
    let digits: Vec<u32> = text.chars().map(|digit| digit.to_digit(16)).collect::<Option<_>>()?;
    let pairs = digits.chunks(2);
    pairs.map(|pair| u8::try_from(16 * pair[0] + pair.get(1)?).ok()).collect()
}

impl Instance {
    /// The values of all elements of one variable.
    ///
    /// # Errors
    /// See [`Instance`].
    pub fn read(
        &mut self,
        storage: Storage,
        reference: u32,
        elements: usize,
    ) -> Result<Vec<Value>, CallError> {
        Ok(match storage {
            Storage::Float32 | Storage::Float64 | Storage::Boolean => {
                let mut numbers = vec![0.0; elements];
                self.get_numbers(storage, &[reference], &mut numbers)?;
                let value = |number: f64| match storage {
                    Storage::Boolean => Value::Boolean(number != 0.0),
                    _ => Value::Real(number),
                };
                numbers.into_iter().map(value).collect()
            }
            Storage::String => {
                self.get_strings(reference, elements)?.into_iter().map(Value::String).collect()
            }
            Storage::Binary => {
                self.get_binaries(reference, elements)?.into_iter().map(Value::Binary).collect()
            }
            _ => self
                .get_integers(storage, reference, elements)?
                .into_iter()
                .map(Value::Integer)
                .collect(),
        })
    }

    /// Gives all elements of one variable values of its type; what is of another type is left out.
    ///
    /// # Errors
    /// See [`Instance`]; also when a text contains NUL.
    pub fn write(
        &mut self,
        storage: Storage,
        reference: u32,
        values: &[Value],
    ) -> Result<(), CallError> {
        match storage {
            Storage::Float32 | Storage::Float64 | Storage::Boolean => {
                let number = |value: &Value| match value {
                    Value::Real(value) => Some(*value),
                    Value::Boolean(value) => Some(f64::from(u8::from(*value))),
                    _ => None,
                };
                let numbers: Vec<_> = values.iter().filter_map(number).collect();
                self.set_numbers(storage, &[reference], &numbers)
            }
            Storage::String => {
                let text = |value: &Value| match value {
                    Value::String(text) => Some(text.clone()),
                    _ => None,
                };
                self.set_strings(reference, &values.iter().filter_map(text).collect::<Vec<_>>())
            }
            Storage::Binary => {
                let bytes = |value: &Value| match value {
                    Value::Binary(bytes) => Some(bytes.clone()),
                    _ => None,
                };
                self.set_binaries(reference, &values.iter().filter_map(bytes).collect::<Vec<_>>())
            }
            _ => {
                let integer = |value: &Value| match value {
                    Value::Integer(integer) => Some(*integer),
                    _ => None,
                };
                let integers: Vec<_> = values.iter().filter_map(integer).collect();
                self.set_integers(storage, reference, &integers)
            }
        }
    }
}
